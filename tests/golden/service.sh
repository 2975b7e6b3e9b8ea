#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# The systemd unit: well formed, with a tight sandbox, without a capability, and it never gives up.
set -u
unit=config/waymark.service
command -v systemd-analyze >/dev/null || { echo "systemd-analyze is not there: skipped"; exit 77; }
failures=0
fail() { echo "$1"; failures=$((failures + 1)); }
systemd-analyze security --offline=true --no-pager --threshold=20 "$unit" >/dev/null 2>&1 || fail "exposure above 2.0"
said=$(systemd-analyze --no-pager verify "$unit" 2>&1 | grep -F "waymark.service" | grep -vE "is not executable|man page")
[ -z "$said" ] || fail "$said"
for line in Type=notify CapabilityBoundingSet= StartLimitIntervalSec=0 RestartPreventExitStatus=2 Restart=always; do
  grep -qx "$line" "$unit" || fail "the unit has no line $line"
done
exit $((failures > 0))
