#!/usr/bin/env bash
# run.sh RUNS [TARGET...]: so many executions of each fuzz target over its corpus, from build/dev.
# What is new and interesting is kept in build/dev/fuzz/found/TARGET, an input that breaks a parser in
# build/dev/fuzz/broken-TARGET-*: mend the parser and add the input to the corpus, where make_seeds.py
# writes the inputs that fuzzing starts from. `repair`, `inspect` and `dicom` run only where they are
# named: CGAL's algorithms and GDCM make them ten times as slow as the parsers.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
runs=${1:?usage: tests/fuzz/run.sh RUNS [case|scene|report|label_table|markups|surface|nifti|nrrd|metaimage|labels|dicom|inspect|repair...]}
shift
targets=("$@")
((${#targets[@]} > 0)) || targets=(case scene report label_table markups surface nifti nrrd metaimage labels)

# The libraries are built without sanitizers, so that leaks inside them and containers handed to
# them cannot be told from sound use. Short traces of allocations, a short queue of what was freed and
# inputs that are not weighed make twice as many executions.
export ASAN_OPTIONS=detect_leaks=0:detect_container_overflow=0:malloc_context_size=2:quarantine_size_mb=8
fuzz_one() {
  local target=$1 corpus=("tests/fuzz/corpus/$1") memory=2000 start=$SECONDS
  mkdir -p "build/dev/fuzz/found/$target"
  [[ $target != repair ]] || corpus+=(tests/fuzz/corpus/surface)
  # Where an assertion of a library is left (in_place.h), what it held is lost.
  [[ $target != dicom && $target != inspect ]] || memory=6000
  if ! "build/dev/tests/fuzz/fuzz_$target" -runs="$runs" -seed=1 -max_len=4096 -timeout=20 \
    -entropic=0 -malloc_limit_mb=2000 -rss_limit_mb="$memory" -artifact_prefix="build/dev/fuzz/broken-$target-" \
    "build/dev/fuzz/found/$target" "${corpus[@]}" >"build/dev/fuzz/$target.log" 2>&1 </dev/null; then
    tail -n 40 "build/dev/fuzz/$target.log"
    echo "fuzz $target: found something, see above"
    return 255  # xargs starts no other
  fi
  echo "fuzz $target: $runs executions in $((SECONDS - start)) s, nothing found"
}
export -f fuzz_one
export runs
printf '%s\0' "${targets[@]}" | xargs -0 -n 1 -P "$(nproc)" bash -c 'fuzz_one "$1"' -
