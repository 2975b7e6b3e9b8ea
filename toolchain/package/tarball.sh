#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# tarball.sh BUILD NAME OUT: what a portable build installs for the robot, stripped, as OUT/NAME.tar.xz with one folder NAME.
# The same build gives the same bytes.
set -euo pipefail
build=$1 name=$2 out=$3
mkdir -p "$out"
stage=$(mktemp -d)
trap 'rm -r "$stage"' EXIT
cmake --install "$build" --prefix "$stage/$name" --component runtime --strip >/dev/null
cp "$(dirname "$(readlink -f "$0")")/PORTABLE" "$stage/$name/README"
tar -C "$stage" --sort=name --mtime=@1763683200 --owner=0 --group=0 --numeric-owner --mode=u+w,go-w -cJf "$out/$name.tar.xz" "$name"
echo "$out/$name.tar.xz"
