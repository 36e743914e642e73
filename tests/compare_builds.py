#!/usr/bin/env python3
"""compare_builds.py OLD NEW [CASE...]: runs cases with two programs, each with a cache of its own, and
compares all that they put out byte for byte; of report.json all but `timing` and
`provenance.program`, of report.html nothing, for it holds both. All cases of cases/ where none is
named; those whose data are absent are skipped, and so told. Exits 1 where something differs."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent


def all_cases():
    for file in sorted(ROOT.glob("cases/*/*.json")):
        if json.loads(file.read_text()).get("schema") in ("wireplan.case/1", "wireplan.scene/1"):
            yield file


def run(program, file, out, cache):
    """The exit code; 2 where the case cannot be run here."""
    schema = json.loads(file.read_text())["schema"]
    if schema == "wireplan.scene/1":
        command = [program, "simulate", file, "-o", out]
    else:
        command = [program, "run", file, "-o", out, "--cache", cache]
    return subprocess.run(list(map(str, command)), capture_output=True, check=False).returncode


def without_times(value):
    if isinstance(value, dict):
        return {key: without_times(part) for key, part in value.items()
                if key not in ("timing", "program", "cpu_time_s")}
    return [without_times(part) for part in value] if isinstance(value, list) else value


def files_of(folder):
    found = {}
    for path in sorted(pathlib.Path(folder).rglob("*")):
        name = str(path.relative_to(folder))
        if not path.is_file() or name in ("report.html", ".wireplan-files"):
            continue
        data = path.read_bytes()
        if name in ("report.json", "result.json"):
            data = json.dumps(without_times(json.loads(data))).encode()
        found[name] = data
    return found


def first_difference(old, new, path=""):
    if isinstance(old, dict) and isinstance(new, dict) and list(old) == list(new):
        pairs = [(f"{path}/{key}", old[key], new[key]) for key in old]
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        pairs = [(f"{path}/{k}", *pair) for k, pair in enumerate(zip(old, new))]
    else:
        return "" if old == new else f"{path}: {str(old)[:60]} -> {str(new)[:60]}"
    return next(filter(None, (first_difference(a, b, p) for p, a, b in pairs)), "")


def compare(old, new):
    """What differs, a line each."""
    lines = [f"only in one: {name}" for name in sorted(set(old) ^ set(new))]
    for name in sorted(set(old) & set(new)):
        if old[name] == new[name]:
            continue
        where = ""
        if name.endswith(".json"):
            where = " at " + first_difference(json.loads(old[name]), json.loads(new[name]))
        lines.append(f"differs: {name}{where}")
    return lines


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    programs = [pathlib.Path(name).resolve() for name in sys.argv[1:3]]
    cases = [pathlib.Path(name).resolve() for name in sys.argv[3:]] or list(all_cases())
    failed = False
    with tempfile.TemporaryDirectory() as work:
        for case in cases:
            file = case / "case.json" if case.is_dir() else case
            name = f"{file.parent.name}/{file.stem}"
            outs = [os.path.join(work, name, which) for which in ("old", "new")]
            codes = [run(program, file, out, os.path.join(work, f"cache-{k}"))
                     for k, (program, out) in enumerate(zip(programs, outs))]
            if codes == [2, 2]:
                print(f"{name}: skipped, neither can run it here (no data?)", flush=True)
                continue
            old, new = map(files_of, outs)
            lines = compare(old, new)
            if codes[0] != codes[1]:
                lines.insert(0, f"exit codes {codes[0]} and {codes[1]}")
            failed = failed or bool(lines)
            print(f"{name}: {len(new)} files, {len(lines)} differ", flush=True)
            for line in lines[:10]:
                print("  " + line, flush=True)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
