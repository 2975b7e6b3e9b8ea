# SPDX-License-Identifier: Apache-2.0
"""The page of what happened to a fleet: the map with its places, what happened there, and why."""
import collections
import math

from . import html, incidents

_WIDE, _EDGE = 940, 50
_KINDS = {"lost": "lost", "died": "died", "doubted": "doubted"}
# Of one map: more ways than these only cover each other.
_WAYS_AT_MOST = 40


def _cause_words(cause, about, count):
    return f"{count} × {html.escape(cause)}" + (f" ({html.escape(about)})" if about else "")


def text_of(places, logs, out):
    """The places for a terminal."""
    count = sum(place["count"] for place in places)
    lines = [f"{count} incidents in {logs} logs, at {len(places)} places"]
    for number, place in enumerate(places[:20], start=1):
        causes = ", ".join(f"{c['count']} x {c['cause']}" + (f" ({c['about']})" if c["about"] else "") for c in place["causes"][:3])
        lines.append(f"  {number:2}  ({place['x_m']:.1f}, {place['y_m']:.1f}) m  {place['count']:4} incidents, {place['robots']} robots: {causes}")
    return "\n".join([*lines, f"written to {out}/mine.html and {out}/mine.json"])


def _map(places):
    """The picture of one map: landmarks, ways, and a numbered dot a place."""
    members = [one for _, place in places for one in place["incidents"]]
    points = [(x, y) for one in members for x, y in one["way"]] + [(x, y) for _, x, y in members[0]["landmarks"]]
    points += [(place["x_m"], place["y_m"]) for _, place in places]
    points = [p for p in points if math.isfinite(p[0]) and math.isfinite(p[1])]
    if not points:
        return ""
    low = [min(p[k] for p in points) for k in (0, 1)]
    high = [max(p[k] for p in points) for k in (0, 1)]
    scale = (_WIDE - 2 * _EDGE) / max(high[0] - low[0], 0.6 * (high[1] - low[1]), 0.1)
    tall = (high[1] - low[1]) * scale + 2 * _EDGE

    def at(x, y):
        return f"{_EDGE + (x - low[0]) * scale:.1f} {_EDGE + (high[1] - y) * scale:.1f}"
    parts = []
    for axis in (0, 1):
        for step in html.round_steps(low[axis], high[axis]):
            line = f"M{at(step, high[1])}L{at(step, low[1])}" if axis == 0 else f"M{at(low[0], step)}L{at(high[0], step)}"
            x, y = at(step, low[1]).split() if axis == 0 else at(low[0], step).split()
            anchor = f'x="{x}" y="{float(y) + 24:.0f}" text-anchor="middle"' if axis == 0 else f'x="{float(x) - 8:.0f}" y="{y}" text-anchor="end"'
            parts.append(f'<path class="rule" d="{line}"/><text {anchor}>{step:g}</text>')
    for one in members[:_WAYS_AT_MOST]:
        parts.append('<path class="way" d="M' + "L".join(at(x, y) for x, y in one["way"]) + '"/>')
    for _, x, y in members[0]["landmarks"]:
        cx, cy = at(x, y).split()
        parts.append(f'<rect class="landmark" x="{float(cx) - 4:.1f}" y="{float(cy) - 4:.1f}" width="8" height="8"/>')
    for number, place in reversed(places):
        if not math.isfinite(place["x_m"]):
            continue
        kinds = collections.Counter(one["kind"] for one in place["incidents"])
        cx, cy = at(place["x_m"], place["y_m"]).split()
        radius = 9 + 5 * math.sqrt(place["count"])
        parts.append(f'<circle class="spot {kinds.most_common(1)[0][0]}-spot" style="fill-opacity:.75" cx="{cx}" cy="{cy}" r="{min(radius, 60):.0f}"/>'
                     f'<text class="number" x="{cx}" y="{float(cy) + 5:.0f}" text-anchor="middle">{number}</text>')
    return f'<svg class="chart" viewBox="0 0 {_WIDE} {tall:.0f}" role="img" aria-label="map of the places">{"".join(parts)}</svg>'


