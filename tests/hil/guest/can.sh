# SPDX-License-Identifier: Apache-2.0
# In the guest: waymark on a real CAN controller's driver, fed by another one on the same bus. Everything is copied into
# memory and run once before it counts: under the instruction clock, waiting for the disk takes the guest's time.
set -u
cp -r /host/scenario /run/
cd /run/scenario || exit 1
modprobe -a kvaser_pci can-raw || exit 1
for tool in "lcm-logger --help" "canplayer -h" "cansend -h" "ip -s link" "waymark help"; do $tool >/dev/null 2>&1; done
cat can.log >/dev/null
fails=0
fail() { echo "FAIL: $*"; fails=$((fails + 1)); }
play() { canplayer -I can.log can1=can0; }
play_again_and_again() { while :; do play 2>/dev/null; sleep 0.2; done; }
# What happens when, on the clock that poses have.
mark() { echo "$1 $(cut -d' ' -f1 /proc/uptime)" >>/host/out/marks; }
up() { ip link set "$1" up type can bitrate 500000 restart-ms 100; ip link set "$1" txqueuelen 2000; }

echo "== the doctor on what is broken on purpose, and on what is in order"
says() { grep -q "^$1 *$2  *.*$3" doctor.txt || { fail "the doctor doesn't say: $1 $2 $3"; cat doctor.txt; }; }
echo -1 >/proc/sys/kernel/sched_rt_runtime_us
ip route del 224.0.0.0/4 dev lo
(ulimit -r 0 -l 64; setpriv --reuid=65534 --clear-groups --inh-caps=-all waymark doctor robot.yaml --seconds 0.5) >doctor.txt
for broken in "note throttling" "bad lcm" "bad priority" "bad memory.lock"; do says $broken ""; done
says bad can.can0 "is down"
echo 950000 >/proc/sys/kernel/sched_rt_runtime_us
ip route add 224.0.0.0/4 dev lo
up can0
up can1
waymark doctor robot.yaml --seconds 0.5 >doctor.txt
for whole in throttling lcm priority memory.lock; do says good $whole ""; done
says good kernel PREEMPT_RT
says good can.can0 "is up"

echo "== drive, with candump as a witness"
candump -L -T 6000 can0 >heard.log &
witness=$!
waymark run --config robot.yaml --out /run/drive --duration "$(cat duration)" &
run=$!
sleep 2
play
wait $run || fail "waymark run: exit code $?"
wait $witness
cp heard.log /host/out/
errors=$(cat /sys/class/net/can0/statistics/rx_errors)
[ "$errors" = 0 ] || fail "the controller lost frames: $errors"
cp -r /run/drive /host/out/

echo "== the interface goes down and up, the adapter is removed and comes back"
play_again_and_again &
player=$!
lcm-logger --lcm-url='udpm://239.255.76.67:7667?ttl=0' -q /run/heard.lcm &
logger=$!
sleep 1
waymark run --config robot.yaml --out /run/faults --duration 24 >faults.txt 2>&1 &
run=$!
sleep 5
mark down
ip link set can0 down
sleep 3
ip link set can0 up
mark up
sleep 4
device=$(readlink -f /sys/class/net/can0/device)
mark removed
echo 1 >"$device/remove"
sleep 3
echo 1 >/sys/bus/pci/rescan
sleep 1
up can0
mark back
wait $run || fail "waymark run among faults: exit code $?"
cat faults.txt
# A removed adapter's interface is heard to go down first, or it is gone at once.
for said in "can0 went down" "can0 receives again" "can0 is (gone \(No such device\)|not there \(adapter)" "can: is back"; do
  grep -qE "$said" faults.txt || fail "not said: $said"
done
kill $logger
wait $logger
cp -r /run/faults /host/out/
cp /run/heard.lcm faults.txt /host/out/faults/

echo "== killed and started again"
waymark run --config robot.yaml &
run=$!
sleep 5
kill -9 $run
wait $run
waymark run --config robot.yaml --duration 3 --out /run/restart >restart.txt 2>&1
cat restart.txt
grep -q "start: saved pose of" restart.txt || fail "a killed run doesn't begin where it was"
cp -r /run/restart /host/out/
ls /run/box
[ -s /run/box/died-0001-now.wmlog ] || fail "the black box of a killed run is not kept"
kill $player

echo "== bus-off, error-passive and restart, as error frames"
modprobe vcan && ip link add dev vcan0 type vcan && ip link set vcan0 up
sed 's/interface: can0/interface: vcan0/' robot.yaml >virtual.yaml
waymark run --config virtual.yaml --duration 5 >errors.txt 2>&1 &
run=$!
sleep 2
cansend vcan0 20000004#0010000000000000
cansend vcan0 20000040#0000000000000000
sleep 0.5
cansend vcan0 20000100#0000000000000000
wait $run || fail "waymark run among error frames: exit code $?"
cat errors.txt
for said in "error-passive" "bus-off" "is on the bus again"; do
  grep -qF "$said" errors.txt || fail "not said: $said"
done
exit $((fails > 0))
