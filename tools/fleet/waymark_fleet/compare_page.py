# SPDX-License-Identifier: Apache-2.0
"""The page of a comparison: verdicts, all drives before and after, and the worst of them."""
import math
import random

from . import comparison, html

# One circle a drive, 45 bytes each: a page of 1000 drives stays far below 2 MB.
_DRIVES_AT_MOST = 5000
_WIDE, _HIGH, _LEFT, _BELOW = 940, 560, 90, 60


def change_text(row, value):
    """A change as a person reads it: per cent of a ratio, else the difference."""
    if value is None:
        return "–"
    is_share = row["is_ratio"] or row["figure"] == "lost"
    return f"{100 * value:+.2f}&nbsp;%" if is_share else f"{value:+.3f}"


def _headline(verdicts, names):
    worse = [row for row in verdicts if row["verdict"] == "worse"]
    better = [row for row in verdicts if row["verdict"] == "better"]
    parts = []
    for rows, word in ((worse, "worse"), (better, "better")):
        if rows:
            parts.append(" and ".join(f"the {row['title']} ({change_text(row, row['change'])})" for row in rows)
                         + f' became <em class="{word}">{word}</em>')
    if not parts:
        parts = ["<em>no difference</em> was found"]
    text = f"Of {names['pairs']} drives, " + "; ".join(parts) + "."
    if names["failing"]:
        text += f" <em class='worse'>{names['failing']}</em> drives that were replayed before now fail."
    return f'<p class="headline">{text}</p>'


def _verdict_table(verdicts, alpha, is_apart):
    rows = []
    for row in verdicts:
        title = f"{html.escape(row['title'])}<small>{html.escape(row['about'])}</small>"
        if row["verdict"] == "not measured":
            rows.append([title, "not measured", "–", "–", "–", "–", "–", str(row["drives"])])
            continue
        interval = "–" if row["low"] is None else f"{change_text(row, row['low'])} … {change_text(row, row['high'])}"
        rows.append([title, (row["verdict"] if row["verdict"] in ("worse", "better") else "", row["verdict"]), change_text(row, row["change"]),
                     interval, f"{row['p_holm']:.2g}" if "p_holm" in row else "–", change_text(row, row["tolerance"]).lstrip("+"), f"{row['worse']} / {row['better']}", str(row["drives"])])
    how = (f"Each drive is compared with itself. The change is the mean over the drives without the fifth that changed most in each direction, "
           f"with its 95&nbsp;% bootstrap interval; p is of the signed-rank test and holds for all figures together (Holm). A change counts from "
           f"p&nbsp;&lt;&nbsp;{alpha:g} on, and where it exceeds the tolerance: what two runs of the same program differ by.")
    if is_apart:
        how += (" The sides are of two batches, between which the computer's speed changes. So times have no verdict; "
                "put both programs into one plan to have one.")
    head = ["figure", "verdict", "change", "95&nbsp;% interval", "p", "tolerance", "drives worse / better", "drives"]
    return html.section("Verdicts", how, html.table(head, rows))


