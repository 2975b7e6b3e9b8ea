# SPDX-License-Identifier: Apache-2.0
"""Judges one fault of faults.yaml by what a subscriber received: health against its `health:`, poses against its `pose:`. Times are in
seconds since the recording's first datum."""
import bisect
import math

from . import lcm_log
from .poses import largest

_HEALTH_PERIOD_S = 1.0  # health is sent once a second: a state is seen up to so much later
# A pose is as good as before when its sigma is at most three times that of before: the filter narrows it further for seconds.
_AS_BEFORE = 3
_COUNTED_S = 0.2  # a gap is counted when the next datum comes
_STAYS_S = 1.0  # a pose is well again when it stays so: one that the search has just found may be doubted by its next picture
FLAGS = {"motion_stale": 1, "fusion_stale": 2, "jumped": 4}
CAUSES = ["none", "contradicted", "refused", "inconsistent", "biased", "lost_again", "unknown_identities", "silent", "off_map", "turn", "floor"]


def plain(text):
    """A name with one spelling: bus-off, bus_off and "bus off" are the same."""
    return str(text).lower().replace("-", "_").replace(" ", "_")


def is_in(fault, from_s, until_s):
    """Whether some of a fault is in a part of the drive."""
    ends_s = fault.get("until_s")
    return fault["from_s"] < until_s and (ends_s is None or ends_s > from_s or ends_s == fault["from_s"] >= from_s)


class Heard:
    """Poses and healths with their times; `reference` gives where the robot was: [(t_s, x, y, heading, z)]."""

    def __init__(self, poses, healths, reference, said, end_s):
        self.poses, self.healths, self.reference, self.said, self.end_s = poses, healths, reference, said, end_s
        self.pose_times = [t for t, _ in poses]
        self.reference_times = [row[0] for row in reference]

    def poses_between(self, from_s, until_s):
        """[(t, pose)]"""
        return self.poses[bisect.bisect_left(self.pose_times, from_s):bisect.bisect_left(self.pose_times, until_s)]

    def healths_between(self, from_s, until_s):
        """[(t, health)]"""
        return [(t, h) for t, h in self.healths if from_s <= t < until_s]

    def error(self, t, pose):
        """(m, degrees) from the reference; None where it has none."""
        i = bisect.bisect_right(self.reference_times, t)
        if i == 0 or i == len(self.reference) or self.reference[i][0] - self.reference[i - 1][0] > 0.5:
            return None
        a, b = self.reference[i - 1], self.reference[i]
        part = (t - a[0]) / (b[0] - a[0])
        x, y = (a[k] + part * (b[k] - a[k]) for k in (1, 2))
        heading = a[3] + part * math.remainder(b[3] - a[3], 2 * math.pi)
        turn = math.degrees(math.remainder(lcm_log.heading(pose) - heading, 2 * math.pi)) if math.isfinite(heading) else 0.0
        return math.hypot(pose.position_m[0] - x, pose.position_m[1] - y), abs(turn)


def _span(fault, heard):
    until_s = fault.get("until_s")
    return fault["from_s"], heard.end_s if until_s is None else min(until_s, heard.end_s)


def _states(heard, statement, fault):
    """[(t, as it is stated)] for statements that hold or not: of health for devices and causes, of poses for flags and states."""
    kind, value = statement["what"], plain(statement["value"])
    from_s, until_s = _span(fault, heard)
    until_s = max(until_s, from_s) + (statement.get("cleared_within_s") or 0) + 2 * _HEALTH_PERIOD_S
    if kind == "device":
        out = []
        for t, health in heard.healths_between(from_s, until_s):
            source = lcm_log.source(health, statement["source"])
            out.append((t, source is not None and plain(lcm_log.DEVICES[source.device]) == value, "none" if source is None else lcm_log.DEVICES[source.device]))
        return out
    if kind == "cause":
        return [(t, plain(CAUSES[h.cause]) == value, CAUSES[h.cause]) for t, h in heard.healths_between(from_s, until_s)]
    if kind == "flag":
        bit = FLAGS.get(value, 0)
        return [(t, bool(p.status_flags & bit), "set" if p.status_flags & bit else "not set") for t, p in heard.poses_between(from_s, until_s)]
    return [(t, plain(lcm_log.STATES[p.state]) == value, lcm_log.STATES[p.state]) for t, p in heard.poses_between(from_s, until_s)]


def _shown(values):
    """States in their order, each once in a row."""
    out = [value for i, value in enumerate(values) if i == 0 or value != values[i - 1]]
    return ", ".join(out[:6]) or "nothing"


