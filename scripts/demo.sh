#!/usr/bin/env bash
# The main job, on a block that the program simulates: adjust with both solvers, then with the missing effect in the model.
set -euo pipefail
cd "$(dirname "$0")/.."
demo=out/demo
rm -rf "$demo"
mkdir -p "$demo"

run() {
  printf '\n$ misclosure %s\n' "$*"
  target/release/misclosure --quiet "$@"
}

printf 'A dike of 200 m, four flights, 0.1 px noise; the focal length grows from image to image by 1e-5 of itself.\n'
run simulate dike -o "$demo/dike"
run inject "$demo/dike" -o "$demo/drift" --error focal-growth --error noise:px=0.1
printf '\nOne camera for all images. The check points are the truth: what they show is the error that nobody sees in the field.\n'
run adjust "$demo/drift" -o "$demo/plain"
printf '\nThe same with a focal length that changes from image to image.\n'
run adjust "$demo/drift" -o "$demo/modelled" --add focal-time:against=order

cat <<TXT

What to open:
  $demo/plain/summary.json       the first adjustment; compare "check" with that of
  $demo/modelled/summary.json    the second
  $demo/modelled/checks.csv      residuals at every check point
TXT
