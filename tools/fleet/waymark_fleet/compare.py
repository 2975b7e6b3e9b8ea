# SPDX-License-Identifier: Apache-2.0
"""`waymark compare`: what a change did to all drives of a batch."""
import argparse
import json
import os
import pathlib
import re
import subprocess
import sys

from . import compare_page, comparison, html
from .plan import PlanError, desk_program, finite

EXAMPLES = """examples:
  waymark compare nightly-monday nightly-tuesday --out monday-tuesday.html
  waymark compare nightly:program=released nightly:program=built --json
docs/fleet.md explains each figure. Exit code: 0 nothing became worse, 1 something did, 2 usage."""


def parser():
    """The command line."""
    out = argparse.ArgumentParser(prog="waymark compare", formatter_class=argparse.RawDescriptionHelpFormatter, epilog=EXAMPLES,
                                  description="Compares two batches drive by drive: a verdict for position, heading, NEES, lost, latency and CPU, "
                                              "on one page with the drives that became worse most.")
    out.add_argument("before", metavar="BEFORE", help="folder of waymark batch, or FOLDER:program=NAME (also configuration=, seed=)")
    out.add_argument("after", metavar="AFTER", help="likewise, after the change")
    out.add_argument("--out", metavar="FILE", default="comparison.html", help="the page; comparison.html by default")
    out.add_argument("--json", action="store_true", help="print the verdicts as JSON")
    out.add_argument("--alpha", metavar="P", type=finite, default=comparison.ALPHA, help="rate of false alarms of all figures together; 0.01 by default")
    out.add_argument("--tolerate", metavar="FIGURE=SIZE", action="append", default=[],
                     help="a change that does not count, as position=0.02; figures: " + ", ".join(figure.name for figure in comparison.FIGURES))
    out.add_argument("--no-reports", action="store_true", help="without the reports of the worst drives")
    return out


def tolerances_of(words):
    """{figure: size}"""
    known = [figure.name for figure in comparison.FIGURES]
    out = {}
    for word in words:
        name, _, size = word.partition("=")
        try:
            out[name] = finite(size)
        except argparse.ArgumentTypeError:
            raise PlanError(f"--tolerate {word}: write FIGURE=SIZE, as position=0.02") from None
        if name not in known:
            raise PlanError(f"--tolerate {word}: the figures are {', '.join(known)}")
    return out


def began(diff, one, two):
    """What differs first between two runs, by waymark diff."""
    if not (one / "trajectory.csv").is_file() or not (two / "trajectory.csv").is_file():
        return "the runs are not kept"
    done = subprocess.run([*diff, one, two], capture_output=True, text=True, check=False)
    found = re.search(r"^The first difference is at t = \S+ s \(t_ns (\d+)\) in (.*)", done.stdout, re.MULTILINE)
    if found:
        with (one / "trajectory.csv").open() as file:
            begun_ns = int([next(file), next(file)][1].split(",")[0])
        return f"{(int(found[1]) - begun_ns) * 1e-9:.3f} s after the start, in {found[2]}"
    return "the runs are the same" if done.returncode == 0 else done.stderr.strip() or "files without stamps differ"


def worst_drives(given, folders, pairs, beside):
    """The ten worst drives, with their reports beside the page."""
    figure, found = comparison.worst(pairs)
    diff, report = desk_program("waymark-diff", beside), desk_program("waymark-report", beside)
    page = pathlib.Path(given.out)
    place = page.parent / f"{page.stem}-reports"
    rows = []
    for number, (_, one, two) in enumerate(found, start=1):
        runs = [folder / "cells" / row["key"] / "run" for folder, row in zip(folders, (one, two))]
        links = {}
        for side, run, row in zip(("before", "after"), runs, (one, two)):
            if given.no_reports or not (run / "trajectory.csv").is_file():
                continue
            place.mkdir(parents=True, exist_ok=True)
            file = place / f"{number:02d}-{side}.html"
            judged_by = row["truth"] or row["data"]
            recording = [judged_by] if os.path.isdir(judged_by) else []
            done = subprocess.run([*report, run, *recording, "--out", file], capture_output=True, text=True, check=False)
            if done.returncode == 0:
                links[side] = f"{place.name}/{file.name}"
        rows.append({"name": comparison.name_of(two, [pair[1] for pair in pairs]), "before": figure.value(one), "after": figure.value(two),
                     "began": began(diff, *runs), "reports": links})
    return figure, rows


def compare(given, beside):
    """The result as JSON has it, and the pairs."""
    (folder_one, before), (folder_two, after) = comparison.load(given.before), comparison.load(given.after)
    pairs = comparison.pairs_of(before, after)
    is_apart = folder_one.resolve() != folder_two.resolve()
    verdicts = comparison.judge(pairs, given.alpha, tolerances_of(given.tolerate), is_apart)
    figure, worst = worst_drives(given, (folder_one, folder_two), pairs, beside)
    failing = [{"name": comparison.name_of(two, after), "error": two.get("error", "")} for one, two in pairs
               if one["status"] == "done" and two["status"] != "done"]
    return {"format": "waymark-comparison/1", "before": given.before, "after": given.after, "drives": len(pairs), "alpha": given.alpha, "is_apart": is_apart,
            "only_before": len(before) - len(pairs), "only_after": len(after) - len(pairs),
            "same_bits": sum(one.get("sum") is not None and one.get("sum") == two.get("sum") for one, two in pairs),
            "is_worse": bool(failing) or any(row["verdict"] == "worse" for row in verdicts), "verdicts": verdicts,
            "now_failing": failing, "worst_by": figure.title, "worst": worst}, pairs


def text_of(result, page):
    """The verdicts for a terminal."""
    lines = [f"{result['drives']} drives, {result['same_bits']} with the same bits"
             + (f"; {result['only_before']} only before, {result['only_after']} only after" if result["only_before"] or result["only_after"] else "")]
    for row in result["verdicts"]:
        change = compare_page.change_text(row, row["change"]).replace("&nbsp;", " ") if "p" in row else ""
        change += f", p {row['p_holm']:.2g}" if "p_holm" in row else ", not judged: put both programs into one plan" if change else ""
        lines.append(f"  {row['title']:28} {row['verdict']:20} {change}")
    if result["now_failing"]:
        lines.append(f"  {len(result['now_failing'])} drives now fail: {result['now_failing'][0]['name']}: {result['now_failing'][0]['error']}")
    return "\n".join([*lines, f"written to {page}"])


def main(argv=None, beside=None):
    """The program."""
    given = parser().parse_args(argv)
    beside = beside or pathlib.Path(sys.argv[0]).resolve().parent
    try:
        result, pairs = compare(given, beside)
        page = compare_page.make(html.style(desk_program("waymark-report", beside)), result, pairs)
        pathlib.Path(given.out).write_text(page, encoding="utf-8")
    except (PlanError, OSError, KeyError, subprocess.CalledProcessError) as error:
        print(f"waymark compare: {error}", file=sys.stderr)
        return 2
    print(json.dumps(result, indent=1) if given.json else text_of(result, given.out))
    return 1 if result["is_worse"] else 0
