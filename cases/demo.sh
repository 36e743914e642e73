#!/usr/bin/env bash
# The bundled case from nothing to a report: installs packages, builds wireplan, makes the CT of a
# synthetic abdomen and plans on it. The last lines name the best plan and the report.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

bash tests/build.sh release wireplan
build/release/pipeline/wireplan phantom cases/abdomen/phantom.json -o cases/abdomen/phantom
build/release/pipeline/wireplan run cases/abdomen
