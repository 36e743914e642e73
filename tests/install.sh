#!/usr/bin/env bash
# install.sh [--program] [LIST]: installs the packages of LIST, tests/packages.txt if none is named,
# that are missing; with --program without those marked "tests". Silent and quick where none is.
# WIREPLAN_SKIP_INSTALL=1 leaves the system as it is, for other distributions.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
left_out='^$'  # lines
if [[ "${1:-}" == --program ]]; then
  left_out='# *tests[:,]'
  shift
fi
list=${1:-tests/packages.txt}

[[ -n "${WIREPLAN_SKIP_INSTALL:-}" ]] && exit 0
if ! { command -v apt-get && command -v dpkg-query; } >/dev/null; then
  echo "install: needs Debian 12, Ubuntu 22.04 or later (no apt-get here). Elsewhere, install what" \
    "$list names and set WIREPLAN_SKIP_INSTALL=1." >&2
  exit 1
fi

# What the list names and no installed package is or provides (that of Node's makers has npm in it).
mapfile -t wanted < <(grep -v "$left_out" "$list" | sed 's/#.*//' | xargs -n 1 | sort -u)
present=$(dpkg-query -W -f '${db:Status-Status} ${Package}, ${Provides}\n' 2>/dev/null |
  sed -n 's/^installed //p' | sed 's/([^)]*)//g' | tr -s ', ' '\n' | sort -u) || true
mapfile -t missing < <(comm -23 <(printf '%s\n' "${wanted[@]}") <(echo "$present"))
((${#missing[@]} == 0)) && exit 0

# What may be left out: optional ones, where no source that apt has read knows them.
is_optional() { grep -q "^$1 .*optional:" "$list"; }
is_known() { apt-cache show "$1" 2>/dev/null | grep -q '^Filename:'; }
drop_unknown() {
  local kept=() package
  for package in "${missing[@]}"; do
    if is_optional "$package" && ! is_known "$package"; then
      echo "install: $package is not among this system's packages; going on without" >&2
    else
      kept+=("$package")
    fi
  done
  missing=("${kept[@]}")
  ((${#missing[@]})) || exit 0
}
is_known cmake && drop_unknown  # the sources were read before

as_root=()
if [[ $EUID -ne 0 ]]; then
  if ! command -v sudo >/dev/null; then
    echo "install: these packages are missing: ${missing[*]}. Run as root:" \
      "apt-get install --no-install-recommends ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi

# The output of apt is long; it is shown where something fails.
echo "install: ${missing[*]}" >&2
log=$(mktemp)
trap 'rm -f "$log"' EXIT
apt() {
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get -q -y -o Acquire::Retries=3 -o DPkg::Lock::Timeout=300 -o Dpkg::Use-Pty=0 "$@" \
    </dev/null >>"$log" 2>&1
}
apt update || true  # a broken source that has none of our packages does not matter
drop_unknown
if ! apt install --no-install-recommends "${missing[@]}"; then
  tail -n 30 "$log" >&2
  echo "install: apt-get failed (see above); expected network access and Debian 12, Ubuntu 22.04" \
    "or later" >&2
  exit 1
fi
