#!/usr/bin/env python3
"""submit.py JOBSCRIPT: puts a job of the Snakefile into Slurm's queue and prints its number.

What runs is the job's own command, from the properties that Snakemake writes into the script, and
not the script: that would start a whole Snakemake in each job, as much CPU time as a small shard.
A job that is lost is Snakemake's to try again, with more memory, so Slurm does not requeue it.
"""
import json
import subprocess
import sys

MARK = "# properties = "


def main():
    with open(sys.argv[-1]) as script:
        job = next(json.loads(line[len(MARK):]) for line in script if line.startswith(MARK))
    resources, parameters = job["resources"], job["params"]
    name = "-".join(["wireplan", job["rule"], *job["wildcards"].values()])
    answer = subprocess.run(
        ["sbatch", "--parsable", "--no-requeue", f"--job-name={name}", "--output=/dev/null",
         f"--cpus-per-task={job['threads']}", f"--mem={resources['mem_mb']}",
         f"--time={resources['runtime']}", *parameters["slurm"], "--wrap", parameters["command"]],
        stdout=subprocess.PIPE, text=True, check=True)
    print(answer.stdout.strip().split(";")[0])


main()
