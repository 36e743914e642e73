#!/usr/bin/env bash
# build.sh PRESET [TARGET...]: installs what is missing, configures a preset of CMakePresets.json
# and builds it, or these targets of it alone, into build/PRESET. WIREPLAN_WERROR=ON makes warnings errors: not for users, whose compiler may know
# other ones than ours.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
preset=${1:?usage: tests/build.sh PRESET [TARGET...] (release, dev, tsan or surface-only)}
targets=("${@:2}")

if [[ "${targets[*]}" == wireplan ]]; then
  bash tests/install.sh --program
else
  bash tests/install.sh
fi

# What was compiled in another folder counts too, with its precompiled headers.
export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$PWD} CCACHE_NOHASHDIR=${CCACHE_NOHASHDIR:-1}
export CCACHE_SLOPPINESS=${CCACHE_SLOPPINESS:-pch_defines,time_macros,include_file_mtime,include_file_ctime}

# One job per core, as far as memory allows: a file that uses CGAL takes up to 2.6 GB to compile.
available_kb=$(awk '/^MemAvailable:/ {print $2}' /proc/meminfo)
jobs=$((available_kb / 2700000))
cores=$(nproc)
((jobs > cores)) && jobs=$cores
((jobs < 1)) && jobs=1

# Status lines of the libraries' own package files are left out.
cmake --preset "$preset" --log-level=NOTICE >/dev/null
cmake --build --preset "$preset" --parallel "$jobs" ${targets:+--target "${targets[@]}"}
