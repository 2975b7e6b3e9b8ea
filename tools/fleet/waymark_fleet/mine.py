# SPDX-License-Identifier: Apache-2.0
"""`waymark mine`: what the black boxes of a fleet hold, by place and by cause."""
import argparse
import concurrent.futures
import datetime
import json
import math
import os
import pathlib
import re
import subprocess
import sys

from . import html, incidents, mine_page
from .plan import PlanError, desk_program, finite
from .sums import Sums, of_text, write_whole

EXAMPLES = """examples:
  waymark mine fleet/robot-*/box --out monday
  waymark mine runs/tuesday/events.wmlog --out monday --within 5
docs/fleet.md shows a page. Exit code: 0 done, 1 some logs could not be read, 2 usage."""
_KEPT = re.compile(r"(lost|died)-\d+-now\.wmlog$")
# Reports of one incident a place, of the places with the most.
_REPORTS_AT_MOST = 20


def parser():
    """The command line."""
    out = argparse.ArgumentParser(prog="waymark mine", formatter_class=argparse.RawDescriptionHelpFormatter, epilog=EXAMPLES,
                                  description="Lists what happened to a fleet: where robots were lost or doubted their pose and where programs died, with the cause. "
                                              "Each log of a black box is replayed once.")
    out.add_argument("box", metavar="BOX", nargs="+", help="black boxes, folders that hold some, or event logs")
    out.add_argument("--out", metavar="FOLDER", required=True, help="mine.html, mine.json, and what is known of each log")
    out.add_argument("--within", metavar="M", type=finite, default=2.0, help="incidents so near to the middle one are at one place; 2 m by default")
    out.add_argument("--all", action="store_true", help="also the present logs of black boxes (now.wmlog): doubts that ended well")
    out.add_argument("--jobs", metavar="N", type=int, default=len(os.sched_getaffinity(0)), help="at once; all cores by default")
    out.add_argument("--json", action="store_true", help="print mine.json")
    return out


def logs_of(boxes, all_logs):
    """[(log, kind)] of files and of the folders below which black boxes are."""
    out = []
    for box in map(pathlib.Path, boxes):
        if box.is_file():
            found = _KEPT.search(box.name)
            out.append((box, found[1] if found else ""))
            continue
        if not box.is_dir():
            raise PlanError(f"{box}: there is no such file or folder")
        for path in sorted(box.rglob("*.wmlog")):
            found = _KEPT.search(path.name)
            if found or all_logs and path.name == "now.wmlog":
                out.append((path, found[1] if found else ""))
    if not out:
        raise PlanError(f"{boxes[0]}: no log of a loss or a death is there (lost-NNNN-now.wmlog, died-NNNN-now.wmlog); --all takes now.wmlog, too")
    return out


def look(program, program_sum, sums, kept, log, kind):
    """What happened in a log, judged once. None: nothing; a text: why it could not be read."""
    file = kept / f"{of_text(f'{incidents.VERSION} {program_sum} {sums.file(log)} {kind}')[:32]}.json"
    try:
        known = json.loads(file.read_text())
    except (OSError, ValueError):
        try:
            known = incidents.judge(program, log, kind)
        except (ValueError, OSError, KeyError) as error:
            return str(error)
        write_whole(file, json.dumps(known))
    if known is None:
        return None
    return known | {"log": str(log), "robot": str(log.parent), "at": datetime.datetime.fromtimestamp(log.stat().st_mtime).isoformat(" ", "minutes")}


def _is_near(one, other, within_m):
    if one["map"] != other["map"]:
        return False
    away = math.hypot(one["x_m"] - other["x_m"], one["y_m"] - other["y_m"])
    return away <= within_m or math.isnan(one["x_m"]) and math.isnan(other["x_m"])


def places_of(found, within_m):
    """Incidents in groups of one map, the largest first: the incident with the most others within a radius, with these; then
    again among what is left. A chain of incidents along a corridor is several places."""
    near = [{k for k, other in enumerate(found) if _is_near(one, other, within_m)} for one in found]
    left, out = set(range(len(found))), []
    while left:
        middle = max(left, key=lambda i: (len(near[i] & left), -i))
        members = near[middle] & left | {middle}
        left -= members
        group = [found[i] for i in sorted(members)]
        causes = {}
        for one in group:
            causes.setdefault((one["cause"], one["about"]), []).append(one)
        out.append({"map": group[0]["map"], "x_m": sum(one["x_m"] for one in group) / len(group), "y_m": sum(one["y_m"] for one in group) / len(group),
                    "count": len(group), "robots": len({one["robot"] for one in group}),
                    "causes": [{"cause": cause, "about": about, "count": len(rows)} for (cause, about), rows in
                               sorted(causes.items(), key=lambda item: -len(item[1]))], "incidents": group})
    return sorted(out, key=lambda place: -place["count"])


def add_reports(places, program, report, out):
    """A report of the newest incident of each place."""
    for number, place in enumerate(places[:_REPORTS_AT_MOST], start=1):
        newest = max(place["incidents"], key=lambda one: one["at"])
        run, page = out / "runs" / f"place-{number:02d}", out / f"place-{number:02d}.html"
        done = subprocess.run([*program, "replay", newest["log"], "--out", run, "--force"], capture_output=True, check=False)
        if done.returncode == 0:
            done = subprocess.run([*report, run, "--out", page], capture_output=True, check=False)
        place["report"] = page.name if done.returncode == 0 else None


def main(argv=None, beside=None):
    """The program."""
    given = parser().parse_args(argv)
    beside = beside or pathlib.Path(sys.argv[0]).resolve().parent
    try:
        return _run(given, beside)
    except (PlanError, OSError, subprocess.CalledProcessError) as error:
        print(f"waymark mine: {error}", file=sys.stderr)
        return 2


def _run(given, beside):
    program, report = desk_program("waymark", beside), desk_program("waymark-report", beside)
    logs = logs_of(given.box, given.all)
    out = pathlib.Path(given.out)
    kept = out / "known"
    kept.mkdir(parents=True, exist_ok=True)
    sums = Sums()
    program_sum = sums.program(program)
    found, unread = [], []
    with concurrent.futures.ThreadPoolExecutor(max(1, given.jobs)) as pool:
        looks = pool.map(lambda one: look(program, program_sum, sums, kept, *one), logs)
        for number, (log, result) in enumerate(zip(logs, looks), start=1):
            if isinstance(result, str):
                unread.append({"log": str(log[0]), "error": result})
            elif result:
                found.append(result)
            if sys.stderr.isatty():
                print(f"\r\033[K{number} of {len(logs)} logs", end="" if number < len(logs) else "\r\033[K", file=sys.stderr, flush=True)
    places = places_of(found, given.within)
    add_reports(places, program, report, out)
    whole = {"format": "waymark-mine/1", "logs": len(logs), "incidents": len(found), "unread": unread,
             "places": [{**place, "incidents": [{k: v for k, v in one.items() if k not in ("way", "landmarks")} for one in place["incidents"]]} for place in places]}
    write_whole(out / "mine.json", json.dumps(whole, indent=1))
    (out / "mine.html").write_text(mine_page.make(html.style(report), places, len(logs), unread), encoding="utf-8")
    for row in unread[:10]:
        print(f"not read: {row['error']}", file=sys.stderr)
    print(json.dumps(whole, indent=1) if given.json else mine_page.text_of(places, len(logs), out))
    return 1 if unread else 0
