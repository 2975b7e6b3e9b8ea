# SPDX-License-Identifier: Apache-2.0
# By drive.sh: what happens to the computer and its processes, at the times of faults.plan. A line there is "NUMBER FROM UNTIL KIND A B TEXT":
# seconds since the recording's first datum, numbers of the fault, and a text ("-": none). What was done when is written to out/faults.txt; a fault that this
# target does not have is written there as "absent", with the reason.

wait_until() { # SECONDS since start_ns
  local left
  left=$(awk -v at="$1" -v start="$begin_ns" -v now="$(now_ns)" 'BEGIN {s = at - (now - start) * 1e-9; print (s > 0 ? s : 0)}')
  sleep "$left"
}
note() { echo "$1 $2 $(awk -v start="$begin_ns" -v now="$(now_ns)" 'BEGIN {printf "%.3f", (now - start) * 1e-9}') ${*:3}" >>out/faults.txt; }
bound() { awk -v a="$1" -v b="$2" 'BEGIN {printf "%.1f", b - a}'; } # seconds that a fault lasts

# fault_KIND begin|end A B TEXT: 0 done; else it prints why not.
fault_process_killed() {
  if [ "$1" = begin ]; then
    kill -KILL "$(<state/pid)"
    return 0
  fi
  local drives=(out/drive*)
  [ -d out/disk ] && drives=(out/disk/drive*)
  "$program" run --config robot.yaml --out "${drives[0]}-$((${#drives[@]} + 1))" >>out/said.txt 2>&1 &
  echo $! >state/pid
  echo $! >>state/pids
  : >state/again
}
fault_disk_full() {
  grep -q " $PWD/out/disk tmpfs " /proc/mounts || { echo "the run's folder is on no disk of its own: that takes root"; return 1; }
  if [ "$1" = end ]; then
    rm -f out/disk/full
    return 0
  fi
  # All but a piece at once; what is left to the end, as the run writes beside it.
  local room free_kb=${2%.*} rest=512
  room=$(df --output=avail -k out/disk | tail -1)
  [ "$room" -le $((free_kb + rest)) ] || fallocate -l $((room - free_kb - rest))K out/disk/full
  if [ "$free_kb" = 0 ]; then cat /dev/zero; else head -c "${rest}K" /dev/zero; fi >>out/disk/full 2>/dev/null
  return 0
}
fault_cpu_hogged() {
  local count=${3%.*} i
  [ "$1" = begin ] || return 0 # each has its own end
  [ "$count" -gt 0 ] || count=$(nproc)
  for i in $(seq "$count"); do
    timeout "$lasts_s" awk -v share="$2" 'BEGIN {
      for (;;) { # periods of about a tenth of a second
        for (i = 0; i < 1000000; i++) x += i
        if (share < 1) system("sleep " 0.05 * (1 - share) / share)
      }}' >/dev/null 2>&1 &
    echo $! >>state/pids
  done
}
fault_frequency_cap() {
  local policy least top done_=1
  for policy in /sys/devices/system/cpu/cpufreq/policy*; do
    [ -e "$policy/scaling_max_freq" ] || continue
    least=$(<"$policy/cpuinfo_min_freq") top=$(<"$policy/cpuinfo_max_freq")
    if [ "$1" = begin ]; then
      echo "as_root tee $policy/scaling_max_freq <<<$(<"$policy/scaling_max_freq")" >>state/caps
      awk -v top="$top" -v least="$least" -v share="$2" 'BEGIN {f = top * share; printf "%d\n", f < least ? least : f}' | as_root tee "$policy/scaling_max_freq" >/dev/null && done_=0
    fi
  done
  if [ "$1" = end ]; then
    . state/caps >/dev/null
    return 0
  fi
  [ "$done_" = 0 ] || echo "no clock rate can be set here (no cpufreq)"
  return "$done_"
}
fault_no_route() {
  local address=${url#*://}
  address=${address%%:*}
  if [ "$1" = begin ]; then as_root ip route add unreachable "$address/32"; else as_root ip route del unreachable "$address/32"; fi
}
fault_bad_config() {
  if [ "$1" = begin ]; then
    cp robot.yaml state/robot.yaml
    echo "an_unknown_key: 1" >>robot.yaml
    kill -HUP "$(<state/pid)"
    sleep 1
    cp state/robot.yaml robot.yaml
  fi
}
fault_bus_removed() {
  local one=${4%%,*} device
  [ "$one" != - ] || one=${buses%%=*}
  device=$(readlink -f "/sys/class/net/$one/device" 2>/dev/null)
  if [ "$1" = begin ] && [ -e "$device/remove" ]; then
    echo "$one" >state/removed
    echo 1 | as_root tee "$device/remove" >/dev/null
  elif [ "$1" = begin ]; then
    as_root ip link del "$one"
  elif [ -e state/removed ]; then
    local before after
    before=$(ls /sys/class/net)
    echo 1 | as_root tee /sys/bus/pci/rescan >/dev/null
    sleep 0.3
    after=$(ls /sys/class/net | grep -vxF "$before" | head -1)
    [ "$after" = "$one" ] || as_root ip link set "$after" name "$one"
    as_root ip link set "$one" up type can bitrate "$bitrate" restart-ms 100
  else
    as_root ip link add dev "$one" type vcan && as_root ip link set "$one" up
  fi
}
fault_power_cut() {
  echo "a power cut takes a target that can be switched off: ./dev hil power has one"
  return 1
}

one_fault() { # NUMBER FROM UNTIL KIND A B TEXT
  local number=$1 from=$2 until=$3 kind=$4 why lasts_s
  lasts_s=$(bound "$from" "$until")
  wait_until "$from"
  if ! why=$("fault_$kind" begin "${@:5}"); then
    note "$number" absent "${why:-it cannot be done}"
    return
  fi
  note "$number" begin
  wait_until "$until"
  "fault_$kind" end "${@:5}" >/dev/null
  note "$number" end
}

break_things() { # START_NS
  begin_ns=$1
  local line own=()
  while read -r -a line; do
    [ "${#line[@]}" -ge 4 ] || continue
    one_fault "${line[@]}" &
    own+=($!)
    echo $! >>state/pids
  done <faults.plan
  [ "${#own[@]}" = 0 ] || wait "${own[@]}"
}
