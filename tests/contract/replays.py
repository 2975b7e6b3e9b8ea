# SPDX-License-Identifier: Apache-2.0
"""What the tables of replays have in common: programs, tables of numbers, changed copies of recordings, command lines."""
import argparse
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

WRONG_M = 0.5
WRONG_SIGMA = 3.5


class Refused(RuntimeError):
    """A program's error instead of a result."""


def fewer(cases, first=1):
    """All cases; in the gate (WM_GATE=N in the environment, by ./dev test) the first ones and every N-th of the others."""
    every = max(1, int(os.environ.get("WM_GATE") or 1))
    taken = list(cases[:first]) + list(cases[first::every])
    if len(taken) < len(cases):
        print(f"{len(taken)} of {len(cases)} cases (WM_GATE={every})")
    return taken


def command(*words):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True)
    if done.returncode != 0:
        raise Refused(done.stderr.strip() or f"{words[0]}: {done.returncode}")
    return done.stdout


def need_simulator(bin_dir, cache):
    """Makes the folder for simulated drives; skips (77) where no simulator was built."""
    if not (bin_dir / "waymark-simulate").exists():
        print("skipped: no simulator was built")
        sys.exit(77)
    cache.mkdir(parents=True, exist_ok=True)


def has_causes(bin_dir):
    """Whether the engine for causes runs here: it needs the Python package's dependencies. Says so where it does not."""
    is_there = subprocess.run([bin_dir / "waymark-causes", "--help"], capture_output=True).returncode == 0
    if not is_there:
        print("without causes: waymark-causes does not run here (tests/judges/setup.sh makes the tests' Python)")
    return is_there


def rows(path):
    head, *lines = path.read_text().splitlines()
    names = head.split(",")
    return [dict(zip(names, line.split(","))) for line in lines]


def write_rows(path, table):
    names = list(table[0])
    path.write_text("\n".join([",".join(names), *(",".join(r[n] for n in names) for r in table)]) + "\n")


def find(tree, key):
    """The first value under a key, or of the entry with this name, in a tree of maps and lists."""
    if isinstance(tree, dict):
        if key in tree:
            return tree[key]
        if tree.get("name") == key:
            return tree
        tree = list(tree.values())
    if isinstance(tree, list):
        for branch in tree:
            value = find(branch, key)
            if value is not None:
                return value
    return None


def printed(value, digits):
    return "-" if value is None else f"{value:.{digits}f}"


# Judgement

def mahalanobis2(d, p):
    """d' P^-1 d for two or three numbers, by Gauss's elimination. Infinite where P is singular."""
    n = len(d)
    a = [[*p[i], d[i]] for i in range(n)]
    total = 0.0
    for i in range(n):
        if not a[i][i] > 0:
            return float("inf")
        total += a[i][n] ** 2 / a[i][i]
        for j in range(i + 1, n):
            f = a[j][i] / a[i][i]
            a[j] = [x - f * y for x, y in zip(a[j], a[i])]
    return total


def errors(run, recording):
    """(t_s, tracking, error in m, error in sigma) at each stamp of the truth at which the run has a pose."""
    return ((t_s, state == "tracking", error_m, sigmas) for t_s, state, error_m, sigmas in stated_errors(run, recording))


def stated_errors(run, recording):
    """As errors, with the state's name."""
    trajectory, truth = rows(run / "trajectory.csv"), rows(recording / "truth.csv")
    axes = "xyz" if trajectory and "cov_zz" in trajectory[0] else "xy"
    place = [f"{a}_m" for a in axes]
    at = 0
    for row in truth:
        t = int(row["t_ns"])
        while at + 1 < len(trajectory) and int(trajectory[at + 1]["t_ns"]) <= t:
            at += 1
        if at + 1 >= len(trajectory) or int(trajectory[at]["t_ns"]) > t:
            continue
        a, b = trajectory[at], trajectory[at + 1]
        share = (t - int(a["t_ns"])) / (int(b["t_ns"]) - int(a["t_ns"]))
        d = [float(row[k]) - float(a[k]) - share * (float(b[k]) - float(a[k])) for k in place]
        p = [[float(a["cov_" + min(i, j) + max(i, j)]) for j in axes] for i in axes]
        yield t * 1e-9, a["state"], sum(x * x for x in d) ** 0.5, mahalanobis2(d, p) ** 0.5


