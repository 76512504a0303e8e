#!/usr/bin/env bash
# The pictures of the gallery in the book: the first screen of the report of each finding, taken by a headless Chromium.
# Usage: scripts/gallery.sh [PROGRAM [FOLDER [NAME...]]]; CHROMIUM names another browser.
set -euo pipefail
cd "$(dirname "$0")/.."
program=$(realpath "${1:-target/release/misclosure}")
folder=$(realpath -m "${2:-docs/gallery}")
names=("${@:3}")
browser=${CHROMIUM:-$(command -v chromium || command -v chromium-browser || command -v google-chrome)} ||
  { echo "gallery: no Chromium here: scripts/setup-lab.sh installs one" >&2; exit 1; }

# Largest picture, bytes.
largest=150000

place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
mkdir -p "$folder"

# What the finding NAME says, and the first HEIGHT pixels of its report: finding NAME BLOCK HEIGHT. The page names the
# command, so that runs are made in the folder of the blocks.
finding() {
  (cd "$place" && "$program" --quiet improve "$2" -o "$1") >"$place/$1.txt"
  "$browser" --headless --no-sandbox --disable-gpu --hide-scrollbars --user-data-dir="$place/browser" \
    --window-size="1100,$3" --screenshot="$folder/$1.png" "file://$place/$1/report.html" 2>/dev/null
  [ "$(stat -c %s "$folder/$1.png")" -le $largest ] || { echo "gallery: $1.png is larger than $largest bytes" >&2; exit 1; }
  echo "== $1"
  sed -n '1,/^What may be missing/{/^What may be missing/!p}' "$place/$1.txt"
}

# A block with an effect in it.
hidden() {
  wanted "$1" || return 0
  "$program" --quiet inject "data/hidden/$2.toml" -o "$place/block-$1" >/dev/null
  finding "$1" "block-$1" 900
}

# Feet where metres belong, in a simulated block.
feet() {
  "$program" --quiet simulate mapping -o "$place/mapping" >/dev/null
  "$program" --quiet inject "$place/mapping" -o "$place/block-feet" --error noise:px=0.3 \
    --mistake scale:of=control,unit=feet >/dev/null
  finding feet block-feet 705
}

wanted() {
  [ ${#names[@]} -eq 0 ] || [[ " ${names[*]} " == *" $1 "* ]]
}

hidden rolling-shutter dike-rolling-shutter
hidden focal-temperature dike-focal-temperature
hidden local-flaw dike-local-flaw
hidden gnss-lever-arm mapping-lever-arm
! wanted feet || feet
! wanted geoid || finding geoid "$PWD/data/ign-borea" 420
