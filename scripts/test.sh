#!/usr/bin/env bash
# Everything CI runs, with the time of each part (`make test`). The C++ tests need neither cargo nor its lock: they are
# built and run beside the rest, at the lowest priority, where lints, linker and browser leave a processor idle.
set -euo pipefail
cd "$(dirname "$0")/.."
times=()

# Runs a part, and notes how long it took.
part() {
  local begun=$SECONDS
  echo "== $*"
  "$@"
  times+=("$(printf '%5d s  %s' $((SECONDS - begun)) "$*")")
}

mkdir -p target
log=target/sanitize.log
# In a group of its own, so that its compilers end with it where something else fails.
set -m
nice -n 19 make --no-print-directory test-sanitize >"$log" 2>&1 &
sanitizer=$!
set +m
trap 'kill -- -$sanitizer 2>/dev/null || true' EXIT

# Waits for the C++ tests, and shows what they said.
test_sanitize() {
  local code=0
  wait "$sanitizer" || code=$?
  [ $code -eq 0 ] && tail -n 12 "$log" || cat "$log"
  return $code
}

part cargo fmt --check
part cargo clippy --release --all-targets -- -D warnings
# Without Ceres the program and what tests it compile, too; benchmarks and examples were linted above.
part cargo clippy --release --lib --bins --tests --no-default-features --features lab -- -D warnings
part env RUSTDOCFLAGS="-D warnings" cargo doc --release --no-deps
# Examples were compiled by the lints; those that a test runs are part of it.
part cargo test --release --lib --bins --tests
part cargo test --release --doc
part tests/lab_page/run.sh
part test_sanitize
printf '%s\n' "${times[@]}" "$(printf '%5d s  in all' $SECONDS)"
