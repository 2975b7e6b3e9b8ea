#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Makes what a guest needs, once for a kernel version, in the folder that is named: Debian's PREEMPT_RT kernel with its
# modules, v4l2loopback (and for amd64 vimc and guest_second) built for it, a small root file system, an initramfs. Packages come from Debian
# alone. An armhf guest has arm64's kernel, which runs its programs.
# usage: prepare.sh FOLDER [amd64|arm64|armhf]   (4 minutes, 3 GB; needs the packages that docs/dependencies.md lists for hil)
# Two that are begun at once wait for each other; the second finds the image ready.
set -euo pipefail
arch=${2:-amd64}
here=$(dirname "$(readlink -f "$0")")
mkdir -p "$1"
folder=$(readlink -f "$1")
# Beside this script where it is installed, else in the sources.
toolchain=$here
[ -e "$toolchain/foreign-apt.sh" ] || toolchain=$here/../../../toolchain
case "$arch" in
  amd64) machine=amd64 build=() ;;
  arm64 | armhf) machine=arm64 build=(ARCH=arm64 CROSS_COMPILE=aarch64-linux-gnu-) ;;
  *) echo "prepare.sh: '$arch': amd64, arm64 and armhf are known" >&2; exit 2 ;;
esac

exec 9>"$folder/.lock"
flock 9

# The kernel's packages, by an apt with its own state where they are another architecture's. With an image that is there, lists
# that were fetched before are new enough.
apt_folder=$folder/$machine.apt
if [ "$machine" != amd64 ] && [ ! -e "$apt_folder/update.log" ]; then bash "$toolchain/foreign-apt.sh" "$machine" "$apt_folder"; fi
its_apt() { if [ "$machine" = amd64 ]; then "$@"; else env APT_CONFIG="$apt_folder/apt.conf" "$@"; fi; }

kernel=$(its_apt apt-cache depends "linux-image-rt-$machine" | awk '/Depends: linux-image-/{sub("linux-image-", "", $2); print $2; exit}')
[ -n "$kernel" ] || { echo "apt knows no linux-image-rt-$machine (apt-get update?)"; exit 1; }
cd "$folder"
made_of="$kernel $(cat "$here/prepare.sh" "$here/initramfs.sh" "$here/guest_second.c" | sha256sum)"
if [ "$(cat made_of 2>/dev/null)" = "$made_of" ] && [ -f init.cpio.gz ]; then exit 0; fi
for program in mmdebstrap cpio mke2fs make; do # before the image that is there is removed
  PATH=$PATH:/usr/sbin:/sbin command -v "$program" >/dev/null || { echo "prepare.sh: $program is missing; the image is as it was"; exit 1; }
done
echo "preparing a guest with $kernel in $folder"
rm -rf debs files root v4l2loopback vimc second made_of root.ext4 init.cpio.gz

version=$(echo "$kernel" | cut -d. -f1,2)
mkdir debs files
(
  cd debs
  its_apt apt-get download -q "linux-image-$kernel" "linux-headers-$kernel"
  # Headers that are every architecture's, and the programs that build, which are this computer's.
  apt-get download -q "linux-headers-${kernel/-rt-$machine/-common-rt}" "linux-kbuild-$version" v4l2loopback-dkms
  [ "$arch" != amd64 ] || apt-get download -q "linux-source-$version"
)
for deb in debs/*.deb; do dpkg -x "$deb" files; done
cp "files/boot/vmlinuz-$kernel" vmlinuz

include=iproute2,kmod,can-utils,v4l-utils,liblcm1,procps,udev,liblcm-bin,libyaml-0-2,libturbojpeg0,libpng16-16,libapriltag3,busybox-static
# A board that is reached over ssh; the library of cyclictest, whose package also has Python scripts and would bring Python.
include=$include,openssh-server,libnuma1
cyclictest='cd "$1/tmp" && APT_CONFIG=$MMDEBSTRAP_APT_CONFIG apt-get download -q rt-tests &&
  dpkg-deb --fsys-tarfile rt-tests_*.deb | tar -C "$1" -x ./usr/bin/cyclictest && rm rt-tests_*.deb'
# The libraries of gpsd, whose package would bring Python, too; and the one of the package's page.
include=$include,libgps28,libusb-1.0-0,libbluetooth3,netbase,libmicrohttpd12
gpsd='cd "$1/tmp" && APT_CONFIG=$MMDEBSTRAP_APT_CONFIG apt-get download -q gpsd &&
  dpkg-deb --fsys-tarfile gpsd_*.deb | tar -C "$1" -x ./usr/sbin/gpsd && rm gpsd_*.deb'
# What the package's service runs under, and its dynamic user.
include=$include,systemd,libnss-systemd,init-system-helpers
if [ "$arch" = amd64 ]; then
  mmdebstrap --quiet --variant=minbase --include="$include,libcamera0.0.3,libcamera-ipa" --customize-hook="$cyclictest" --customize-hook="$gpsd" bookworm root
else
  # A mirror's security index of another architecture is sometimes in the middle of a change: the guest does without.
  mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' | grep -v security | head -1)
  bash "$toolchain/foreign.sh" "$arch" mmdebstrap --quiet --mode=root --variant=minbase --architectures="$arch" --include="$include" \
    --customize-hook="$cyclictest" --customize-hook="$gpsd" bookworm root.tar "deb $mirror bookworm main" "deb $mirror bookworm-updates main"
  mkdir root
  tar -C root -xf root.tar --exclude='./dev/*'
  rm root.tar
fi

# The headers name an absolute path once; patched, modules are built without installing anything here.
headers=files/usr/src/linux-headers-$kernel
sed -i "s#^include /usr/src/#include $PWD/files/usr/src/#" "$headers/Makefile"
modules() { make -s -C "$headers" M="$PWD/$1" "${build[@]}" "${@:2}" modules; }
mkdir -p root/usr/lib/modules
cp -a "files/lib/modules/$kernel" root/usr/lib/modules/
cp -r files/usr/src/v4l2loopback-*/ v4l2loopback
modules v4l2loopback
install -D v4l2loopback/v4l2loopback.ko "root/usr/lib/modules/$kernel/extra/v4l2loopback.ko"
if [ "$arch" = amd64 ]; then
  # Debian's kernel has no vimc; its sources do.
  tar -xf files/usr/src/linux-source-*.tar.xz --wildcards --strip-components=4 '*/drivers/media/test-drivers/vimc'
  modules vimc CONFIG_VIDEO_VIMC=m
  install -D vimc/vimc.ko "root/usr/lib/modules/$kernel/extra/vimc.ko"
  mkdir second
  cp "$here/guest_second.c" second/
  echo 'obj-m := guest_second.o' >second/Makefile
  modules second
  install -D second/guest_second.ko "root/usr/lib/modules/$kernel/extra/guest_second.ko"
fi
/sbin/depmod -b root "$kernel"

mke2fs -q -F -t ext4 -d root -O ^has_journal root.ext4 1500M
bash "$here/initramfs.sh" root "$kernel" root/bin/busybox "$PWD/init.cpio.gz"
rm -rf root debs files v4l2loopback vimc second
echo "$made_of" >made_of
