#!/usr/bin/env bash
# Everything that the build machine runs, with the time of each part (`make test`). The C++ tests need neither cargo nor
# its lock. They run beside the rest at the lowest priority, and take what lints, linker and browser leave idle.
set -euo pipefail
cd "$(dirname "$0")/.."
times=()

# Runs a part and notes its time.
part() {
  local begun=$SECONDS
  echo "== $*"
  "$@"
  times+=("$(printf '%5d s  %s' $((SECONDS - begun)) "$*")")
}

mkdir -p target
log=target/sanitize.log
# Its own process group: when another part fails, the trap below also ends its compilers.
set -m
nice -n 19 make --no-print-directory test-sanitize >"$log" 2>&1 &
sanitizer=$!
# Packages from PyPI come while cargo compiles.
nice -n 19 scripts/test_python.sh prepared >target/python.log 2>&1 &
packages=$!
set +m
trap 'kill -- -$sanitizer -$packages 2>/dev/null || true' EXIT

# Waits for the C++ tests, and shows what they said.
test_sanitize() {
  local code=0
  wait "$sanitizer" || code=$?
  if [ $code -eq 0 ]; then tail -n 12 "$log"; else cat "$log"; fi
  return $code
}

# The Python package, by the library that cargo has built.
test_python() {
  wait "$packages" || { cat target/python.log; return 1; }
  scripts/test_python.sh built
}

# The book, by the program's own pages (tests/program/book holds them current).
book() {
  if command -v mdbook >/dev/null; then mdbook build docs
  else printf '\n  book: skipped: no mdbook (make docs installs it)\n\n' >&2; fi
}

# The Python crate is a module, which links no libpython. Without an interpreter it builds against the stable interface
# once it is told so; the tests of the package then say that they are skipped.
export PYO3_BUILD_EXTENSION_MODULE=1
command -v python3 >/dev/null || export PYO3_NO_PYTHON=1

part cargo fmt --check
# The Python crate takes part everywhere: cargo then compiles what both need once.
part cargo clippy --release --all-targets --workspace --features misclosure-py/ceres -- -D warnings
# What differs without Ceres: the library, the program and the Python package.
part cargo clippy --release --lib --bins --workspace --no-default-features --features misclosure/lab -- -D warnings
part env RUSTDOCFLAGS="-D warnings" cargo doc --release --no-deps --workspace --features misclosure-py/ceres
# The lints compiled the examples; tests/program/examples.rs runs them.
part cargo test --release --tests --workspace --features misclosure-py/ceres
part cargo test --release --doc --workspace --features misclosure-py/ceres
part test_python
part book
part tests/lab_page/run.sh
part test_sanitize
printf '%s\n' "${times[@]}" "$(printf '%5d s  in all' $SECONDS)"
