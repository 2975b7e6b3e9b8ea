# SPDX-License-Identifier: Apache-2.0
# In the guest, under systemd: the service is killed (SIGKILL) again and again while `slam` maps; what it keeps is on a disk, ext4
# with a journal. At the end the host takes the power away (it kills qemu).
name=kills
. /host/guest/service-parts.sh
modprobe -a virtio_blk ext4
mkdir -p -m 0700 /var/lib/private
mount -t ext4 /dev/vdb /var/lib/private || fail "no second disk"
chmod 0700 /var/lib/private
rmdir /var/lib/waymark 2>/dev/null # the service would move it here, from another disk
robot_files
bus_up
camera_up
systemctl start waymark || { journalctl -u waymark -o cat --no-pager | tail; exit 1; }
systemctl stop waymark # its libraries are in memory, its route is there
rm -rf /var/lib/private/waymark
# What systemd itself takes from a service's start to its first instruction: the same unit with a program that does nothing.
sed '/^ExecStart/d; /^ExecReload/d; /^Restart/d; /^Watchdog/d; s/^Type=.*/Type=oneshot\nRemainAfterExit=yes\nUser=waymark\nExecStart=\/bin\/true/' /lib/systemd/system/waymark.service >/run/systemd/system/nothing.service
systemctl daemon-reload
for try in 1 2 3; do
  systemctl start nothing || fail "the unit of /bin/true doesn't start"
  systemctl show nothing -p ExecMainStartTimestampMonotonic,ExecMainExitTimestampMonotonic --value | tr '\n' ' ' >>"$out/nothing-us"
  systemctl stop nothing
done
hear /run/heard.lcm
chrt -f 46 ./disk_clock /dev/vdb &
systemctl start waymark || fail "the service doesn't start"
play drive.timeline 1
sleep 53 # a lap: the map has all markers
while read -r pause; do
  sleep "$pause"
  mark killed
  systemctl kill --signal=KILL waymark
  sleep 1
  until [ "$(what MainPID)" != 0 ]; do sleep 0.1; done # after RestartSec= and the unit's check
  what ExecMainStartTimestampMonotonic >>"$out/started-us"
done <pauses
sleep 6
journal journal
cp drive.timeline.txt /run/heard.lcm "$out/"
[ $fails = 0 ] || exit 1
echo "NO MORE POWER"
sleep 1000
