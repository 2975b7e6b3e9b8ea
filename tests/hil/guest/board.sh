# SPDX-License-Identifier: Apache-2.0
# In the guest: a board that is reached over ssh, with Waymark's program and what the doctor asks for, as root, as a user with sudo and as one without.
# It waits until the desk is done, then compares itself with what it was before.
set -u
modprobe -a virtio_net vcan can-raw || exit 1
for try in $(seq 50); do
  nic=$(ls /sys/class/net | grep -vE '^(lo|can|vcan)' | head -1)
  [ -n "$nic" ] && break
  sleep 0.1
done
ip link set "$nic" up && ip addr add 10.0.2.15/24 dev "$nic" || exit 1
mkdir -p /run/sshd
dpkg -i /host/board/sudo_*.deb >/run/sudo.txt 2>&1 || { cat /run/sudo.txt; exit 1; }
echo 'pi ALL=(ALL) NOPASSWD: ALL' >/etc/sudoers.d/pi
chmod 440 /etc/sudoers.d/pi
for user in root pi guest; do # pi may use sudo, guest may not
  id "$user" >/dev/null 2>&1 || useradd --create-home --shell /bin/bash --password '*' "$user"
  home=$(getent passwd "$user" | cut -d: -f6)
  install -d -m 700 "$home/.ssh"
  install -m 600 /host/board/key.pub "$home/.ssh/authorized_keys"
  chown -R "$user:" "$home"
done
/usr/sbin/sshd -o PermitRootLogin=prohibit-password -o UsePAM=no -o UseDNS=no -o LoginGraceTime=0 || exit 1 # its clock skips idle time
as_it_is() {
  ls /sys/class/net
  lsmod | awk '$1 != "Module" {print $1}' | grep -E 'vcan|v4l2loopback'
  ls /tmp
  ps -eo args= | grep -E 'waymark|drive.sh|cyclictest' | grep -v grep
}
as_it_is >/run/before
echo BOARD-READY
until [ -e /host/out/board-done ]; do sleep 1; done
sleep 2
as_it_is >/run/after
diff /run/before /run/after || { echo "FAIL: the board is not as it was"; exit 1; }
