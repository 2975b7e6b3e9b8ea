#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs every benchmark, one after the other: run.sh FOLDER. Figures are medians, and ratios within one run, because
# machines are shared and noisy; then instruction counts (instructions.sh). The tests run each one with WM_BENCH_SHORT=1, for
# seconds: there it is only seen whether it works.
set -euo pipefail
folder=${1:-build/bench}
shopt -s nullglob
benches=("$folder"/wm_bench_*)
[ ${#benches[@]} -gt 0 ] || { echo "no benchmark in $folder" >&2; exit 1; }
for bench in "${benches[@]}"; do
  echo "== $(basename "$bench")"
  "$bench"
done
echo "== instructions"
bash "$(dirname "$0")/instructions.sh" "$folder/wm_bench_works"
