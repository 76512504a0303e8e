#!/usr/bin/env bash
# Installs what scripts/dist.sh made in clean roots, without compilers, and runs it there. As root; needs debootstrap.
# Debian 12: the .deb by apt, and the tarball. Ubuntu 22.04: the tarball, where a mirror of Ubuntu answers. Debian has no
# keys of Ubuntu: debootstrap then says that it cannot check the signature, which a root to throw away bears.
set -euo pipefail
cd "$(dirname "$0")/.."
debian=${DEBIAN_MIRROR:-http://deb.debian.org/debian}
ubuntu=${UBUNTU_MIRROR:-http://archive.ubuntu.com/ubuntu}

die() { printf 'try_dist: %s\n' "$*" >&2; exit 1; }
[ "$(id -u)" = 0 ] || die "run as root: it makes and enters root folders"
command -v debootstrap >/dev/null || die "no debootstrap: apt-get install debootstrap"
deb=$(ls target/dist-packages/*.deb) && tarball=$(ls target/dist-packages/*.tar.gz) || die "nothing to try: make dist"
roots=$(mktemp -d)
trap 'rm -rf "$roots"' EXIT

root() { # NAME SUITE MIRROR: makes a root
  printf '\n== %s\n' "$1"
  debootstrap --variant=minbase "$2" "$roots/$1" "$3" >"$roots/$1.log" 2>&1 || { tail -n 5 "$roots/$1.log"; return 1; }
  cp /etc/resolv.conf "$roots/$1/etc/resolv.conf"
}

try() { # NAME SOLVERS: runs the program of a root
  local inside=(chroot "$roots/$1" env -i PATH=/usr/local/bin:/usr/bin:/bin LANG=C.UTF-8)
  "${inside[@]}" sh -c '! command -v cc && ! command -v c++' || die "$1 has a compiler: it proves nothing"
  "${inside[@]}" misclosure --version | tee "$roots/version"
  grep -qxF "solvers: $2" "$roots/version" || die "$1: other solvers than $2"
  "${inside[@]}" sh -ec 'misclosure --quiet simulate closerange -o /tmp/b >/dev/null
    misclosure check /tmp/b; misclosure --quiet adjust /tmp/b -o /tmp/run | sed -n "/^solver/,/^\$/p"; rm -r /tmp/b /tmp/run'
}

unpack() { tar -C "$roots/$1/usr/local" --strip-components=1 -xzf "$tarball"; } # NAME

root debian12-tarball bookworm "$debian" || die "no root of Debian 12 from $debian"
unpack debian12-tarball
try debian12-tarball "native (this build has no Ceres)"

# The same root, with the package in place of the tarball.
mv "$roots/debian12-tarball" "$roots/debian12-deb"
rm -r "$roots/debian12-deb/usr/local/bin/misclosure"
printf '\n== debian12-deb\n'
cp "$deb" "$roots/debian12-deb/tmp/misclosure.deb"
chroot "$roots/debian12-deb" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive sh -ec \
  'apt-get -q update && apt-get -q install -y --no-install-recommends /tmp/misclosure.deb' >"$roots/apt.log" 2>&1 ||
  { tail -n 20 "$roots/apt.log"; die "the package cannot be installed"; }
try debian12-deb "native, ceres"
chroot "$roots/debian12-deb" dpkg -L misclosure | grep -E 'man1/misclosure-adjust|completions/misclosure|doc/misclosure/'

if root ubuntu2204 jammy "$ubuntu"; then
  unpack ubuntu2204
  try ubuntu2204 "native (this build has no Ceres)"
else
  printf '\nSKIPPED: UBUNTU 22.04 WAS NOT TRIED: no root from %s (UBUNTU_MIRROR names another mirror)\n' "$ubuntu"
  exit 0
fi
printf '\ntry_dist: all roots ran the program\n'
