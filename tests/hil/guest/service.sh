# SPDX-License-Identifier: Apache-2.0
# In the guest, under systemd: the package's service, as it is shipped. It begins on a computer that has no camera yet; then the
# bus is silent for two minutes; in another drive the camera is gone for one, in a third both.
name=service
. /host/guest/service-parts.sh

echo "== installed, not started"
[ "$(what ActiveState)" = inactive ] || fail "the installed service is $(what ActiveState)"
robot_files
bus_up
lsmod | grep -q '^v4l2loopback' && fail "this guest has a camera from the beginning"

echo "== a subscriber on this computer, which is in no network: without the unit's route, and with it"
mkdir -p /run/systemd/system/waymark.service.d
printf '[Service]\nExecStartPre=\n' >/run/systemd/system/waymark.service.d/no-route.conf
systemctl daemon-reload
systemctl start waymark || fail "the service doesn't start"
hear /run/without.lcm # ends by itself, as LCM has no way either
sleep 2
end_hearing
systemctl stop waymark
rm -r /run/systemd/system/waymark.service.d
systemctl daemon-reload
systemctl start waymark || fail "the service doesn't start"
hear /run/alone.lcm
sleep 2
end_hearing
systemctl stop waymark
ip route del 239.255.76.67 dev lo

echo "== the same where multicast goes out of a network's interface; one subscriber was there before the service"
modprobe dummy numdummies=0
ip link add nic0 type dummy && ip addr add 192.0.2.2/24 dev nic0 && ip link set nic0 up && ip route add default dev nic0 || fail "no network"
hear /run/early.lcm
early=$logger
sleep 1
systemctl start waymark || fail "the service doesn't start"
hear /run/late.lcm
sleep 2
end_hearing
logger=$early
end_hearing
systemctl stop waymark
for when in without alone early late; do echo "$when $(stat -c %s /run/$when.lcm 2>/dev/null || echo 0)" >>"$out/heard-bytes"; done
cat "$out/heard-bytes"

# drive NAME: with a new map; at what times (ns) the camera goes and comes stands in NAME.camera.
drive() {
  echo "== drive: $1"
  rm -rf /var/lib/private/waymark /var/lib/waymark
  hear "/run/$1.lcm"
  systemctl start waymark || fail "the service doesn't start"
  if [ ! -e /dev/robot-camera ]; then # an hour after the start, in short
    sleep 2
    camera_up
    sleep 2
    journalctl -u waymark -o cat --no-pager | grep -F "front " | tail -2
  fi
  play "$1.timeline" 3
  until grep -q ahead "$1.timeline.txt"; do sleep 0.1; done
  ahead_ns=$(sed -n 's/^ahead \(.*\) ns$/\1/p' "$1.timeline.txt")
  (while :; do
    echo "$(now)|$(systemctl show waymark -p MainPID,NRestarts,ActiveState,StatusText | tr '\n' '|')"
    sleep 2
  done) >"$out/$1.states" &
  states=$!
  while read -r event at_ns; do
    left=$(awk -v at="$at_ns" -v ahead="$ahead_ns" -v now="$(now)" 'BEGIN { s = (at + ahead) * 1e-9 - now; print (s > 0 ? s : 0) }')
    sleep "$left"
    $event
    mark "$1-$event"
  done <"$1.camera"
  wait $player || fail "the player: exit code $?"
  kill $states
  end_hearing
  systemctl stop waymark
  journal "$1.journal"
  cp "$1.timeline.txt" "/run/$1.lcm" "$out/"
  cat "$1.timeline.txt"
}
drive bus
drive camera
drive both
cat "$out"/*.states | awk 'NR % 8 == 1'
exit $((fails > 0))
