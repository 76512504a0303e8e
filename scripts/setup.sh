#!/usr/bin/env bash
# Brings the machine to the point where `cargo build` works; quick and silent when it is there already.
# Debian and Ubuntu: what is missing is installed with apt. Elsewhere: what is missing is listed, and that is all.
set -euo pipefail
cd "$(dirname "$0")/.."
export PATH="${CARGO_HOME:-$HOME/.cargo}/bin:$PATH"

say() { printf 'setup: %s\n' "$*" >&2; }
die() { say "$*"; exit 1; }

# Debian package | what it is needed for | how to see that it is there.
packages=(
  "make|runs this project's targets and CMake's builds|command -v make"
  "g++|compiles the Ceres side, and links the Rust program|command -v g++"
  "cmake|builds the C++ library and its tests|command -v cmake"
  "pkg-config|tells CMake where the libraries under Ceres are|command -v pkg-config"
  "libsuitesparse-dev|sparse Cholesky for Ceres|has_header cholmod.h || has_header suitesparse/cholmod.h"
  "libceres-dev|the Ceres solver, with Eigen and glog|has_header ceres/ceres.h"
)

has_header() {
  command -v g++ >/dev/null && printf '#if !__has_include(<%s>)\n#error\n#endif\n' "$1" | g++ -E -x c++ - 
}

missing=()
for entry in "${packages[@]}"; do
  IFS='|' read -r package reason check <<<"${entry//||/@@}"
  if ! eval "${check//@@/||}" >/dev/null 2>&1; then
    [ ${#missing[@]} -gt 0 ] || say "missing on this machine:"
    printf '  %-20s %s\n' "$package" "$reason" >&2
    missing+=("$package")
  fi
done

if [ ${#missing[@]} -gt 0 ]; then
  command -v apt-get >/dev/null || die "no apt-get here: install these (Debian's names) and run the command again"
  as_root=()
  if [ "$(id -u)" != 0 ]; then
    command -v sudo >/dev/null || die "neither root nor sudo: run as root: apt-get install ${missing[*]}"
    as_root=(sudo)
  fi
  say "installing them with apt"
  # Kept quiet unless it fails: a fresh machine prints some hundred lines here.
  log=$(mktemp)
  trap 'rm -f "$log"' EXIT
  apt() {
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -o Acquire::Retries=3 "$@" >"$log" 2>&1 ||
      { cat "$log" >&2; die "apt-get $1 failed (its output is above)"; }
  }
  apt update
  apt install -y --no-install-recommends "${missing[@]}"
  say "installed: ${missing[*]}"
fi

command -v cargo >/dev/null || die "no cargo: install Rust with rustup, see https://rustup.rs"
cargo --version >/dev/null 2>&1 || {
  say "rustup has no default toolchain: installing stable"
  rustup default stable >&2 || die "rustup could not install a toolchain"
}

wanted=$(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)
found=$(rustc --version | cut -d' ' -f2)
[ "$(printf '%s\n%s\n' "$wanted" "${found%%-*}" | sort -V | head -n 1)" = "$wanted" ] ||
  die "rustc $found is too old, $wanted is needed: rustup update stable"

for component in rustfmt clippy; do
  tool=${component/rustfmt/fmt}
  cargo "$tool" --version >/dev/null 2>&1 && continue
  say "adding rustup component $component (make test checks with it)"
  command -v rustup >/dev/null || die "$component is missing and there is no rustup to add it: install it the way Rust was"
  rustup component add "$component" >&2 || die "rustup could not add $component: make test cannot run its checks without it"
done
