#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs a command in a user namespace of its own, with all users of a whole Debian, where the kernel runs programs of another
# architecture by qemu-user (Linux 6.7); this machine's own table of such programs is not touched. Root.
# usage: foreign.sh amd64|arm64|armhf COMMAND...
set -euo pipefail
arch=$1
case "$arch" in
  amd64) qemu= ;;
  arm64) qemu=qemu-aarch64-static class='\x02' machine='\xb7' ;;
  armhf) qemu=qemu-arm-static class='\x01' machine='\x28' ;;
  *) echo "foreign.sh: '$arch': amd64, arm64 and armhf are known" >&2; exit 2 ;;
esac

if [ "${WM_OWN_USERS:-}" != 1 ]; then
  [ "$(id -u)" -eq 0 ] || exec sudo bash "$0" "$@"
  # The users of a whole Debian, not root alone: who is outside writes the map.
  pipe=$(mktemp -u)
  mkfifo "$pipe"
  WM_OWN_USERS=1 unshare --user --mount --uts bash -c 'read -r _ <"$0"; rm "$0"; exec bash "$@"' "$pipe" "$0" "$@" &
  child=$!
  until [ "$(readlink "/proc/$child/ns/user")" != "$(readlink /proc/self/ns/user)" ]; do sleep 0.05; done
  echo "0 0 65536" >"/proc/$child/uid_map"
  echo "0 0 65536" >"/proc/$child/gid_map"
  echo >"$pipe"
  wait "$child"
  exit
fi

if [ -n "$qemu" ]; then
  zeros='\x00\x00\x00\x00\x00\x00\x00\x00'
  mount -t binfmt_misc binfmt_misc /proc/sys/fs/binfmt_misc
  # F: opened now, so that it is found from inside of a root; C: credentials of the program, O: opened for it.
  printf '%s' ":waymark-$arch:M::\\x7fELF${class}\\x01\\x01\\x00${zeros}\\x02\\x00${machine}\\x00:\\xff\\xff\\xff\\xff\\xff\\xff\\xff\\x00\\xff\\xff\\xff\\xff\\xff\\xff\\xff\\xff\\xfe\\xff\\xff\\xff:/usr/bin/$qemu:OCF" \
    >/proc/sys/fs/binfmt_misc/register
fi
shift
exec "$@"
