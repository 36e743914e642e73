#!/usr/bin/env bash
# run.sh RUNS [TARGET...]: so many executions of each fuzz target over its corpus, from build/dev.
# What is new and interesting is kept in build/dev/fuzz/found/TARGET, an input that breaks a parser in
# build/dev/fuzz/broken-TARGET-*: mend the parser and add the input to the corpus. `repair` and `dicom`
# run only where they are named: CGAL's algorithms on each input, and a process for each, make them
# 10 and 50 times as slow as the parsers.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
runs=${1:?usage: tests/fuzz/run.sh RUNS [case|scene|report|surface|volume|repair|dicom...]}
shift
targets=("$@")
((${#targets[@]} > 0)) || targets=(case scene report surface volume)

# The libraries are built without sanitizers, so that leaks inside them and containers handed to
# them cannot be told from sound use.
export ASAN_OPTIONS=detect_leaks=0:detect_container_overflow=0
for target in "${targets[@]}"; do
  mkdir -p "build/dev/fuzz/found/$target"
  corpus=("tests/fuzz/corpus/$target")
  [[ $target != repair ]] || corpus+=(tests/fuzz/corpus/surface)
  start=$SECONDS
  if ! "build/dev/tests/fuzz/fuzz_$target" -runs="$runs" -seed=1 -max_len=4096 -timeout=20 \
    -rss_limit_mb=3000 -artifact_prefix="build/dev/fuzz/broken-$target-" \
    "build/dev/fuzz/found/$target" "${corpus[@]}" >"build/dev/fuzz/$target.log" 2>&1; then
    tail -n 40 "build/dev/fuzz/$target.log"
    echo "fuzz $target: found something, see above"
    exit 1
  fi
  echo "fuzz $target: $runs executions in $((SECONDS - start)) s, nothing found"
done
