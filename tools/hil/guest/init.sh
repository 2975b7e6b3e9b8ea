#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The first program of the guest: a bare system, then the script that the command line names, then off. With "systemd" in the
# command line systemd is started first, and the script is a service of it.
export PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root TERM=dumb
script=$(sed -n 's/.*hil=\([^ ]*\).*/\1/p' /proc/cmdline)

run_and_stop() {
  echo "GUEST-UP $(uname -rm), $(dpkg --print-architecture), $(waymark --version)"
  bash /host/guest/"$script" 2>&1 </dev/null
  echo "GUEST-RC $?"
  sync
  echo o >/proc/sysrq-trigger
  sleep 5
}
if [ "${1:-}" = service ]; then
  dpkg -i /host/waymark.deb
  run_and_stop
fi
mkdir -p /dev/pts /dev/shm
for d in tmp run dev/shm; do mount -t tmpfs tmpfs /$d; done
mount -t devpts devpts /dev/pts
ln -sf /proc/self/fd /dev/fd
[ -e /etc/hosts ] || echo "127.0.0.1 localhost" >/etc/hosts # as every installed Debian has
if grep -qw systemd /proc/cmdline; then
  echo 0123456789abcdef0123456789abcdef >/etc/machine-id # a computer that was started before: nothing is enabled by itself
  cat >/etc/systemd/system/hil.service <<'UNIT'
[Unit]
Description=The script of this run
[Service]
Type=oneshot
ExecStart=/bin/sh /host/guest/init.sh service
StandardOutput=tty
StandardError=tty
TTYPath=/dev/console
UNIT
  printf '[Unit]\nRequires=basic.target\nWants=hil.service\n' >/etc/systemd/system/hil.target
  exec /lib/systemd/systemd --unit=hil.target
fi
ip link set lo up
ip route add 224.0.0.0/4 dev lo
/lib/systemd/systemd-udevd --daemon 2>/dev/null
# The program alone, or the package as on a robot; into memory, as all that is written here.
if [ -e /host/waymark ]; then
  cp /host/waymark /usr/bin/
  [ ! -e /host/waymark-play ] || cp /host/waymark-play /usr/bin/
  [ ! -e /host/waymark-camera ] || install -D /host/waymark-camera /usr/lib/waymark/waymark-camera
else
  dpkg -i /host/waymark.deb
fi
run_and_stop
