#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# fresh.sh [--system NAME] [--with PACKAGE,...] [--bind FROM:TO]... COMMAND...: runs a command in a fresh, minimal system (mmdebstrap, minbase),
# which is removed afterwards: NAME is one of tests/systems/table.sh of this computer's architecture, by default Debian 12. --with: packages that are there
# from the beginning. The environment is empty; network, proxy and certificates are this computer's. A folder of --bind stays.
# Root, or sudo. Roots are kept in .cache/roots and made anew after a week. Exit code 77: the system can't be had here.
set -euo pipefail
here=$(dirname "$(readlink -f "$0")")
[ "$(id -u)" -eq 0 ] || exec sudo --preserve-env=WM_DEBIAN_ARCHIVE,WM_UBUNTU_ARCHIVE bash "$here/fresh.sh" "$@"
# Mounts are of a namespace of their own: none is left behind.
[ "${WM_FRESH:-}" = 1 ] || WM_FRESH=1 exec unshare --mount --pid --fork --kill-child bash "$here/fresh.sh" "$@"
. "$here/../systems/table.sh"

system=debian-12-$(dpkg --print-architecture) with=""
[ "${1:-}" != --system ] || { system=$2; shift 2; }
[ "${1:-}" != --with ] || { with=$2; shift 2; }
mkdir -p "$here/../../.cache/roots"
roots=$(readlink -f "$here/../../.cache/roots")

row=$(grep "^$system " <<<"$table") || { echo "fresh.sh: '$system' is none of: $(cut -d' ' -f1 <<<"$table" | xargs)" >&2; exit 2; }
read -r _ suite archive components _ <<<"$row"
[ "$archive" != - ] || { echo "$system can't be had: no archive is named (WM_DEBIAN_ARCHIVE, WM_UBUNTU_ARCHIVE)" >&2; exit 77; }
keyring=()
if [[ $system == ubuntu* ]]; then # whose keys Debian 13 has
  keyring=(--keyring="$roots/ubuntu.gpg")
  [ -e "$roots/ubuntu.gpg" ] || WM_FRESH='' bash "$here/fresh.sh" --system "debian-13-${system##*-}" --with ubuntu-keyring --bind "$roots:/roots" cp "$ubuntu_keys" /roots/ubuntu.gpg
fi
tar=$roots/$system${with:+-$(cksum <<<"$with" | cut -d' ' -f1)}.tar
if [ -z "$(find "$tar" -mtime -7 2>/dev/null)" ]; then
  echo "making a minimal $system${with:+ with $(tr , '\n' <<<"$with" | wc -l) packages}" >&2
  mmdebstrap --mode=root --variant=minbase --dpkgopt=force-unsafe-io "${keyring[@]}" --include="apt${with:+,$with}" "$suite" "$tar.new.tar" \
    "deb $archive $suite ${components//,/ }" "deb $archive $suite-updates ${components//,/ }" >"$tar.log" 2>&1 || { tail -30 "$tar.log" >&2; exit 77; }
  mv "$tar.new.tar" "$tar"
fi
root=$(mktemp -d "$roots/fresh.XXXXXX")
mount --bind "$root" "$root"
# Lazily: what still runs in it keeps no mount there, or a bound folder of this file system would be removed with it.
trap 'umount -R -l "$root" && rm -rf --one-file-system "$root"' EXIT
chmod 755 "$root"
tar -C "$root" -xf "$tar" --exclude='./dev/*'
mkdir -p "$root/dev/shm" "$root/etc/ssl/certs"
for device in null zero full random urandom; do : >"$root/dev/$device"; mount --bind "/dev/$device" "$root/dev/$device"; done
mount -t tmpfs tmpfs "$root/dev/shm"
ln -s /proc/self/fd "$root/dev/fd"
mount -t proc proc "$root/proc"
mount --rbind /sys "$root/sys"
apt-config dump | grep -E '^Acquire::(https?|Retries)' | grep -v '""' >"$root/etc/apt/apt.conf.d/99desk" || true
cp /etc/resolv.conf /etc/hosts "$root/etc/"
network=(PIP_CERT=/etc/ssl/desk.crt CURL_CA_BUNDLE=/etc/ssl/desk.crt SSL_CERT_FILE=/etc/ssl/desk.crt)
cp /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/desk.crt" 2>/dev/null || network=()
network+=(http_proxy="${http_proxy:-}" https_proxy="${https_proxy:-}" no_proxy="${no_proxy:-}")
while [ "${1:-}" = --bind ]; do
  mkdir -p "$root/${2#*:}"
  mount --bind "${2%%:*}" "$root/${2#*:}"
  shift 2
done
chroot "$root" env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 "${network[@]}" "$@"
