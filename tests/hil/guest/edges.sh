# SPDX-License-Identifier: Apache-2.0
# In the guest: edge_mcl from video and CAN, both through the kernel's drivers, each datum at its own time; what LCM's own
# logger hears is what is judged.
set -u
waymark=/run/waymark
cp -r /host/edges /host/waymark /run/
cd /run/edges || exit 1
modprobe -a kvaser_pci can-raw || exit 1
modprobe v4l2loopback devices=1 video_nr=10 exclusive_caps=0 max_buffers=4 || exit 1
for can in can0 can1; do
  ip link set $can up type can bitrate 500000 restart-ms 100
  ip link set $can txqueuelen 2000
done
for tool in "$waymark check robot.yaml" "lcm-logger --help" "chrt -h" "./play"; do $tool >/dev/null 2>&1; done
cat timeline pictures >/dev/null
seconds=$(cat duration)
fails=0
fail() { echo "FAIL: $*"; fails=$((fails + 1)); }

lcm-logger --lcm-url='udpm://239.255.76.67:7667?ttl=0' -q /run/heard.lcm &
logger=$!
chrt -f 45 ./play timeline pictures can1 /dev/video10 640 360 8 >played.txt &
player=$!
sleep 1
$waymark run --config robot.yaml --out /run/drive --duration $((seconds + 10)) || fail "waymark run: exit code $?"
wait $player || fail "the player: exit code $?"
cat played.txt
kill $logger
wait $logger
errors=$(cat /sys/class/net/can0/statistics/rx_errors)
[ "$errors" = 0 ] || fail "the controller lost frames: $errors"
cp -r /run/drive /run/heard.lcm /host/out/
exit $((fails > 0))