def confidently_wrong(run, recording):
    """Share of the truth's time with state tracking while the position is off by more than WRONG_M and WRONG_SIGMA."""
    wrong, total, last = 0, 0, None
    for t_s, tracking, error_m, sigmas in errors(run, recording):
        if last is not None:
            wrong += (tracking and error_m > WRONG_M and sigmas > WRONG_SIGMA) * (t_s - last)
            total += t_s - last
        last = t_s
    return wrong / total if total else None


# Changed copies of recordings: a change is a function from a file's text (of a video: its bytes) to another one.

def copy_changed(recording, out, changes):
    """A copy in which some files read differently: {name: change}. The others are links."""
    out.mkdir()
    for file in recording.iterdir():
        inner = {name.removeprefix(f"{file.name}/"): change for name, change in changes.items() if name.startswith(f"{file.name}/")}
        if file.is_dir() and inner:
            copy_changed(file, out / file.name, inner)
        elif file.name not in changes:
            (out / file.name).symlink_to(file.resolve())
        elif file.suffix in (".avi", ".png"):
            (out / file.name).write_bytes(changes[file.name](file.read_bytes()))
        else:
            before = file.read_text()
            after = changes[file.name](before)
            assert after != before, f"{file}: the disturbance changed nothing"
            (out / file.name).write_text(after)


def of_lines(change):
    """Change of a table by a function of its lines, without the head, to others."""
    def whole(text):
        head, *lines = text.splitlines()
        return "\n".join([head, *change(lines)]) + "\n"
    return whole


def each_row(change):
    """Change of a table by a function that alters a row's fields in place."""
    def whole(text):
        head, *lines = text.splitlines()
        names = head.split(",")
        out = []
        for line in lines:
            fields = dict(zip(names, line.split(",")))
            change(fields)
            out.append(",".join(fields[n] for n in names))
        return "\n".join([head, *out]) + "\n"
    return whole


def shifted(seconds, columns=("t_ns",)):
    def change(f):
        for column in columns:
            if f.get(column):
                f[column] = str(int(f[column]) + round(seconds * 1e9))
    return each_row(change)


def scaled(columns, factor):
    """Columns (one name or several; those that are there) times a factor."""
    def change(f):
        for column in [columns] if isinstance(columns, str) else columns:
            if f.get(column):
                f[column] = repr(float(f[column]) * factor)
    return each_row(change)


def turned(degrees):
    """All mountings of a calibration turned about the upright axis."""
    return lambda text: re.sub(r"rpy_deg: \[([^,]+), ([^,]+), ([^\]]+)\]",
                               lambda m: f"rpy_deg: [{m[1]}, {m[2]}, {float(m[3]) + degrees}]", text)


def replaced(pattern, change, text):
    """Each match's first group, as a number, changed."""
    out, count = re.subn(pattern, lambda m: m[0].replace(m[1], f"{change(float(m[1])):.9g}", 1), text, flags=re.M)
    assert count, f"nothing matches {pattern}"
    return out


# Command lines

def parser(about, only, has_data=True):
    """BIN_DIR SOURCE_DIR [DATA_DIR] [--only WORDS] [--set KEY=VALUE] [--json]"""
    out = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("bin_dir", "source_dir", "data_dir")[:2 + has_data]:
        out.add_argument(name, type=lambda p: pathlib.Path(p).resolve())
    out.add_argument("--only", default="", metavar="WORD[,WORD]", help=only)
    out.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="a key of the plain configurations")
    out.add_argument("--json", action="store_true", help="one object a row instead of the table")
    return out


def table(options, head, cases, judge, printed):
    """All rows of judge(options, case, scratch) for each case, with a scratch folder of its own: printed one by one, or as JSON at the end."""
    if not options.json:
        print(head)
    results = []
    for case in cases:
        with tempfile.TemporaryDirectory() as scratch:
            for row in judge(options, case, pathlib.Path(scratch)):
                results.append(row)
                if not options.json:
                    print(printed(row), flush=True)
    if options.json:
        print(json.dumps(results, indent=1))
    return results


def is_chosen(options, title):
    """Whether a title contains one of --only's words; without them, each does."""
    return not options.only or any(word in title for word in options.only.split(","))
