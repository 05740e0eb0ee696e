"""The report of a campaign as one HTML file, which needs no other file and no network."""

import re
from collections.abc import Iterator, Sequence
from html import escape

from m2pem.campaign.charts import DARK, DARK_SCREEN, LIGHT
from m2pem.campaign.report import Report, Section, Table

STYLE = (
    f":root{{color-scheme:light dark;{LIGHT}}}{DARK_SCREEN}{{:root{{{DARK}}}}}"
    """
body{margin:0 auto;padding:16px;max-width:960px;background:var(--paper);color:var(--ink);
font:16px/1.5 system-ui,sans-serif}
h1,h2{line-height:1.25;overflow-wrap:anywhere}h2{margin-top:32px}
.wide{overflow-x:auto}.wide:focus-visible{outline:2px solid var(--good);outline-offset:2px}
table{border-collapse:collapse}td,th{padding:4px 12px 4px 0;text-align:left;vertical-align:top;
border-bottom:1px solid var(--rule)}tbody th{font-weight:normal}
tbody th:not(.number){min-width:120px}
.number{text-align:right;font-variant-numeric:tabular-nums}.interval{white-space:nowrap}
figure{margin:24px 0}.chart{max-width:100%;min-width:560px;height:auto}
@media print{:root{color-scheme:light}body{padding:0;max-width:none;font-size:9px}
tbody th:not(.number){min-width:0;overflow-wrap:anywhere}.interval{white-space:normal}
td,th{padding:2px 8px 2px 0}
.wide{overflow:visible}pre{white-space:pre-wrap;overflow-wrap:anywhere}.chart{min-width:0}
tr,figure{break-inside:avoid}h2{break-after:avoid}
thead{display:table-header-group}}
"""
)

# Nothing in the file may load anything.
POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"

_NUMBER = re.compile(r"[+-]?[0-9][0-9,]*(\.[0-9]+)?")
_INTERVAL = re.compile(rf"{_NUMBER.pattern} to {_NUMBER.pattern}")


def html_page(report: Report) -> str:
    """Return the HTML document of a report."""
    return "\n".join(
        [
            '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
            f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            '<link rel="icon" href="data:,">',
            f"<title>{escape(report.title)}</title>\n<style>{STYLE}</style>\n</head>",
            f"<body>\n<main>\n<h1>{escape(report.title)}</h1>",
            *(f"<p>{escape(text)}</p>" for text in report.paragraphs),
            *(
                part
                for number, section in enumerate(report.sections, 1)
                for part in _section(section, f"section-{number}")
            ),
            "</main>\n</body>\n</html>\n",
        ]
    )


def _section(section: Section, name: str) -> Iterator[str]:
    yield f'<section aria-labelledby="{name}">\n<h2 id="{name}">{escape(section.title)}</h2>'
    for text in section.before:
        yield f"<p>{escape(text)}</p>"
    yield _wide(f"Table: {section.title}", _table(section.table, name))
    for text in section.after:
        yield f"<p>{escape(text)}</p>"
    if section.commands:
        typed = escape("\n".join(section.commands))
        yield _wide(f"Commands: {section.title}", f"<pre>{typed}</pre>")
    if section.chart is not None:
        drawn = _wide(f"Chart: {section.chart.title}", section.chart.svg())
        yield f"<figure>\n{drawn}\n</figure>"
    yield "</section>"


def _wide(label: str, content: str) -> str:
    """Return what is scrolled sideways, also by keys, where the page is narrower."""
    return (
        f'<div class="wide" role="region" tabindex="0" aria-label="{escape(label)}">{content}</div>'
    )


def _table(table: Table, name: str) -> str:
    style = [_style(cells) for cells in zip(*table.rows, strict=True)]
    head = "".join(
        f'<th scope="col"{style[place]}>{escape(column)}</th>'
        for place, column in enumerate(table.columns)
    )
    body = "\n".join(
        "<tr>"
        f'<th scope="row"{style[0]}>{escape(row[0])}</th>'
        + "".join(f"<td{style[place]}>{escape(cell)}</td>" for place, cell in enumerate(row[1:], 1))
        + "</tr>"
        for row in table.rows
    )
    return (
        f'<table aria-labelledby="{name}">\n<thead><tr>{head}</tr></thead>\n'
        f"<tbody>\n{body}\n</tbody>\n</table>"
    )


def _style(cells: Sequence[str]) -> str:
    """Return the class of a column."""
    if any(map(_NUMBER.fullmatch, cells)):
        return ' class="number"'
    return ' class="interval"' if any(map(_INTERVAL.match, cells)) else ""
