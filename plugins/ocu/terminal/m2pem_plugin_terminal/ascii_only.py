"""Terminals that show ASCII only: which they are, and what stands for other characters there."""

import locale
import os
from collections.abc import Mapping

from rich.cells import cell_len
from rich.segment import Segment
from textual.color import Color
from textual.filter import LineFilter

VARIABLE = "M2PEM_ASCII"
DUMB = frozenset({"dumb", "linux", "vt52", "vt100", "vt102", "vt220", "ansi"})
"""Values of TERM. The console of Linux has no braille characters."""

INSTEAD = str.maketrans(
    {
        **dict.fromkeys("●", "*"),
        **dict.fromkeys("○", "o"),
        **dict.fromkeys("◐", "%"),
        **dict.fromkeys("✓", "+"),
        **dict.fromkeys("✗", "x"),
        **dict.fromkeys("…", "~"),
        **dict.fromkeys("°", "'"),
        **dict.fromkeys("─━▁▔", "-"),
        **dict.fromkeys("│┃▎▏▕", "|"),
        **dict.fromkeys("├└┌┐┘┤╭╮╰╯", "+"),
        **dict.fromkeys("→", ">"),
        **dict.fromkeys("←", "<"),
        **dict.fromkeys("↑", "^"),
        **dict.fromkeys("↓", "v"),
        **dict.fromkeys("█▇▆▅▄▃▂", "#"),
        **dict.fromkeys("\xa0", " "),
        **dict.fromkeys("‖", "="),
    }
)


def ascii_only(environment: Mapping[str, str] = os.environ, encoding: str = "") -> bool:
    """Return whether the terminal shows ASCII only. `M2PEM_ASCII` says it: 1 or 0; else the kind
    of the terminal and the encoding of the locale do."""
    if said := environment.get(VARIABLE):
        return said != "0"
    encoding = encoding or locale.getpreferredencoding(do_setlocale=False)
    return environment.get("TERM") in DUMB or "utf" not in encoding.lower()


def in_ascii(text: str) -> str:
    """Return a text of the same width; "?" stands for what has nothing like it."""
    if text.isascii():
        return text
    text = text.translate(INSTEAD)
    return "".join(each if each.isascii() else "?" * cell_len(each) for each in text)


class AsciiFilter(LineFilter):
    """Writes every line of the screen in ASCII."""

    def apply(self, segments: list[Segment], background: Color) -> list[Segment]:
        """Return the same segments in ASCII."""
        return [Segment(in_ascii(text), style, control) for text, style, control in segments]
