# SPDX-License-Identifier: Apache-2.0
# In the guest: two detectors, black box and recording on one camera; then the detectors without the rest, to compare the
# processor's time.
modprobe v4l2loopback devices=1 video_nr=10 exclusive_caps=0 max_buffers=4 || exit 1
name=walls
. /host/guest/service-parts.sh
bus_up
waymark check robot.yaml >/dev/null 2>&1
seconds=$(cat duration)
mkdir -p /run/keep /run/disk
mount -t tmpfs -o size=4g tmpfs /run/disk # more than a recording leaves free
TIMEFORMAT="%U %S"

# drive NAME [OPTION...]: with NAME.yaml; its processor's time is in NAME.cpu.
drive() {
  chrt -f 45 ./play timeline pictures can1 /dev/video10 640 400 3 >"$1.played" & player=$!
  sleep 1
  { time waymark run --config "$1.yaml" --duration $((seconds + 3)) "${@:2}" 2>"$1.txt"; } 2>"$out/$1.cpu" || { fail "waymark run ($1): failed"; cat "$1.txt"; }
  wait $player || fail "the player: exit code $?"
  cat "$1.played"
}
hear /run/heard.lcm
drive robot --out /run/drive --record /run/disk/rec
end_hearing
cat robot.txt
for other in apriltag mr both; do drive $other; done
errors=$(cat /sys/class/net/can0/statistics/rx_errors)
[ "$errors" = 0 ] || fail "the controller lost frames: $errors"
cp -r /run/drive /run/disk/rec /run/keep /run/heard.lcm "$out/"
exit $((fails > 0))
