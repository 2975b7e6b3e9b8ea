#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Makes what a guest needs, once for a kernel version, in the folder that is named: Debian's PREEMPT_RT kernel with its
# modules, v4l2loopback and vimc built for it, a small root file system, an initramfs. Packages come from Debian alone.
# usage: prepare.sh FOLDER        (4 minutes, 3 GB; needs the packages that docs/dependencies.md lists for hil)
set -euo pipefail
folder=$1
here=$(cd "$(dirname "$0")" && pwd)
kernel=$(apt-cache depends linux-image-rt-amd64 | awk '/Depends: linux-image-/{sub("linux-image-", "", $2); print $2; exit}')
[ -n "$kernel" ] || { echo "apt knows no linux-image-rt-amd64 (apt-get update?)"; exit 1; }
mkdir -p "$folder"
cd "$folder"
if [ "$(cat kernel 2>/dev/null)" = "$kernel" ] && [ -f init.cpio.gz ]; then exit 0; fi
echo "preparing a guest with $kernel in $folder"
rm -rf debs files root v4l2loopback vimc kernel root.ext4 init.cpio.gz

mkdir debs files
(cd debs && apt-get download -q "linux-image-$kernel" "linux-headers-$kernel" "linux-headers-${kernel/-rt-amd64/-common-rt}" \
  "linux-kbuild-$(echo "$kernel" | cut -d. -f1,2)" v4l2loopback-dkms "linux-source-$(echo "$kernel" | cut -d. -f1,2)")
for deb in debs/*.deb; do dpkg -x "$deb" files; done
cp "files/boot/vmlinuz-$kernel" vmlinuz

mmdebstrap --quiet --variant=minbase \
  --include=iproute2,kmod,can-utils,v4l-utils,liblcm1,procps,udev,liblcm-bin,libyaml-0-2,libturbojpeg0,libpng16-16,libapriltag3,libcamera0.0.3,libcamera-ipa \
  bookworm root

# The headers name an absolute path once; patched, modules are built without installing anything here.
sed -i "s#^include /usr/src/#include $PWD/files/usr/src/#" "files/usr/src/linux-headers-$kernel/Makefile"
cp -r files/usr/src/v4l2loopback-*/ v4l2loopback
make -s -C "files/usr/src/linux-headers-$kernel" M="$PWD/v4l2loopback" modules
# Debian's kernel has no vimc; its sources do.
tar -xf files/usr/src/linux-source-*.tar.xz --wildcards --strip-components=4 '*/drivers/media/test-drivers/vimc'
make -s -C "files/usr/src/linux-headers-$kernel" M="$PWD/vimc" CONFIG_VIDEO_VIMC=m modules
mkdir -p root/usr/lib/modules
cp -a "files/lib/modules/$kernel" root/usr/lib/modules/
install -D v4l2loopback/v4l2loopback.ko "root/usr/lib/modules/$kernel/extra/v4l2loopback.ko"
install -D vimc/vimc.ko "root/usr/lib/modules/$kernel/extra/vimc.ko"
depmod -b root "$kernel"

mke2fs -q -F -t ext4 -d root -O ^has_journal root.ext4 1500M
bash "$here/initramfs.sh" root "$kernel" /bin/busybox "$PWD/init.cpio.gz"
rm -rf root debs files v4l2loopback vimc
echo "$kernel" >kernel