def _scatter(pairs, figure):
    """Before and after of each drive on logarithmic axes."""
    points = [(figure.value(one), figure.value(two)) for one, two in pairs if comparison.difference(figure, one, two) is not None]
    points = [(a, b) for a, b in points if a > 0 and b > 0]
    if not points:
        return ""
    shown = points if len(points) <= _DRIVES_AT_MOST else random.Random(1).sample(points, _DRIVES_AT_MOST)
    low = math.log10(min(map(min, points))) - 0.1
    high = math.log10(max(map(max, points))) + 0.1

    def x_of(value):
        return _LEFT + (math.log10(value) - low) / (high - low) * (_WIDE - _LEFT - 20)

    def y_of(value):
        return _HIGH - _BELOW - (math.log10(value) - low) / (high - low) * (_HIGH - _BELOW - 20)
    parts = []
    steps = []
    for leading in ((1,), (1, 2, 5), range(1, 10)):  # the fewest that are enough
        if len(steps) < 4:
            steps = [k * 10 ** e for e in range(math.floor(low), math.ceil(high) + 1) for k in leading if low <= math.log10(k) + e <= high]
    for step in steps:
        parts.append(f'<path class="rule" d="M{x_of(step):.0f} 20V{_HIGH - _BELOW}M{_LEFT} {y_of(step):.0f}H{_WIDE - 20}"/>'
                     f'<text x="{x_of(step):.0f}" y="{_HIGH - _BELOW + 26}" text-anchor="middle">{step:g}</text>'
                     f'<text x="{_LEFT - 10}" y="{y_of(step) + 5:.0f}" text-anchor="end">{step:g}</text>')
    ends = (10 ** low, 10 ** high)
    parts.append(f'<path class="even" d="M{x_of(ends[0]):.0f} {y_of(ends[0]):.0f}L{x_of(ends[1]):.0f} {y_of(ends[1]):.0f}"/>')
    for a, b in shown:
        mark = ' class="worse"' if b > a * comparison.LARGE_CHANGE else ' class="better"' if a > b * comparison.LARGE_CHANGE else ""
        parts.append(f'<circle{mark} cx="{x_of(a):.0f}" cy="{y_of(b):.0f}" r="3.5"/>')
    parts.append(f'<text x="{(_LEFT + _WIDE) / 2:.0f}" y="{_HIGH - 8}" text-anchor="middle">before, m</text>'
                 f'<text transform="translate(20 {_HIGH / 2:.0f}) rotate(-90)" text-anchor="middle">after, m</text>')
    how = (f"A dot is a drive. On the dashed line nothing changed; above it, in orange from a factor of {comparison.LARGE_CHANGE} on, it became worse; "
           "below, in green, better. Both axes are logarithmic, in metres.")
    if len(shown) < len(points):
        how += f" {len(shown)} of {len(points)} drives are drawn."
    return html.section("Position error of each drive", how, f'<svg class="chart" viewBox="0 0 {_WIDE} {_HIGH}" role="img" '
                        f'aria-label="position error before and after">{"".join(parts)}</svg>')


def _worst_table(worst, unit):
    rows = []
    for drive in worst:
        links = " ".join(f'<a href="{html.escape(link)}">{side}</a>' for side, link in drive["reports"].items()) or "–"
        rows.append([html.escape(drive["name"]), html.short(drive["before"]), html.short(drive["after"]), links,
                     ("words", html.escape(drive["began"]))])
    how = f"{unit}, before and after, with the reports of both runs, and the first difference between them as <code>waymark diff</code> finds it."
    return html.section("The drives that became worse most", how, html.table(["drive", "before", "after", "reports", ("words", "what changed first")], rows)
                        if rows else "<p>No drive became worse.</p>")


def _all_drives(pairs, names):
    rows = []
    for one, two in pairs:
        cells = [html.escape(comparison.name_of(two, names))]
        for key in ("position_rmse_m", "heading_rmse_deg", "nees_mean"):
            cells += [html.short(row.get("figures", {}).get(key)) for row in (one, two)]
        rows.append(cells)
    head = ["drive"] + [f"{title} {side}" for title in ("position m", "heading °", "NEES") for side in ("before", "after")]
    return f"<details><summary>All drives</summary>{html.table(head, rows)}</details>\n"


def make(sheet, result, pairs):
    """The page as HTML."""
    names = result["before"], result["after"]
    same = f"{result['same_bits']} of them gave the same bits. " if result["same_bits"] else ""
    note = f'<p class="note">{same}Before: {html.escape(names[0])}. After: {html.escape(names[1])}.</p>'
    position = next(figure for figure in comparison.FIGURES if figure.name == "position")
    body = (f"<header><h1>{html.escape(names[0])} and {html.escape(names[1])}</h1>"
            + _headline(result["verdicts"], {"pairs": len(pairs), "failing": len(result["now_failing"])}) + note + "</header>"
            + _verdict_table(result["verdicts"], result["alpha"], result["is_apart"]) + _failures(result) + _scatter(pairs, position)
            + _worst_table(result["worst"], f"By the {result['worst_by']}") + _all_drives(pairs, [two for _, two in pairs]))
    return html.page("Comparison", sheet, body, "waymark compare")


def _failures(result):
    items = "".join(f"<li class=\"bad\"><p><b>{html.escape(row['name'])}</b></p><p>{html.escape(row['error'])}</p></li>" for row in result["now_failing"][:20])
    return html.section("Drives that now fail", "Their replay ended with an error. Each is a worse verdict by itself.",
                        f'<ul class="findings">{items}</ul>' if items else "")
