# SPDX-License-Identifier: Apache-2.0
"""Replays that eval judges, as the cells of `waymark batch`: results are kept by what they depend on, and two folders of
them are compared by `waymark compare`."""
import json
import pathlib
import sys
import tempfile
import threading

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tools/fleet"))
from waymark_fleet import batch, cell, plan, sums

from replays import Refused


def out_option(parser):
    """--out FOLDER"""
    parser.add_argument("--out", metavar="FOLDER", help="keeps the runs: the next call repeats what has changed; two folders are compared "
                        "by `waymark compare BEFORE AFTER`")


class Bench:
    """A folder of judged runs; a temporary one where none is given. Its functions may be called by several threads."""

    def __init__(self, bin_dir, folder=None):
        self._temporary = None if folder else tempfile.TemporaryDirectory(prefix="waymark-bench-")
        self.folder = pathlib.Path(folder or self._temporary.name).resolve()
        self._program, self._judge = ((str(bin_dir / name),) for name in ("waymark", "waymark-eval"))
        self._store = cell.Store(self.folder)
        self._store.tidy()
        self._sums, self._results, self._lock = sums.Sums(self.folder / "sums.json"), [], threading.Lock()

    def judge(self, title, recording, config, evaluation=(), replay=(), seed=1, keep=plan.KEPT):
        """(figures of eval, folder of the run). The title names the row of the results. Raises Refused: a program's error."""
        options, judged_by = tuple(map(str, replay)), tuple(map(str, evaluation))
        one = plan.Cell(title, pathlib.Path(config).stem, "waymark", seed, recording, recording, pathlib.Path(config), self._program, self._judge, options,
                        judged_by, tuple(keep))
        self._sums.forget(one.data, one.config)  # a caller may write them anew under the same name
        key = one.key(self._sums)
        result = batch.row_of(one, self._store.run(one, key))
        with self._lock:
            self._results.append(result)
        if result["status"] != "done":
            raise Refused(result["error"])
        return json.loads((self._store.cells / key / "eval.json").read_text()), self._store.cells / key / "run"

    def write_results(self, made_by):
        """results.csv and results.json, in the order of their titles, and the known sums."""
        self._sums.keep()
        batch.write_results(self.folder, sorted(self._results, key=lambda row: (row["recording"], row["configuration"], row["seed"])), made_by)
