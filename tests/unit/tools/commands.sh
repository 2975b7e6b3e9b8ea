#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The desk's commands as a person calls them: exit codes, what is said, what is written.
set -u
bin=$WM_BIN_DIR
dir=$(mktemp -d)
trap 'rm -r "$dir"' EXIT
failures=0

# expect CODE TEXT COMMAND...: the command ends with CODE and says TEXT.
expect() {
  local code=$1 text=$2 said got
  shift 2
  said=$("$@" 2>&1)
  got=$?
  if [ "$got" -ne "$code" ] || ! grep -qF -- "$text" <<<"$said"; then
    echo "FAIL: $*"
    echo "  exit code $got, expected $code; expected to read '$text' in:"
    sed 's/^/  | /' <<<"$said"
    failures=$((failures + 1))
  fi
}

mkdir "$dir/rec" "$dir/run" "$dir/empty"
{
  echo 't_ns,x_m,y_m,z_m,qx,qy,qz,qw'
  for i in $(seq 0 9); do echo "${i}00000000,0.$i,0,0,0,0,0,1"; done
} >"$dir/rec/truth.csv"
{
  echo 't_ns,x_m,y_m,z_m,qx,qy,qz,qw,cov_xx,cov_xy,cov_yy,cov_xt,cov_yt,cov_tt,state'
  for i in $(seq 0 9); do echo "${i}00000000,0.$i,0.1,0,0,0,0,1,0.01,0,0.01,0,0,0.01,tracking"; done
} >"$dir/run/trajectory.csv"

expect 0 '"position_max_m": 0.1,' "$bin/waymark-eval" "$dir/run" "$dir/rec" --json
expect 0 '"landmark_rmse_m": null' "$bin/waymark-eval" "$dir/run" "$dir/rec" --json
expect 0 'position m' "$bin/waymark-eval" "$dir/run" "$dir/rec"
expect 0 'waymark eval runs/corridor' "$bin/waymark-eval" --help
expect 2 'REC is required' "$bin/waymark-eval" "$dir/run"
expect 2 'se4' "$bin/waymark-eval" "$dir/run" "$dir/rec" --align se4
expect 2 '--from must be before --to' "$bin/waymark-eval" "$dir/run" "$dir/rec" --from 3 --to 2
expect 2 'is not a folder' "$bin/waymark-eval" "$dir/nowhere" "$dir/rec"
expect 1 'has neither trajectory.csv nor trajectory.tum' "$bin/waymark-eval" "$dir/empty" "$dir/rec"
expect 1 'has no truth.csv' "$bin/waymark-eval" "$dir/run" "$dir/empty"
expect 1 'gnss.csv: can' "$bin/waymark-eval" "$dir/run" "$dir/rec" --against gnss
expect 1 'published.csv: can' "$bin/waymark-eval" "$dir/run" "$dir/rec" --published
expect 1 'nothing to compare' "$bin/waymark-eval" "$dir/run" "$dir/rec" --from 50
expect 1 'all at one place' "$bin/waymark-eval" "$dir/run" "$dir/rec" --align se2 --from 0.85
printf 'P5 8 8 255\n%064d' 0 >"$dir/sign.pgm"
expect 2 "--wheel-radius: 'nan' is not a finite number" "$bin/waymark-init" "$dir/robot" --motion ticks --wheel-radius nan --ticks 1024 --track 0.4 --sees nothing --yes
expect 2 '--wheel-radius: Value 50 not in range' "$bin/waymark-init" "$dir/robot" --motion ticks --wheel-radius 50 --ticks 1024 --track 0.4 --sees nothing --yes
expect 1 '/proc/robot: could not be written' "$bin/waymark-init" /proc/robot --motion twist --sees nothing --yes
expect 2 "--at: 'nan' is not a finite number" "$bin/waymark-map" add-landmark "$dir/map" --id 7 --picture "$dir/sign.pgm" --at nan,2,3 --size 1,1 --yaw 0
expect 2 "--corners: 'inf' is not a finite number" "$bin/waymark-map" add-landmark "$dir/map" --id 7 --picture "$dir/sign.pgm" --at 1,2,3 --size 1,1 --yaw 0 --corners 0,0,7,0,7,inf,0,7
expect 2 "--pose: 'nan' is not a finite number" "$bin/waymark-map" look "$dir/map" --picture "$dir/sign.pgm" --calibration none.yaml --pose 0,nan,0
# A detector against labels: a straight edge on the floor, found half.
mkdir -p "$dir/rec/labels" "$dir/run/detections"
printf 'frame,polyline,u_px,v_px\n0,0,400,500\n0,0,800,500\n' >"$dir/rec/labels/edges.csv"
expect 1 'has no cameras' "$bin/waymark-eval" "$dir/run" "$dir/rec" --detector edges
printf 'cameras:\n  front: {model: equidistant, size: [1280, 720], intrinsics: [520, 520, 640, 360], distortion: [0, 0, 0, 0], mounting: {xyz_m: [1, 0, 0.4], rpy_deg: [0, 22, 0]}}\n' >"$dir/rec/calibration.yaml"
expect 1 'this run detected no edges' "$bin/waymark-eval" "$dir/run" "$dir/rec" --detector edges
printf 'frame,polyline,u_px,v_px\n0,0,400,505\n0,0,600,505\n' >"$dir/run/detections/front-edges.csv"
expect 0 '"length_precision": 1.0' "$bin/waymark-eval" "$dir/run" "$dir/rec" --detector edges --json
expect 0 '"left_out_of_view": 1' "$bin/waymark-eval" "$dir/run" "$dir/rec" --detector edges --json --view 3,6,-3,3
expect 0 'precision 100.0 %' "$bin/waymark-eval" "$dir/run" "$dir/rec" --detector edges
expect 2 "no camera 'back'; it has front" "$bin/waymark-eval" "$dir/run" "$dir/rec" --detector edges --camera back
expect 2 'colours' "$bin/waymark-eval" "$dir/run" "$dir/rec" --detector colours
expect 1 'labels/lines.csv: is not there' "$bin/waymark-eval" "$dir/run" "$dir/rec" --detector lines
expect 1 'labels/edges.csv: is not there' "$bin/waymark-eval" "$dir/run" "$dir/empty" --detector edges
printf 't_ns,x_m,y_m,z_m,sigma_xy_m,sigma_z_m\n100000000,0.1,0.4,,2,\n' >"$dir/rec/gnss.csv"
expect 0 '"nees_mean": null' "$bin/waymark-eval" "$dir/run" "$dir/rec" --against gnss --json
expect 0 '"lost_count": null' "$bin/waymark-eval" "$dir/run" "$dir/rec" --against gnss --json

