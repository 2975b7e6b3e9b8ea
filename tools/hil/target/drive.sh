#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# On a target, in the test's folder: a recording played into this computer's own interfaces, into `waymark run`, with what it needs to be
# judged at the desk in out/. Needs Waymark, and what `waymark doctor` asks for. The desk wrote plan.sh:
#   waymark  the commands      program  of the run           seconds  of the recording        play     words of `waymark play`
#   buses    RUN=PLAYER ...    bitrate  bit/s   has_fd 1: FD    cameras  devices
#   where    local guest host  played   1: the program has a recording in the place of the kernel's drivers
#   url      of LCM            priority of the estimator        faults   1: faults.sh has those that happen to the computer
#   record   1: beside the run
#   from_s   of the recording  lead_s   before the first datum  plays    0: nothing is left for the player
# It ends when standard input does: then the desk is gone. Whatever ends it, interfaces, modules and processes are as before.
set -u
cd "$(dirname "$(readlink -f "$0")")/.." || exit 2
. ./plan.sh
mkdir -p out state
ulimit -c 0
ulimit -R 3000000 2>/dev/null # us: a real-time process that never sleeps is ended, and the computer goes on
fails=0
fail() {
  echo "HIL fail $*"
  echo "$*" >>out/failures
  fails=$((fails + 1))
}
step() { echo "HIL step $*"; }
# CLOCK_MONOTONIC in ns. /proc/uptime counts a suspended computer's time, too: it is right where timer_list may not be read and nothing slept.
now_ns() {
  local t
  t=$(awk '/^now at/ {print $3; exit}' /proc/timer_list 2>/dev/null)
  [ -n "$t" ] || t=$(awk '{printf "%.0f", $1 * 1e9}' /proc/uptime)
  echo "$t"
}

# ── this computer as it was ─────────────────────────────────────────────────────────────────────────────────────────
undo=()
later() { undo=("$*" "${undo[@]}"); } # a command that takes a step back, when all ends
processes=()
begun() { processes+=("$1"); }
clean_up() {
  trap '' INT TERM HUP PIPE
  local process command
  for process in "${processes[@]}" $(cat state/pids 2>/dev/null); do kill -TERM "$process" 2>/dev/null; done
  sleep 0.3
  for process in "${processes[@]}" $(cat state/pids 2>/dev/null); do kill -KILL "$process" 2>/dev/null; done
  for command in "${undo[@]}"; do eval "$command" >>out/undo.txt 2>&1; done
}
trap 'clean_up' EXIT
trap 'exit 130' INT TERM HUP PIPE
if [ "$where" = host ]; then
  (cat >/dev/null; kill -TERM $$ 2>/dev/null) <&0 & # the desk is gone
  begun $!
fi

# ── interfaces ──────────────────────────────────────────────────────────────────────────────────────────────────────
as_root() { if [ "$(id -u)" = 0 ]; then "$@"; else sudo -n "$@"; fi; }
module() { # NAME [OPTION...]: loaded, and taken out again where it was not there
  [ -e "/sys/module/$1" ] && return 0
  as_root modprobe "$@" 2>>out/modules.txt || return 1
  later as_root rmmod "$1"
}

bus_up() { # RUN PLAYER
  local run=$1 player=$2
  if [ -e "/sys/class/net/$run" ] && [ -e "/sys/class/net/$player" ]; then return 0; fi # a real adapter, which is up, or the doctor finds it
  module vcan || { fail "no CAN: this kernel has no module vcan (Debian: linux-image-$(uname -r) has it), and $run is not there"; return 1; }
  as_root ip link add dev "$run" type vcan || { fail "the virtual interface $run cannot be made"; return 1; }
  later as_root ip link del "$run"
  [ "$has_fd" = 0 ] || as_root ip link set "$run" mtu 72
  as_root ip link set "$run" up
}

guest_buses() { # the guest's own controllers, two on each bus: one receives, one plays
  local i=0 pair
  [ "$has_fd" = 0 ] || return 1
  modprobe kvaser_pci && modprobe can-raw || return 1
  for pair in $buses; do
    [ -e "/sys/class/net/can$((i + 1))" ] || return 1
    i=$((i + 2))
  done
  # Other names first, so that two interfaces never change places.
  i=0
  for pair in $buses; do
    ip link set "can$i" name "hil$i" && ip link set "can$((i + 1))" name "hil$((i + 1))" || return 1
    i=$((i + 2))
  done
  i=0
  for pair in $buses; do
    ip link set "hil$i" name "${pair%=*}" && ip link set "hil$((i + 1))" name "${pair#*=}" || return 1
    i=$((i + 2))
    for one in "${pair%=*}" "${pair#*=}"; do
      ip link set "$one" up type can bitrate "$bitrate" restart-ms 100 && ip link set "$one" txqueuelen 2000 || return 1
    done
  done
}

