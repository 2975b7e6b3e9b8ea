#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# bare.sh [FINDING.sh...]: each finding, all by default, twice, each time in a fresh minimal Debian 12 (tests/package/fresh.sh; root, network).
# Prints a line for each run: round, finding, exit status, seconds. Exit status 1: one is not as seen.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")"
[ $# -gt 0 ] || set -- $(ls -- *.sh | grep -v -x -e common.sh -e bare.sh)
# Packages that not every finding needs, by the helper of common.sh that it calls.
more=""
while read -r helper packages; do
  ! grep -q "^$helper " "${@##*/}" || more+=" $packages"
done <<'EOF'
npm_packages npm
go_modules golang-go
crates cargo-web
maven_artifacts maven default-jdk-headless
EOF
code=0
for round in 1 2; do
  # What the scripts need beside those: Python for most, g++ for tf2, ip for a network of its own, GLib for LCM, libusb for librealsense. This computer's
  # authorities, as that of a company's proxy, are made the bare system's: Java and Debian's cargo heed no SSL_CERT_FILE.
  ../tests/package/fresh.sh --bind "$PWD:/findings" bash -uc '
    authorities=/usr/local/share/ca-certificates
    mkdir -p $authorities
    [ -z "${SSL_CERT_FILE:-}" ] || awk -v to=$authorities "/BEGIN CERT/ { file = to \"/desk\" ++n \".crt\" } file { print >file } /END CERT/ { close(file) }" "$SSL_CERT_FILE"
    apt-get -qq update && DEBIAN_FRONTEND=noninteractive apt-get -qq install --no-install-recommends \
      python3 python3-venv python3-pip g++ libc6-dev iproute2 libglib2.0-0 libusb-1.0-0 ca-certificates $2 >/tmp/apt.log 2>&1 || { tail -20 /tmp/apt.log >&2; exit 1; }
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