# Calibrations of other programs.
printf 'cam0:\n  camera_model: ds\n  distortion_model: none\n  intrinsics: [-0.2, 0.59, 290, 291, 370, 240]\n  resolution: [752, 480]\n' >"$dir/camchain.yaml"
expect 0 'waymark calibrate import camchain.yaml' "$bin/waymark-calibrate" import --help
expect 0 'waymark calibrate import' "$bin/waymark-calibrate" --help
expect 2 'A subcommand is required' "$bin/waymark-calibrate"
expect 0 'model: double-sphere' "$bin/waymark-calibrate" import "$dir/camchain.yaml"
expect 0 'intrinsics: [-0.2, 0.59, 290, 291, 370, 240]' "$bin/waymark-calibrate" import "$dir/camchain.yaml"
expect 0 'px in the mean, at most' "$bin/waymark-calibrate" import "$dir/camchain.yaml" --model equidistant --name front --out "$dir/rec/imported.yaml"
expect 2 'not overwritten' "$bin/waymark-calibrate" import "$dir/camchain.yaml" --out "$dir/rec/imported.yaml"
expect 2 'cannot be read' "$bin/waymark-calibrate" import "$dir/nowhere.yaml"
expect 2 'is a folder' "$bin/waymark-calibrate" import "$dir/rec"
expect 2 'is not WIDTHxHEIGHT' "$bin/waymark-calibrate" import "$dir/camchain.yaml" --size big
expect 0 'waymark calibrate camera pictures/' "$bin/waymark-calibrate" camera --help
expect 2 'no such file or folder' "$bin/waymark-calibrate" camera "$dir/nowhere"
expect 2 'has no pictures in it' "$bin/waymark-calibrate" camera "$dir/empty"
expect 2 'waymark import' "$bin/waymark-calibrate" camera "$dir/camchain.yaml"
expect 2 'is not COLUMNSxROWS' "$bin/waymark-calibrate" camera "$dir/empty" --chessboard nine
printf 'P5 64 48 255\n%3072s' '' >"$dir/blank.pgm"
expect 1 'a board was found in 0 of 1 pictures' "$bin/waymark-calibrate" camera "$dir/blank.pgm" --chessboard 9x6
# What was imported is what eval reads.
cp "$dir/rec/imported.yaml" "$dir/rec/calibration.yaml"
expect 1 'this run detected no edges' "$bin/waymark-eval" "$dir/empty" "$dir/rec" --detector edges

