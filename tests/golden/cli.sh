#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The command line: exit codes, help with an example each, "did you mean", what is said where something is missing.
set -uo pipefail
waymark=$WM_BIN_DIR/waymark
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failures=0

# expect CODE PATTERN ARGS...: the exit code, and a text that must be in the output.
expect() {
  local code=$1 pattern=$2 output got
  shift 2
  output=$("$waymark" "$@" 2>&1 </dev/null)
  got=$?
  if [ "$got" -ne "$code" ] || ! grep -qF -- "$pattern" <<<"$output"; then
    echo "waymark $*: exit code $got (expected $code), and this should hold '$pattern':"
    echo "$output"
    failures=$((failures + 1))
  fi
}

# A recording of two seconds: straight on.
mkdir "$work/rec"
printf 'format: waymark-recording/1\nname: straight\nduration_s: 2\nstreams: [motion.csv]\nvehicle: {initial_pose: {t_ns: 0, x_m: 1, y_m: 2, heading_rad: 0}}\n' >"$work/rec/recording.yaml"
{ echo t_ns,v_mps,w_radps; for i in $(seq 0 19); do echo "$((i * 100000000)),0.5,0"; done; } >"$work/rec/motion.csv"
printf 'format: waymark-config/1\nestimator: odometry\npublish: {lcm: false}\nrealtime: {lock_memory: false}\nmerge: {horizon_ms: 900, lateness_max_ms: 900}\n' >"$work/good.yaml"
printf 'format: waymark-config/1\nestimator: odometri\n' >"$work/bad.yaml"
mkdir "$work/nomotion"
printf 'format: waymark-recording/1\nname: nomotion\nduration_s: 2\nstreams: []\n' >"$work/nomotion/recording.yaml"

expect 2 "usage: waymark COMMAND"
expect 0 "usage: waymark COMMAND" help
expect 0 "example:" --help
expect 0 "waymark " --version
expect 0 "  eval      measure a run against truth" help
expect 2 "did you mean 'replay'" repaly
expect 2 "did you mean 'detect'" detct
expect 2 "'dance' is not a command" dance
for command in run replay check doctor record watch stamps config; do expect 0 "example" "$command" --help; done

expect 2 "--record: records devices" run --config "$work/good.yaml" --recording "$work/rec" --record "$work/new"
expect 2 "exists already; a recording is never overwritten" run --config "$work/good.yaml" --record "$work/rec"
expect 2 "config needs --schema" config
expect 0 "json-schema.org" config --schema
expect 2 "replay needs a recording" replay
expect 2 "replay needs --out" replay "$work/rec"
expect 2 "needs --config" replay "$work/rec" --out "$work/out"
expect 2 "did you mean '--config'" replay "$work/rec" --confg x --out "$work/out"
expect 2 "nowhere.yaml" replay "$work/rec" --config "$work/nowhere.yaml" --out "$work/out"
expect 2 "did you mean 'odometry'" replay "$work/rec" --config "$work/bad.yaml" --out "$work/out"
expect 1 "nosuch" replay "$work/nosuch" --config "$work/good.yaml" --out "$work/out"
expect 2 "no motion" replay "$work/nomotion" --config "$work/good.yaml" --out "$work/out"
expect 1 "there is a file of this name" replay "$work/rec" --config "$work/good.yaml" --out "$work/good.yaml"
expect 0 "20 poses" replay "$work/rec" --config "$work/good.yaml" --out "$work/deep/er/out"
expect 0 "20 poses" replay "$work/rec" --config "$work/good.yaml" --out "$work/deep/er/out"
expect 0 "20 poses" replay "$work/deep/er/out/events.wmlog" --out "$work/again"
# A run of another recording is not written over unasked.
cp -r "$work/rec" "$work/bent"
sed -i 's/straight/bent/' "$work/bent/recording.yaml"
expect 0 "had another run, which was renamed to $work/again.before-1" replay "$work/bent" --config "$work/good.yaml" --out "$work/again"
expect 0 "had another run, which was renamed to $work/again.before-2" run --recording "$work/rec" --config "$work/good.yaml" --out "$work/again/"
cmp -s "$work/again.before-1/events.wmlog" "$work/again.before-2/events.wmlog" && { echo "a run put aside was written over"; failures=$((failures + 1)); }
expect 0 "20 poses" replay "$work/bent" --config "$work/good.yaml" --out "$work/again" --force
[ ! -e "$work/again.before-3" ] || { echo "--force puts a run aside"; failures=$((failures + 1)); }
expect 0 "20 poses" replay "$work/deep/er/out/events.wmlog" --out "$work/again" --force
"$waymark" replay "$work/deep/er/out/events.wmlog" --out "$work/again" 2>&1 | grep "no pose was" && { echo "a log's replay says that it found no pose"; failures=$((failures + 1)); }
expect 2 "another one needs the recording" replay "$work/deep/er/out/events.wmlog" --out "$work/again" --calibration x
expect 1 "not an event log" replay "$work/good.yaml" --out "$work/again"
expect 2 "has the log that is replayed" replay "$work/deep/er/out/events.wmlog" --out "$work/deep/er/out"
expect 2 "is a recording" replay "$work/rec" --config "$work/good.yaml" --out "$work/rec"
expect 2 "did you mean its log" replay "$work/deep/er/out" --config "$work/good.yaml" --out "$work/again"
expect 2 "is a recording" run --recording "$work/rec" --config "$work/good.yaml" --out "$work/rec"
printf 'id,x_m,y_m,z_m,sigma_m\n1,2,3,0,0.1\n' >"$work/map.csv"
expect 2 "was made with another map" replay "$work/deep/er/out/events.wmlog" --out "$work/again" --landmarks "$work/map.csv"

