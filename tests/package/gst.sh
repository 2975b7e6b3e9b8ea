#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# A camera by GStreamer, from the configuration to the recording: waymark-gst as toolchain/gst.sh compiles it, beside the daemon of a build.
# A live pipeline, a file, a pipeline that is wrong, a process that is killed, a program that is missing. gst.sh BUILD. Skipped (77) without
# GStreamer.
set -euo pipefail
build=$(readlink -f "$1")
root=$(readlink -f "$(dirname "$(readlink -f "$0")")/../..")
{ pkg-config --exists gstreamer-app-1.0 gstreamer-video-1.0 && gst-inspect-1.0 --exists avimux; } 2>/dev/null || { echo "skipped: there is no GStreamer with its base and good plugins"; exit 77; }
dir=$(mktemp -d)
trap 'rm -r "$dir"' EXIT
fail() { echo "gst.sh: $*" >&2; cat "$dir"/*.log >&2; exit 1; }
mkdir "$dir/bin"
cp "$build/bin/waymark" "$dir/bin/"
cat >"$dir/calibration.yaml" <<'EOT'
cameras:
  front: {model: pinhole-radtan, size: [320, 240], intrinsics: [250, 250, 160, 120], distortion: [0, 0, 0, 0], mounting: {xyz_m: [0, 0, 0.4], rpy_deg: [0, 0, 0]}}
markers: {family: tag36h11, size_m: 0.16}
EOT
record() { # NAME PIPELINE SECONDS
  printf 'format: waymark-config/1\nestimator: slam\ncalibration: calibration.yaml\ninitial_pose: {x_m: 0, y_m: 0, heading_rad: 0}\ndevices: {cameras: [{name: front, gst: "%s"}]}\nvision: {apriltag: {}}\n' "$2" >"$dir/$1.yaml"
  "$dir/bin/waymark" record --config "$dir/$1.yaml" --out "$dir/$1" --duration "$3" >"$dir/$1.log" 2>&1
}
pictures() { awk 'END {print NR - 1}' "$dir/$1/video/front.csv"; }
SIZE=width=320,height=240,framerate=50/1

record missing "videotestsrc ! video/x-raw,$SIZE" 1 && fail "a run without waymark-gst"
grep -q 'camera front: gst: the program waymark-gst is missing: install the package waymark-gst' "$dir/missing.log" || fail "another reason"
"$root/toolchain/gst.sh" "$dir"

record live "videotestsrc is-live=true pattern=ball ! video/x-raw,format=NV12,$SIZE ! appsink" 3
[ "$(pictures live)" -ge 75 ] || fail "$(pictures live) pictures in 3 s at 50 Hz"
awk -F, 'NR > 2 && ($2 - before) % 20000000 != 0 {print "a stamp is off its period:", $0; bad = 1} {before = $2} NR > 1 && ($4 < $2 || $4 - $2 > 1e9) {print "late:", $0; bad = 1} END {exit bad}' \
  "$dir/live/video/front.csv" || fail "stamps"

gst-launch-1.0 -q videotestsrc num-buffers=100 pattern=ball ! video/x-raw,format=I420,$SIZE ! jpegenc ! avimux ! filesink location="$dir/film.avi"
record file "filesrc location=$dir/film.avi ! avidemux" 3 # at its end it begins anew
[ "$(pictures file)" -ge 75 ] || fail "$(pictures file) pictures of a film in 3 s"

record wrong "videotestzrc ! appsink" 1 || true
grep -q 'no element "videotestzrc"' "$dir/wrong.log" || fail "no reason of a wrong pipeline"

record killed "videotestsrc is-live=true pattern=ball ! video/x-raw,format=GRAY8,$SIZE" 5 &
recorder=$!
for _ in $(seq 100); do
  process=$(pgrep -f "^$dir/bin/../lib/waymark/waymark-gst" || true)
  [ -n "$process" ] && sleep 1 && break
  sleep 0.05
done
kill -KILL $process
wait "$recorder" || fail "the recorder ended with its camera's process"
awk -F, 'NR > 2 && $2 - before > 100000000 {gaps++} {before = $2} END {exit gaps != 1}' "$dir/killed/video/front.csv" || fail "not one gap where the process was killed"
[ "$(pictures killed)" -ge 100 ] || fail "$(pictures killed) pictures in 5 s with a camera that was gone for half a second"
echo "a live pipeline ($(pictures live) pictures), a film ($(pictures file)), one whose process was killed ($(pictures killed)); a wrong one and a missing program have their reasons"
