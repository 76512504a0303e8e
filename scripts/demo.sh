#!/usr/bin/env bash
# The main job, on a block as somebody would receive it: what is missing in the model? Add it, and watch the error fall.
set -euo pipefail
cd "$(dirname "$0")/.."
block=data/hidden/received-1
run=out/demo
rm -rf "$run"
mkdir -p out

run() {
  printf '\n$ misclosure %s\n' "$*"
  target/release/misclosure "$@"
}

printf 'A dike, four flights, measured with noise and outliers; something acts on it that the camera model does not know.\n'
run --quiet check "$block"
run improve "$block" -o "$run"

printf '\nWhat to open:\n'
[ -f "$run/report.html" ] && printf '  %s/report.html      the whole story with pictures\n' "$run"
printf '  %s/diagnosis.json   every candidate, the tests and the ledger\n' "$run"
printf '  %s/summary.json     the final adjustment with both solvers\n' "$run"
