#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Draws docs/images/threads.svg: the threads of a live run and what they share. Names and sizes of threads and rings are read
from firmware/live/threads.[ch] and firmware/live/live.h. tests/golden/docs.py checks that the picture is up to date.

    threads.py > threads.svg"""
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]
TABLE = (ROOT / "firmware/live/threads.c").read_text()
SIZES = (ROOT / "firmware/live/threads.h").read_text()
WIDTH, HEIGHT = 1090, 500

STYLE = """
  svg { --paper: #ffffff; --ink: #1f2328; --soft: #59636e; --line: #818b98; --thread: #ddeafc; --fast: #ffe3d1; --ring: #e6f4e4; --part: #f2f3f5; }
  @media (prefers-color-scheme: dark) {
    svg { --paper: #151b23; --ink: #e6edf3; --soft: #9aa5b1; --line: #768390; --thread: #1c3554; --fast: #58331c; --ring: #1f3d2b; --part: #262c36; }
  }
  text { font: 13px system-ui, "Segoe UI", "DejaVu Sans", sans-serif; fill: var(--ink); }
  .name { font-weight: 600; }
  .soft { font-size: 11.5px; fill: var(--soft); }
  .box { stroke: var(--line); stroke-width: 1.2; }
  .thread { fill: var(--thread); } .fast { fill: var(--fast); } .ring { fill: var(--ring); } .part { fill: var(--part); }
  .way { fill: none; stroke: var(--ink); stroke-width: 1.4; marker-end: url(#tip); }
  .shared { stroke-dasharray: 5 4; stroke: var(--soft); }
  #tip path { fill: var(--ink); }"""


def spec(role):
    """Name, ring slots and period in ms (0: none) of a thread, by the table of threads.c."""
    match = re.search(rf'\[{role}\]\s*= \{{"([\w-]+)",\s*\d,\s*[^,]+,\s*(\d+),\s*(\d+)', TABLE)
    return match[1], int(match[2]), int(match[3])


def size(name):
    return int(re.search(rf"#define {name} (\d+)", SIZES)[1])


def text(x, y, words, style="", anchor="middle"):
    return f'<text x="{x}" y="{y}" class="{style}" text-anchor="{anchor}">{words}</text>'


def box(x, y, w, h, style, *lines):
    """A rectangle with its first line as its name."""
    out = [f'<rect x="{x}" y="{y}" width="{w}" height="{h}" rx="6" class="box {style}"/>']
    top = y + h / 2 - (len(lines) - 1) * 8 + 4
    out += [text(x + w / 2, round(top + i * 16), line, "soft" if i else "name") for i, line in enumerate(lines)]
    return "\n".join(out)


def ring(x, y, label, w=76):
    """A row of slots."""
    out = [f'<rect x="{x}" y="{y - 9}" width="{w}" height="18" rx="3" class="box ring"/>']
    out += [f'<path d="M{x + w * i / 6:.1f} {y - 9}v18" class="box"/>' for i in range(1, 6)]
    return "\n".join([*out, text(x + w / 2, y - 14, label, "soft")])


def way(d, style=""):
    return f'<path d="{d}" class="way {style}"/>'


def drawing():
    source, camera, estimator = spec("THREAD_SOURCE")[0], spec("THREAD_CAMERA")[0], spec("THREAD_ESTIMATOR")[0]
    publish, disk = spec("THREAD_PUBLISH"), spec("THREAD_DISK")
    parts = []
    # Inputs and source threads.
    rows = (("can", 70, "CAN bus"), ("commands, sightings", 155, "LCM"), ("DETECTOR:CAMERA", 250, None), ("DETECTOR:CAMERA", 335, None))
    for i, (name, y, hardware) in enumerate(rows):
        parts.append(box(350, y - 27, 150, 54, "thread", f"{source}-{i}", name))
        if hardware:
            parts += [box(12, y - 17, 96, 34, "part", hardware), way(f"M108 {y}H348")]
        parts += [way(f"M500 {y}H522"), ring(526, y, "events"), way(f"M602 {y}H626")]
    parts += [box(12, 275, 96, 34, "part", "camera"), way("M108 292H126"), box(128, 263, 110, 58, "thread", f"{camera}-N", "decodes once"),
              way("M238 292H256")]
    parts += [f'<rect x="{258 + 5 * i}" y="{271 + 5 * i}" width="44" height="30" rx="3" class="box ring"/>' for i in range(3)]
    parts += [text(285, 260, "frame hub", "soft"), way("M314 283 348 258"), way("M314 303 348 327")]
    # The estimator's thread.
    parts.append(box(628, 43, 132, 319, "fast", estimator, "SCHED_FIFO", "absolute ticks", "", "arrive: merge", "advance: fuser", "publish: predictor"))
    # Its rings, and the consumers.
    for y, name, slots in ((75, "to_publish", size("PUBLISH_RING_SLOTS")), (130, "healths", size("HEALTH_RING_SLOTS")),
                           (280, "to_disk", spec("THREAD_ESTIMATOR")[1]), (335, "maps", 1)):
        parts += [way(f"M760 {y}H782"), ring(786, y, f"{name} ({slots})"), way(f"M862 {y}H886")]
    parts += [box(888, 48, 110, 104, "thread", publish[0], f"every {publish[2]} ms"), box(888, 253, 110, 109, "thread", disk[0], f"every {disk[2]} ms")]
    parts += [way("M998 80H1022"), way("M998 125H1022"), text(1026, 84, "LCM", "", "start"), text(1026, 129, "systemd", "", "start")]
    for y, name in ((275, "run folder"), (296, "event log"), (317, "black box"), (338, "saved pose")):
        parts.append(text(1004, y, name, "soft", "start"))
    parts += [text(1004, 356, "saved map", "soft", "start")]
    parts += [way("M943 152V168"), ring(905, 196, f"lines ({size('LINE_RING_SLOTS')}; of each source {size('SOURCE_LINE_RING_SLOTS')})"), way("M943 205V251")]
    # What is shared besides rings.
    parts += [way("M694 362V398H425V364", "shared"), text(560, 392, "newest pose (sequence lock), for detectors", "soft")]
    parts += [way("M425 43V22H943V46", "shared"), text(684, 16, "counts of each source (atomics)", "soft")]
    parts += [way("M285 313V440H943V364", "shared"), text(614, 434, "pictures for the black box and the recorder (frame hub)", "soft")]
    # Key.
    x = 12
    for style, words, w in (("thread", "normal thread", 150), ("fast", "real-time thread", 165), ("ring", "ring of fixed slots, one producer and one consumer", 365)):
        parts += [f'<rect x="{x}" y="466" width="22" height="16" rx="3" class="box {style}"/>', text(x + 30, 479, words, "soft", "start")]
        x += w
    parts += [way(f"M{x} 474h26", "shared"), text(x + 36, 479, "shared besides rings", "soft", "start")]
    body = "\n".join(parts)
    return f"""<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" role="img">
<title>Threads of a live run and the rings between them</title>
<style>{STYLE}
</style>
<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto"><path d="M0 0 8 4 0 8z"/></marker></defs>
<rect width="{WIDTH}" height="{HEIGHT}" rx="10" style="fill: var(--paper)"/>
{body}
</svg>
"""


if __name__ == "__main__":
    print(drawing(), end="")
