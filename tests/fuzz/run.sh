#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs every fuzz target for a number of seconds: run.sh FOLDER SECONDS. A crash is kept beside the target and fails the run.
set -euo pipefail
folder=$1 seconds=$2
corpus=$(dirname "$(readlink -f "$0")")/corpus
shopt -s nullglob
for target in "$folder"/fuzz_*; do
  [ -x "$target" ] && [ -f "$target" ] || continue
  name=$(basename "$target")
  work=$folder/corpus-$name
  mkdir -p "$work"
  seeds=()
  [ -d "$corpus/$name" ] && seeds=("$corpus/$name")
  echo "== $name, $seconds s"
  "$target" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -max_len=65536 -artifact_prefix="$folder/crash-$name-" \
    -print_final_stats=1 "$work" "${seeds[@]}" >"$folder/$name.log" 2>&1 || { tail -40 "$folder/$name.log" >&2; echo "$name failed" >&2; exit 1; }
done
