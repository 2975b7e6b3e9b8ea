#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The wheel with libwaymark.so, at most 6 MB, unpacked beside the judges' packages: ten lines replay a log to the bits of the
# program. wheel.sh BUILD [PYTHON]. Skipped (77) without a library or the judges' Python.
set -euo pipefail
build=$(readlink -f "$1") python=${2:-.cache/venv/bin/python}
[ -e "$build/lib/libwaymark.so.0" ] || { echo "skipped: this build has no libwaymark.so"; exit 77; }
"$python" -c 'import cffi, hatchling, numpy' 2>/dev/null || { echo "skipped: the judges are not in .cache/venv"; exit 77; }
python=$(cd "$(dirname "$python")" && pwd)/$(basename "$python")
dir=$(mktemp -d)
trap 'rm -r "$dir"' EXIT
bash toolchain/package/wheel.sh "$build" "$dir/dist" "$python" >/dev/null
wheel=$(ls "$dir"/dist/waymark-*-manylinux_*.whl)
bytes=$(stat -c %s "$wheel")
echo "$(basename "$wheel"): $bytes bytes"
[ "$bytes" -le 6000000 ]
"$python" -m zipfile -e "$wheel" "$dir/installed"
"$python" - "$dir/recording" <<'EOT'
import pathlib, sys
sys.path.insert(0, "tests/contract")
import small_robot
small_robot.write(pathlib.Path(sys.argv[1]))
EOT
printf 'format: waymark-config/1\nestimator: landmark_ekf\n' >"$dir/robot.yaml"
"$build/bin/waymark" replay "$dir/recording" --config "$dir/robot.yaml" --out "$dir/run" >/dev/null
cd "$dir"
env -u WAYMARK_LIBRARY PYTHONPATH="$dir/installed" "$python" - <<'EOT'
import numpy as np
import waymark

run = waymark.Run("run")
again = waymark.replay("run/events.wmlog")
for name, column in again.trajectory.items():
    assert np.array_equal(column, run.trajectory[name]), name
print(len(again.trajectory["t_ns"]), "poses, bit by bit, by", waymark.__file__)
EOT
