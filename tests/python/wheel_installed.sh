#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# wheel_installed.sh BUILD [BOARD_BUILD]: the wheel of BUILD installed with its dependencies in an empty virtual environment, by pip and
# the judges' sums; with BOARD_BUILD (arm64) its wheel, by Debian's Python of that architecture under qemu-user. A log of BUILD's
# `waymark replay` is replayed to the same bits; console scripts work. Skipped (77) without a library, the judges, or the network.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/../.."
build=$(readlink -f "$1") board=${2:+$(readlink -f "$2")}
judges=$PWD/.cache/venv/bin/python
for library in "$build" ${board:+"$board"}; do
  [ -e "$library/lib/libwaymark.so.0" ] || { echo "skipped: $library has no libwaymark.so"; exit 77; }
done
"$judges" -c 'import hatchling, numpy' 2>/dev/null || { echo "skipped: the judges are not in .cache/venv"; exit 77; }
dir=$(mktemp -d)
trap 'rm -r "$dir"' EXIT

bash toolchain/package/wheel.sh "${board:-$build}" "$dir/dist" >/dev/null
wheel=$(ls "$dir"/dist/waymark-*-manylinux_*.whl)
bytes=$(stat -c %s "$wheel")
echo "$(basename "$wheel"): $bytes bytes"
[ "$bytes" -le 6000000 ]

# What the package needs, at the judges' versions and by their sums.
awk '/^[a-z]/ {on = $0 ~ /^(cffi|lz4|mcap|numpy|pillow|pycparser|pyyaml|rosbags|ruamel-yaml|typing-extensions|zstandard|apsw|backports-zstd)==/}
  on' tests/judges/requirements.txt >"$dir/needs.txt"
install=(install -q --disable-pip-version-check --only-binary :all: --no-deps)
offline() { echo "skipped: the packages can't be fetched"; exit 77; }
cat >"$dir/ten.py" <<'EOT'
import numpy as np
import waymark

run = waymark.Run("run")
again = waymark.replay("run/events.wmlog")
for name, column in again.trajectory.items():
    assert np.array_equal(column, run.trajectory[name]), name
careful = waymark.replay("run/events.wmlog", changes={"sightings.noise.bearing_factor": 2})
assert not np.array_equal(careful.trajectory["x_m"], run.trajectory["x_m"])
print(len(again.trajectory["t_ns"]), "poses, bit by bit, by", waymark.__file__)
EOT
"$judges" - "$dir/recording" <<'EOT'
import pathlib, sys
sys.path.insert(0, "tests/contract")
import small_robot
small_robot.write(pathlib.Path(sys.argv[1]))
EOT
printf 'format: waymark-config/1\nestimator: landmark_ekf\n' >"$dir/robot.yaml"
"$build/bin/waymark" replay "$dir/recording" --config "$dir/robot.yaml" --out "$dir/run" >/dev/null

if [ -z "$board" ]; then
  python3 -m venv "$dir/venv"
  "$dir/venv/bin/pip" "${install[@]}" --require-hashes -r "$dir/needs.txt" || offline
  "$dir/venv/bin/pip" "${install[@]}" "$wheel"
  cd "$dir"
  env -u WAYMARK_LIBRARY -u PYTHONPATH venv/bin/python ten.py
  venv/bin/waymark-export run --recording recording --can --mcap run.mcap
  venv/bin/waymark-import-bag run.mcap --out again
  exit 0
fi

# Debian's Python of the board, unpacked; its C library is the sysroot's.
sysroot=$(readlink -f .cache/sysroot)/arm64
mkdir "$dir/debs"
(cd "$dir/debs" && APT_CONFIG=$sysroot.apt/apt.conf apt-get -q download python3.11-minimal libpython3.11-minimal libpython3.11-stdlib \
  libexpat1 zlib1g libssl3 libbz2-1.0 liblzma5 libffi8 >/dev/null 2>&1) || offline
for package in "$dir"/debs/*.deb; do dpkg -x "$package" "$dir/root"; done
"$judges" -m pip "${install[@]}" --require-hashes -r "$dir/needs.txt" --target "$dir/site" --python-version 3.11 \
  --platform manylinux2014_aarch64 --platform manylinux_2_17_aarch64 --platform manylinux_2_28_aarch64 || offline
"$judges" -m zipfile -e "$wheel" "$dir/site"
cd "$dir"
qemu-aarch64 -L "$sysroot" -E LD_LIBRARY_PATH="$dir/root/usr/lib/aarch64-linux-gnu:$dir/root/lib/aarch64-linux-gnu" \
  -E PYTHONPATH="$dir/site" root/usr/bin/python3.11 -c 'import platform; assert platform.machine() == "aarch64"; exec(open("ten.py").read())'
