#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Instructions of the kernels, by valgrind, beside what is recorded in instructions.txt: the same binary counts the same on
# every machine, however busy. instructions.sh [PROGRAM]; with WRITE=1 in the environment it records them anew.
set -euo pipefail
program=${1:-build/tests/wm_instructions}
record=$(dirname "$(readlink -f "$0")")/instructions.txt
command -v valgrind >/dev/null || { echo "instructions: not counted, there is no valgrind (Debian: valgrind)"; exit 0; }
fresh=$(mktemp)
trap 'rm -f "$fresh"' EXIT
for work in particles_200 particles_2000 window_50x50 picture_rays picture_windows picture_lines picture_landmarks; do
  count=$(valgrind --tool=callgrind --callgrind-out-file=/dev/null --collect-atstart=no --toggle-collect=wm_counted \
    "$program" "$work" 2>&1 | sed -n 's/.*Collected : *//p')
  before=$(awk -v work="$work" '$1 == work {print $2}' "$record" 2>/dev/null || true)
  printf '%-18s %10s instructions, recorded %s\n' "$work" "$count" "${before:-none}"
  echo "$work $count" >>"$fresh"
done
[ -z "${WRITE:-}" ] || cp "$fresh" "$record"
