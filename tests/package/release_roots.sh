#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# release_roots.sh OUT [packages|wheel|source]...: tries the artefacts of ./dev release, each in a fresh minimal Debian (fresh.sh):
# - packages: apt installs all of them; every program starts; a drive is simulated, localized, judged; C programs are compiled against
#   the library; then the tutorials' commands with the installed programs, with their times;
# - wheel: in an empty venv, with its dependencies from PyPI; replays an event log, writes MCAP;
# - source: the tarball is built by ./dev build (WM_CCACHE=FOLDER shares a cache of the compiler) and replays a drive.
set -euo pipefail
here=$(dirname "$(readlink -f "$0")")
out=$(readlink -f "${1:?usage: release_roots.sh OUT [packages|wheel|source]...}")
parts=("${@:2}")
[ ${#parts[@]} -gt 0 ] || parts=(packages wheel source)
(cd "$out" && sha256sum --quiet --strict -c SHA256SUMS)
echo "the sums are right"

packages='
set -euo pipefail
export DEBIAN_FRONTEND=noninteractive
begin=$SECONDS
apt-get -qq update >/dev/null
apt-get -qq install -y --no-install-recommends /out/*.deb gcc libc6-dev pkg-config procps >/tmp/apt.log 2>&1 || { tail -20 /tmp/apt.log; exit 1; }
echo "== $((SECONDS - begin)) s: apt install of $(ls /out/*.deb | wc -l) packages"
mkdir /src && tar -C /src -xzf /out/waymark-*.tar.gz && cd /src/waymark-*
waymark --version
for command in init check simulate replay eval report diff map calibrate detect web batch compare mine import ros2; do
  waymark "$command" --help >/dev/null || { echo "waymark $command --help failed"; exit 1; }
done
waymark simulate config/worlds/crossing.yaml --no-video --out /tmp/drive >/dev/null
waymark replay /tmp/drive --config /usr/share/doc/waymark/examples/datasets/crossing-points.yaml --out /tmp/run >/dev/null
waymark replay /tmp/run/events.wmlog --out /tmp/again >/dev/null
cmp /tmp/run/trajectory.csv /tmp/again/trajectory.csv
waymark eval /tmp/run /tmp/drive | grep "position m"
for example in $(cd /usr/share/doc/libwaymark-dev/examples && ls *.c); do
  libraries=$(grep -l waymark_open "/usr/share/doc/libwaymark-dev/examples/$example" >/dev/null && echo waymark-session || echo waymark)
  gcc -Wall -o "/tmp/${example%.c}" "/usr/share/doc/libwaymark-dev/examples/$example" $(pkg-config --cflags --libs $libraries) && echo "compiled: $example"
done
failed=0
for page in landmarks board hil floor-plan tags; do
  begin=$SECONDS
  python3 tests/docs/tutorial.py docs/tutorials/$page.md /usr/bin && echo "== $((SECONDS - begin)) s: tutorial $page" || { echo "failed: tutorial $page"; failed=1; }
done
exit $failed'

wheel='
set -euo pipefail
export DEBIAN_FRONTEND=noninteractive
apt-get -qq update >/dev/null
apt-get -qq install -y --no-install-recommends python3 python3-venv /out/waymark_*.deb /out/waymark-tools_*.deb /out/waymark-sim_*.deb >/tmp/apt.log 2>&1 || { tail -20 /tmp/apt.log; exit 1; }
python3 -m venv /venv
/venv/bin/pip -q --disable-pip-version-check install /out/waymark-*.whl
mkdir /src && tar -C /src -xzf /out/waymark-*.tar.gz && cd /src/waymark-*
waymark simulate config/worlds/crossing.yaml --no-video --out /tmp/drive >/dev/null
waymark replay /tmp/drive --config config/datasets/crossing-points.yaml --out /tmp/run >/dev/null
cd /tmp
/venv/bin/python -c "
import numpy, waymark
run, again = waymark.Run(\"run\"), waymark.replay(\"run/events.wmlog\")
assert all(numpy.array_equal(column, run.trajectory[name]) for name, column in again.trajectory.items())
print(len(run.trajectory[\"t_ns\"]), \"poses, the same bits, by\", waymark.__file__)"
/venv/bin/waymark-export run --recording drive --mcap run.mcap && ls -l run.mcap'

source='
set -euo pipefail
mkdir /src && tar -C /src -xzf /out/waymark-*.tar.gz && cd /src/waymark-*
begin=$SECONDS
./dev --yes build >/tmp/build.log 2>&1 || { tail -30 /tmp/build.log; exit 1; }
echo "== $((SECONDS - begin)) s: ./dev build"
build/bin/waymark simulate config/worlds/crossing.yaml --no-video --out /tmp/drive >/dev/null
build/bin/waymark replay /tmp/drive --config config/datasets/crossing-points.yaml --out /tmp/run | tail -1'

bind=(--bind "$out:/out")
[ -z "${WM_CCACHE:-}" ] || bind+=(--bind "$WM_CCACHE:/root/.cache/ccache")
for part in "${parts[@]}"; do
  echo "== $part"
  bash "$here/fresh.sh" "${bind[@]}" bash -c "${!part}"
done
