# SPDX-License-Identifier: Apache-2.0
# In a guest: the test's folder into memory, then drive.sh as on any target; what it leaves goes back to the desk.
# A second that is longer than the processor's own: the timer that wakes has the same one.
khz=$(sed -n 's/.*tsc_early_khz=\([0-9]*\).*/\1/p' /proc/cmdline)
[ -z "$khz" ] || modprobe guest_second factor_permille=$((khz / 1000)) 2>/dev/null || echo "guest: without guest_second; the desk takes longer"
mkdir -p /run/test
mount -t tmpfs -o size=90% tmpfs /run/test
tar -C /run/test -xf /host/test.tar || exit 1
bash /run/test/target/drive.sh </dev/null
code=$?
cp -r /run/test/out/. /host/out/
exit $code
