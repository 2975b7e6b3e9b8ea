#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Instructions of the kernels, by valgrind, beside what is recorded in instructions.txt: the same binary counts the same on
# every machine, however busy. instructions.sh [PROGRAM]; with WRITE=1 in the environment it records them anew.
# Exit code 1 where a count left its record by more than 2 % (other compilers' patches and libm's variants stay below that): more
# is slower; fewer is recorded anew, so that the next loss is seen.
set -euo pipefail
program=${1:-build/bench/wm_bench_works}
record=$(dirname "$(readlink -f "$0")")/instructions.txt
command -v valgrind >/dev/null || { echo "instructions: not counted, there is no valgrind (Debian: valgrind)"; exit 0; }
fresh=$(mktemp)
trap 'rm -f "$fresh"' EXIT
for work in plain_step landmark_pose landmark_defaults landmark_step particles_200 particles_2000 window_50x50 picture_rays picture_windows picture_lines picture_landmarks own_map_cycle; do
  count=$(valgrind --tool=callgrind --callgrind-out-file=/dev/null --collect-atstart=no --toggle-collect=wm_counted \
    "$program" "$work" 2>&1 | sed -n 's/.*Collected : *//p')
  echo "$work $count" >>"$fresh"
done
if [ -n "${WRITE:-}" ]; then
  cp "$fresh" "$record"
  cat "$record"
  exit
fi
awk -v record="$record" '
  NR == FNR { before[$1] = $2; next }
  {
    ratio = $1 in before ? $2 / before[$1] : 0
    word = ratio == 0 ? "NOT RECORDED: WRITE=1 records it" : ratio > 1.02 ? "MORE: find the cause" : ratio < 0.98 ? "FEWER: WRITE=1 records it" : ""
    printf "%-18s %10d instructions, %6.3f of the recorded %10d  %s\n", $1, $2, ratio, before[$1], word
    left += word != ""
  }
  END { exit left > 0 }' "$record" "$fresh"
