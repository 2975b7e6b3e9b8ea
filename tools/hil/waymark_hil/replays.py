# SPDX-License-Identifier: Apache-2.0
"""Replays of `waymark replay` at the desk, beside each other and beside a target that is not this computer."""
import subprocess

from . import HilError


class Replays:
    """Each is named by the folder that it writes, and runs once."""

    def __init__(self, waymark):
        self.waymark, self.begun, self.found = waymark, {}, {}

    def begin(self, out, *words):
        """Begins a replay into the folder `out`, if it is not begun yet."""
        if out not in self.begun:
            self.begun[out] = subprocess.Popen([self.waymark, "replay", *map(str, words), "--out", str(out)], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                               stderr=subprocess.PIPE, text=True)

    def result(self, out):
        """Waits for it. What it printed; HilError with its last line."""
        if out not in self.found:
            text, errors = self.begun[out].communicate()
            self.found[out] = text, errors
        text, errors = self.found[out]
        if code := self.begun[out].returncode:
            raise HilError((errors.strip() or f"exit code {code}").splitlines()[-1])
        return text

    def end(self):
        """Ends those that still run."""
        for process in self.begun.values():
            if process.poll() is None:
                process.kill()
                process.communicate()
