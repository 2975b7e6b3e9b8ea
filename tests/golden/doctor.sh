#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# doctor.sh WAYMARK CONFIG_ETC: the doctor on this computer, with five things broken on purpose, and with them in order again.
set -u
waymark=$(readlink -f "$1")
[ "$(id -u)" = 0 ] && unshare -n true 2>/dev/null || { echo "no right to a network of its own: skipped"; exit 77; }
setpriv --reuid=65534 --clear-groups true 2>/dev/null || { echo "no other user here (an emulator's namespace has one): skipped"; exit 77; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
chmod 755 "$folder"
cp "$waymark" "$folder/waymark"
cp "$2"/vehicle.dbc "$2"/can-signals.yaml "$2"/calibration.yaml "$folder"
cd "$folder" || exit 1
cat >robot.yaml <<'YAML'
format: waymark-config/1
estimator: odometry
calibration: calibration.yaml
dbc: vehicle.dbc
can_signals: can-signals.yaml
devices:
  can: [{interface: can7}]
  cameras: [{name: front, device: /dev/nosuchvideo}]
YAML
failures=0
says() { grep -q "^$1 *$2  *.*$3" said.txt || { echo "the doctor doesn't say: $1 $2 $3"; cat said.txt; failures=$((failures + 1)); }; }

unshare -n bash -c 'ip link set lo up; ulimit -r 0 -l 64; setpriv --reuid=65534 --clear-groups --inh-caps=-all ./waymark doctor robot.yaml --seconds 0.2' >said.txt
[ $? = 1 ] || { echo "the exit code of a computer with faults isn't 1"; failures=$((failures + 1)); }
says bad lcm ""
says bad priority ""
says bad memory.lock ""
says bad can.can7 "no interface"
says bad camera.front "No such file"
[ "$(grep -c '^bad' said.txt)" = "$(grep -c '^bad.*; fix: ' said.txt)" ] || { echo "a finding without a fix"; cat said.txt; failures=$((failures + 1)); }

sed -i '/^devices/,$d' robot.yaml
unshare -n bash -c 'ip link set lo up; ip route add 224.0.0.0/4 dev lo; ./waymark doctor robot.yaml --seconds 0.2' >said.txt
says good lcm ""
says good priority ""
says good memory.lock ""
exit $((failures > 0))