printf 'BO_ 256 M: 2 X\n SG_ V : 0|16@1+ (0.001,0) [0|65] "m/s" X\n SG_ W : 8|8@1- (0.01,0) [-1|1] "rad/s" X\n' >"$work/car.dbc"
printf -- '- {quantity: vehicle_speed, message: M, signal: V}\n- {quantity: yaw_rate, message: M, signal: W}\n' >"$work/signals.yaml"
printf 'format: waymark-config/1\nestimator: odometry\ndevices: {can: [{interface: nocan7, dbc: car.dbc, can_signals: signals.yaml}]}\n' >"$work/robot.yaml"
expect 0 "can                  a device" check "$work/robot.yaml"
# (qemu-user doesn't know that request of the kernel.)
[ -n "${WM_FEWER:-}" ] || expect 0 "nocan7: is not there" stamps "$work/robot.yaml"
sed 's/nocan7/lo/' "$work/robot.yaml" >"$work/lo.yaml"
[ "$(id -u)" -ne 0 ] || expect 0 "lo: has no clock that can be switched on" stamps "$work/lo.yaml"
sed -i 's/signal: V/signal: Vee/' "$work/signals.yaml"
expect 2 "signals.yaml:1" check "$work/robot.yaml"
expect 2 "check needs a configuration" check
expect 0 "good" check "$work/good.yaml"
expect 0 "20 data, 10.0 a second" check "$work/good.yaml" "$work/rec"
expect 0 "x 1.000 m, y 2.000 m" check "$work/good.yaml" "$work/rec"
expect 2 "did you mean 'odometry'" check "$work/bad.yaml" "$work/rec"
expect 2 "no motion" check "$work/good.yaml" "$work/nomotion"

# Where nothing can be read, why.
cp -r "$work/rec" "$work/halves"
sed -i 's/^\([0-9]*\),/\1.5,/' "$work/halves/motion.csv"
expect 1 "motion.csv:2: t_ns: '0.5' is not a whole number" replay "$work/halves" --config "$work/good.yaml" --out "$work/out"

# A model whose input the recording doesn't have is refused, not silently left without motion.
sed 's/^estimator.*/&\nmotion: {model: speed_yaw_rate}/' "$work/good.yaml" >"$work/model.yaml"
expect 2 "it needs a speed (motion.csv" replay "$work/rec" --config "$work/model.yaml" --out "$work/out"
expect 2 "it needs a speed (motion.csv" check "$work/model.yaml" "$work/rec"

