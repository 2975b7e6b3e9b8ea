# SPDX-License-Identifier: Apache-2.0
# In a guest: the test's folder into memory, then drive.sh as on any target; what it leaves goes back to the desk.
mkdir -p /run/test
mount -t tmpfs -o size=90% tmpfs /run/test
tar -C /run/test -xf /host/test.tar || exit 1
bash /run/test/target/drive.sh </dev/null
code=$?
cp -r /run/test/out/. /host/out/
exit $code
