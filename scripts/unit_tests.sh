#!/usr/bin/env bash
# The unit tests of the library: `unit_tests.sh [NAME]`. Compiled with few optimisations, but linked with the optimised
# libraries of the other tests: 246 s of the processor for the compiler in place of 450 s, and 52 s for the tests in
# place of 36 s. A profile of their own would compile every library again.
set -euo pipefail
cd "$(dirname "$0")/.."
program=$(cargo rustc --lib --profile bench --message-format json-render-diagnostics -- -C opt-level=1 -C lto=off |
  sed -n 's/.*"executable":"\([^"]*\)".*/\1/p')
CARGO_MANIFEST_DIR=$PWD exec "$program" --quiet "$@"
