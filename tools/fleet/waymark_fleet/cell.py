# SPDX-License-Identifier: Apache-2.0
"""A cell's run: a pure function of files to files, in a folder that is there as a whole or not at all."""
import collections
import hashlib
import json
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import threading
import time

# Files of a run that are the same each time. timing.json never is.
SUMMED = ["trajectory.csv", "trajectory.tum", "published.csv", "innovations.csv", "map-estimate.csv", "reference.csv", "looked-for.csv",
          "particles.bin", "events.wmlog", "health.json"]
_running, _lock = set(), threading.Lock()
_HOST = socket.gethostname()


class Stopped(Exception):
    """The batch is being ended."""


def stop_all():
    """Ends the programs that run now; further ones are not begun."""
    with _lock:
        _running.add(None)
        for process in _running - {None}:
            process.send_signal(signal.SIGKILL)


def call(command, out, err):
    """Runs a program. (exit code, CPU time in s, memory at most in MB, time in s)"""
    begun = time.monotonic()
    with _lock:
        if None in _running:
            raise Stopped
        process = subprocess.Popen([str(word) for word in command], stdin=subprocess.DEVNULL, stdout=out, stderr=err)
        _running.add(process)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    with _lock:
        _running.discard(process)
        if None in _running:
            raise Stopped
    return process.returncode, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, time.monotonic() - begun


def replay_command(cell, run):
    """The command of a cell's replay into a folder."""
    words = [*cell.command, "replay", cell.data]
    if cell.config:
        words += ["--config", cell.config]
    if cell.data.is_dir():
        words += ["--seed", cell.seed]
    return [str(word) for word in [*words, "--out", run, *cell.replay]]


def execute(cell, folder):
    """Runs a cell in a folder. Returns its result; `status` is "done", "failed", or "killed" by a signal."""
    run = folder / "run"
    result = {name: getattr(cell, name) for name in ("recording", "configuration", "program", "seed")}
    with (folder / "said.txt").open("wb") as said:
        code, cpu_s, memory_mb, wall_s = call(replay_command(cell, run), said, said)
    result |= {"status": "done" if code == 0 else "failed" if code > 0 else "killed", "cpu_s": round(cpu_s, 4),
               "wall_s": round(wall_s, 4), "memory_mb": round(memory_mb, 1)}
    if code == 0 and cell.truth:
        with (folder / "eval.json").open("wb") as judged, (folder / "said.txt").open("ab") as said:
            code, *_ = call([*cell.judge, run, cell.truth, "--json", *cell.evaluation], judged, said)
        result["status"] = "done" if code == 0 else "failed"
    if code != 0:
        said = (folder / "said.txt").read_text(errors="replace").replace(f"{folder}/", "")  # which is gone afterwards
        (folder / "said.txt").write_text(said)
        lines = said.strip().splitlines()
        result["error"] = lines[-1].removeprefix("waymark: ") if lines else f"exit code {code}"
        return result
    result["figures"] = figures(run, folder / "eval.json")
    result["sum"] = _sum(run)
    for file in run.iterdir():
        if file.name not in cell.keep:
            shutil.rmtree(file) if file.is_dir() else file.unlink()
    return result


def figures(run, judged):
    """What eval found, the shares of the states, and the time of an update."""
    out = {}
    if judged.is_file():
        out = {name: value for name, value in json.loads(judged.read_text()).items() if not isinstance(value, (dict, list))}
    with (run / "trajectory.csv").open("rb") as file:
        at = file.readline().strip().split(b",").index(b"state")
        states = collections.Counter(line.strip().split(b",")[at] for line in file)
    total = sum(states.values())
    for state in ("tracking", "dead_reckoning", "degraded", "lost"):
        out[f"{state}_share"] = states[state.encode()] / total if total else None
    timing = json.loads((run / "timing.json").read_text())
    for stage in ("predict", "correct"):
        if stage in timing:
            # 90 of 100: the rarer ones are those that the computer's other work interrupts.
            out[f"{stage}_p90_us"] = timing[stage]["p90_us"]
    return out


def _sum(run):
    made = hashlib.sha256()
    for name in SUMMED:
        if (run / name).is_file():
            made.update(f"{name} {hashlib.sha256((run / name).read_bytes()).hexdigest()}\n".encode())
    return made.hexdigest()[:32]


class Store:
    """Results of cells in a folder, by their keys."""

    def __init__(self, folder):
        self.cells, self.failed = pathlib.Path(folder) / "cells", pathlib.Path(folder) / "failed"
        self.cells.mkdir(parents=True, exist_ok=True)

    def result(self, key):
        """The result of a cell that is done, else None."""
        try:
            return json.loads((self.cells / key / "cell.json").read_text())
        except FileNotFoundError:
            return None

    def run(self, cell, key):
        """The result of a cell; runs it where it is not there. A failed one is not kept: the next batch tries it again."""
        known = self.result(key)
        if known:
            return known
        part = self.cells / f".part-{_HOST}-{os.getpid()}-{threading.get_ident()}-{key}"
        shutil.rmtree(part, ignore_errors=True)
        part.mkdir()
        try:
            result = {"key": key, **execute(cell, part)}
            if result["status"] != "done":
                self.failed.mkdir(exist_ok=True)
                shutil.copy(part / "said.txt", self.failed / f"{key}.txt")
                return result
            (part / "cell.json").write_text(json.dumps(result, indent=1))
            try:
                part.rename(self.cells / key)
            except OSError:  # another process was sooner, with the same result
                pass
            (self.failed / f"{key}.txt").unlink(missing_ok=True)
            return result
        finally:
            shutil.rmtree(part, ignore_errors=True)

    def tidy(self):
        """Removes what processes of this computer that were killed left behind."""
        for part in self.cells.glob(f".part-{_HOST}-*"):
            pid = part.name.removeprefix(f".part-{_HOST}-").split("-")[0]
            if not os.path.exists(f"/proc/{pid}") or pid == str(os.getpid()):
                shutil.rmtree(part, ignore_errors=True)
