#!/usr/bin/env bash
# The COLMAP model of the tutorial, from the block of IGN: data/borea-colmap. The model holds the poses of an adjustment
# with GNSS positions and the camera of the laboratory; ground control and positions are those of the block, as lists.
# Usage: scripts/borea_colmap.sh [PROGRAM [FOLDER]]
set -euo pipefail
cd "$(dirname "$0")/.."
program=$(realpath "${1:-target/release/misclosure}")
folder=$(realpath -m "${2:-data/borea-colmap}")
block=data/ign-borea

place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
rm -rf "$folder"
mkdir -p "$folder"

# The project that COLMAP would have saved.
"$program" --quiet adjust "$block" -o "$place/run" --datum gnss --free none >/dev/null
"$program" --quiet export colmap-text "$place/run" -o "$folder/sparse" >/dev/null

# Columns of a table by their names: columns TABLE NAME...
columns() {
  awk -F, -v names="${*:2}" '
    NR == 1 { count = split(names, wanted, " "); for (k = 1; k <= NF; k++) at[$k] = k; next }
    { for (k = 1; k <= count; k++) printf "%s%s", $at[wanted[k]], k < count ? "," : "\n" }' "$block/$1"
}

{ echo "name,easting,northing,height"; columns control.csv point x y z; } >"$folder/ground.csv"
{ echo "image,name,column,row"; columns marks.csv image point x y; } >"$folder/marks.csv"
{ echo "EPSG:2154"; columns images.csv image gnss_x gnss_y gnss_z | tr , ' '; } >"$folder/geo.txt"
cp "$block/LICENSE.txt" "$folder/"
