#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The demo: a car turns left at a crossing. First in a rendered world with two fisheye cameras, then with 0, 1, 2 and 3
# known landmarks in view. Simulates, localizes, judges; prints tables and makes a report and a picture. Needs the
# programs in build/bin (./dev demo builds them first).
# usage: demo.sh [OUT]    OUT is build/demo if it isn't given
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/../.."
export LC_ALL=C

waymark=build/bin/waymark
out=${1:-build/demo}
world=config/worlds/crossing-demo.yaml
world_config=config/datasets/crossing-cameras.yaml
scenario=config/worlds/crossing.yaml
config=config/datasets/crossing-points.yaml
drives=40

step() { printf '\033[1m== %s\033[0m\n' "$*"; }
quietly() { # COMMAND... : shows its output only when it fails
  local log="$out/log.txt"
  "$@" >"$log" 2>&1 || { printf 'demo: this failed: %s\n' "$*" >&2; cat "$log" >&2; exit 1; }
}
figure() { # FILE KEY : a number out of the JSON of `waymark eval`
  local value
  value=$(sed -n "s/.*\"$2\": *\([-0-9.e+]*\).*/\1/p" "$1" | head -1)
  [ -n "$value" ] || { echo "demo: $1 has no $2" >&2; exit 1; }
  echo "$value"
}

[ -x "$waymark" ] || { echo "demo: $waymark isn't there; ./dev demo builds it" >&2; exit 1; }
rm -rf "$out"
mkdir -p "$out"

step "a drive in a rendered world: build it, take the pictures, localize, judge"
quietly "$waymark" simulate "$world" --duration 20 --out "$out/recording"
for run in cameras odometry; do
  config_of_run=$world_config
  [ $run = cameras ] || config_of_run=config/datasets/crossing-odometry.yaml
  quietly "$waymark" replay "$out/recording" --config "$config_of_run" --out "$out/run-$run"
  "$waymark" eval "$out/run-$run" "$out/recording" --json >"$out/eval-$run.json"
done

for n in 0 1 2 3; do
  step "a drive with $n landmarks: simulate, localize, judge"
  quietly "$waymark" simulate "$scenario" --landmarks "$n" --out "$out/recording-$n"
  quietly "$waymark" replay "$out/recording-$n" --config "$config" --out "$out/run-$n"
  "$waymark" eval "$out/run-$n" "$out/recording-$n" --json >"$out/eval-$n.json"
done

step "report and picture"
quietly "$waymark" report "$out/run-cameras" "$out/recording" --out "$out/report.html"
quietly python3 tools/demo/picture.py "$out" "$out/demo.svg"
quietly python3 tools/demo/moving.py "$out" "$out/moving.svg"

step "$drives drives each, with other wheels, biases, maps and noise"
statistics=$(build/bin/waymark-montecarlo "$scenario" --config "$config" --drives "$drives" | sed -n '3,/^$/p')

printf '\nA rendered crossing, %s m, %s pictures: RMS error %.3f m and %.2f deg with two cameras, %.3f m with the wheels alone.\n' \
  "$(figure "$out/eval-cameras.json" distance_m | awk '{printf "%.0f", $1}')" \
  "$(cat "$out"/recording/video/*.csv | grep -vc frame)" \
  "$(figure "$out/eval-cameras.json" position_rmse_m)" "$(figure "$out/eval-cameras.json" heading_rmse_deg)" \
  "$(figure "$out/eval-odometry.json" position_rmse_m)"
printf '\nThe same turn with landmarks alone, truth known exactly. Errors of the position in m, of the heading in degrees:\n\n'
printf '%10s | %12s | %12s | %12s | %14s | %12s\n' landmarks 'at the end' RMS largest 'heading RMS' 'inside 95 %'
printf -- '-----------+--------------+--------------+--------------+----------------+-------------\n'
for n in 0 1 2 3; do
  e=$out/eval-$n.json
  awk -v n="$n" -v end="$(figure "$e" position_end_m)" -v rms="$(figure "$e" position_rmse_m)" \
    -v max="$(figure "$e" position_max_m)" -v heading="$(figure "$e" heading_rmse_deg)" \
    -v inside="$(figure "$e" nees_inside_95)" \
    'BEGIN { printf "%10d | %12.3f | %12.3f | %12.3f | %14.2f | %10.0f %%\n", n, end, rms, max, heading, 100 * inside }'
done
printf '\nThat was one drive. RMS over %s drives, beside the least that any estimator could reach (eff.: the one divided by\n' "$drives"
printf 'the other), and whether the errors are as large as the estimate says (NEES and NIS: 1; docs/consistency.md):\n\n%s\n\n' \
  "$statistics"

printf 'Report of the rendered drive, pictures in it: %s\n' "$(realpath "$out")/report.html"
printf 'Picture of the four without pictures:         %s\n' "$(realpath "$out")/demo.svg"