def _holds(checks, group, name, heard, statement, fault):
    """Stated in time, until the end, and taken back in time."""
    from_s, until_s = _span(fault, heard)
    rows = _states(heard, statement, fault)
    what = f"{statement.get('source') or 'the run'} {statement['what']} {statement['value']}"
    within_s = statement.get("within_s")
    first_s = next((t for t, good, _ in rows if good), None)
    when = "never" if first_s is None else f"{first_s - from_s:.2f} s after it begins"
    if within_s is None and statement.get("cleared_within_s") is None:
        checks.add(group, name, first_s is not None and first_s < until_s + _HEALTH_PERIOD_S, f"{what}: stated {when}; {_shown([v for *_, v in rows])}")
        return
    if within_s is not None:
        # Each message from then on; of a fault that is over before the next one is sent, that one.
        due = [(t, good, v) for t, good, v in rows if t >= from_s + within_s]
        judged = [row for row in due if row[0] < until_s] or due[:1]
        checks.add(group, f"{name}, in time", bool(judged) and judged[0][1],
                   f"{what}: {when}, {within_s:g} s are allowed; {_shown([v for *_, v in rows])}", None if first_s is None else first_s - from_s, within_s)
        if judged[1:]:
            checks.add(group, f"{name}, as long as it lasts", all(good for _, good, _ in judged[1:]), f"{what}: then {_shown([v for *_, v in judged[1:]])}")
    cleared_s = statement.get("cleared_within_s")
    if cleared_s is not None and until_s < heard.end_s:
        after = [(good, v) for t, good, v in rows if t >= until_s + cleared_s]
        checks.add(group, f"{name}, taken back", None if not after else not any(good for good, _ in after[:1]),
                   f"{what}: {cleared_s:g} s after its end: {_shown([v for _, v in after[:1]])}")


def _counts(checks, group, name, heard, statement, fault):
    from_s, until_s = _span(fault, heard)
    before = [h for t, h in heard.healths if t <= from_s]
    after = [h for t, h in heard.healths if t >= until_s + _COUNTED_S] or [h for _, h in heard.healths[-1:]]
    ends = []
    for health in (before[-1:], after[:1]):
        source = lcm_log.source(health[0], statement["source"]) if health else None
        ends.append(None if source is None else getattr(source, statement["value"]))
    if ends[1] is None:
        checks.add(group, name, False, f"health has no source {statement['source']}")
        return
    grown = ends[1] - (ends[0] or 0)
    least, most = statement.get("at_least"), statement.get("at_most")
    good = (least is None or grown >= least) and (most is None or grown <= most)
    checks.add(group, name, good, f"{statement['source']} {statement['value']} grows by {grown}; "
               f"{'' if least is None else f'at least {least:g}'}{' and ' if None not in (least, most) else ''}{'' if most is None else f'at most {most:g}'} is right",
               grown, most if most is not None else least)


def _said(checks, group, name, heard, statement):
    times, least, most = heard.said.count(statement["value"]), statement.get("at_least"), statement.get("at_most")
    good = times >= (1 if least is None else least) and (most is None or times <= most)
    checks.add(group, name, good, f"'{statement['value']}' is on the run's standard error {times} times", times, most if most is not None else 1 if least is None else least)


def recovery(fault, others):
    """(s, s): since when the pose is not as usual, and when it has to be again. Faults whose times until then overlap share them: the pose is as
    good as before the first, by the latest of their times."""
    spans = [(one["from_s"], one["until_s"] + one["pose"]["within_s"]) for one in others
             if one.get("until_s") is not None and (one.get("pose") or {}).get("within_s") is not None]
    begun_s, due_s = fault["from_s"], fault["until_s"] + fault["pose"]["within_s"]
    for _ in spans:
        for from_s, well_s in spans:
            if from_s < due_s and begun_s < well_s:
                begun_s, due_s = min(begun_s, from_s), max(due_s, well_s)
    return begun_s, due_s


