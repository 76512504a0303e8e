#!/usr/bin/env bash
# Puts the program, its manual pages and completions, the header of effects, a CMake package and a pkg-config file in
# place: scripts/install.sh PREFIX [PROGRAM]
# Everything finds itself by its place: the folder can be moved. DESTDIR goes before PREFIX, as packagers want it.
set -euo pipefail
[ $# -ge 1 ] && [ -n "$1" ] || { echo "usage: scripts/install.sh PREFIX [PROGRAM]" >&2; exit 2; }
prefix=${DESTDIR:-}$1
cd "$(dirname "$0")/.."
program=${2:-target/release/misclosure}
[ -x "$program" ] || { echo "install: no $program: make build compiles it" >&2; exit 1; }
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)

into() { mkdir -p "$prefix/$1" && install -m "$2" "${@:3}" "$prefix/$1"; }
with_version() { sed "s/@VERSION@/$version/" "cmake/$1" >"$prefix/$2/$1" && chmod 644 "$prefix/$2/$1"; }

into bin 755 "$program"
into include/misclosure 644 cpp/effect.h cpp/rotation.h cpp/surveyed.h cpp/bspline.h cpp/effect_test.h
into lib/cmake/misclosure 644 cmake/misclosureConfig.cmake
with_version misclosureConfigVersion.cmake lib/cmake/misclosure
mkdir -p "$prefix/lib/pkgconfig"
with_version misclosure.pc lib/pkgconfig
into share/doc/misclosure 644 README.md CONVENTIONS.md docs/*.md
into share/doc/misclosure/effects 644 examples/effects/*.h examples/effects/*.c
"$program" --quiet man "$prefix/share/man/man1" >/dev/null
completions() { mkdir -p "$prefix/$2" && "$program" completions "$1" >"$prefix/$2/$3"; }
completions bash share/bash-completion/completions misclosure
completions zsh share/zsh/site-functions _misclosure
completions fish share/fish/vendor_completions.d misclosure.fish
echo "install: $prefix/bin/misclosure, include/misclosure, lib/cmake/misclosure, lib/pkgconfig/misclosure.pc, share/man, completions, share/doc/misclosure"
