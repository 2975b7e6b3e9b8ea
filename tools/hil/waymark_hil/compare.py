# SPDX-License-Identifier: Apache-2.0
"""`waymark hil --compare`: what a change made slower, later or less accurate on the same target."""
import json
import math
import pathlib
import sys

from waymark_fleet import html, statistics

from . import HilError, limits, page, verdict

# Family-wise rate of false alarms of the figures that are compared second by second.
ALPHA = 0.01
# Series of a test, and the figure whose limit holds for it.
_SECONDS = {"truth_m": "truth_rmse_m", "apart_m": "position_rmse_m", "cpu_share": "cpu_share", "memory_mb": "memory_mb"}


def load(folder):
    """A test's result.json."""
    file = pathlib.Path(folder) / "result.json"
    try:
        result = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise HilError(f"{file}: {error.strerror}; `waymark hil REC --config C --out {folder}` writes it") from None
    except ValueError as error:
        raise HilError(f"{file}: {error}") from None
    if result.get("format") != verdict.FORMAT:
        raise HilError(f"{file}: its format is not {verdict.FORMAT}")
    return result


def _by_second(before, after, name):
    """p of the signed-rank test over the seconds that both have; None: too few, or not measured."""
    one, two = dict(map(tuple, before["per_second"].get(name, []))), dict(map(tuple, after["per_second"].get(name, [])))
    both = sorted(one.keys() & two.keys())
    differences = [two[second] - one[second] for second in both]
    return statistics.signed_rank(differences) if len(both) >= 6 else None


def judge(before, after, allowed):
    """A row for each figure that both tests have; worse counts beyond its limit, and where seconds are compared, beyond chance."""
    rows = []
    for figure, pair in allowed.items():
        one, two = before["figures"].get(figure), after["figures"].get(figure)
        if pair is None or not all(value is not None and math.isfinite(value) for value in (one, two)):
            continue
        share, least = pair
        series = next((name for name, owner in _SECONDS.items() if owner == figure), None)
        rows.append({"figure": figure, "before": one, "after": two, "change": two - one, "share": (two - one) / one if one else None,
                     "limit": max(share * abs(one), least), "p": _by_second(before, after, series) if series else None})
    measured = [row for row in rows if row["p"] is not None]
    for row, p in zip(measured, statistics.holm([row["p"] for row in measured])):
        row["p"] = p
    for row in rows:
        beyond = abs(row["change"]) > row["limit"] and (row["p"] is None or row["p"] < ALPHA)
        row["verdict"] = ("worse" if row["change"] > 0 else "better") if beyond else "no difference found"
    return rows


def _new_failures(before, after):
    """Checks that passed before and fail now."""
    passed = {(row["group"], row["name"]) for row in before["checks"] if row["status"] != verdict.FAILED}
    known = {(row["group"], row["name"]) for row in before["checks"]}
    return [row for row in after["checks"] if row["status"] == verdict.FAILED and ((row["group"], row["name"]) in passed or (row["group"], row["name"]) not in known)]


def compare(before, after, allowed):
    """The result as comparison.json has it, and its checks for JUnit."""
    try:
        return _compare(before, after, allowed)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise HilError(f"a test's result.json is damaged: {type(error).__name__}: {error}") from None


def _compare(before, after, allowed):
    for key in ("recording", "target"):
        if before[key] != after[key]:
            raise HilError(f"the tests are of different {key}s: {before[key]} and {after[key]}; the same is compared with the same")
    rows, failing, checks = judge(before, after, allowed), _new_failures(before, after), verdict.Checks()
    for row in rows:
        checks.add("comparison", row["figure"], row["verdict"] != "worse",
                   f"{row['before']:.4g} before, {row['after']:.4g} after; a change up to {row['limit']:.3g} is allowed" + (f", p {row['p']:.2g}" if row["p"] is not None else ""),
                   row["after"], row["before"] + row["limit"])
    for row in failing:
        checks.add("comparison", f"{row['group']}: {row['name']}", False, f"passed before: {row['text']}")
    if not rows:
        raise HilError("the tests have no figure in common")
    return {"format": "waymark-hil-comparison/1", "recording": after["recording"], "target": after["target"], "figures": rows,
            "now_failing": [{"group": row["group"], "name": row["name"], "text": row["text"]} for row in failing],
            "is_worse": bool(checks.failed())}, checks


def _page(style, names, result):
    worse = [row for row in result["figures"] if row["verdict"] == "worse"]
    head = ("; ".join(f"{html.escape(row['figure'])} became <em>worse</em>" for row in worse) or "<em>No difference</em> was found that counts") + "."
    if result["now_failing"]:
        head += f" <em>{len(result['now_failing'])}</em> checks that passed before fail now."
    rows = [[html.escape(row["figure"]), (row["verdict"] if row["verdict"] in ("worse", "better") else "", row["verdict"]), html.short(row["before"], 4), html.short(row["after"], 4),
             "–" if row["share"] is None else f"{100 * row['share']:+.1f}&nbsp;%", html.short(row["limit"]), "–" if row["p"] is None else f"{row['p']:.2g}"] for row in result["figures"]]
    how = ("Both tests played the same recording on the same target. A change counts beyond its limit; where p is there, it also has to be beyond chance: signed-rank test "
           "of each second with itself, for all such figures together (Holm).")
    body = (f"<header><h1>{html.escape(names[0])} and {html.escape(names[1])}</h1><p class=\"headline\">{head}</p></header>"
            + html.section("Figures", how, html.table(["figure", "verdict", "before", "after", "change", "allowed", "p"], rows)))
    body += html.section("Checks that fail now", "They passed before.", '<ul class="findings">' + "".join(
        f'<li class="bad"><p><b>{html.escape(row["group"])}: {html.escape(row["name"])}</b></p><p>{html.escape(row["text"])}</p></li>' for row in result["now_failing"]) + "</ul>"
        if result["now_failing"] else "")
    return html.page("Comparison", style, body, "waymark hil --compare")


def main(given, one, two, beside):
    """Compares two tests' folders; 1 where something became worse."""
    _, allowed = limits.read(given.limits, False)
    result, checks = compare(load(one), load(two), allowed)
    out = pathlib.Path(given.out or "hil-compare")
    out.mkdir(parents=True, exist_ok=True)
    (out / "comparison.json").write_text(json.dumps(result, indent=1), encoding="utf-8")
    (out / "junit.xml").write_bytes(verdict.junit(checks, f"waymark hil {result['recording']} comparison", 0.0))
    (out / "comparison.html").write_text(_page(page.sheet(beside), (str(one), str(two)), result), encoding="utf-8")
    if given.json:
        print(json.dumps(result, indent=1))
    else:
        for row in result["figures"]:
            print(f"{row['verdict']:20} {row['figure']:24} {row['before']:.4g} -> {row['after']:.4g} (allowed {row['limit']:.3g})")
        for row in result["now_failing"]:
            print(f"fails now            {row['group']}: {row['name']}: {row['text']}")
        print(f"{'worse' if result['is_worse'] else 'no worse'}; {out}/comparison.html, junit.xml", file=sys.stdout)
    return 1 if result["is_worse"] else 0
