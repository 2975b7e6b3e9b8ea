# SPDX-License-Identifier: Apache-2.0
"""What a run published while something broke: checks on what LCM's own logger heard."""
import math
import os

import drives
import messages

WORKS, ABSENT, DOWN, BUS_OFF, STALLED, FROZEN = 1, 2, 3, 5, 6, 7
MOTION_STALE = 1
# On a desk that does much else, a thread may wait; a robot's computer is doing well enough to have been chosen.
IS_BUSY = os.getloadavg()[0] > os.cpu_count()
GAP_MAX_S = 1.5 if IS_BUSY else 0.3


class Published:
    """Times are in seconds since begin_ns; `folder` has heard.lcm; `said()` is what the run said on standard error; `truth` has rows
    (t_ns, x_m, y_m, heading_rad) on the run's clock, or is None."""

    def __init__(self, name, folder, begin_ns, said, truth=None):
        self.name, self.said, self.failures = name, said, []
        poses, healths = messages.heard(folder, folder / "heard.lcm")
        self.poses = [((p.t_ns - begin_ns) * 1e-9, p) for p in poses]
        self.healths = [((h.t_ns - begin_ns) * 1e-9, h) for h in healths]
        self.truth = truth and [((t - begin_ns) * 1e-9, *rest) for t, *rest in truth]
        self.times = truth and [row[0] for row in self.truth]

    def check(self, good, text):
        print(f"  {'good' if good else 'BAD '}  {self.name}: {text}")
        if not good:
            self.failures.append(text)

    def between(self, from_s, until_s):
        return [(t, p) for t, p in self.poses if from_s <= t < until_s]

    @staticmethod
    def sigma_m(pose):
        return math.sqrt(pose.covariance[0][0] + pose.covariance[1][1])

    def error_m(self, t, pose):
        q = drives.at(self.truth, self.times, t)
        return math.hypot(pose.position_m[0] - q[0], pose.position_m[1] - q[1]) if q else 0.0

    def goes_on(self, what, from_s, until_s):
        """Poses come at their rate, are numbers, and lie as far from the truth as they say."""
        poses = self.between(from_s, until_s)
        stamps = [from_s] + [t for t, _ in poses] + [until_s]
        gap_s = max(b - a for a, b in zip(stamps, stamps[1:]))
        finite = all(math.isfinite(v) for _, p in poses for v in (*p.position_m, *p.orientation_xyzw, *p.covariance[0][:2], p.covariance[1][1]))
        self.check(len(poses) > (25 if IS_BUSY else 40) * (until_s - from_s) and gap_s < GAP_MAX_S and finite,
                   f"{what}: {len(poses)} poses in {until_s - from_s:.0f} s, {gap_s * 1e3:.0f} ms apart at most")
        if not self.truth:
            return poses
        worst = max((self.error_m(t, p) / self.sigma_m(p) for t, p in poses), default=math.inf)
        self.check(worst < 4, f"{what}: errors are at most {worst:.1f} sigma, {max((self.error_m(t, p) for t, p in poses), default=math.inf):.3f} m")
        return poses

    def grows(self, what, from_s, until_s):
        poses = self.between(from_s, until_s)
        before, after = self.sigma_m(poses[0][1]), self.sigma_m(poses[-1][1])
        self.check(after > 1.15 * before, f"{what}: sigma grows from {before:.3f} to {after:.3f} m")

    def health_at(self, at_s):
        return max((h for h in self.healths if h[0] <= at_s), key=lambda h: h[0], default=(None, None))[1]

    def device(self, what, name, state, from_s, until_s):
        """All healths in between say so."""
        states = [messages.source(h, name).device for t, h in self.healths if from_s <= t < until_s]
        self.check(states != [] and all(s == state for s in states), f"{what}: health says device {states} of {name}, {state} is right")

    def counted(self, what, name, counter, from_s, until_s, least, most):
        n = [getattr(messages.source(self.health_at(t), name), counter) for t in (from_s, until_s)]
        self.check(least <= n[1] - n[0] <= most, f"{what}: {n[1] - n[0]} {counter} of {name}, {least} to {most} are right")

    def is_back(self, what, name, until_s, at_s, sigma_m):
        """Broken until until_s, in order from at_s on: then, and on the way there, too, it lies as far from the truth as it says."""
        self.goes_on(what + ", over", until_s, at_s + 2.5)
        self.device(what + ", over", name, WORKS, at_s, at_s + 2.5)
        poses = self.between(at_s, at_s + 2.5)
        now = min((self.sigma_m(p) for _, p in poses), default=math.inf)
        self.check(now < sigma_m, f"{what}, over: sigma {now:.3f} m again, {sigma_m:.3f} before")
        self.check(any(p.state == 1 for _, p in poses), f"{what}, over: tracking again")

    def is_said(self, text, times=1, or_else=None):
        n = self.said().count(text) + (self.said().count(or_else) if or_else else 0)
        self.check(n == times, f"'{text}' is said {n} times, {times} is right")

    def sigma_at(self, at_s):
        return self.sigma_m(self.between(at_s - 1, at_s)[-1][1])