interfaces() {
  local pair numbers="" device
  [ "$played" = 0 ] || return 0
  if [ "$where" = guest ] && [ -n "$buses" ] && ! guest_buses; then
    for pair in $buses; do bus_up "${pair%=*}" "${pair#*=}"; done
  elif [ "$where" != guest ]; then
    for pair in $buses; do bus_up "${pair%=*}" "${pair#*=}" || return 1; done
  fi
  [ -n "$cameras" ] || return 0
  for device in $cameras; do numbers=$numbers,${device#/dev/video}; done
  if [ -e /sys/module/v4l2loopback ]; then
    fail "v4l2loopback is loaded already: end what uses it, then \`rmmod v4l2loopback\`"
    return 1
  fi
  module v4l2loopback video_nr="${numbers#,}" exclusive_caps=0 max_buffers=4 card_label="$(seq -s, -f 'recorded %g' "$(wc -w <<<"$cameras")")" ||
    { fail "no cameras: this kernel has no module v4l2loopback (Debian: apt install v4l2loopback-dkms)"; return 1; }
  for device in $cameras; do
    for _ in $(seq 50); do [ -w "$device" ] && break; sleep 0.1; done
    [ -w "$device" ] || { fail "$device does not come, or may not be written"; return 1; }
  done
}

# ── what is measured beside the run ─────────────────────────────────────────────────────────────────────────────────
mkfifo state/idle && exec {idle}<>state/idle # nothing comes: `read -t` on it sleeps without a process
nap() { read -rt "$1" _ <&"$idle"; }

sample_computer() { # T
  local file value name
  for file in /sys/class/thermal/thermal_zone*/temp; do
    [ -r "$file" ] && read -r value <"$file" && echo "$1 temperature ${file//[^0-9]/} $value"
  done
  for file in /sys/devices/system/cpu/cpu[0-9]*/cpufreq/scaling_cur_freq; do
    [ -r "$file" ] && read -r value <"$file" && name=${file#/sys/devices/system/cpu/cpu} && echo "$1 clock ${name%%/*} $value"
  done
  read -r value <<<"$(</proc/loadavg)"
  echo "$1 load - ${value%% *}"
}
sample_process() { # T PID THREADS
  local key value rest task line comm
  while read -r key value rest; do
    case $key in VmRSS: | VmHWM:) echo "$1 memory ${key%:} $value" ;; esac
  done <"/proc/$2/status" 2>/dev/null
  [ "$3" = 1 ] || return 0
  for task in /proc/"$2"/task/[0-9]*; do
    read -r line <"$task/stat" 2>/dev/null || continue
    comm=${line#*(} comm=${comm%)*} line=${line##*) }
    # shellcheck disable=SC2086
    set -- "$1" "$2" "$3" $line
    echo "$1 cpu ${comm// /_}:${task##*/} $((${15} + ${16}))" # utime and stime, clock ticks
  done
}
sample() { # START_NS
  local round=0 t
  echo "# seconds since the start, what, of which, value; ticks a second: $(getconf CLK_TCK)"
  while :; do
    t=$((($(now_ns) - $1) / 10000000))
    t=$((t / 100)).$(printf %02d $((t < 0 ? -t % 100 : t % 100)))
    sample_computer "$t"
    [ -e state/pid ] && sample_process "$t" "$(<state/pid)" $((round % 5 == 0))
    round=$((round + 1))
    [ $((round % 3)) = 1 ] && echo "HIL at $t of $seconds" >&3
    nap 1
  done
}

wake_ups() { # cyclictest at the estimator's priority and usual period of 5 ms; without it the doctor measures the same
  if command -v cyclictest >/dev/null; then
    cyclictest -m -S -q -p "$priority" -i 5000 -D "${seconds%.*}" -h 100000 --json=out/cyclictest.json >/dev/null 2>&1 &
  else
    "$waymark" doctor --seconds "${seconds%.*}" --json >out/wake.json 2>/dev/null &
  fi
  begun $!
  wake=$!
}

# ── the run ─────────────────────────────────────────────────────────────────────────────────────────────────────────
start_run() {
  local out=out/drive
  if grep -qs ' disk_full ' faults.plan && mkdir -p out/disk; then # a disk of its own, which a fault fills
    if as_root mount -t tmpfs -o size=512m tmpfs out/disk 2>/dev/null; then
      later "cp -r out/disk/drive* out/; as_root umount out/disk; rmdir out/disk"
      as_root chown "$(id -u)" out/disk
      out=out/disk/drive
    else
      rmdir out/disk
    fi
  fi
  [ "$played" = 0 ] || export WM_PLAYED=$PWD/played
  local more=()
  [ "$record" = 0 ] || more=(--record out/recorded)
  "$program" run --config robot.yaml --out "$out" "${more[@]}" >>out/said.txt 2>&1 &
  run=$!
  begun "$run"
  echo "$run" >state/pid
  echo "$run" >>state/pids
  up=""
  for _ in $(seq 600); do
    [ -s "$out/events.wmlog" ] && up=1 && return 0
    kill -0 "$run" 2>/dev/null || break
    sleep 0.1
  done
  wait "$run"
  fail "waymark run ends at once with exit code $?: $(tail -1 out/said.txt)"
  return 1
}

step interfaces
interfaces || exit 1
step doctor
ip route show 2>/dev/null | grep -qE '^(default|224|239)' || { [ "$where" = local ] && ip route add 224.0.0.0/4 dev lo; }
"$waymark" doctor robot.yaml --json --seconds 1 >out/doctor.json 2>out/doctor.txt
{
  uname -srvm
  "$waymark" --version
  awk -F': ' '/^(model name|Model|Hardware|CPU part)/ {print $2; exit}' /proc/cpuinfo
  nproc
  [ -r /proc/device-tree/model ] && tr -d '\0' </proc/device-tree/model && echo
} >out/computer.txt 2>/dev/null
step warm
for tool in "$waymark check robot.yaml" "$waymark play --help" "$waymark watch --help" "chrt -h" "cyclictest --help"; do $tool >/dev/null 2>&1; done
[ "$where" = guest ] || find -L recording files robot.yaml played -type f -exec cat {} + >/dev/null 2>&1 # a guest has them in memory

step listen
"$waymark" watch --log out/heard.lcm --url "$url" >out/watch.txt 2>&1 &
logger=$!
begun "$logger"
step begin
start_run || exit 1
start_ns=$(($(now_ns) + ${lead_s}000000000))
echo "$start_ns" >out/start_ns
if [ "$played" = 1 ]; then
  awk -v start="$start_ns" -v from="$from_s" 'BEGIN {printf "%.0f\n", start - from * 1e9}' >played/begin.new && mv played/begin.new played/begin
fi
if [ "$plays" = 1 ]; then
  "$waymark" play recording "${play[@]}" --start-at "$start_ns" --json out/played.json >out/played.txt 2>&1 &
else # all of it comes from the place of drivers
  sleep "$((lead_s + ${seconds%.*} + 1))" &
fi
player=$!
begun "$player"
sample "$start_ns" 3>&1 >out/samples.txt &
begun $!
if [ "$faults" = 1 ]; then
  . ./target/faults.sh
  break_things "$(awk -v start="$start_ns" -v from="$from_s" 'BEGIN {printf "%.0f", start - from * 1e9}')" &
  breaker=$!
  begun "$breaker"
fi
wake_ups
nap $((lead_s - 2))
# The sending thread alone: what reads and decodes is seconds ahead, and would keep it waiting at the same priority.
[ "$plays" = 0 ] || for task in /proc/"$player"/task/[0-9]*; do
  [ "$(<"$task/comm")" != wm-play-send ] || chrt -f -p 45 "${task##*/}" >/dev/null 2>&1
done
step drive
wait "$player"
code=$?
[ "$code" = 0 ] || fail "waymark play: exit code $code: $(tail -1 out/played.txt)"
[ "$faults" = 0 ] || wait "$breaker"
nap 2.5 # what is late is fused, too
run=$(<state/pid)
step end
wait "$wake"
[ ! -r "/proc/$run/stat" ] || sample_process "$seconds" "$run" 1 >>out/last.txt
kill -TERM "$run" 2>/dev/null
for _ in $(seq 200); do
  [ -e "/proc/$run" ] && [ "$(awk '{print $3}' "/proc/$run/stat" 2>/dev/null)" != Z ] || break
  sleep 0.1
done
if [ -e state/again ]; then code=0; else wait "$run"; code=$?; fi
echo "$code" >out/exit_code
kill -TERM "$logger" 2>/dev/null
wait "$logger"
for one in $buses; do
  [ "$played" = 1 ] || [ ! -e "/sys/class/net/${one%=*}" ] || echo "${one%=*} $(<"/sys/class/net/${one%=*}/statistics/rx_errors") $(<"/sys/class/net/${one%=*}/statistics/rx_packets")"
done >out/buses.txt
step done
exit $((fails > 0))
