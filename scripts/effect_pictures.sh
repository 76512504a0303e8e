#!/usr/bin/env bash
# The pictures of the effects' pages: the residuals in which each effect of the catalogue shows, before and after it is in
# the model. One block of data/hidden for each. Usage: scripts/effect_pictures.sh [PROGRAM [FOLDER [EFFECT...]]]
set -euo pipefail
cd "$(dirname "$0")/.."
program=$(realpath "${1:-target/release/misclosure}")
folder=$(realpath -m "${2:-docs/effects}")
shift $(($# < 2 ? $# : 2))

# Effect | the recipe that hides it.
blocks=(
  "focal-temperature|dike-focal-temperature"
  "focal-flight|dike-focal-steps"
  "focal-image|dike-focus-hunting"
  "pp-time|mapping-pp-drift"
  "pp-flight|mapping-pp-steps"
  "pp-image|closerange-sensor-jitter"
  "gravity-sag|closerange-lens-sag"
  "local-flaw|dike-local-flaw"
  "unflatness|mapping-unflatness"
  "radial-high|mapping-radial-high"
  "decentring-high|closerange-decentring-high"
  "rolling-shutter|dike-rolling-shutter"
  "refraction|high-refraction"
  "flat-port|closerange-flat-port"
  "gnss-lever-arm|mapping-lever-arm"
  "gnss-delay|dike-gnss-delay"
  "gnss-shift|mapping-gnss-shift"
  "gnss-drift|mapping-gnss-drift"
)

place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
mkdir -p "$folder"
for entry in "${blocks[@]}"; do
  IFS='|' read -r effect recipe <<<"$entry"
  if [ $# -gt 0 ] && [[ " $* " != *" $effect "* ]]; then continue; fi
  "$program" --quiet inject "data/hidden/$recipe.toml" -o "$place/block" >/dev/null
  "$program" --quiet improve "$place/block" -o "$place/run" >/dev/null
  # A field over the sensor has a figure for each model; the first one shows what there was to explain.
  for picture in "$place/run/figures/found-$effect.svg" "$place/run/figures/found-$effect-base-1.svg"; do
    [ -f "$picture" ] || continue
    cp "$picture" "$folder/$effect.svg"
    echo "$effect: $recipe"
    break
  done
  [ -f "$picture" ] || echo "$effect: not found in $recipe, no picture" >&2
  rm -rf "$place/block" "$place/run"
done
