#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# fresh.sh [--bind FROM:TO]... COMMAND...: runs a command in a fresh, minimal Debian 12 of this computer's architecture (mmdebstrap,
# minbase), which is removed afterwards. Its environment is empty; network, proxy and certificates are this computer's. A folder
# of --bind stays. Root, or sudo. The root is kept as .cache/roots/minbase.tar and made anew after a week.
set -euo pipefail
here=$(dirname "$(readlink -f "$0")")
[ "$(id -u)" -eq 0 ] || exec sudo bash "$here/fresh.sh" "$@"
# Mounts are of a namespace of their own: none is left behind.
[ "${WM_FRESH:-}" = 1 ] || WM_FRESH=1 exec unshare --mount --pid --fork --kill-child bash "$here/fresh.sh" "$@"

roots=$here/../../.cache/roots
mkdir -p "$roots"
roots=$(readlink -f "$roots")
tar=$roots/minbase.tar
if [ -z "$(find "$tar" -mtime -7 2>/dev/null)" ]; then
  echo "making a minimal Debian" >&2
  mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' | grep 'deb.*debian' | grep -v security | head -1)
  mmdebstrap --mode=root --variant=minbase bookworm "$roots/minbase.new.tar" "deb $mirror bookworm main" "deb $mirror bookworm-updates main" \
    >"$roots/minbase.log" 2>&1 || { tail -30 "$roots/minbase.log" >&2; exit 1; }
  mv "$roots/minbase.new.tar" "$tar"
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
