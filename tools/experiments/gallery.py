# SPDX-License-Identifier: MIT
"""The gallery page: one HTML file beside its pictures that opens without a server."""

from html import escape

STYLE = """
body { font: 16px/1.45 system-ui, sans-serif; max-width: 62em; margin: 2em auto; padding: 0 1em }
img { max-width: 100%; border: 1px solid #ccc } figure { margin: 1em 0 2em }
figcaption { color: #333 } table { border-collapse: collapse; margin: 1em 0 }
td, th { border: 1px solid #bbb; padding: .25em .7em; text-align: right }
td:first-child, th:first-child { text-align: left } nav a { margin-right: 1em }
"""


def write(path, outcomes):
    """Write the page of these outcomes, in order."""
    parts = [
        '<!doctype html><html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width"><title>Plumb: experiments</title>',
        f"<style>{STYLE}</style></head><body><h1>The papers' systems, and what does better</h1>",
        "<nav>",
        *(f'<a href="#e{k}">{escape(o.title)}</a>' for k, o in enumerate(outcomes)),
        "</nav>",
    ]
    for k, outcome in enumerate(outcomes):
        parts += _section(k, outcome)
    parts.append("</body></html>\n")
    path.write_text("\n".join(parts), encoding="utf-8")


def _section(k, outcome):
    yield f'<section id="e{k}"><h2>{escape(outcome.title)}</h2><p>{escape(outcome.paper)}</p>'
    if outcome.rows:
        yield "<table>" + _row("th", outcome.header)
        for row in outcome.rows:
            yield _row("td", row)
        yield "</table>"
    if outcome.notes:
        yield "<ul>" + "".join(f"<li>{escape(note)}</li>" for note in outcome.notes) + "</ul>"
    for name, caption in outcome.pictures:
        yield f'<figure><img src="{escape(name)}" alt="{escape(caption)}" loading="lazy">'
        yield f"<figcaption>{escape(caption)}</figcaption></figure>"
    yield "</section>"


def _row(tag, cells):
    return "<tr>" + "".join(f"<{tag}>{escape(_text(c))}</{tag}>" for c in cells) + "</tr>"


def _text(cell):
    return f"{cell:.3g}" if isinstance(cell, float) else str(cell)


def as_text(outcome):
    """The table of an outcome for the terminal."""
    lines = [[_text(c) for c in row] for row in (outcome.header, *outcome.rows) if row]
    if not lines:
        return ""
    widths = [max(len(row[k]) for row in lines) for k in range(len(lines[0]))]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if k == 0 else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        for row in lines
    )