def _pose(checks, group, heard, fault, what, others, ended_s):
    bound = fault["pose"]
    from_s, until_s = _span(fault, heard)
    end_s = min(until_s + (bound.get("within_s") or 0), heard.end_s)
    poses, during = heard.poses_between(from_s, end_s), heard.poses_between(from_s, max(until_s, from_s + 0.5))
    errors = [(heard.error(t, p), p) for t, p in poses]
    errors = [(e, p) for e, p in errors if e is not None]

    def at_most(name, value, unit):
        limit = bound.get(name)
        if limit is None:
            return
        found = None if value is None else f"{value:.3g} {unit}"
        checks.at_most(group, f"pose {name}", value, limit, f"{found or 'no pose to judge'} at most, {limit:g} are allowed ({what})")
    at_most("position_m", largest(e[0] for e, _ in errors), "m from the reference")
    at_most("heading_deg", largest(e[1] for e, _ in errors), "degrees from the reference")
    at_most("error_sigmas", largest(e[0] / max(lcm_log.sigma_m(p), 1e-6) for e, p in errors), "sigma of its error")
    at_most("sigma_m", largest(lcm_log.sigma_m(p) for _, p in poses), "m of sigma")
    at_most("sigma_deg", largest(math.degrees(math.sqrt(max(p.covariance[5][5], 0.0))) for _, p in poses), "degrees of sigma")
    stamps = [from_s, *(t for t, _ in poses), end_s]
    at_most("gap_max_s", largest(b - a for a, b in zip(stamps, stamps[1:])), "s between two poses")
    if bound.get("rate_hz") is not None:
        rate_hz = len(poses) / max(end_s - from_s, 1e-3)
        checks.add(group, "pose rate_hz", rate_hz >= bound["rate_hz"], f"{rate_hz:.1f} poses a second, {bound['rate_hz']:g} are needed", rate_hz, bound["rate_hz"])
    if bound.get("sigma_grows") is not None:
        grown = lcm_log.sigma_m(during[-1][1]) / max(lcm_log.sigma_m(during[0][1]), 1e-9) if during else 0.0
        checks.add(group, "pose sigma_grows", grown >= bound["sigma_grows"], f"sigma grows by a factor of {grown:.2f}, {bound['sigma_grows']:g} is needed", grown, bound["sigma_grows"])
    if bound.get("within_s") is not None and until_s < heard.end_s:
        begun_s, due_s = recovery({**fault, "until_s": until_s}, others)
        # What happens to processes is over when the target has done its part: a killed one has poses until then.
        over_s = max(until_s, ended_s or until_s)
        _recovers(checks, group, heard, begun_s, over_s, due_s - until_s)


def _well_again(poses, usual_m, states):
    """When the poses become as good as before, and stay so: the same state or tracking, known motion, a small sigma. None: they do not."""
    since_s = None
    for t, p in poses:
        if p.status_flags & FLAGS["motion_stale"] or not lcm_log.sigma_m(p) <= usual_m or p.state not in states:
            since_s = None
            continue
        since_s = t if since_s is None else since_s
        if t - since_s >= _STAYS_S:
            return since_s
    return None


def _recovers(checks, group, heard, begun_s, until_s, within_s):
    """A pose as good as before, with a sigma of at most three times that of before."""
    before = heard.poses_between(begun_s - 1, begun_s)
    usual_m = _AS_BEFORE * lcm_log.sigma_m(before[-1][1]) if before else math.inf
    since_s = _well_again(heard.poses_between(until_s, heard.end_s), usual_m, (1, before[-1][1].state if before else 1))
    if since_s is None and until_s + within_s + _STAYS_S > heard.end_s:
        checks.add(group, "pose within_s", None, f"not as good as before when the drive ends, {heard.end_s - until_s:.1f} s after its end; {within_s:g} s are allowed")
        return
    well_s = math.inf if since_s is None else since_s - until_s
    found = "not as good as before until the drive ends" if since_s is None else f"as good as before {well_s:.2f} s after its end"
    checks.at_most(group, "pose within_s", well_s, within_s, f"{found} (sigma below {usual_m:.3f} m), {within_s:g} s are allowed")


def judge(checks, fault, heard, done, what, others=()):
    """One fault. `done`: what the player or the target did of it: {"done": bool, "why": text}, and "ended_s" where the
    target noted when it was over. `others`: faults that happened, too."""
    group = f"fault: {fault['name']}"
    if not done.get("done"):
        checks.add(group, "it happened", None if done.get("absent") else False, done.get("why") or "neither the player nor the target did it")
        return
    from_s, until_s = _span(fault, heard)
    checks.add(group, "it happened", True, f"{fault['fault']} from {from_s:.1f} to {until_s:.1f} s")
    for number, statement in enumerate(fault.get("health") or [], start=1):
        name = f"health {number}: {statement.get('source') or ''} {statement['value']}".replace("  ", " ")
        if statement.get("not_here"):
            checks.add(group, name, None, f"not on this target: {statement['not_here']}")
        elif statement["what"] == "counter":
            _counts(checks, group, name, heard, statement, fault)
        elif statement["what"] == "text":
            _said(checks, group, name, heard, statement)
        else:
            _holds(checks, group, name, heard, statement, fault)
    if fault.get("pose"):
        _pose(checks, group, heard, fault, what, others, done.get("ended_s"))
