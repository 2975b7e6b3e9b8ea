# SPDX-License-Identifier: Apache-2.0
# In the guest: a camera by libcamera, recorded by waymark. vimc is the camera: a picture that is drawn by the kernel,
# through a debayer and a scaler, as a sensor's on a board.
set -u
cp -r /host/libcamera /run/
cd /run/libcamera || exit 1
modprobe vimc || exit 1
udevadm settle
waymark help >/dev/null 2>&1
fails=0
fail() { echo "FAIL: $*"; fails=$((fails + 1)); }
record() { waymark record --config "$2" --out "/run/$1" --duration "$3" --free-mb 50 >"$1.txt" 2>&1 & recording=$!; }
finish() { wait $recording || fail "waymark record ($1): exit code $?"; cat "$1.txt"; }
said() { grep -qF "$2" "$1.txt" || fail "$1: not said: $2"; }
pictures() { grep -c , "/run/$1/video/front.csv"; }
keep() { cp -r "/run/$1" "/host/out/libcamera-$1"; }

echo "== pictures as they come"
record plain robot.yaml 5
finish plain
said plain "front gives pictures"
[ "$(pictures plain)" -gt 10 ] || fail "plain: only $(pictures plain) pictures"
keep plain

echo "== controls: one that is there, one beyond its limits, one that isn't there"
record bright bright.yaml 5
finish bright
said bright "control 'Brightness': 5 is beyond its limits; 1 was set"
said bright "has no control 'Nonsense'"
[ "$(pictures bright)" -gt 10 ] || fail "bright: only $(pictures bright) pictures"
keep bright

echo "== a format and a size that it hasn't"
record format format.yaml 3
finish format
said format "the driver gives RGB3 instead of YUYV"
record size size.yaml 3
finish size
said size "gives 342x246 pixels, but is calibrated for 344x246"

echo "== in use by another program"
record first robot.yaml 6
sleep 3
waymark record --config robot.yaml --out /run/second --duration 2 --free-mb 50 >second.txt 2>&1
cat second.txt
said second "is not there"
finish first
said first "front gives pictures"

echo "== SIGTERM in the middle of a recording"
record term robot.yaml 60
sleep 4
kill -TERM $recording
finish term
[ "$(pictures term)" -gt 5 ] || fail "term: only $(pictures term) pictures"

echo "== unplugged and back: the process that has the camera may end, the program does not"
record unplugged robot.yaml 16
sleep 4
echo vimc.0 >/sys/bus/platform/drivers/vimc/unbind
sleep 2
echo vimc.0 >/sys/bus/platform/drivers/vimc/bind
finish unplugged
grep -qE "front (is gone|gives no pictures)" unplugged.txt || fail "unplugged: not said"
[ "$(grep -c 'front gives pictures' unplugged.txt)" = 2 ] || fail "unplugged: it doesn't come back"

exit $((fails > 0))
