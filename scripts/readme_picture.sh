#!/usr/bin/env bash
# The picture of the README: residuals on the sensor and check points, before and after, from the figures of a run on
# data/hidden/received-1. Usage: scripts/readme_picture.sh [PROGRAM [FILE]]
set -euo pipefail
cd "$(dirname "$0")/.."
program=$(realpath "${1:-target/release/misclosure}")
file=$(realpath -m "${2:-docs/before-after.svg}")

place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
"$program" --quiet improve data/hidden/received-1 -o "$place/run" >/dev/null
figures=$place/run/figures

# A figure of the run as a part of the picture: moved by $2 and $3, and $4 per cent as large.
part() {
  sed -E "1s|^<svg |<svg x=\"$2\" y=\"$3\" |; 1s| width=\"[0-9.]+\"| width=\"$(size "$1" width "$4")\"|
    1s| height=\"[0-9.]+\"| height=\"$(size "$1" height "$4")\"|" "$figures/$1.svg"
}
# The number in an attribute of a figure's first line, as large as $3 per cent of it.
size() {
  local number
  number=$(sed -nE "1s/.* $2=\"([0-9]+)[0-9.]*\".*/\1/p" "$figures/$1.svg")
  echo $((number * $3 / 100))
}
heading() {
  printf '<text x="%d" y="30" font-size="20" fill="#222222" font-weight="bold">%s</text>\n' "$1" "$2"
}

sensor=$(size sensor-base-1 width 100)
map=$(size finding-before width 130)
left=$((sensor + $(size sensor-final-1 width 100)))
width=$((left + 2 * map))
height=$((50 + $(size finding-before height 130)))
{
  printf '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 %d %d" width="%d" font-family="sans-serif" role="img" ' \
    "$width" "$height" "$width"
  printf 'aria-label="Residuals on the sensor and errors of check points, before and after">\n'
  printf '<title>Residuals on the sensor and errors of check points, before and after</title>\n'
  printf '<rect width="%d" height="%d" fill="#FFFFFF"/>\n' "$width" "$height"
  heading 14 "Residuals in the images, by place on the sensor"
  heading $((left + 14)) "Errors of the check points (3D RMS)"
  part sensor-base-1 0 50 100
  part sensor-final-1 "$sensor" 50 100
  part finding-before "$left" 50 130
  part finding-after $((left + map)) 50 130
  printf '</svg>\n'
} >"$file"
echo "$file"
