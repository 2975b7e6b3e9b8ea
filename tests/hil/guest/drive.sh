# SPDX-License-Identifier: Apache-2.0
# In the guest, by other scripts: a recording's data through the kernel's drivers, each datum at its own time, into waymark; what
# LCM's own logger hears is what is judged. Needs: name (of the folder), device (v4l2loopback's, or "-"), width, height; where
# a function `beside` is defined, it starts what else must run. With record=1 the run records beside it; it begins after `wait` seconds.
set -u
cp -r "/host/$name" /run/
cd "/run/$name" || exit 1
modprobe -a kvaser_pci can-raw || exit 1
for can in can0 can1; do
  ip link set $can up type can bitrate 500000 restart-ms 100
  ip link set $can txqueuelen 2000
done
for tool in "waymark check robot.yaml" "lcm-logger --help" "chrt -h" "./play"; do $tool >/dev/null 2>&1; done
cat timeline pictures >/dev/null
seconds=$(cat duration)
fails=0
fail() { echo "FAIL: $*"; fails=$((fails + 1)); }

if [ "${record:-}" ]; then # more than a recording leaves free
  mkdir /run/disk
  mount -t tmpfs -o size=4g tmpfs /run/disk
fi
lcm-logger --lcm-url='udpm://239.255.76.67:7667?ttl=0' -q /run/heard.lcm &
logger=$!
chrt -f 45 ./play timeline pictures can1 "$device" "$width" "$height" 8 >played.txt &
player=$!
if declare -F beside >/dev/null; then beside; fi
sleep "${wait:-1}"
waymark run --config robot.yaml --out /run/drive ${record:+--record /run/disk/rec} --duration $((seconds + 10)) || fail "waymark run: exit code $?"
wait $player || fail "the player: exit code $?"
cat played.txt
kill $logger
wait $logger
errors=$(cat /sys/class/net/can0/statistics/rx_errors)
[ "$errors" = 0 ] || fail "the controller lost frames: $errors"
mkdir -p "/host/out/$name"
cp -r /run/drive /run/heard.lcm ${record:+/run/disk/rec} "/host/out/$name"
exit $((fails > 0))
