# SPDX-License-Identifier: Apache-2.0
"""What drive.sh sampled beside the run: temperature, clock rate, memory, processor's time of each thread; wake-ups by cyclictest."""
import dataclasses
import json


@dataclasses.dataclass
class Samples:
    """Series are [(seconds since the recording's first datum, value)]."""

    temperature: list = dataclasses.field(default_factory=list)  # of the hottest zone, degrees Celsius
    clock: list = dataclasses.field(default_factory=list)  # of the slowest processor, MHz
    memory: list = dataclasses.field(default_factory=list)  # resident, MB
    cpu: list = dataclasses.field(default_factory=list)  # all threads, share of one processor
    threads: list = dataclasses.field(default_factory=list)  # (name, share of one processor), the busiest first
    memory_peak_mb: float | None = None


def _lines(path):
    try:
        text = path.read_text(errors="replace")
    except OSError:
        return
    for line in text.splitlines():
        words = line.split()
        try:
            yield float(words[0]), words[1], words[2], float(words[3])
        except (IndexError, ValueError):
            continue


def _ticks_per_s(path):
    try:
        first = path.read_text(errors="replace").split("\n", 1)[0]
    except OSError:
        return 100.0
    last = first.rsplit(" ", 1)[-1]
    return float(last) if last.isdecimal() and int(last) > 0 else 100.0  # Linux has 100 everywhere


def read(out):
    """The samples of a test."""
    found, ticks = Samples(), {}
    per_s = _ticks_per_s(out / "samples.txt")
    at = {}
    for t, what, name, value in [*_lines(out / "samples.txt"), *_lines(out / "last.txt")]:
        if what == "temperature":
            at.setdefault(("t", t), []).append(value / 1000)
        elif what == "clock":
            at.setdefault(("c", t), []).append(value / 1000)
        elif what == "memory" and name == "VmRSS":
            found.memory.append((t, value / 1024))
        elif what == "memory":
            found.memory_peak_mb = max(found.memory_peak_mb or 0, value / 1024)
        elif what == "cpu":
            ticks.setdefault(name, []).append((t, value / per_s))
    found.temperature = [(t, max(values)) for (kind, t), values in at.items() if kind == "t"]
    found.clock = [(t, min(values)) for (kind, t), values in at.items() if kind == "c"]
    shares, sums = {}, {}
    for name, rows in ticks.items():
        span_s = rows[-1][0] - rows[0][0]
        if span_s > 0:  # threads of one name are one row: each detector has its own number
            shares[name.split(":")[0]] = shares.get(name.split(":")[0], 0.0) + (rows[-1][1] - rows[0][1]) / span_s
        for (t0, s0), (t1, s1) in zip(rows, rows[1:]):
            if t1 > t0:
                sums[t1] = sums.get(t1, 0.0) + (s1 - s0) / (t1 - t0)
    found.threads = sorted(shares.items(), key=lambda one: -one[1])
    found.cpu = sorted(sums.items())
    return found


def wake_us(out):
    """Wake-ups of a real-time thread beside the run: by cyclictest, else by the doctor. None: neither measured."""
    try:
        threads = json.loads((out / "cyclictest.json").read_text())["thread"].values()
        counted = {}
        for thread in threads:
            for us, count in thread["histogram"].items():
                counted[int(us)] = counted.get(int(us), 0) + count
        total, seen = sum(counted.values()), 0
        for us in sorted(counted):
            seen += counted[us]
            if seen >= 0.99 * total:
                return {"what": "cyclictest", "p99_us": float(us), "max_us": float(max(counted))}
    except (OSError, ValueError, KeyError, AttributeError):
        pass
    try:
        wake = json.loads((out / "wake.json").read_text())["wake_ms"]
        return {"what": "the doctor's thread", "p99_us": 1e3 * wake["p99"], "max_us": 1e3 * wake["max"]}
    except (OSError, ValueError, KeyError, TypeError):
        return None
