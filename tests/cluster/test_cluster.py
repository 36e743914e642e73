#!/usr/bin/env python3
"""test_cluster.py WIREPLAN: the Snakefile of pipeline/cluster on six small patients and one whose
input is broken, by Snakemake alone and on a real Slurm of this machine. In each one job is killed
in the middle of its work. What comes out must be what `wireplan batch` gives, byte for byte outside
`timing`, with no job run twice but the killed one. Exits 77 where Snakemake is missing; without
Slurm its part is left out and told."""
import json
import math
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.dont_write_bytecode = True
from slurm_here import NotHere, Slurm  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
CLUSTER = ROOT / "pipeline" / "cluster"
NAMES = ["anna", "bert", "carl", "dora", "emil", "fritz"]
BROKEN = "gina"
SHARDS = 3
MINUTES = 5  # that a workflow may take
VICTIM = "carl/case.json --shard 2/3"  # the job that is killed

# In the place of the program: notes every call and stops the victim, once, in the middle of its work.
WRAPPER = """#!/bin/bash
echo "$*" >>"{folder}/calls"
if [[ "$*" == *"{victim}"* ]] && mkdir "{folder}/stopped" 2>/dev/null; then
  "{program}" "$@" &
  sleep 0.3
  kill -STOP $!
  touch "{folder}/stopped/now"
  {then}
fi
exec "{program}" "$@"
"""


def write_tube(file, radius, length):
    """A closed tube along z as OBJ."""
    around, along = 24, 24
    points = [(radius * math.cos(2 * math.pi * a / around), radius * math.sin(2 * math.pi * a / around),
               length * k / along) for k in range(along + 1) for a in range(around)]
    points += [(0, 0, 0), (0, 0, length)]
    faces = []
    for a in range(around):
        b = (a + 1) % around
        for k in range(along):
            p, q = k * around, (k + 1) * around
            faces += [(p + a, p + b, q + b), (p + a, q + b, q + a)]
        faces += [(b, a, len(points) - 2),
                  (along * around + a, along * around + b, len(points) - 1)]
    with open(file, "w") as out:
        out.writelines("v %.17g %.17g %.17g\n" % p for p in points)
        out.writelines("f %d %d %d\n" % tuple(v + 1 for v in f) for f in faces)


def write_study(folder):
    """Patients that differ in their vessel and so in every stage; ten candidates each, so that they
    are scouted."""
    for k, name in enumerate([*NAMES, BROKEN]):
        (folder / name).mkdir(parents=True)
        write_tube(folder / name / "tube.obj", 3.6 + 0.1 * k, 36.0)
        wire = {"name": "soft", "diameter_mm": 0.889,
                "sections": [{"length_mm": 200, "bending_stiffness_n_mm2": 50}]}
        case = {"schema": "wireplan.case/1", "name": name,
                "surface": {"path": "tube.obj", "unit": "mm", "frame": "LPS", "edge_length_mm": 1.5},
                "access": {"point_mm": [0, 0, 6], "inclination_deg": [0, 8, 16, 24],
                           "azimuth_deg": [0, 120, 240]},
                "target": {"point_mm": [0, 0, 28], "radius_mm": 3.5}, "wires": [wire],
                "insertion": {"length_mm": 30, "step_mm": 2, "element_length_mm": 2},
                "robustness": {"repeats": 2}}
        (folder / name / "case.json").write_text(json.dumps(case, indent=1))
    (folder / BROKEN / "tube.obj").write_text("not a surface\n")


def without_timing(value):
    if isinstance(value, dict):
        return {k: without_timing(v) for k, v in value.items() if k != "timing"}
    return [without_timing(v) for v in value] if isinstance(value, list) else value


def results(folder):
    """Every result's bytes by name; of JSON files without `timing`. The page has its own block of
    times, and is filled from the report."""
    found = {}
    for file in sorted(folder.rglob("*")):
        name = str(file.relative_to(folder))
        # Logs and the list of what was put there are of the way, not of the result.
        if not file.is_file() or name.startswith(".") or name.endswith((".log", ".html", "-files")):
            continue
        data = file.read_bytes()
        if name.endswith(".json"):
            data = json.dumps(without_timing(json.loads(data))).encode()
        found[name] = data
    return found


