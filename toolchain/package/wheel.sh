#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# wheel.sh BUILD OUT [PYTHON]: the Python package with libwaymark.so of a build and the libraries that it needs, for computers of
# the build's kind with glibc 2.36 or later. A board's build takes them from its sysroot. PYTHON has hatchling (default: that of
# the judges, .cache/venv).
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/../.."
build=$(readlink -f "$1") out=$(readlink -m "$2") python=${3:-$PWD/.cache/venv/bin/python}
library=$build/lib/libwaymark.so.0
[ -e "$library" ] || { echo "wheel.sh: $build has no lib/libwaymark.so.0: cmake --build it (target wm_shared)" >&2; exit 2; }
tool() { sed -n "s/^CMAKE_$1:FILEPATH=//p" "$build/CMakeCache.txt"; }
case $("$(tool READELF)" -h "$library" | sed -n 's/^ *Machine: *//p') in
  *X86-64*) machine=x86_64 debian=amd64 ;;
  AArch64) machine=aarch64 debian=arm64 ;;
  *) echo "wheel.sh: there are wheels for x86-64 and arm64 alone" >&2; exit 2 ;;
esac
root=""
[ "$machine" = "$(uname -m)" ] || root=$(readlink -f .cache/sysroot)/$debian
native=$(mktemp -d)
trap 'rm -r "$native"' EXIT
"$(tool STRIP)" -o "$native/libwaymark.so.0" "$library"
# The rest of what it needs is on every such computer.
needed=$("$(tool READELF)" -d "$library" | sed -nE 's/.*NEEDED.*\[(lib(yaml|png|turbojpeg|apriltag)[^]]*)\].*/\1/p')
for name in $needed; do cp -L "$root/usr/lib/$machine-linux-gnu/$name" "$native/"; done
export WAYMARK_NATIVE=$native WAYMARK_PLATFORM=manylinux_2_36_$machine
cd tools/python && "$python" -m hatchling build -t wheel -d "$out"
