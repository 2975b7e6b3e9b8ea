#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# The systemd units: well formed, with a tight sandbox, without a capability; the run never gives up, the page is this computer's.
set -u
command -v systemd-analyze >/dev/null || { echo "systemd-analyze is not there: skipped"; exit 77; }
failures=0
fail() { echo "$1"; failures=$((failures + 1)); }
has() { # UNIT LINE...
  local unit=$1 line said
  systemd-analyze security --offline=true --no-pager --threshold=20 "$unit" >/dev/null 2>&1 || fail "$unit: exposure above 2.0"
  said=$(systemd-analyze --no-pager verify "$unit" 2>&1 | grep -F "${unit##*/}" | grep -vE "is not executable|man page")
  [ -z "$said" ] || fail "$said"
  for line in CapabilityBoundingSet= StartLimitIntervalSec=0 RestartPreventExitStatus=2 "${@:2}"; do
    grep -qx -- "$line" "$unit" || fail "$unit has no line $line"
  done
}
has config/waymark.service Type=notify Restart=always
has config/waymark-web.service IPAddressDeny=any User=waymark 'ExecStart=.* --listen 127\.0\.0\.1:8080'
exit $((failures > 0))
