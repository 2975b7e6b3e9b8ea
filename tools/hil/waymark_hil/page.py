# SPDX-License-Identifier: Apache-2.0
"""The page of a test: verdict, checks, faults, and the target's figures over the time. In the look of `waymark report`."""
import math

from waymark_fleet import html
from waymark_fleet.plan import desk_program

from . import verdict

_WIDE, _HIGH, _LEFT, _BELOW = 940, 260, 80, 40
_POINTS_AT_MOST = 1500
_CHARTS = [("apart_m", "Distance from the replay", "m", "Each pose over LCM beside the replay of what the run saw."),
           ("truth_m", "Error from the truth", "m", "Each pose over LCM beside the recording's truth."),
           ("cpu_share", "Processor's time", "processors", "All threads of the run."),
           ("memory_mb", "Resident memory", "MB", "Of the run's process."),
           ("temperature_c", "Temperature", "°C", "Of the hottest zone."),
           ("clock_mhz", "Clock rate", "MHz", "Of the slowest processor.")]


def sheet(beside):
    """The report's style sheet, and what it does not have."""
    return html.style(desk_program("waymark-report", beside)) + (
        ".chart .fault{fill:var(--orange);fill-opacity:.12}.chart .curve{fill:none;stroke:var(--blue);stroke-width:2}"
        "td.failed{color:var(--orange);font-weight:600}td.passed{color:var(--green)}td.skipped{color:var(--soft)}")


def per_second(series):
    """{name: [[second, mean]]}: what two tests are compared by."""
    out = {}
    for name, rows in series.items():
        sums = {}
        for t, value in rows:
            if math.isfinite(value):
                total, count = sums.get(math.floor(t), (0.0, 0))
                sums[math.floor(t)] = total + value, count + 1
        out[name] = [[second, total / count] for second, (total, count) in sorted(sums.items())]
    return out


