"""How results look in a notebook: SVG drawings, and HTML in which every text is escaped.

Names come from other people's files, so no text of a result is HTML by itself.
"""

from collections.abc import Iterable, Sequence
from html import escape

_COLOURS = {
    **dict.fromkeys(("holds", "completed", "terminated"), "#3b8a55"),
    **dict.fromkeys(("violated", "error", "failed", "stopped"), "#b3322a"),
    **dict.fromkeys(("undecided", "warning"), "#b7791f"),
}
"""Of words that say how something is or has ended, as in the drawings."""


class Svg(str):
    """The text of an SVG document. A notebook shows it as a picture."""

    __slots__ = ()

    def _repr_svg_(self) -> str:
        return str(self)


def headline(word: str, text: str) -> str:
    """Return a line that begins with a verdict or outcome in its colour."""
    return f"<p>{_coloured(word)}: {escape(text)}</p>"


def paragraph(text: str) -> str:
    """Return a paragraph."""
    return f"<p>{escape(text)}</p>"


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table; a cell that is a verdict, an outcome or a severity has its colour."""
    head = "".join(f"<th>{escape(each)}</th>" for each in header)
    lines = [
        "".join(f'<td style="text-align:left">{_coloured(each)}</td>' for each in row)
        for row in rows
    ]
    body = "".join(f"<tr>{each}</tr>" for each in lines)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def numbered(lines: Iterable[str]) -> str:
    """Return a list of steps that are numbered from 1."""
    return f"<ol>{''.join(f'<li>{escape(each)}</li>' for each in lines)}</ol>"


def picture(svg: str) -> str:
    """Return a drawing that is scrolled sideways where the page is narrower."""
    return f'<div style="overflow-x:auto">{svg}</div>'


def page(title: str, body: str) -> str:
    """Return a whole HTML document that needs no other file."""
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head><meta charset="utf-8">'
        f"<title>{escape(title)}</title>\n"
        "<style>body{font-family:sans-serif;margin:1.5em}td,th{padding:.2em .6em;"
        "text-align:left}</style></head>\n"
        f"<body>\n{body}\n</body>\n</html>\n"
    )


def _coloured(word: str) -> str:
    colour = _COLOURS.get(word)
    text = escape(word)
    return f'<strong style="color:{colour}">{text}</strong>' if colour else text
