#!/usr/bin/env bash
# Installs the packages of packages.txt that are missing. Silent and quick where none is.
# WIREPLAN_SKIP_INSTALL=1 leaves the system as it is, for other distributions.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

[[ -n "${WIREPLAN_SKIP_INSTALL:-}" ]] && exit 0
if ! { command -v apt-get && command -v dpkg-query; } >/dev/null; then
  echo "install: needs Debian 12, Ubuntu 22.04 or later (no apt-get here). Elsewhere, install what" \
    "tests/packages.txt names and set WIREPLAN_SKIP_INSTALL=1." >&2
  exit 1
fi

# What the list names and dpkg does not have.
mapfile -t listed < <(sed 's/#.*//' packages.txt | xargs -n 1 | sort -u)
# A name with a "?" counts unless apt knows packages (clang), but none of that name.
is_unknown() {
  ! dpkg-query -W "$1" >/dev/null 2>&1 && apt-cache show clang >/dev/null 2>&1 &&
    ! apt-cache show "$1" >/dev/null 2>&1
}
wanted=()
for package in "${listed[@]}"; do
  if [[ $package == *\? ]] && is_unknown "${package%\?}"; then continue; fi
  wanted+=("${package%\?}")
done
present=$(dpkg-query -W -f '${Package} ${db:Status-Status}\n' "${wanted[@]}" 2>/dev/null |
  sed -n 's/ installed$//p' | sort -u) || true
mapfile -t missing < <(comm -23 <(printf '%s\n' "${wanted[@]}") <(echo "$present"))
((${#missing[@]} == 0)) && exit 0

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
for k in "${!missing[@]}"; do
  if grep -q "^${missing[k]}?" packages.txt && is_unknown "${missing[k]}"; then unset "missing[k]"; fi
done
if ! apt install --no-install-recommends "${missing[@]}"; then
  tail -n 30 "$log" >&2
  echo "install: apt-get failed (see above); expected network access and Debian 12, Ubuntu 22.04" \
    "or later" >&2
  exit 1
fi