def _chart(rows, unit, faults, end_s):
    rows = [(t, v) for t, v in rows if math.isfinite(v)]
    if len(rows) < 2:
        return ""
    step = max(1, len(rows) // (_POINTS_AT_MOST // 2))
    groups = [rows[i:i + step] for i in range(0, len(rows), step)]  # least and most of each: no peak is lost
    shown = rows if step == 1 else [row for group in groups for row in sorted({min(group, key=lambda r: r[1]), max(group, key=lambda r: r[1])})]
    left, right = min(0.0, shown[0][0]), max(shown[-1][0], end_s)
    low, high = min(0.0, *(v for _, v in shown)), max(v for _, v in shown)
    high = high if high > low else low + 1

    def x_of(t):
        return _LEFT + (t - left) / (right - left) * (_WIDE - _LEFT - 20)

    def y_of(v):
        return _HIGH - _BELOW - (v - low) / (high - low) * (_HIGH - _BELOW - 20)
    parts = []
    for fault in faults:
        a, b = fault["from_s"], min(end_s if fault.get("until_s") is None else max(fault["until_s"], fault["from_s"] + 0.3), right)
        parts.append(f'<rect class="fault" x="{x_of(a):.1f}" y="20" width="{max(1.0, x_of(b) - x_of(a)):.1f}" height="{_HIGH - _BELOW - 20}">'
                     f"<title>{html.escape(fault['name'])}</title></rect>")
    for value in html.round_steps(low, high, 4):
        parts.append(f'<path class="rule" d="M{_LEFT} {y_of(value):.1f}H{_WIDE - 20}"/><text x="{_LEFT - 8}" y="{y_of(value) + 5:.1f}" text-anchor="end">{value:.3g}</text>')
    for value in html.round_steps(left, right, 8):
        parts.append(f'<text x="{x_of(value):.1f}" y="{_HIGH - 16}" text-anchor="middle">{value:g}</text>')
    curve = "M" + "L".join(f"{x_of(t):.1f} {y_of(v):.1f}" for t, v in shown)
    return (f'<svg class="chart" viewBox="0 0 {_WIDE} {_HIGH}" role="img">{"".join(parts)}<path class="curve" d="{curve}"/>'
            f'<text x="{_WIDE - 20}" y="{_HIGH - 2}" text-anchor="end">s</text><text x="{_LEFT}" y="14">{unit}</text></svg>')


def _headline(result):
    rows = result["checks"]
    failed = [row for row in rows if row["status"] == verdict.FAILED]
    passed = sum(row["status"] == verdict.PASSED for row in rows)
    word = f"<em>{len(failed)}</em> of {len(rows)} checks failed" if failed else f"All {passed} checks that were judged <em>passed</em>"
    return f'<p class="headline">{word}: {html.escape(result["recording"])} on {html.escape(result["target"])}.</p>'


def _tiles(result):
    figures = result["figures"]
    known = [("position_max_m", 1e3, "mm", "largest distance from the replay"), ("heading_max_deg", 1, "°", "largest turn from it"), ("truth_rmse_m", 1e3, "mm", "RMS from the truth"),
             ("lost_share", 100, "%", "lost of the worst source"), ("wake_p99_us", 1, "µs", "wake-up, p99"), ("send_p99_us", 1e-3, "ms", "made to sent, p99"),
             ("cpu_share", 100, "%", "of one processor"), ("memory_mb", 1, "MB", "resident"), ("play_late_max_ms", 1, "ms", "player's largest lateness")]
    def shown(value, factor, unit):
        return f"{value:.3g}&nbsp;m" if unit == "mm" and value >= 1 else f"{value * factor:.3g}&nbsp;{unit}"
    return html.tiles([(shown(figures[key], factor, unit), words) for key, factor, unit, words in known if figures.get(key) is not None])


def _check_table(rows):
    return html.table(["check", "verdict", ("words", "found"), "limit"],
                      [[html.escape(row["name"]), (row["status"], "not judged" if row["status"] == verdict.SKIPPED else row["status"]), ("words", html.escape(row["text"])),
                        html.short(row["limit"]) if row["limit"] is not None else "–"] for row in rows])


def _faults(rows, faults):
    """One row a fault; its checks below it."""
    table, details = [], ""
    for fault in faults:
        mine = [row for row in rows if row["group"] == f"fault: {fault['name']}"]
        failed = [row for row in mine if row["status"] == verdict.FAILED]
        judged = [row for row in mine if row["status"] == verdict.PASSED]
        status = verdict.FAILED if failed else verdict.PASSED if judged else verdict.SKIPPED
        until = "the end" if fault.get("until_s") is None else f"{fault['until_s']:g} s"
        table.append([html.escape(fault["name"]), html.escape(fault["fault"].replace("_", " ")), f"{fault['from_s']:g} s to {until}",
                      (status, "not judged" if status == verdict.SKIPPED else status), ("words", html.escape("; ".join(row["text"] for row in (failed or mine)[:3])))])
        details += f"<details><summary>{html.escape(fault['name'])}</summary>{_check_table(mine)}</details>\n"
    if not table:
        return ""
    return html.section("Faults", "What was broken on purpose, and whether health and poses were as the faults file has it.",
                        html.table(["fault", "what", "when", "verdict", ("words", "found")], table) + details)


def make(style, result, series, faults):
    """The page as HTML."""
    rows = result["checks"]
    own = [row for row in rows if not row["group"].startswith("fault: ")]
    failed = [row for row in rows if row["status"] == verdict.FAILED]
    body = f"<header><h1>{html.escape(result['recording'])} on {html.escape(result['target'])}</h1>" + _headline(result) + _tiles(result)
    body += f'<p class="note">{html.escape("; ".join(result["computer"]))}. Configuration {html.escape(result["config"])}; {result["seconds"]:.0f} s were driven in {result["took_s"]:.0f} s.</p></header>'
    if failed:
        body += html.section("What failed", "Each with what was found, and where to look.", '<ul class="findings">' + "".join(
            f'<li class="bad"><p><b>{html.escape(row["group"])}: {html.escape(row["name"])}</b></p><p>{html.escape(row["text"])}</p></li>' for row in failed) + "</ul>")
    body += _faults(rows, faults)
    for group in dict.fromkeys(row["group"] for row in own):
        body += html.section(group.capitalize(), _HOW.get(group, ""), _check_table([row for row in own if row["group"] == group]))
    for name, title, unit, how in _CHARTS:
        body += html.section(title, how + (" Shaded: faults." if faults else ""), _chart(series.get(name, []), unit, faults, result["seconds"]))
    body += html.section("Threads", "Share of one processor while it drove, the busiest first. Threads of one name are one row.",
                         html.table(["thread", "share"], [[html.escape(name), f"{100 * share:.2f}&nbsp;%"] for name, share in result["threads"]]) if result["threads"] else "")
    return html.page(f"{result['recording']} on {result['target']}", style, body, "waymark hil")


_HOW = {"target": "The computer, as the doctor found it, and the program's end.", "player": "How late data were given to the interfaces.",
        "log": "The event log is replayed at the desk.", "poses": "What a subscriber heard, beside a replay of the same recording with what the run saw.",
        "truth": "The recording's truth.", "losses": "By the run's own counts, and those of the interfaces.", "timing": "Of the estimator's thread.",
        "computer": "While it drove.", "health": "While nothing was broken."}
