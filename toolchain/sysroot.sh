#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The headers and libraries of another architecture's Debian, unpacked into .cache/sysroot/ARCH: what the toolchain files
# compile against and what qemu-user runs with. Packages come from this machine's own Debian sources by an apt with its
# own state beside the sysroot: the host's package state is neither read nor written, and root is not needed.
# Run again after a failure: what was fetched stays. A sysroot that is complete and asked for nothing new is left alone.
set -euo pipefail

arch=${1:-}
case "$arch" in
  arm64 | armhf) ;;
  *) echo "usage: ./dev sysroot arm64|armhf" >&2; exit 2 ;;
esac
cd "$(dirname "$(readlink -f "$0")")/.."

# What a board's build includes and links. Embree is the desk's (pictures of the simulator).
packages=(libc6-dev libstdc++-12-dev libeigen3-dev liblcm-dev libyaml-dev libturbojpeg0-dev libpng-dev zlib1g-dev libapriltag-dev
  nlohmann-json3-dev libcli11-dev libmicrohttpd-dev libhpdf-dev)
# For 64-bit boards on Debian 12 whose cameras are behind an image processor (presets arm64 and odroid-m1).
[ "$arch" = armhf ] || packages+=(libcamera-dev)

mkdir -p .cache/sysroot
root=$(readlink -f .cache/sysroot)/$arch
work=$root.apt # apt's state and the packages as fetched
stamp=$root/.complete
say() { printf '\033[1m== %s\033[0m\n' "$*"; }
fail() { echo "./dev sysroot $arch: $*" >&2; exit 1; }

exec 9>"$root.lock"
flock -n 9 || { say "another ./dev sysroot $arch is at work: waiting for it"; flock 9; }
complete="${packages[*]} and their database"
[ "$(cat "$stamp" 2>/dev/null)" = "$complete" ] && exit 0

# ── an apt of its own ───────────────────────────────────────────────────────────────────────────────────────────────
apt() { env APT_CONFIG="$work/apt.conf" apt-get -q "$@"; }
say "sysroot $arch: package lists"
bash toolchain/foreign-apt.sh "$arch" "$work" ||
  fail "the package lists of $arch could not be fetched (above). Is the mirror reachable? Run this again: it goes on where it stopped."

enter() { # PACKAGE.deb : into the sysroot's own database of packages, by which dpkg-shlibdeps knows whose a library is
  local info=$root.new/var/lib/dpkg/info/$(dpkg-deb -f "$1" Package) control
  control=$(mktemp -d)
  dpkg-deb -e "$1" "$control"
  for file in shlibs symbols; do [ ! -e "$control/$file" ] || cp "$control/$file" "$info.$file"; done
  rm -r "$control"
  dpkg-deb --fsys-tarfile "$1" | tar -t | sed "s#^\./*#$root/#; s#/\$##" >"$info.list"
  { dpkg-deb -f "$1"; printf 'Status: install ok installed\n\n'; } >>"$root.new/var/lib/dpkg/status"
}

# ── fetch, unpack ───────────────────────────────────────────────────────────────────────────────────────────────────
# All of them: apt does not list packages that are in its archives, so it looks into an empty folder.
mkdir -p "$work/empty/partial"
apt -o Dir::Cache::Archives="$work/empty" --no-install-recommends -y --print-uris install "${packages[@]}" >"$work/uris" 2>"$work/install.log" ||
  { cat "$work/install.log" >&2; fail "the packages do not fit together (above)"; }
total=$(grep -c "^'" "$work/uris")
say "sysroot $arch: $total packages"
apt --no-install-recommends -y --download-only install "${packages[@]}" >"$work/install.log" 2>&1 || {
  grep -E '^(E|W):' "$work/install.log" >&2
  fail "fetching stopped (above). Run this again: it goes on where it stopped."
}
rm -rf "$root.new"
mkdir -p "$root.new"/var/lib/dpkg/info
count=0
for name in $(awk "/^'/{print \$2}" "$work/uris"); do
  count=$((count + 1))
  [ -t 1 ] && printf '\r%3d/%d %-60.60s' "$count" "$total" "$name"
  dpkg-deb -x "$work/archives/$name" "$root.new" && enter "$work/archives/$name" ||
    fail "$name cannot be unpacked: remove $work/archives/$name and run this again"
done
[ -t 1 ] && printf '\r%70s\r' ''
# Links to absolute paths point into the host: make them relative.
find "$root.new" -type l -lname '/*' | while read -r link; do
  target=$root.new$(readlink "$link")
  [ -e "$target" ] && ln -sfr "$target" "$link"
done || true
echo "$complete" >"$root.new/.complete"
rm -rf "$root"
mv "$root.new" "$root"
say "sysroot $arch: $(du -sh "$root" | cut -f1) in .cache/sysroot/$arch"
