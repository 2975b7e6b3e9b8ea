#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# An initramfs that mounts the guest's image read-only under a tmpfs, and the host's folder beside it.
# usage: initramfs.sh ROOT KERNEL BUSYBOX OUT.cpio.gz
set -euo pipefail
root=$1 kernel=$2 busybox=$3 out=$4
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work"/{bin,lib/modules,proc,sys,dev,root,host}
cp "$busybox" "$work/bin/busybox"
: >"$work/lib/order"
# In Debian's kernel all of these are modules.
for module in virtio_pci virtio_blk crc32c_generic ext4 9pnet_virtio 9p overlay; do
  /sbin/modprobe -d "$root" -S "$kernel" --show-depends "$module" | awk '$1 == "insmod" {print $2}' | while read -r file; do
    name=$(basename "$file")
    grep -qx "$name" "$work/lib/order" || { cp "$file" "$work/lib/modules/"; echo "$name" >>"$work/lib/order"; }
  done
done
second=$(find "$root/usr/lib/modules/$kernel/" -name guest_second.ko)
[ -z "$second" ] || cp "$second" "$work/lib/modules/"
cat >"$work/init" <<'INIT'
#!/bin/busybox sh
b=/bin/busybox
$b mount -t proc proc /proc
$b mount -t sysfs sys /sys
$b mount -t devtmpfs dev /dev
# A second that is longer than the processor's own: the timer that wakes has the same one (guest_second.c).
khz=$($b sed -n 's/.*tsc_early_khz=\([0-9]*\).*/\1/p' /proc/cmdline)
[ -z "$khz" ] || $b insmod /lib/modules/guest_second.ko factor_permille=$((khz / 1000)) || echo "guest_second failed: the desk takes longer"
while read -r module; do $b insmod /lib/modules/$module || echo "insmod $module failed"; done </lib/order
n=0
while [ ! -b /dev/vda ] && [ $n -lt 100 ]; do $b sleep 0.1; n=$((n + 1)); done
$b mount -t ext4 -o ro,noload /dev/vda /root
$b mkdir -p /ov
$b mount -t tmpfs tmpfs /ov
$b mkdir -p /ov/u /ov/w /newroot
$b mount -t overlay -o lowerdir=/root,upperdir=/ov/u,workdir=/ov/w overlay /newroot
$b mkdir -p /newroot/host /newroot/proc /newroot/sys /newroot/dev
$b mount -t 9p -o trans=virtio,version=9p2000.L,msize=262144 host /newroot/host
for d in dev proc sys; do $b mount --move /$d /newroot/$d; done
exec $b switch_root /newroot /bin/sh /host/guest/init.sh
INIT
chmod +x "$work/init"
(cd "$work" && find . | cpio -o -H newc --quiet | gzip -1) >"$out"
