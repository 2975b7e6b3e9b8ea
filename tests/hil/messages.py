# SPDX-License-Identifier: Apache-2.0
"""What a run said over LCM, out of the log of LCM's own logger, by code that LCM's own generator made."""
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tools/hil"))
from waymark_hil import lcm_log  # noqa: E402
from waymark_hil.lcm_log import heading, logged, name_of, rows, source  # noqa: E402


def types(work):
    """The module of message types, made in `work`."""
    folder = work / "types"
    subprocess.run(["lcm-gen", "-p", "--ppath", folder, *sorted((ROOT / "msgs/lcm").glob("*.lcm"))], check=True)
    return lcm_log.types(folder)


def heard(work, path):
    """Poses and healths, decoded."""
    waymark = types(work)
    poses, healths = [], []
    for _, channel, message in logged(path):
        if channel == "WAYMARK_POSE":
            poses.append(waymark.pose_t.decode(message))
        if channel == "WAYMARK_HEALTH":
            healths.append(waymark.health_t.decode(message))
    return poses, healths