class Workflow:
    """One run of the Snakefile in a folder of its own."""

    def __init__(self, folder, program, study, then):
        self.folder = folder
        folder.mkdir()
        self.wrapper = folder / "wireplan"
        self.wrapper.write_text(WRAPPER.format(folder=folder, program=program, victim=VICTIM,
                                               then=then))
        self.wrapper.chmod(0o755)
        (folder / "study.json").write_text(json.dumps(
            {"cases": str(study), "output": "out", "cache": "cache", "wireplan": str(self.wrapper),
             "shards": SHARDS, "stages": {s: {"threads": 1, "memory_mb": 1000, "minutes": 5}
                                          for s in ("prepare", "trials", "report", "summary")}}))

    def start(self, options, environment):
        command = ["snakemake", "-s", str(CLUSTER / "Snakefile"), "--configfile", "study.json",
                   *options]
        self.log = open(self.folder / "snakemake.log", "w")
        self.process = subprocess.Popen(command, cwd=self.folder, env=environment, stdout=self.log,
                                        stderr=subprocess.STDOUT, start_new_session=True)

    def wait(self):
        try:
            code = self.process.wait(60 * MINUTES)
        finally:
            if self.process.poll() is None:
                os.killpg(self.process.pid, signal.SIGKILL)
        if code != 0:
            raise AssertionError((self.folder / "snakemake.log").read_text()[-4000:])

    def wait_for_victim(self):
        while not (self.folder / "stopped" / "now").exists():
            assert self.process.poll() is None, "no job was stopped"
            time.sleep(0.05)

    def check(self, expected):
        got = results(self.folder / "out")
        assert got.keys() == expected.keys(), sorted(got.keys() ^ expected.keys())
        different = [name for name in got if got[name] != expected[name]]
        assert not different, different

        # Every job once, and the killed one twice; of the broken patient what tells that it is.
        calls = [line for line in (self.folder / "calls").read_text().splitlines()
                 if not line.startswith("batch")]
        wanted = ["run " + BROKEN, "trials carl 2"]
        for name in NAMES:
            wanted += ["run " + name, "report " + name]
            wanted += [f"trials {name} {k}" for k in range(1, SHARDS + 1)]
        told = sorted(self.describe(call) for call in calls)
        assert told == sorted(wanted), (told, sorted(wanted))
        return len(got)

    @staticmethod
    def describe(call):
        name = re.search(r"/(\w+)/case\.json", call)[1]
        shard = re.search(r"--shard (\d+)/", call)
        return f"{call.split()[0]} {name}" + (f" {shard[1]}" if shard else "")


def version_of_snakemake():
    if shutil.which("snakemake") is None:
        return None
    told = subprocess.run(["snakemake", "--version"], capture_output=True, text=True).stdout
    return tuple(int(part) for part in told.split(".")[:2])


def main():
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that daemons end also then
    program = Path(sys.argv[1]).resolve()
    version = version_of_snakemake()
    if version is None or not (7, 8) <= version < (8, 0):
        print("cluster: not run, it needs Snakemake 7.8 or later of 7 (package snakemake), this is",
              "none" if version is None else ".".join(map(str, version)))
        return 77
    with tempfile.TemporaryDirectory(prefix="wireplan-cluster-") as temporary:
        folder = Path(temporary)
        folder.chmod(0o755)
        study = folder / "study"
        write_study(study)
        batch = subprocess.run([program, "batch", study, "-o", folder / "batch", "--cache",
                                folder / "cache"], capture_output=True, text=True)
        assert batch.returncode == 2, batch.stdout + batch.stderr  # the broken one
        assert "6 planned, 1 failed" in batch.stdout, batch.stdout
        expected = results(folder / "batch")

        # Snakemake alone; the victim is killed as a machine that goes down kills it.
        alone = Workflow(folder / "alone", program, study, then="kill -KILL $! $$")
        alone.start(["--cores", "2"], os.environ)
        alone.wait()
        print(f"Snakemake alone: {alone.check(expected)} files as of batch")

        # On Slurm; the victim is cancelled while it runs.
        try:
            with Slurm(folder / "slurm", cpus=2) as slurm:
                queued = Workflow(folder / "queued", program, study, then="sleep 300")
                queued.start(["--profile", str(CLUSTER / "slurm"), "--latency-wait", "5"],
                             slurm.environment)
                try:
                    queued.wait_for_victim()
                    slurm.ask("scancel", "--name=wireplan-trials-carl-1-2")
                finally:
                    queued.wait()
                print(f"Snakemake on Slurm: {queued.check(expected)} files as of batch")
        except NotHere as reason:
            print(f"Snakemake on Slurm: not run, {reason}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
