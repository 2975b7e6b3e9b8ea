#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# try_packages.sh: in a fresh root of a system, with packages in /newer, those of the release before in /older, drives in /drives: tries what an owner of a robot
# does with them. The last line is "ROW built | installed | ...", of packages.sh's table; else the last line says what failed.
set -euo pipefail
export DEBIAN_FRONTEND=noninteractive
fail() { echo "$*"; exit 1; }
apt() { apt-get -q -y -o Dpkg::Options::=--force-confdef "$@" >>/tmp/apt.log 2>&1 || { tail -20 /tmp/apt.log; fail "apt-get $*: $(grep -E '^E:|Depends:' /tmp/apt.log | grep -v /dev/pts | tail -1)"; }; }
used_kb() { dpkg-query -W -f='${Installed-Size}\n' | awk '{kb += $1} END {print kb}'; }
named() { find / -xdev \( -path /proc -o -path /tmp -o -path /newer -o -path /older -o -path /drives -o -path /tests -o -path /sys -o -path /var/cache/apt \) -prune -o -iname '*waymark*' -print; }

apt-get -q update >/tmp/apt.log 2>&1 || fail "apt-get update: $(tail -1 /tmp/apt.log)"
apt install --no-install-recommends systemd iproute2 procps # a robot has them
. /etc/os-release
echo "== $PRETTY_NAME, $(uname -m)"

echo "== upgrade"
# The release before has packages of Debian 12. Where another system cannot have them, there is nothing to upgrade.
upgrade="no 0.2.0 for this system"
if apt-get -q -y install --no-install-recommends /older/waymark_*.deb >/tmp/older.log 2>&1; then
  waymark --version
  echo "# mine" >>/etc/waymark/robot.yaml
  mkdir -p /var/lib/waymark && echo "pose" >/var/lib/waymark/pose.yaml
  before=$(waymark --version)
  apt install --no-install-recommends /newer/waymark_*.deb
  [ "$(waymark --version)" != "$before" ] || fail "upgrade: still $before"
  tail -1 /etc/waymark/robot.yaml | grep -qx '# mine' || fail "upgrade: took the configuration"
  grep -qx pose /var/lib/waymark/pose.yaml || fail "upgrade: took the saved pose"
  upgrade="$before to $(waymark --version | cut -d' ' -f2), configuration and pose kept"
  apt purge --autoremove waymark
  [ -z "$(named)" ] || fail "purge after an upgrade left: $(named | xargs)"
else
  grep -m3 'Depends:' /tmp/older.log || tail -3 /tmp/older.log
fi

echo "== install"
kb=$(used_kb) count=$(dpkg-query -W | wc -l)
apt install --no-install-recommends /newer/waymark_*.deb
own=$(dpkg-query -W -f='${Installed-Size}' waymark)
added=$(($(used_kb) - kb - own)) packages=$(($(dpkg-query -W | wc -l) - count - 1))
waymark --version
depends=$(dpkg-query -W -f='${Depends}' waymark)
echo "$depends"
code=0
waymark doctor --seconds 1 || code=$?
[ $code -le 1 ] || fail "waymark doctor: exit code $code"

echo "== replays"
bash /tests/replay_drives.sh /drives waymark | tee /tmp/sums
cmp /tmp/sums /drives/expected || fail "other bits than on the computer that built: $(diff /tmp/sums /drives/expected | grep '^<' | cut -d' ' -f2 | sort -u | xargs)"
bits="yes, $(wc -l </tmp/sums) files"

echo "== services"
for unit in $(dpkg -L waymark | grep '\.service$'); do
  said=$(systemd-analyze --no-pager --man=no verify "$unit" 2>&1 | grep -F "${unit##*/}" || true)
  [ -z "$said" ] || fail "$unit: $said"
done
# The unit's own lines, as nobody without a right, in a network with a loopback alone.
unit=$(dpkg -L waymark | grep '/waymark\.service$')
command=$(sed -n 's/^ExecStart=//p' "$unit")
$(sed -n 's/^ExecStartPre=\(\/usr\/bin\/waymark .*\)/\1/p' "$unit") >/tmp/check.log 2>&1 || fail "ExecStartPre: $(tail -1 /tmp/check.log)"
unshare --net bash -euc '
  ip link set lo up
  eval "$(sed -n "s/^ExecStartPre=+-\(.*\)/\1/p" "$1")"
  install -d -o 65534 -g 65534 -m 0700 /var/lib/waymark
  setpriv --reuid 65534 --regid 65534 --clear-groups --no-new-privs --bounding-set=-all $2 --duration 8 >/tmp/run.log 2>&1 &
  run=$!
  sleep 2
  waymark watch --once
  wait $run' bash "$unit" "$command" || fail "the service's command: $(tail -1 /tmp/run.log)"
waymark config set /etc/waymark/robot.yaml --untried
ls /etc/waymark/robot.yaml.versions/*.yaml >/dev/null || fail "waymark config set: no version was kept"
services="verified; runs as nobody, health heard"

echo "== all packages"
apt install --no-install-recommends /newer/*.deb
all=$(dpkg-query -W -f='${db:Status-Abbrev} ${Package}\n' '*waymark*' | awk '$1 == "ii" {print $2}' | xargs)
for program in $(dpkg -L $all | grep '^/usr/bin/waymark'); do "$program" --help >/dev/null || fail "$program --help: exit code $?"; done
# A program of another, by pkg-config.
if [ -e /newer/libwaymark-dev_*.deb ] 2>/dev/null || ls /newer/libwaymark-dev_* >/dev/null 2>&1; then
  apt install --no-install-recommends gcc libc6-dev pkg-config
  for example in /usr/share/doc/libwaymark-dev/examples/*.c; do
    module=$(grep -q waymark_open "$example" && echo waymark-session || echo waymark)
    gcc -Wall -Werror -o /tmp/example "$example" $(pkg-config --cflags --libs "$module") || fail "$example: does not compile"
  done
  echo "compiled: $(ls /usr/share/doc/libwaymark-dev/examples/*.c | wc -l) examples"
fi

echo "== removal, purge"
apt remove $all
[ -e /etc/waymark/robot.yaml ] || fail "removal took the configuration"
[ ! -e /usr/bin/waymark ] || fail "removal left the program"
dpkg -P $all >>/tmp/apt.log 2>&1 || fail "dpkg -P: $(tail -1 /tmp/apt.log)" # those that have left nothing are gone for apt
[ -z "$(named)" ] || fail "purge left: $(named | xargs)"
echo "ROW yes: $(ls /newer/*.deb | wc -l) | $(wc -w <<<"$all") by apt | $bits | $services | $upgrade | yes | $own | $added in $packages packages | $(sed 's/, /; /g' <<<"$depends") |"
