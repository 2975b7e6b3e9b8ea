#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# qemu.sh arm64|armhf COMMAND...: COMMAND where programs of that architecture run as if they were this machine's, under
# qemu-user and with the libraries of the sysroot; also when a script or another program starts them.
# The kernel is told so (binfmt_misc) in a user namespace of our own, Linux 6.7 and later: nothing is registered for others,
# and root is not needed. Where the machine has them registered (package qemu-user-binfmt), that is used.
set -euo pipefail

arch=$1
shift
case "$arch" in
  arm64) qemu=qemu-aarch64 class='\x02' machine='\xb7' triplet=aarch64-linux-gnu ;;
  armhf) qemu=qemu-arm class='\x01' machine='\x28' triplet=arm-linux-gnueabihf ;;
  *) echo "qemu.sh: '$arch' is not an architecture; arm64 and armhf are" >&2; exit 2 ;;
esac
root=$(readlink -f "$(dirname "$(readlink -f "$0")")/../.cache/sysroot/$arch")
[ -e "$root/.complete" ] || { echo "qemu.sh: there is no sysroot in $root. Make it: ./dev sysroot $arch" >&2; exit 2; }
export QEMU_LD_PREFIX=$root

# The dynamic linker is a program, too.
probe=$(readlink -f "$root"/lib/$triplet/ld-linux-*.so.*)
if "$probe" --version >/dev/null 2>&1; then
  exec "$@"
fi

zeros='\x00\x00\x00\x00\x00\x00\x00\x00'
magic="\\x7fELF${class}\\x01\\x01\\x00${zeros}\\x02\\x00${machine}\\x00"
mask='\xff\xff\xff\xff\xff\xff\xff\x00\xff\xff\xff\xff\xff\xff\xff\xff\xfe\xff\xff\xff'
export WM_BINFMT=":waymark-$arch:M::$magic:$mask:$(command -v $qemu):PF"
exec unshare --user --map-root-user --mount bash -c '
  mount -t binfmt_misc binfmt_misc /proc/sys/fs/binfmt_misc && printf "%s" "$WM_BINFMT" >/proc/sys/fs/binfmt_misc/register || {
    echo "qemu.sh: this kernel has no binfmt_misc of its own for a user namespace (Linux 6.7 has). Install qemu-user-binfmt." >&2
    exit 2
  }
  unset WM_BINFMT
  exec "$@"' bash "$@"
