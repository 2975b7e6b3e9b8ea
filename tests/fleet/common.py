# SPDX-License-Identifier: Apache-2.0
"""What the tests of the fleet bench share: programs, small drives, calls."""
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tools/fleet"), str(ROOT / "tests/contract")]
BIN = pathlib.Path(sys.argv.pop(1)).resolve()

import small_robot

small_robot.DURATION_S = 12.0


def call(command, *words):
    """(exit code, text) of `waymark COMMAND`, by the Python that runs this test."""
    done = subprocess.run([sys.executable, BIN / f"waymark-{command}", *map(str, words)], capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


class Fleet:
    """A folder with a few drives of the small robot and two configurations; removed by close()."""

    def __init__(self, drives):
        self.temporary = tempfile.TemporaryDirectory(prefix="waymark-fleet-")
        self.folder = pathlib.Path(self.temporary.name)
        for seed in range(1, drives + 1):
            small_robot.write(self.folder / "drives" / f"drive-{seed}", seed)
        self.configure("plain", "")
        self.configure("noisy", "sightings: {noise: {range_factor: 0.3}}\n")

    def configure(self, name, text):
        (self.folder / f"{name}.yaml").write_text("format: waymark-config/1\nestimator: landmark_ekf\n" + text)

    def plan(self, text="configurations: [plain.yaml, noisy.yaml]", recordings="[drives/*]"):
        path = self.folder / "plan.yaml"
        path.write_text(f"format: waymark-plan/1\nrecordings: {recordings}\n{text}\n")
        return path

    def close(self):
        self.temporary.cleanup()
