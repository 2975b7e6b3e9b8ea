# SPDX-License-Identifier: Apache-2.0
"""Parts of a page in the look of `waymark report`: its style sheet is the report's own."""
import html
import math
import subprocess

# What the report's style sheet does not have: dots of drives, rows of verdicts.
_MORE = """
.chart{display:block;width:100%;height:auto;border:1px solid var(--rule);border-radius:10px;background:var(--card)}
.chart text{font:15px system-ui,-apple-system,'Segoe UI',Roboto,'DejaVu Sans',sans-serif;fill:var(--soft)}
.chart .rule{stroke:var(--grid);fill:none}.chart .even{stroke:var(--soft);stroke-dasharray:6 4;fill:none}
.chart circle{fill:var(--blue);fill-opacity:.5}.chart circle.worse{fill:var(--orange);fill-opacity:.8}.chart circle.better{fill:var(--green);fill-opacity:.8}
.chart .range{stroke:var(--blue);stroke-width:3}.chart .way{fill:none;stroke:var(--pale);stroke-width:1.4}
.chart .spot{stroke:var(--card);stroke-width:1.5}.chart .number{fill:var(--ink);font-weight:600}
.lost-spot{fill:var(--orange)}.died-spot{fill:var(--ink)}.doubted-spot{fill:var(--amber)}
td small{display:block;color:var(--soft);white-space:normal;min-width:12em;max-width:20em}td.worse{color:var(--orange);font-weight:600}td.better{color:var(--green);font-weight:600}td a,li a{color:var(--blue)}
.headline em.worse{color:var(--orange)}.headline em.better{color:var(--green)}
@media (max-width:620px){.chart text{font-size:27px}.chart circle{r:6}}
"""


def style(report):
    """The style sheet of a page. `report`: the command of waymark report."""
    done = subprocess.run([*report, "--style"], capture_output=True, text=True, check=True)
    return done.stdout + _MORE


def escape(text):
    """Text in HTML."""
    return html.escape(str(text))


def page(title, sheet, body, program):
    """A whole page with nothing beside it."""
    return (f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width,initial-scale=1">'
            f'<meta name="color-scheme" content="light dark"><title>{escape(title)} – Waymark</title><style>{sheet}</style></head>\n'
            f"<body><main>\n{body}<footer>Made by <code>{program}</code>.</footer>\n</main></body></html>\n")


def section(title, how, body):
    """A part of the page, with a sentence how to read it."""
    return f'<section><h2>{title}</h2><p class="how">{how}</p>{body}</section>\n' if body else ""


def tiles(values):
    """(value, words) each."""
    return '<div class="tiles">' + "".join(f"<div><b>{value}</b><span>{words}</span></div>" for value, words in values) + "</div>\n"


def table(head, rows):
    """A table. A cell is its HTML, or (class, HTML)."""
    def cells(tag, row):
        return "".join(f'<{tag} class="{cell[0]}">{cell[1]}</{tag}>' if isinstance(cell, tuple) else f"<{tag}>{cell}</{tag}>" for cell in row)
    lines = "".join(f"<tr>{cells('td', row)}</tr>\n" for row in rows)
    return f'<div class="wide"><table><tr>{cells("th", head)}</tr>\n{lines}</table></div>\n'


def round_steps(low, high, wanted=6):
    """Round numbers between two values, for the lines of a grid."""
    if not high > low:
        return [low]
    rough = (high - low) / wanted
    unit = 10 ** math.floor(math.log10(rough))
    step = next(k * unit for k in (1, 2, 5, 10) if k * unit >= rough)
    return [k * step for k in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)]


def short(value, digits=3):
    """A number with so many digits, or a dash."""
    return "–" if value is None or not math.isfinite(value) else f"{value:.{digits}g}"