def _maps(places):
    by_map = {}
    for number, place in enumerate(places, start=1):
        by_map.setdefault(place["map"], []).append((number, place))
    pictures = "".join((f"<h3>Map {html.escape(name) or 'without a name'}</h3>" if len(by_map) > 1 else "") + _map(members)
                       for name, members in by_map.items())
    legend = ('<ul class="legend"><li><i class="key lost-spot" style="background:var(--orange)"></i>mostly lost</li>'
              '<li><i class="key" style="background:var(--amber)"></i>mostly doubted</li>'
              '<li><i class="key" style="background:var(--ink)"></i>mostly ended programs</li>'
              '<li><svg class="swatch" viewBox="0 -8 28 16"><rect class="landmark" x="9" y="-4" width="8" height="8"/></svg>landmark</li></ul>')
    return html.section("Where", "A dot is a place, numbered as below; its area grows with the number of incidents. Thin lines are the ways of the robots "
                        "before. Metres.", f"<figure>{pictures}{legend}</figure>" if pictures else "")


def _places(places):
    rows = []
    for number, place in enumerate(places[:200], start=1):
        causes = "<br>".join(_cause_words(c["cause"], c["about"], c["count"]) for c in place["causes"])
        example = place["incidents"][0]["text"]
        link = f'<a href="{place["report"]}">report</a>' if place.get("report") else "–"
        rows.append([str(number), f"{html.short(place['x_m'])}, {html.short(place['y_m'])}", str(place["count"]), str(place["robots"]), ("words", causes),
                     ("words", html.escape(example)), link])
    return html.section("Places", "The places with the most incidents first. The report shows the newest incident there.",
                        html.table(["place", "x, y", "incidents", "robots", ("words", "causes"), ("words", "for example"), "report"], rows) if rows else "")


def _causes(found):
    rows = []
    counts = collections.Counter((one["cause"], one["about"]) for one in found)
    for (cause, about), count in counts.most_common():
        words, anchor = incidents.CAUSES[cause]
        robots = len({one["robot"] for one in found if (one["cause"], one["about"]) == (cause, about)})
        rows.append([f"{html.escape(cause)}<small>{html.escape(about)}</small>", str(count), str(robots), ("words", html.escape(words)),
                     ("words", f"docs/troubleshooting.md#{anchor}")])
    return html.section("Why", "The causes, as the runtime's own findings and the refused innovations show them.",
                        html.table(["cause", "incidents", "robots", ("words", "usually"), ("words", "what to do")], rows) if rows else "")


def _list(found):
    rows = [[html.escape(one["at"]), html.escape(one["kind"]), f"{html.escape(one['cause'])}<small>{html.escape(one['text'])}</small>",
             f"{html.short(one['x_m'])}, {html.short(one['y_m'])}", ("words", html.escape(one["log"]))] for one in
            sorted(found, key=lambda one: one["at"], reverse=True)]
    return f"<details><summary>All incidents</summary>{html.table(['written', 'what', 'cause', 'x, y', ('words', 'log')], rows)}</details>\n" if rows else ""


def make(sheet, places, logs, unread):
    """The page as HTML."""
    found = [one for place in places for one in place["incidents"]]
    kinds = collections.Counter(one["kind"] for one in found)
    causes = collections.Counter(one["cause"] for one in found).most_common(1)
    headline = f"In {logs} logs, <em>{len(found)}</em> incidents at {len(places)} places."
    if causes:
        headline += f" The most frequent cause is <em>{html.escape(causes[0][0])}</em> ({causes[0][1]} times): {html.escape(incidents.CAUSES[causes[0][0]][0])}."
    tiles = html.tiles([(str(kinds[kind]), words) for kind, words in (("lost", "poses lost"), ("doubted", "poses doubted"), ("died", "programs ended"))]
                       + [(str(len({one["robot"] for one in found})), "robots")])
    broken = "".join(f"<li>{html.escape(row['error'])}</li>" for row in unread[:20])
    note = f'<p class="note">{len(unread)} logs could not be read:</p><ul class="findings">{broken}</ul>' if unread else ""
    body = f'<header><h1>Black boxes of a fleet</h1><p class="headline">{headline}</p>{tiles}{note}</header>' + _maps(places) + _places(places) + _causes(found) + _list(found)
    return html.page("Black boxes", sheet, body, "waymark mine")
