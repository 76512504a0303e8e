#!/usr/bin/env bash
# Kills `improve -o RUN` at random moments. RUN must then hold every file of one run: the older or the newer.
#
#   scripts/kills.sh [PROGRAM] [KILLS] [SEED]
#
# A quarter of the kills strike at any moment of the run. A quarter waits for the first file of the results, half for
# the figures, the last results but the report; these strike between then and the end. Two blocks take turns, so that a
# mixture of two runs shows as different tables. The test suite does 30 such kills (tests/program/hostile/kills.rs).
set -euo pipefail
program=$(realpath "${1:-$(dirname "$0")/../target/release/misclosure}")
kills=${2:-1000}
RANDOM=${3:-1}
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
cd "$place"
exec 9<> <(:)

pause() { read -rt "$1" -u 9 || true; }
share() { awk -v r=$((RANDOM * 32768 + RANDOM)) -v all="$1" 'BEGIN { printf "%.6f", all * r / 1073741824 }'; }
now() { date +%s.%N; }
less() { awk -v a="$1" -v b="$2" 'BEGIN { printf "%.6f", a - b }'; }
improve() { exec "$program" --quiet --threads 1 improve "$1" -o run --solver native >/dev/null 2>&1; }
# Does a folder of unfinished results, other than those that earlier kills left, hold such a file?
earlier=()
staged() {
  local folder
  for folder in .misclosure-*; do
    [[ " ${earlier[*]} " == *" $folder "* ]] || ! compgen -G "$folder/$1" >/dev/null || return 0
  done
  return 1
}

for name in a b; do
  "$program" --quiet simulate closerange -o "$name-truth" --set points=20 >/dev/null
  "$program" --quiet inject "$name-truth" -o "$name" --error noise:px=0.3 --seed $((RANDOM)) >/dev/null
  rm -rf run
  began=$(now)
  (improve "$name")
  whole=$(less "$(now)" "$began")
  mv run "of-$name"
done
# Tables of the two runs, equal whenever the run is repeated. The others hold seconds: they must be there.
tables=(images.csv points.csv residuals.csv checks.csv model.toml)
mapfile -t files < <(cd of-a && find . -type f | sort)
cp -r of-a run
echo mine > run/notes.txt

# From the first file of the results, or from the figures, to the end of the program.
end_from() {
  improve b & child=$!
  until staged "$1"; do pause 0.0005; done
  began=$(now)
  wait "$child"
  less "$(now)" "$began"
}
writing=$(end_from '*')
replacing=$(end_from figures)
echo "a run takes $whole s, from the first file of the results $writing s, from the figures $replacing s"

which_run() {
  local name table file
  for name in a b; do
    for table in "${tables[@]}"; do cmp -s "run/$table" "of-$name/$table" || continue 2; done
    for file in "${files[@]}"; do [ -s "run/$file" ] || { echo "run/$file is missing"; return 1; }; done
    [ "$(cat run/notes.txt)" = mine ] || { echo "run/notes.txt has gone"; return 1; }
    [ "$(tail -c 2 run/summary.json | tr -d '\n')" = '}' ] || { echo "run/summary.json is cut"; return 1; }
    tail -c 20 run/report.html | grep -q '</html>' || { echo "run/report.html is cut"; return 1; }
    echo "$name"
    return
  done
  echo "run holds neither of the two runs"
  return 1
}

struck=0 computing=0 writes=0 before=0 after=0 ended=0
for ((k = 0; k < kills; k++)); do
  next=$([ "$(which_run)" = a ] && echo b || echo a)
  folder=$(stat -c %i run)
  mapfile -t earlier < <(compgen -G '.misclosure-*' || true)
  case $((k % 4)) in
    0) file='' delay=$(share "$whole") ;;
    1) file='*' delay=$(share "$writing") ;;
    *) file=figures delay=$(share "$replacing") ;;
  esac
  improve "$next" & child=$!
  until [ -z "$file" ] || staged "$file" || ! kill -0 "$child" 2>/dev/null; do pause 0.0002; done
  pause "$delay"
  kill -KILL "$child" 2>/dev/null || true
  code=0
  wait "$child" 2>/dev/null || code=$?
  found=$(which_run) || { echo "kill $k: $found"; exit 1; }
  if ((code != 137)); then
    ((code == 0)) || { echo "kill $k: the run failed with code $code"; exit 1; }
    ended=$((ended + 1))
    continue
  fi
  struck=$((struck + 1))
  if [ "$(stat -c %i run)" != "$folder" ]; then after=$((after + 1))
  elif staged summary.json; then before=$((before + 1))
  elif staged '*'; then writes=$((writes + 1))
  else computing=$((computing + 1)); fi
done
# What the last kill left must not disturb.
(improve a)
! compgen -G '.misclosure-*' >/dev/null || { echo "the next run left $(echo .misclosure-*)"; exit 1; }
which_run >/dev/null
echo "$kills kills: $struck struck a running program, $ended came too late"
echo "computing $computing, writing the results $writes"
echo "in the replacement: complete but not yet in place $before, older run being removed $after"
echo "every time one complete run"
