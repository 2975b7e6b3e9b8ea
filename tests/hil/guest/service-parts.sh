# SPDX-License-Identifier: Apache-2.0
# In the guest, by other scripts: the package's service on the robot's files in /host/NAME, a CAN controller and a camera.
# Needs: name (of the folder).
set -u
fails=0
fail() { echo "FAIL: $*"; fails=$((fails + 1)); }
now() { cut -d' ' -f1 /proc/uptime; } # the monotonic clock
mark() { echo "$1 $(now)" >>"$out/marks"; }
out=/host/out/$name
mkdir -p "$out"
cp -r "/host/$name" /run/
cd "/run/$name" || exit 1

bus_up() {
  modprobe -a kvaser_pci can-raw || exit 1
  for can in can0 can1; do
    ip link set $can up type can bitrate 500000 restart-ms 100
    ip link set $can txqueuelen 2000
  done
}
# The camera that /dev/robot-camera points to.
camera_up() { modprobe v4l2loopback devices=1 video_nr=10 exclusive_caps=0 max_buffers=4 && ln -sf video10 /dev/robot-camera; }
camera_gone() {
  rm -f /dev/robot-camera
  for try in $(seq 100); do
    rmmod v4l2loopback 2>/dev/null && return
    sleep 0.1
  done
  fail "the camera's module is still in use"
}
robot_files() { cp robot.yaml calibration.yaml vehicle.dbc can-signals.yaml /etc/waymark/; }
# play TIMELINE DELAY [FROM UNTIL]
play() { chrt -f 45 ./play "$1" pictures can1 /dev/video10 640 400 "${@:2}" >"$1.txt" & player=$!; }
hear() { lcm-logger -q --lcm-url='udpm://239.255.76.67:7667?ttl=0' "$1" & logger=$!; }
end_hearing() {
  kill -INT $logger
  wait $logger
}
what() { systemctl show waymark -p "$1" --value; }
journal() { journalctl -u waymark -o short-monotonic --no-pager >"$out/$1"; }
# What has to be in memory before it counts.
for tool in "lcm-logger --help" "chrt -h" "./play" "systemctl --version" "journalctl --version"; do $tool >/dev/null 2>&1; done
cat pictures *timeline >/dev/null
