#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# bare.sh [FINDING.sh...]: each finding, all by default, twice, each time in a fresh minimal Debian 12 (tests/package/fresh.sh; root, network).
# Prints a line for each run: round, finding, exit status, seconds. Exit status 1: one is not as seen.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")"
[ $# -gt 0 ] || set -- $(ls -- *.sh | grep -v -x -e common.sh -e bare.sh)
more=""
! grep -q ^go_modules "${@##*/}" || more+=" golang-go"
code=0
for round in 1 2; do
  # All that the scripts need: Python for most, npm for packages of npm, g++ for tf2, ip for a network of its own, GLib for LCM, libusb for librealsense, Go where one asks for it.
  ../tests/package/fresh.sh --bind "$PWD:/findings" bash -uc '
    apt-get -qq update && DEBIAN_FRONTEND=noninteractive apt-get -qq install --no-install-recommends \
      python3 python3-venv python3-pip npm g++ libc6-dev iproute2 libglib2.0-0 libusb-1.0-0 ca-certificates $2 >/tmp/apt.log 2>&1 || { tail -20 /tmp/apt.log >&2; exit 1; }
    round=$1 code=0
    shift 2
    for name in "$@"; do
      begin=$SECONDS status=0
      "/findings/$(basename "$name")" >/tmp/said 2>&1 || status=$?
      echo "$round $name $status $((SECONDS - begin)) s"
      [ $status -eq 0 ] || { code=1; sed "s/^/    /" /tmp/said | tail -20; }
    done
    exit $code' bash "$round" "$more" "$@" || code=1
done
exit $code
