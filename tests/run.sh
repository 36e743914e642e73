#!/usr/bin/env bash
# The whole suite: formatting, a release build, installed and tested, cases end to end, the tests with Clang under
# address and undefined behaviour sanitizers, what starts threads under the thread sanitizer, clang-tidy
# on simulate and plan, the program without ITK and Node, the parsers fuzzed, the workflow for clusters.
# Stops at the first step that fails and names it.
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
    wait  # for what runs beside
    exit 1
  fi
  echo "== $name: ok, $((SECONDS - start)) s"
}

# beside NAME COMMAND...: starts a step that waits for most of its time, or fills what others leave of the cores (files that
# compile last and alone, tests and cases on one thread), to be ended by `step NAME of_beside NAME`.
declare -A beside_jobs
beside() {
  echo "== $1: begun, beside what follows"
  mkdir -p build
  "${@:2}" >"build/$1.log" 2>&1 &
  beside_jobs[$1]=$!
}
of_beside() {
  local status=0
  wait "${beside_jobs[$1]}" || status=$?
  cat "build/$1.log"
  return "$status"
}

# What clang-format and clang-tidy find changes with their version; ours is Debian 12's and Ubuntu
# 22.04's.
is_version_14() {
  local version
  version=$("$1" --version)
  [[ $version == *"version 14."* ]] && return 0
  echo "not checked: needs $1 14, this is $version"
  return 1
}

check_formatting() {
  is_version_14 clang-format || return 0
  find preprocess simulate plan pipeline tests -regex '.*\.\(h\|cpp\)' \
    -exec clang-format --dry-run -Werror {} +
}

# Each folder as one file: most of the time goes to headers of libraries, which are read once for all files
# then. One text and no #include, or clang's analyzer would leave it out; #line makes it tell the place of each finding.
# The analyzer follows 30 000 states of a function, not 225 000: it takes half as long or less.
# As with objects in ccache, what was found clean and is the same to the last letter is not looked at again.
check_tidy() {
  is_version_14 clang-tidy || return 0
  local folder text
  mkdir -p build/tidy
  for folder in simulate plan; do
    find "$folder" -name '*.cpp' | sort | while read -r file; do
      echo "#line 1 \"$PWD/$file\""
      cat "$file"
    done >"build/tidy/$folder.cpp"
    text=$({
      clang-tidy --version
      declare -f check_tidy
      find .clang-tidy preprocess simulate plan /usr/include/eigen3/Eigen/src/Core/util/Macros.h \
        -name '*.h' -o -name .clang-tidy | sort | xargs cat "build/tidy/$folder.cpp"
    } | sha256sum)
    if [[ $text == "$(cat "build/tidy/$folder.clean" 2>/dev/null)" ]]; then
      echo "$folder: found clean before"
      continue
    fi
    nice -n 19 clang-tidy --quiet --warnings-as-errors='*' "build/tidy/$folder.cpp" -- \
      -std=c++20 -I. -isystem /usr/include/eigen3 -Xclang -analyzer-config -Xclang max-nodes=30000 || return 1
    echo "$text" >"build/tidy/$folder.clean"
  done
}

run_suite() { ctest --preset "$1" --parallel "$(nproc)" "${@:2}"; }

# The preset is configured, and the program linked with what stands in the place of ITK's and Node's parts: a surface is planned
# on, a volume refused, a report without a page is told. All else is built of the same sources in the same way as in the release.
check_surface_only() {
  cmake --preset surface-only --log-level=NOTICE >/dev/null || return 1
  local program=build/release/tests/wireplan_bare out=build/surface-only/out status=0
  "$program" simulate cases/s-tube/scene.json -o "$out/scene" || return 1
  local told
  told=$("$program" check cases/abdomen 2>&1) || status=$?
  if ((status != 2)) || [[ $told != *"-DWIREPLAN_IMAGING=ON"* ]]; then
    echo "a volume: exit code $status, expected 2 and the remedy: $told"
    return 1
  fi
  local data=${WIREPLAN_DATA:-../shared/data}
  if [[ ! -d "$data/surface-coronary-left" ]]; then
    echo "not run on a surface: no surface-coronary-left in $data (set WIREPLAN_DATA)"
    return 0
  fi
  "$program" run cases/coronary-left -o "$out/case" --cache "$out/cache" || return 1
  grep -q "report.html was left out" "$out/case/report.json"
}

