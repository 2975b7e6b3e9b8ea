# SPDX-License-Identifier: Apache-2.0
"""What the Python package's tests share: the package on the path, the programs, a drive and its run."""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tools/python/src"), str(ROOT / "tests/contract")]
BIN = pathlib.Path(sys.argv.pop(1)) if len(sys.argv) > 1 and not sys.argv[1].startswith("-") else ROOT / "build/bin"

import small_robot  # noqa: E402

CONFIG = "format: waymark-config/1\nestimator: landmark_ekf\n"


def use_library():
    """The package takes this build's libwaymark.so; the test is skipped where there is none."""
    library = BIN.resolve().parent / "lib/libwaymark.so"
    if not library.exists():
        print("skipped: this build has no libwaymark.so")
        sys.exit(77)
    os.environ["WAYMARK_LIBRARY"] = str(library)


class Folder(unittest.TestCase):
    """A test with a folder of its own."""

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="waymark-test-"))
        self.addCleanup(shutil.rmtree, self.folder)


class Drive:
    """A folder with the small robot's recording and its run; removed by close()."""

    def __init__(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="waymark-python-"))
        self.recording, self.run = self.folder / "recording", self.folder / "run"
        small_robot.write(self.recording)
        (self.folder / "robot.yaml").write_text(CONFIG)
        self.replay(self.recording, self.run)

    def replay(self, recording, out):
        """Localizes the robot of a recording."""
        done = subprocess.run([BIN / "waymark", "replay", recording, "--config", self.folder / "robot.yaml", "--out", out],
                              capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(done.stderr)

    def close(self):
        """Removes the folder."""
        shutil.rmtree(self.folder)
