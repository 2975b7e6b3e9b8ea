#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# portable.sh amd64|arm64|armhf: the libraries that only Debian's shared ones have, as static ones in .cache/portable/ARCH, for
# the build that needs nothing of the board's image (WM_PORTABLE, docs/boards.md). LCM and AprilTag are compiled from Debian's
# sources; GLib and PCRE, which LCM uses, come from Debian's -dev packages and go into the same liblcm.a.
set -euo pipefail

arch=${1:-}
case "$arch" in
  amd64) triplet=x86_64-linux-gnu prefix= ;;
  arm64) triplet=aarch64-linux-gnu prefix=$triplet- ;;
  armhf) triplet=arm-linux-gnueabihf prefix=$triplet- ;;
  *) echo "usage: portable.sh amd64|arm64|armhf" >&2; exit 2 ;;
esac
cd "$(dirname "$(readlink -f "$0")")/.."
mkdir -p .cache/portable
base=$(readlink -f .cache/portable)
out=$base/$arch
say() { printf '\033[1m== %s\033[0m\n' "$*"; }
fail() { echo "portable.sh $arch: $*" >&2; exit 1; }

exec 9>"$base/lock"
flock 9
recipe=$(sha256sum <toolchain/portable.sh) # another recipe makes them anew
[ "$(cat "$out/.complete" 2>/dev/null)" = "$recipe" ] && exit 0
work=$base/$arch.work
rm -rf "$work"
mkdir -p "$work" "$base/sources"

# ── sources: from this machine's Debian archive, checked by apt against its signed index ─────────────────────────────
if [ ! -e "$base/sources/.complete" ]; then
  say "sources of LCM and AprilTag"
  state=$base/sources/apt
  mkdir -p "$state/lists/partial"
  for file in /etc/apt/sources.list.d/*.sources; do [ -e "$file" ] && sed 's/^Types:.*/Types: deb-src/' "$file"; done >"$state/debian.sources"
  sed -n 's/^deb /deb-src /p' /etc/apt/sources.list 2>/dev/null >"$state/one-line.list" || true
  list=$state/debian.sources
  [ -s "$list" ] || list=$state/one-line.list
  src=(apt-get -q -o Dir::Etc::sourcelist="$list" -o Dir::Etc::sourceparts=- -o Dir::State::lists="$state/lists" -o APT::Sandbox::User=root)
  "${src[@]}" update >"$state/log" 2>&1 || { cat "$state/log" >&2; fail "the index of sources could not be fetched (above)"; }
  (cd "$base/sources" && "${src[@]}" source --download-only --tar-only lcm apriltag >"$state/log" 2>&1) ||
    { cat "$state/log" >&2; fail "the sources could not be fetched (above)"; }
  touch "$base/sources/.complete"
fi
for tar in "$base"/sources/*.orig.tar.*; do tar -C "$work" -xf "$tar"; done

say "GLib's and PCRE's static libraries ($arch)"
if [ "$arch" != amd64 ]; then
  bash toolchain/sysroot.sh "$arch"
  export APT_CONFIG=$base/../sysroot/$arch.apt/apt.conf
fi
(cd "$work" && apt-get -q -o APT::Sandbox::User=root download libglib2.0-dev libpcre2-dev >apt.log 2>&1) || { cat "$work/apt.log" >&2; fail "not to be had (above)"; }
unset APT_CONFIG
for deb in "$work"/*.deb; do dpkg-deb -x "$deb" "$work/deb"; done

# ── what the static libraries are made of ────────────────────────────────────────────────────────────────────────────
compile() { # FOLDER CFLAGS... -- SOURCE...: objects into FOLDER, without fused multiply-add: a marker is where other machines see it
  local folder=$1 flags=()
  shift
  while [ "$1" != -- ]; do flags+=("$1"); shift; done
  shift
  mkdir -p "$folder"
  for source in "$@"; do
    "${prefix}gcc" -O2 -g0 -fPIE -w -ffp-contract=off -D_FILE_OFFSET_BITS=64 -ffile-prefix-map="$work=." "${flags[@]}" -c "$source" -o "$folder/$(basename "$source" .c).o"
  done
}

say "LCM and AprilTag ($arch)"
lcm=$(echo "$work"/lcm-*/lcm)
# Names of hosts (in a URL of LCM's TCP way) would need the image's own resolver, which a static program can't load.
compile "$work/lcm.o" -I"$lcm" -I"$work/deb/usr/include/glib-2.0" -I"$work/deb/usr/lib/$triplet/glib-2.0/include" \
  -Dgethostbyname=wm_host_by_number -- "$lcm"/*.c "$lcm"/lcmtypes/*.c toolchain/package/host_by_number.c
tags=$(echo "$work"/apriltag-*)
compile "$work/apriltag.o" -I"$tags" -- $(ls "$tags"/*.c "$tags"/common/*.c | grep -v pywrap)

rm -rf "$out"
mkdir -p "$out/lib" "$out/include"
"${prefix}ar" rcsD "$out/lib/libapriltag.a" "$work"/apriltag.o/*.o
"${prefix}ar" rcsD "$work/liblcm.a" "$work"/lcm.o/*.o
"${prefix}ar" -M <<EOT
create $out/lib/liblcm.a
addlib $work/liblcm.a
addlib $work/deb/usr/lib/$triplet/libglib-2.0.a
addlib $work/deb/usr/lib/$triplet/libpcre2-8.a
save
end
EOT
mkdir -p "$out/include/lcm" "$out/include/apriltag/common"
cp "$lcm"/*.h "$lcm"/*.hpp "$out/include/lcm"
cp "$tags"/*.h "$out/include/apriltag"
cp "$tags"/common/*.h "$out/include/apriltag/common"
rm -rf "$work"
echo "$recipe" >"$out/.complete"