# Each parser gets a fixed number of executions, under a minute; tests/fuzz/run.sh takes as many as asked.
fuzz_parsers() {
  if [[ ! -x build/dev/tests/fuzz/fuzz_case ]]; then
    echo "not run: this clang++ has no libFuzzer (package libclang-rt-dev)"
    return 0
  fi
  bash tests/fuzz/run.sh 20000 && bash tests/fuzz/run.sh 2000 repair inspect dicom
}

# What a package is made of is all there, and the program runs from where it is installed.
check_install() {
  rm -rf build/installed
  cmake --install build/release --prefix "$PWD/build/installed" >/dev/null || return 1
  build/installed/bin/wireplan devices >/dev/null
}

# Cases start from nothing, not from what earlier runs left in the user's cache.
case_cache=$PWD/build/case-cache
rm -rf "$case_cache"
run_bundled_case() { XDG_CACHE_HOME=$case_cache bash cases/demo.sh; }

# Real anatomy, where the data lie beside the checkout: a surface to its plans, and a volume, with
# few of its candidates, to a report that says that none reaches.
run_real_cases() {
  local data=${WIREPLAN_DATA:-../shared/data} folder
  for folder in mra-aorta-iliac-vmtk surface-coronary-left; do
    if [[ ! -d "$data/$folder" ]]; then
      echo "not run: no $folder in $data (set WIREPLAN_DATA)"
      return 0
    fi
  done
  local -x XDG_CACHE_HOME=$case_cache
  local status=0
  build/release/pipeline/wireplan run cases/coronary-left || return 1
  build/release/pipeline/wireplan run cases/aorta-iliac-mra --set manoeuvres=never \
    --set 'wires=["amplatz-stiff-hook"]' --set 'access.inclination_deg=[0]' || status=$?
  ((status == 1))
}

# The pages of these cases' reports in a browser.
check_pages() {
  local pages=() name
  for name in abdomen coronary-left aorta-iliac-mra; do
    [[ -f wireplan-out/$name/report.html ]] && pages+=("wireplan-out/$name/report.html")
  done
  if ((${#pages[@]} == 0)); then
    echo "not run: the reports have no page (see their warnings)"
    return 0
  fi
  printf '%s\0' "${pages[@]}" | WIREPLAN_PAGE_MODULES=$PWD/build/release/pipeline/page \
    xargs -0 -n 1 -P "$(nproc)" bash -c 'node tests/page/test_page.mjs "$1" || (($? == 77))' -  # 77: no browser, which it says
}

# The workflow for clusters, by Snakemake alone and on a Slurm of this machine.
run_cluster() {
  if ! bash tests/install.sh tests/cluster/packages.txt; then
    echo "not run: Snakemake could not be installed, see above"
    return 0
  fi
  local status=0
  python3 tests/cluster/test_cluster.py build/release/pipeline/wireplan || status=$?
  ((status == 0 || status == 77))  # 77: no Snakemake, which it says
}

step "install packages" bash tests/install.sh
step "formatting" check_formatting
beside "clang-tidy on simulate and plan" check_tidy
step "release build" bash tests/build.sh release
beside "thread sanitizer build of simulate and plan" nice -n 19 bash tests/build.sh tsan
step "installation" check_install
step "tests" run_suite release
step "bundled case" run_bundled_case
step "cases on real data" run_real_cases
step "pages in a browser" check_pages
step "without ITK and Node" check_surface_only
beside "cluster" run_cluster
step "build with Clang and sanitizers" bash tests/build.sh dev
step "cluster" of_beside "cluster"
step "tests under address and undefined behaviour sanitizers" run_suite dev
step "clang-tidy on simulate and plan" of_beside "clang-tidy on simulate and plan"
step "fuzz the parsers" fuzz_parsers
step "thread sanitizer build of simulate and plan" of_beside "thread sanitizer build of simulate and plan"
step "tests under thread sanitizer" run_suite tsan
echo "== all steps ok, $SECONDS s"
