#!/usr/bin/env bash
# step.sh MARKER LOG [EARLIER]... -- COMMAND...: one job of the Snakefile. Runs the command with its
# output in LOG. An exit code that another try would not change (0 done, 1 no plan, 2 bad input) is
# written to MARKER; any other one fails the job. Where a marker EARLIER says 2 the patient is passed
# over: the summary will tell why, and no other patient waits for it.
set -uo pipefail
marker=$1 log=$2
shift 2
mkdir -p "$(dirname "$marker")" "$(dirname "$log")" || exit 3
code=0
while [[ $1 != -- ]]; do
  [[ $(<"$1") == 2 ]] && code=2
  shift
done
shift
if ((code == 0)); then
  "$@" >>"$log" 2>&1 || code=$?
fi
((code <= 2)) || exit "$code"
echo "$code" >"$marker.part" && mv "$marker.part" "$marker"
