#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The time of the sources, as SOURCE_DATE_EPOCH has it: of the commit, outside of a repository of the newest version in
# toolchain/package/changelog.
set -eu
here=$(dirname "$(readlink -f "$0")")
if [ -e "$here/../.git" ] && git -C "$here" log -1 --format=%ct 2>/dev/null; then exit; fi
date -d "$(sed -n 's/^ -- .*>  //p' "$here/package/changelog" | head -1)" +%s
