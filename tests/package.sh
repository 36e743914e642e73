#!/usr/bin/env bash
# package.sh [ROOT]: makes the Debian package into build/package. With ROOT, a folder for a bare Debian 12
# (made by debootstrap where it is empty), it is tried there, as root: installed with what it declares
# and nothing else, it lists its wires, makes the CT of the bundled case and plans on it.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
root=${1:-}

bash tests/build.sh release wireplan
rm -rf build/package
cpack --config build/release/CPackConfig.cmake -G DEB -B "$PWD/build/package" >/dev/null
package=$(echo build/package/*.deb)
echo "package: $package, needs $(dpkg-deb -f "$package" Depends)"
[[ -n "$root" ]] || exit 0

if [[ $EUID -ne 0 ]] || ! command -v debootstrap >/dev/null; then
  echo "package: to try it needs root and the package debootstrap" >&2
  exit 1
fi
if [[ ! -e "$root/etc/debian_version" ]]; then
  mkdir -p "$root"
  debootstrap --variant=minbase bookworm "$root" >/dev/null
fi
# Where it is tried, in the root.
place=/opt/try
mkdir -p "$root$place"
cp "$package" "$root$place/wireplan.deb"

# What is on this machine is not seen: neither its environment nor its files.
inside() {
  env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME="$place" LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
    ${http_proxy:+http_proxy="$http_proxy"} chroot "$root" "$@" </dev/null
}
inside apt-get -q -q update
inside apt-get -q -q -y --no-install-recommends -o Dpkg::Use-Pty=0 install --reinstall "$place/wireplan.deb" >/dev/null
inside sh -eu -c '
  cd "$HOME"
  wireplan wires >wires.txt
  grep -q amplatz wires.txt
  rm -rf case out
  cp -r /usr/share/wireplan/cases/abdomen case
  wireplan phantom case/phantom.json -o case/phantom
  wireplan run case -o out
  grep -q "wireplan.report/" out/report.json
  test -s out/report.html'
echo "package: installed in $root, it plans the bundled case"
