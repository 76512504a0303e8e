#!/usr/bin/env bash
# Builds what others install, into target/dist:
#   misclosure_VERSION-1_amd64.deb             both solvers; for the release of Debian or Ubuntu that builds it
#   misclosure-VERSION-x86_64-linux.tar.gz     the native solver alone; for any Linux whose glibc is not older than OLDEST_GLIBC
set -euo pipefail
cd "$(dirname "$0")/.."
export PATH="${CARGO_HOME:-$HOME/.cargo}/bin:$PATH"

# Ubuntu 22.04; Debian 12 has 2.36.
OLDEST_GLIBC=2.35
# Libraries that every Linux with glibc has.
BASIC='^(libc|libm|libgcc_s|ld-linux-x86-64)\.so\.[0-9]+$'

die() { printf 'dist: %s\n' "$*" >&2; exit 1; }

version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
target=${CARGO_TARGET_DIR:-target}
program=$target/dist/misclosure
out=target/dist-packages
command -v cargo-deb >/dev/null || cargo install --locked cargo-deb
rm -rf "$out" && mkdir -p "$out"

# The tarball first: the second build then leaves the program with both solvers in place.
cargo build --locked --profile dist --no-default-features --features lab
"$program" --version | grep -q '^solvers: native (this build has no Ceres)$' || die "the build for the tarball has Ceres"
newest=$(objdump -T "$program" | grep -o 'GLIBC_[0-9.]*' | sort -uV | tail -n 1)
newest=${newest#GLIBC_}
[ "$(printf '%s\n' "$OLDEST_GLIBC" "$newest" | sort -V | tail -n 1)" = "$OLDEST_GLIBC" ] ||
  die "$program needs glibc $newest, Ubuntu 22.04 has $OLDEST_GLIBC: $(objdump -T "$program" | grep "GLIBC_$newest")"
needed=$(objdump -p "$program" | sed -n 's/^ *NEEDED *//p')
others=$(grep -Ev "$BASIC" <<<"$needed" || true)
[ -z "$others" ] || die "$program needs libraries that a bare Linux does not have: $others"
name=misclosure-$version-x86_64-linux
scripts/install.sh "$PWD/$out/$name" "$program"
cp LICENSE-MIT LICENSE-APACHE CHANGELOG.md "$out/$name"
tar -C "$out" --owner=0 --group=0 -czf "$out/$name.tar.gz" "$name"
rm -r "${out:?}/$name"

cargo build --locked --profile dist
"$program" --version | grep -q '^solvers: native, ceres$' || die "the build for the .deb lacks a solver"
# Where [package.metadata.deb] looks for what the program makes itself.
rm -rf target/dist-files && scripts/install.sh "$PWD/target/dist-files" "$program"
cargo deb --locked --no-build --profile dist --output "$out/"

printf 'dist: the program of the tarball needs glibc %s\n' "$newest"
ls -lh "$out"
