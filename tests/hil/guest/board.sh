# SPDX-License-Identifier: Apache-2.0
# In the guest: a board that is reached over ssh, with Waymark's program and what the doctor asks for. It waits until the desk is done,
# then compares itself with what it was before.
set -u
modprobe -a virtio_net vcan can-raw || exit 1
for try in $(seq 50); do
  nic=$(ls /sys/class/net | grep -vE '^(lo|can|vcan)' | head -1)
  [ -n "$nic" ] && break
  sleep 0.1
done
ip link set "$nic" up && ip addr add 10.0.2.15/24 dev "$nic" || exit 1
mkdir -p /run/sshd /root/.ssh
cp /host/board/key.pub /root/.ssh/authorized_keys
chmod 700 /root/.ssh
chmod 600 /root/.ssh/authorized_keys
chown -R root:root /root
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
