# SPDX-License-Identifier: Apache-2.0
"""What a test is doing, and the time left."""
import sys
import time

# Shares of the time beside the drive itself, in seconds on the target's clock: guesses until the drive has begun.
_BEFORE_S, _AFTER_S = 25, 15
_STEPS = {"interfaces": "interfaces", "doctor": "the doctor", "warm": "reading the recording", "listen": "listening", "begin": "the run begins",
          "drive": "driving", "end": "ending", "done": "fetching"}


class Progress:
    """Lines of drive.sh become one line on a terminal, or a line a step elsewhere."""

    def __init__(self, seconds, out=sys.stderr):
        self.seconds, self.out, self.is_terminal = seconds, out, out.isatty()
        self.begun_s, self.drive_begun, self.tenth, self.what = time.monotonic(), None, -1, ""

    def say(self, text):
        """A line that stays."""
        print(f"\r\033[K{text}" if self.is_terminal else text, file=self.out, flush=True)

    def step(self, what):
        """A step of the desk."""
        self.what = what
        self._show(what, None)

    def line(self, text):
        """A line of the target."""
        words = text.split()
        if words[:1] != ["HIL"] or len(words) < 3:
            return
        if words[1] == "fail":
            self.say("failed: " + " ".join(words[2:]))
        elif words[1] == "step":
            self.step(_STEPS.get(words[2], words[2]))
        elif words[1] == "at":
            self._at(float(words[2]))

    def _at(self, at_s):
        """So many seconds of the recording are driven."""
        now = time.monotonic()
        if self.drive_begun is None or at_s <= 0:
            self.drive_begun = (now, at_s)
            return
        rate = (at_s - self.drive_begun[1]) / max(now - self.drive_begun[0], 1e-3)
        left_s = (max(0.0, self.seconds - at_s) + _AFTER_S) / max(rate, 0.01)
        tenth = int(10 * at_s / max(self.seconds, 1))
        if self.is_terminal or tenth != self.tenth:
            self.tenth = tenth
            self._show(f"driving, {at_s:.0f} of {self.seconds:.0f} s", left_s)

    def _show(self, what, left_s):
        text = what if left_s is None else f"{what}, {left_s:.0f} s left"
        if self.is_terminal:
            print(f"\r\033[K{text}", end="", file=self.out, flush=True)
        else:
            print(text, file=self.out, flush=True)

    def end(self):
        if self.is_terminal:
            print("\r\033[K", end="", file=self.out, flush=True)
