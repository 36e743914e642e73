#!/usr/bin/env python3
"""status.py JOB: prints "running", "success" or "failed", as Snakemake asks.

A job that Slurm no longer knows counts as failed: tried again, it finds all that it had finished.
Where the controller does not answer the job counts as running and is asked for again.
"""
import re
import subprocess
import sys

UNDER_WAY = {"PENDING", "CONFIGURING", "RUNNING", "COMPLETING", "SUSPENDED", "RESIZING", "STOPPED",
             "SIGNALING", "STAGE_OUT"}


def main():
    asked = subprocess.run(["scontrol", "--oneliner", "show", "job", sys.argv[1]],
                           capture_output=True, text=True)
    state = re.search(r"\bJobState=(\w+)", asked.stdout)
    if state is None:
        print("failed" if "Invalid job id" in asked.stderr else "running")
    elif state[1] in UNDER_WAY:
        print("running")
    else:
        print("success" if state[1] == "COMPLETED" else "failed")


main()
