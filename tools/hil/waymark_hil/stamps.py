# SPDX-License-Identifier: Apache-2.0
"""With --record: what the target recorded beside the run, datum by datum against the recording. Its stamps are the target's own, so their
differences are what interfaces, drivers and the player add, and the skew between CAN and pictures."""
import bisect
import csv
import re

from . import poses

_FRAME = re.compile(r"^\((\d+)\.(\d+)\) (\S+) (\S+)")
# A frame with the same identity and content is the same one where its stamp is no further off.
_NEAR_NS = 50_000_000


def frames(path, name=None):
    """{identity and content: [stamps in ns]} of can.log, of one interface."""
    out = {}
    with path.open(encoding="utf-8", errors="replace") as lines:
        for line in lines:
            found = _FRAME.match(line)
            if found and name in (None, found[3]):
                out.setdefault(found[4], []).append(int(found[1]) * 10**9 + int(found[2][:9].ljust(9, "0")))
    return out


def pictures(path):
    """Stamps of a camera's table, in ns."""
    with path.open(newline="", encoding="utf-8") as file:
        return sorted(int(row["t_ns"]) for row in csv.DictReader(file) if row.get("t_ns"))


def _nearest(stamps, t):
    i = bisect.bisect_left(stamps, t)
    return min((stamps[k] for k in (i - 1, i) if 0 <= k < len(stamps)), key=lambda s: abs(s - t), default=None)


def _match(sent, got):
    """Differences in ns of what was sent and has come, and how much has not. Both rising."""
    differences, missing = [], 0
    for t in sent:
        near = _nearest(got, t)
        if near is None or abs(near - t) > _NEAR_NS:
            missing += 1
        else:
            differences.append(near - t)
    return differences, missing


def compare(recording, recorded, buses, cameras, offset_ns, from_ns, until_ns):
    """{stream: (sent, missing, differences in ns)}. Times are those of the recording; `recorded` is on the target's clock."""
    out = {}
    for name, run in buses:
        sent, got = frames(recording / "can.log", name), frames(recorded / "can.log", run)
        differences, missing, count = [], 0, 0
        for key, stamps in sent.items():
            mine = [t + offset_ns for t in sorted(stamps) if from_ns <= t < until_ns]
            some, lost = _match(mine, sorted(got.get(key, [])))
            differences += some
            missing, count = missing + lost, count + len(mine)
        out[f"can:{name}"] = (count, missing, differences)
    for name in cameras:
        table = recorded / "video" / f"{name}.csv"
        sent = [t + offset_ns for t in pictures(recording / "video" / f"{name}.csv") if from_ns <= t < until_ns]
        differences, missing = _match(sent, pictures(table) if table.is_file() else [])
        out[f"camera:{name}"] = (len(sent), missing, differences)
    return out


def judge(judge, buses, cameras, settle_s):
    """Losses and skew of what the target recorded; checks and figures go to the judge."""
    recorded, facts = judge.out / "recorded", judge.facts
    if not (recorded / "can.log").is_file() and not (recorded / "video").is_dir():
        judge.checks.add("stamps", "recorded", False, "the target has no recording (out/recorded)")
        return
    first_ns = judge.start_ns - judge.played["offset_ns"]
    begin_ns = first_ns + int((facts["from_s"] + settle_s) * 1e9)
    found = compare(facts["recording"], recorded, buses, cameras, judge.played["offset_ns"], begin_ns, first_ns + int((facts["until_s"] - 0.2) * 1e9))
    can = [d for name, (_, _, differences) in found.items() if name.startswith("can:") for d in differences]
    middle = poses.quantile(can, 0.5)
    for name, (count, missing, differences) in found.items():
        text = f"{count - missing} of {count} are in the target's recording"
        if differences:
            text += f", stamped {poses.quantile(differences, 0.5) / 1e6:.3f} ms (p50) and {poses.quantile(differences, 0.99) / 1e6:.3f} ms (p99) after their time"
        limit = judge.limits["lost_share"]
        judge.checks.add("stamps", name, None if judge.is_broken or limit is None else count > 0 and missing / count <= limit, text, missing / max(count, 1), limit)
        if middle is not None and name.startswith("camera:") and differences:
            skew_ms = poses.quantile([abs(d - middle) for d in differences], 0.99) / 1e6
            judge.figures[f"skew_{name[7:]}_p99_ms"] = skew_ms
            bound = judge.limits["skew_ms"]
            judge.checks.add("stamps", f"skew of {name[7:]} and CAN", None if bound is None or judge.is_broken else skew_ms <= bound,
                             f"{skew_ms:.3f} ms (p99) between the stamps of pictures and of frames", skew_ms, bound)
