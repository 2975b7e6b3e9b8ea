#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# replay_drives.sh DRIVES WAYMARK: a line with the sum of the published poses and the trajectory for each drive of packages.sh, and of its event log again.
set -euo pipefail
drives=$1 waymark=$2
out=$(mktemp -d)
trap 'rm -r "$out"' EXIT
for name in crossing-points seabed-points loops-markers; do
  "$waymark" replay "$drives/$name" --config "$drives/$name.yaml" --out "$out/$name" >/dev/null 2>&1
  "$waymark" replay "$out/$name/events.wmlog" --out "$out/again" --force >/dev/null 2>&1
  cmp "$out/$name/trajectory.csv" "$out/again/trajectory.csv"
  (cd "$out/$name" && sha256sum published.csv trajectory.csv | sed "s|^|$name |")
  rm -r "$out/again"
done
