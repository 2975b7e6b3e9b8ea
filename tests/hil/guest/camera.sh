# SPDX-License-Identifier: Apache-2.0
# In the guest: cameras by V4L2, recorded by waymark; vivid gives the faults, v4l2loopback a producer that dies.
set -u
cp -r /host/camera /run/
cd /run/camera || exit 1
modprobe vivid n_devs=1 node_types=0x1 num_inputs=1 input_types=0 || exit 1
modprobe v4l2loopback devices=1 video_nr=10 exclusive_caps=0 || exit 1
for tool in "lcm-logger --help" "canplayer -h" "v4l2-ctl -d /dev/video0 -D" "waymark help"; do $tool >/dev/null 2>&1; done
fails=0
fail() { echo "FAIL: $*"; fails=$((fails + 1)); }
control() { v4l2-ctl -d /dev/video0 -c "$1"; }

# record NAME SECONDS: in the background; what it says is in NAME.txt.
record() { waymark record --config robot.yaml --out "/run/$1" --duration "$2" --free-mb 50 >"$1.txt" 2>&1 & recording=$!; }
finish() { wait $recording || fail "waymark record ($1): exit code $?"; cat "$1.txt"; }
said() { grep -qF "$2" "$1.txt" || fail "$1: not said: $2"; }
pictures() { grep -c , "/run/$1/video/front.csv"; }

echo "== pictures as they come"
record plain 4
finish plain
said plain "front gives pictures"
[ "$(pictures plain)" -gt 30 ] || fail "plain: only $(pictures plain) pictures"

echo "== SIGTERM in the middle of a recording"
record term 60
sleep 3
kill -TERM $recording
finish term
[ "$(pictures term)" -gt 10 ] || fail "term: only $(pictures term) pictures"

echo "== a disk that is full"
mkdir /run/small && mount -t tmpfs -o size=1500k tmpfs /run/small
waymark record --config robot.yaml --out /run/small/rec --duration 20 --free-mb 0 >full.txt 2>&1
[ $? = 1 ] || fail "full: the exit code isn't 1"
cat full.txt
said full "No space left on device; the files are valid up to there"
rows=$(grep -c , /run/small/rec/video/front.csv)
[ "$rows" -gt 5 ] || fail "full: only $rows rows"
cp -r /run/small/rec /host/out/camera-full

echo "== dropped buffers, a damaged one, numbers and stamps that wrap"
record faults 9
sleep 2
control percentage_of_dropped_buffers=30
sleep 1
control percentage_of_dropped_buffers=0
control inject_v4l2_buf_flag_error=1
sleep 1
control wrap_timestamp=1
sleep 2
control wrap_timestamp=0
finish faults
[ "$(pictures faults)" -gt 50 ] || fail "faults: only $(pictures faults) pictures"
cp -r /run/faults /host/out/camera-faults

echo "== unplugged and back"
record unplugged 9
sleep 2
echo vivid.0 >/sys/bus/platform/drivers/vivid/unbind
sleep 2
echo vivid.0 >/sys/bus/platform/drivers/vivid/bind
finish unplugged
said unplugged "looking for it"
[ "$(grep -c 'front gives pictures' unplugged.txt)" = 2 ] || fail "unplugged: it doesn't come back"

echo "== what is published while the camera breaks"
mark() { echo "$1 $(cut -d' ' -f1 /proc/uptime)" >>/host/out/camera-marks; }
modprobe -a vcan can-raw && ip link add dev vcan0 type vcan && ip link set vcan0 up
while :; do canplayer -I can.log vcan0=can0; done &
player=$!
lcm-logger --lcm-url='udpm://239.255.76.67:7667?ttl=0' -q /run/heard.lcm &
logger=$!
sleep 1
waymark run --config published.yaml --duration 32 >published.txt 2>&1 &
run=$!
sleep 5
mark dropped
control percentage_of_dropped_buffers=20
sleep 5
control percentage_of_dropped_buffers=0
mark damaged
for i in 1 2 3 4 5; do
  control inject_v4l2_buf_flag_error=1
  sleep 0.4
done
mark unplugged
echo vivid.0 >/sys/bus/platform/drivers/vivid/unbind
sleep 5
echo vivid.0 >/sys/bus/platform/drivers/vivid/bind
mark plugged
sleep 4
mark stalled
control percentage_of_dropped_buffers=100
sleep 3.8 # long enough for a message that says so, too short for the stream to be switched off and on
control percentage_of_dropped_buffers=0
mark works
wait $run || fail "waymark run: exit code $?"
kill $player $logger
cat published.txt
mkdir /host/out/camera-published
cp /run/heard.lcm published.txt /host/out/camera-published/

echo "== a producer that dies, and another one"
sed -i 's#/dev/video0#/dev/video10#' robot.yaml
./feed /dev/video10 320 180 15 1000 & feeder=$!
sleep 1
record dies 10
sleep 3
kill -9 $feeder
sleep 3
./feed /dev/video10 320 180 15 1000 & feeder=$!
finish dies
kill $feeder
said dies "gives no pictures"
[ "$(grep -c 'front gives pictures' dies.txt)" -ge 2 ] || fail "dies: it doesn't come back"

echo "== the power fails in the middle of a recording"
modprobe -a virtio_blk ext4
mount -t ext4 /dev/vdb /mnt || fail "no second disk"
while :; do canplayer -I can.log vcan0=can0; done &
waymark record --config published.yaml --out /mnt/rec --free-mb 20 &
sleep 10
mark power
[ $fails = 0 ] || exit 1
echo "GUEST-RC 0"
sleep 0.5
echo b >/proc/sysrq-trigger # no sync, no unmount: what the disk has not got is gone
