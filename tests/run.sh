#!/usr/bin/env bash
# The whole suite: formatting, the tests in a release build, the tests under address and undefined
# behaviour sanitizers, simulate and plan under the thread sanitizer, and cases end to end. Stops at
# the first step that fails and names it.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# The sanitizers of GCC 12 need the plain address layout. Containers may forbid to ask for it.
if [[ -z "${WIREPLAN_PLAIN_LAYOUT:-}" ]] && setarch --addr-no-randomize true 2>/dev/null; then
  WIREPLAN_PLAIN_LAYOUT=1 exec setarch --addr-no-randomize bash tests/run.sh
fi

step() {
  local name=$1 start=$SECONDS
  shift
  echo "== $name"
  if ! "$@"; then
    echo "== $name: FAILED after $((SECONDS - start)) s"
    exit 1
  fi
  echo "== $name: ok, $((SECONDS - start)) s"
}

# clang-format's taste changes with its version; ours is Debian 12's and Ubuntu 22.04's.
check_formatting() {
  if ! clang-format --version | grep -q 'version 14\.'; then
    echo "not checked: needs clang-format 14, this is $(clang-format --version)"
    return 0
  fi
  find preprocess simulate plan pipeline tests -regex '.*\.\(h\|cpp\)' \
    -exec clang-format --dry-run -Werror {} +
}

run_suite() { ctest --preset "$1" --parallel "$(nproc)"; }

# A real volume, where the data lie beside the checkout.
run_real_case() {
  local data=${WIREPLAN_DATA:-../shared/data}
  if [[ ! -d "$data/mra-aorta-iliac-vmtk" ]]; then
    echo "not run: no mra-aorta-iliac-vmtk in $data (set WIREPLAN_DATA)"
    return 0
  fi
  build/release/pipeline/wireplan run cases/aorta-iliac-mra
}

step "install packages" bash tests/install.sh
step "formatting" check_formatting
step "release build" bash tests/build.sh release
step "tests" run_suite release
step "sanitizer build" bash tests/build.sh dev
step "tests under address and undefined behaviour sanitizers" run_suite dev
step "thread sanitizer build of simulate and plan" bash tests/build.sh tsan
step "tests under thread sanitizer" run_suite tsan
step "bundled case" bash cases/demo.sh
step "aorta-iliac-mra" run_real_case
echo "== all steps ok, $SECONDS s"
