#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# wheel.sh BUILD OUT [PYTHON]: the Python package with libwaymark.so of a build and the libraries that it needs, for computers of
# this kind with glibc 2.36 or later. PYTHON has hatchling (default: that of the judges, .cache/venv).
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/../.."
build=$(readlink -f "$1") out=$(readlink -m "$2") python=${3:-$PWD/.cache/venv/bin/python}
[ -e "$build/lib/libwaymark.so.0" ] || { echo "wheel.sh: $build has no lib/libwaymark.so.0: cmake --build it (target wm_shared)" >&2; exit 2; }
native=$(mktemp -d)
trap 'rm -r "$native"' EXIT
strip -o "$native/libwaymark.so.0" "$build/lib/libwaymark.so.0"
# The rest of what it needs is on every such computer.
ldd "$native/libwaymark.so.0" | awk '$1 ~ /^lib(yaml|png|turbojpeg|apriltag)/ {print $3}' | xargs -I{} cp -L {} "$native/"
export WAYMARK_NATIVE=$native WAYMARK_PLATFORM=manylinux_2_36_$(uname -m)
cd tools/python && "$python" -m hatchling build -t wheel -d "$out"
