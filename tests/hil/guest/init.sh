#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The first program of the guest: a bare system, then the script that the command line names, then off.
export PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root TERM=dumb
mkdir -p /dev/pts /dev/shm
for d in tmp run dev/shm; do mount -t tmpfs tmpfs /$d; done
mount -t devpts devpts /dev/pts
ip link set lo up
ip route add 224.0.0.0/4 dev lo
/lib/systemd/systemd-udevd --daemon 2>/dev/null
# The package as on a robot, or the program alone; into memory, as all that is written here.
if [ -e /host/waymark.deb ]; then dpkg -i /host/waymark.deb; else cp /host/waymark /usr/bin/; fi
echo "GUEST-UP $(uname -rm), $(dpkg --print-architecture), $(waymark --version)"
script=$(sed -n 's/.*hil=\([^ ]*\).*/\1/p' /proc/cmdline)
bash /host/guest/"$script" 2>&1 </dev/null
echo "GUEST-RC $?"
sync
echo o >/proc/sysrq-trigger
sleep 5
