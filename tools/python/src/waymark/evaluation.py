# SPDX-License-Identifier: Apache-2.0
"""Figures of a run against the truth of its recording, by the program waymark-eval."""

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any


def eval(run: str | Path, recording: str | Path, *arguments: str) -> dict[str, Any]:
    """What `waymark eval RUN RECORDING --json` gives, with more of its arguments: "--align", "se2" (docs/eval.md).

    The program is looked for in PATH (package waymark-tools). ValueError has its message.
    """
    program = shutil.which("waymark-eval")
    if program is None:
        raise FileNotFoundError("waymark-eval is not in PATH: install waymark-tools, or add build/bin to PATH")
    done = subprocess.run([program, str(run), str(recording), "--json", *arguments], capture_output=True, text=True, check=False)
    if done.returncode:
        raise ValueError(done.stderr.strip())
    figures: dict[str, Any] = json.loads(done.stdout)
    return figures