# Maps.
{ printf 'P5 80 60 255\n'; python3 -c '
import sys
rows = [[255 if 9 < x < 70 and 9 < y < 50 else 0 for x in range(80)] for y in range(60)]
sys.stdout.buffer.write(bytes(sum(rows, [])))'; } >"$dir/plan.pgm"
expect 0 'waymark map make plan.png' "$bin/waymark-map" make --help
expect 2 '--resolution is needed' "$bin/waymark-map" make "$dir/plan.pgm" --out "$dir/map"
expect 2 'there is no such file' "$bin/waymark-map" make "$dir/nowhere.png" --resolution 0.05
expect 2 'not X,Y' "$bin/waymark-map" make "$dir/plan.pgm" --resolution 0.05 --inside here
expect 0 'in 1 areas' "$bin/waymark-map" make "$dir/plan.pgm" --resolution 0.05 --origin=-1,-1 --out "$dir/map"
expect 2 'not overwritten' "$bin/waymark-map" make "$dir/plan.pgm" --resolution 0.05 --out "$dir/map"
expect 1 'no wall in the plan' "$bin/waymark-map" make "$dir/blank.pgm" --walls-below 1 --resolution 0.05 --out "$dir/map2"
printf 'image: no.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n' >"$dir/no.yaml"
expect 1 "no.yaml:1: image: 'no.pgm' can't be read (looked for $dir/no.pgm)" "$bin/waymark-map" make "$dir/no.yaml" --out "$dir/map2"
expect 0 'good' "$bin/waymark-map" check "$dir/map/map.yaml" --draw "$dir/drawn.png"
expect 0 'in 1 areas' "$bin/waymark-map" make "$dir/map/map.yaml" --out "$dir/map3"
expect 2 'nowhere' "$bin/waymark-map" check "$dir/nowhere.yaml"

# Detectors on pictures: a marker's code (ArUco 4x4, identity 0) in a folder, drawn and as rows.
mkdir "$dir/photos" "$dir/junk"
{ printf 'P5 320 240 255\n'; python3 -c '
import sys
code = ["1011", "0101", "0011", "0010"]
def grey(x, y):
    column, row = (x - 100) // 20, (y - 60) // 20
    if not (0 <= column < 6 and 0 <= row < 6): return 230
    return 230 if 1 <= column <= 4 and 1 <= row <= 4 and code[row - 1][column - 1] == "1" else 20
sys.stdout.buffer.write(bytes(grey(x, y) for y in range(240) for x in range(320)))'; } >"$dir/photos/marker.pgm"
cp "$dir/blank.pgm" "$dir/photos/small.pgm"
expect 0 'waymark detect photos/' "$bin/waymark-detect" --help
expect 2 'what to look for?' "$bin/waymark-detect" "$dir/photos" --out "$dir/found"
expect 2 'no such file' "$bin/waymark-detect" "$dir/nowhere" --detector apriltag --out "$dir/found"
expect 2 'has no pictures in it' "$bin/waymark-detect" "$dir/junk" --detector apriltag --out "$dir/found"
expect 2 "is not KEY=VALUE" "$bin/waymark-detect" "$dir/photos" --detector apriltag --set family --out "$dir/found"
expect 2 "aruco_4x4_50" "$bin/waymark-detect" "$dir/photos" --detector apriltag --set family=aruco4 --out "$dir/found"
expect 2 'has no pictures' "$bin/waymark-detect" "$dir/photos" --detector apriltag --camera front --out "$dir/found"
expect 2 '--calibration' "$bin/waymark-detect" "$dir/photos" --detector edges --out "$dir/found"
expect 2 'needs a recording with a pair' "$bin/waymark-detect" "$dir/photos" --detector stereo --out "$dir/found"
expect 0 'camera apriltag: in 1 of 2 pictures, 1 detections, 1 identity (0)' "$bin/waymark-detect" "$dir/photos" --detector apriltag --set family=aruco_4x4_50 --draw png --out "$dir/found"
expect 0 '1 pictures have another size' "$bin/waymark-detect" "$dir/photos" --detector apriltag --set family=aruco_4x4_50 --out "$dir/found"
expect 0 'apriltag-aruco_4x4_50: in 1 of 2' "$bin/waymark-detect" "$dir/photos" --detector apriltag --out "$dir/families"
grep -q '^0,marker,0,0,.*,159.5..,119.5..$' "$dir/found/detections/camera-apriltag.csv" || { echo "FAIL: the marker's row"; cat "$dir/found/detections/camera-apriltag.csv"; failures=$((failures + 1)); }
[ -s "$dir/found/drawn/camera-apriltag/marker.png" ] || { echo "FAIL: no drawn marker.png"; failures=$((failures + 1)); }
[ ! -e "$dir/families/drawn/camera-apriltag-tag36h11" ] || { echo "FAIL: drawings of a family that is not there"; failures=$((failures + 1)); }


# The reference trajectory.
expect 0 'waymark replay recordings/corridor' "$bin/waymark-reference" --help
expect 2 'map.yaml' "$bin/waymark-reference" "$dir/run" "$dir/empty"
expect 1 'published.csv' "$bin/waymark-reference" "$dir/run" "$dir/empty" --map "$dir/map/map.yaml"
expect 1 'waymark replay --reference writes it' "$bin/waymark-eval" "$dir/run" "$dir/rec" --reference
printf 't_ns,x_m,y_m,z_m,qx,qy,qz,qw\n0,0,0.2,0,0,0,0,1\n900000000,0.9,0.2,0,0,0,0,1\n' >"$dir/run/reference.csv"
expect 0 '(reference) against truth' "$bin/waymark-eval" "$dir/run" "$dir/rec" --reference

# JSON is JSON: every field of the format is there, nothing is NaN.
if ! "$bin/waymark-eval" "$dir/run" "$dir/rec" --json | python3 -c '
import json, sys
figures = json.load(sys.stdin, parse_constant=lambda text: sys.exit("not JSON: " + text))
fields = "distance_m duration_s poses coverage position_mean_m position_median_m position_rmse_m position_p95_m position_max_m " \
  "position_end_m position_end_percent longitudinal_mean_m longitudinal_mean_abs_m longitudinal_std_m longitudinal_max_m " \
  "lateral_mean_m lateral_mean_abs_m lateral_std_m lateral_max_m heading_mean_deg heading_mean_abs_deg heading_rmse_deg " \
  "heading_max_deg rotation_rmse_deg rotation_max_deg nees_mean nees_inside_95 anees_dof lost_count lost_s landmark_rmse_m " \
  "landmark_heading_rmse_deg landmarks_found landmarks_total".split()
missing = [field for field in fields if field not in figures]
sys.exit("missing: " + " ".join(missing) if missing else 0)'; then
  failures=$((failures + 1))
fi

expect 0 "$dir/run/report.html" "$bin/waymark-report" "$dir/run" "$dir/rec"
[ -s "$dir/run/report.html" ] || { echo "FAIL: no report.html"; failures=$((failures + 1)); }
expect 0 '' "$bin/waymark-report" "$dir/run" "$dir/rec" --out "$dir/page.html" --svg "$dir/picture.svg"
expect 1 "can't be written" "$bin/waymark-report" "$dir/run" --out "$dir/nowhere/page.html"
if ! python3 -c '
import sys, xml.dom.minidom, html.parser
xml.dom.minidom.parse(sys.argv[1])
class Balanced(html.parser.HTMLParser):
    """Every element that must be closed is, in order."""
    void = {"meta", "path", "rect", "circle", "ellipse", "image"}
    def __init__(self):
        super().__init__()
        self.open = []
    def handle_starttag(self, tag, attrs):
        if tag not in self.void: self.open.append(tag)
    def handle_startendtag(self, tag, attrs): pass
    def handle_endtag(self, tag):
        if tag not in self.void and (not self.open or self.open.pop() != tag): sys.exit(f"page.html: </{tag}> closes nothing")
parser = Balanced()
parser.feed(open(sys.argv[2], encoding="utf-8").read())
sys.exit("page.html: not closed: " + " ".join(parser.open) if parser.open else 0)' "$dir/picture.svg" "$dir/page.html"; then
  failures=$((failures + 1))
fi

expect 0 'The two runs are the same' "$bin/waymark-diff" "$dir/run" "$dir/run"
cp -r "$dir/run" "$dir/other"
sed -i '5s/0.1,/0.2,/' "$dir/other/trajectory.csv"
expect 1 'first at row 4, t = 0.3 s' "$bin/waymark-diff" "$dir/run" "$dir/other"
# Stamps since 1970 are not cut.
cp -r "$dir/run" "$dir/epoch" && sed -i 's/^\([0-9]00000000\),/1700000000\1,/' "$dir/epoch/trajectory.csv"
cp -r "$dir/epoch" "$dir/epoch2" && sed -i '5s/0.1,/0.2,/' "$dir/epoch2/trajectory.csv"
expect 1 'first at row 4, t = 1700000000.3 s' "$bin/waymark-diff" "$dir/epoch" "$dir/epoch2"
expect 2 "is not the folder of a run" "$bin/waymark-diff" "$dir/run" "$dir/empty"

[ "$failures" -eq 0 ] && echo "all as expected"
exit $((failures > 0))