# Without a start pose, odometry finds none: that is said, and the tables have their heads.
mkdir "$work/lost"
cp "$work/rec/motion.csv" "$work/lost"
printf 'format: waymark-recording/1\nname: lost\nstreams: [motion.csv, video/front.avi]\n' >"$work/lost/recording.yaml"
expect 0 "no pose was ever found" replay "$work/lost" --config "$work/good.yaml" --out "$work/nopose"
expect 2 "'video/front.avi' is not in the folder; nothing here reads it" check "$work/good.yaml" "$work/lost"
expect 2 "recording    lost" check "$work/good.yaml" "$work/lost"
"$waymark" check "$work/good.yaml" "$work/lost" 2>&1 | grep -q "nan" && { echo "check prints nan"; failures=$((failures + 1)); }
for table in trajectory published; do
  grep -q "^t_ns,.*state" "$work/nopose/$table.csv" || { echo "$table.csv has no head"; failures=$((failures + 1)); }
done

expect 2 "run needs --config" run
expect 2 "devices: is missing, and no recording is given" run --config "$work/good.yaml"
expect 2 "devices run at real speed" run --config "$work/good.yaml" --speed 2
expect 2 "'0' is not a number above 0" run --config "$work/good.yaml" --recording "$work/rec" --duration 0
expect 0 "20 poses" run --config "$work/good.yaml" --recording "$work/rec" --out "$work/live"
cmp -s "$work/deep/er/out/trajectory.csv" "$work/live/trajectory.csv" || { echo "run and replay differ"; failures=$((failures + 1)); }

# A command of another program is found beside this one, with its arguments and exit code.
mkdir "$work/bin"
cp "$waymark" "$work/bin/"
printf '#!/bin/sh\necho "hello $1"\nexit 7\n' >"$work/bin/waymark-greet"
chmod +x "$work/bin/waymark-greet"
waymark=$work/bin/waymark
expect 7 "hello you" greet you
PATH=/usr/bin:/bin expect 0 "measure a run against truth, GNSS or labels (not installed; package waymark-tools)" help
PATH=/usr/bin:/bin expect 2 "which is not installed here; package waymark-tools has it" eval run rec

# Ctrl-C ends a run in order: the log is closed and everything is there.
waymark=$WM_BIN_DIR/waymark
"$waymark" run --config "$work/good.yaml" --recording "$work/rec" --out "$work/stopped" --speed 0.05 >"$work/said" 2>&1 &
pid=$!
sleep 1
kill -INT $pid
wait $pid || { echo "SIGINT: exit code $?"; cat "$work/said"; failures=$((failures + 1)); }
[ -s "$work/stopped/health.json" ] && [ -s "$work/stopped/timing.json" ] || { echo "SIGINT: files are missing"; failures=$((failures + 1)); }
expect 0 "poses" replay "$work/stopped/events.wmlog" --out "$work/again"
"$waymark" replay "$work/stopped/events.wmlog" --out "$work/again" 2>&1 | grep -q "no regular end" && { echo "SIGINT: the log was not closed"; failures=$((failures + 1)); }

# Ctrl-C of a replay leaves a run that reads as one: all files, a closed log.
awk 'BEGIN { print "t_ns,v_mps,w_radps"; for (i = 0; i < 600000; i++) printf "%d000000,0.5,0\n", i * 10 }' >"$work/long.csv"
cp -r "$work/rec" "$work/long"
mv "$work/long.csv" "$work/long/motion.csv"
sed -i 's/straight/long/; /duration_s/d' "$work/long/recording.yaml"
"$waymark" replay "$work/long" --config "$work/good.yaml" --out "$work/broken" >"$work/said" 2>&1 &
pid=$!
while [ ! -s "$work/broken/trajectory.csv" ] && kill -0 $pid 2>/dev/null; do sleep 0.05; done
kill -INT $pid
wait $pid
code=$?
[ $code -eq 1 ] && grep -q "has the run up to there" "$work/said" || { echo "Ctrl-C of a replay: exit code $code"; cat "$work/said"; failures=$((failures + 1)); }
[ -s "$work/broken/health.json" ] && [ -s "$work/broken/timing.json" ] || { echo "Ctrl-C of a replay: files are missing"; failures=$((failures + 1)); }
expect 0 "poses" replay "$work/broken/events.wmlog" --out "$work/broken2"
"$waymark" replay "$work/broken/events.wmlog" --out "$work/broken2" 2>&1 | grep -q "no regular end" && { echo "Ctrl-C of a replay: the log was not closed"; failures=$((failures + 1)); }

[ $failures -eq 0 ] && echo "good"
exit $((failures > 0))
