# SPDX-License-Identifier: Apache-2.0
# In the guest: `waymark play` into virtual CAN interfaces and v4l2loopback devices, recorded beside it.
set -u
cp -r /host/play /run/
cd /run/play || exit 1
command -v waymark-play >/dev/null || cp waymark-play /usr/bin/
modprobe -a vcan can-raw || exit 1
modprobe v4l2loopback devices=2 video_nr=10,11 exclusive_caps=0 max_buffers=8 || exit 1
for can in vcan0 vcan1; do
  ip link add $can type vcan
  ip link set $can up
done
for tool in "chrt -h" "waymark check robot.yaml" "waymark play --help" "waymark record --help" "v4l2-ctl -d /dev/video10 -D"; do $tool >/dev/null 2>&1; done
cat recording/can.log recording/video/*.avi >/dev/null
fails=0
fail() { echo "FAIL: $*"; fails=$((fails + 1)); }

interfaces="--can can0=vcan0 --can can1=vcan1 --camera left=/dev/video10,MJPG --camera right=/dev/video11,GREY --lcm off"
# From the moment on at which the device lets a reader in.
listen() {
  until timeout -s INT "$3" stdbuf -oL -eL v4l2-ctl -d "/dev/video$1" --stream-mmap=8 --stream-count="$2" --verbose 2>&1 | grep --line-buffered dqbuf; do
    sleep 0.05
  done
}

# Once before: what is read from the disk later would stop the guest's clock for the time of the disk.
chrt -f 45 waymark play recording $interfaces --until 1 >warm.txt 2>&1 &
warm=$!
sleep 1
waymark record --config robot.yaml --out warm --duration 2 --free-mb 50 >/dev/null 2>&1
timeout 2 stdbuf -oL v4l2-ctl -d /dev/video10 --stream-mmap=8 --stream-count=5 --verbose 2>&1 | grep dqbuf >/dev/null
wait $warm

# played NAME JSON OPTIONS: plays, and records what the kernel gives.
played() {
  local name=$1 json=$2
  shift 2
  chrt -f 45 waymark play recording $interfaces --start-at $(($(cut -d. -f1 /proc/uptime) * 1000000000 + 8000000000)) --json "$json" "$@" >"$name.txt" 2>&1 &
  local player=$!
  until grep -sq "begins at" "$name.txt"; do sleep 0.1; done # its devices are open
  listen 10 240 18 >"$name-left.txt" 2>/dev/null &
  local left=$!
  listen 11 240 18 >"$name-right.txt" 2>/dev/null &
  local right=$!
  waymark record --config robot.yaml --out "$name" --duration 17 --free-mb 50 >"$name-record.txt" 2>&1 || fail "waymark record: exit code $?"
  wait $player || fail "waymark play: exit code $?"
  wait $left $right
  cat "$name.txt" "$name-record.txt"
}
played rec played.json
played broken broken.json --faults faults.yaml
waymark play recording --can can0=vcan7 --lcm off 2>&1 | grep -F "vcan7: there is no such interface" || fail "no message about vcan7"
waymark play recording --camera left=/dev/video77 --lcm off 2>&1 | grep -F "/dev/video77: can't be opened" || fail "no message about video77"
mkdir -p /host/out/play
cp -r rec broken ./*-left.txt ./*-right.txt played.json broken.json /host/out/play
exit $((fails > 0))
