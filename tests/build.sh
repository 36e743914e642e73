#!/usr/bin/env bash
# build.sh PRESET: installs what is missing, configures and builds a preset of CMakePresets.json
# into build/PRESET. WIREPLAN_WERROR=ON makes warnings errors: not for users, whose compiler may know
# other ones than ours.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
preset=${1:?usage: tests/build.sh PRESET (release, dev, tsan, tidy, fuzz or surface-only)}

bash tests/install.sh

# One job per core, as far as memory allows: a file that uses CGAL takes up to 2.4 GB to compile.
available_kb=$(awk '/^MemAvailable:/ {print $2}' /proc/meminfo)
jobs=$((available_kb / 2400000))
cores=$(nproc)
((jobs > cores)) && jobs=$cores
((jobs < 1)) && jobs=1

# Status lines of the libraries' own package files are left out.
cmake --preset "$preset" --log-level=NOTICE >/dev/null
cmake --build --preset "$preset" --parallel "$jobs"
