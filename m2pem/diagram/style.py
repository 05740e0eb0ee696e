"""Colours, strokes and fonts of drawings, and how wide texts are."""

from collections.abc import Sequence
from dataclasses import dataclass

FOREGROUND = "#22242a"
BACKGROUND = "#ffffff"
FAINT = "#b4b8bf"
PATH = "#1261b5"
PATH_FILL = "#e6f0fb"
STUCK = "#c62828"
STUCK_FILL = "#fdeaea"
WAITING = "#b26a00"
WAITING_FILL = "#fff4e0"


@dataclass(frozen=True, slots=True)
class Style:
    """What lines, areas and texts are drawn in; `weight` is added to the width of strokes."""

    stroke: str = FOREGROUND
    fill: str = BACKGROUND
    text: str = FOREGROUND
    weight: float = 0.0


PLAIN = Style()
UNREACHED = Style(FAINT, BACKGROUND, "#8a8f98")
ON_PATH = Style(PATH, PATH_FILL, FOREGROUND, 0.5)
WAITS = Style(WAITING, WAITING_FILL, FOREGROUND, 0.5)
IS_STUCK = Style(STUCK, STUCK_FILL, FOREGROUND, 1.0)


FONT = "Arial, 'Liberation Sans', Helvetica, sans-serif"
LINE_HEIGHT = 1.2
"""Of the size."""

_WIDTHS = {
    "ijl'|": 0.23,
    " .,:;!ftI[]/\\": 0.28,
    "r-()`{}": 0.34,
    "ckJvxyszabdeghnopqu0123456789$?L_#": 0.56,
    "ABEKPSVXYFTZ&": 0.67,
    "CDHNRUw": 0.72,
    "GOQ": 0.78,
    "mM": 0.83,
    "W%": 0.94,
}
_OTHERS = 0.6
_WIDE = 1.0  # Chinese, Japanese, Korean and the like
_WIDE_FROM = "\u2e80"
_BY_LETTER = {letter: width for letters, width in _WIDTHS.items() for letter in letters}


def width_of(text: str, size: float) -> float:
    """About how wide a text is in common sans-serif fonts."""
    return size * sum(
        _BY_LETTER.get(each, _WIDE if each >= _WIDE_FROM else _OTHERS) for each in text
    )


def wrapped(text: str, width: float, size: float, most: int = 0) -> list[str]:
    """The text in lines that fit; words that do not are broken. `most` lines, 0 for any number."""
    lines = [line for part in text.split("\n") for line in _wrap(part.split(), width, size)]
    if most and len(lines) > most:
        lines = [
            *lines[: most - 1],
            cut(f"{lines[most - 1]} {lines[most]}", width, size, force=True),
        ]
    return lines


def cut(text: str, width: float, size: float, *, force: bool = False) -> str:
    """The text, or as much of it as fits with an ellipsis; `force`: with one anyway."""
    if not force and width_of(text, size) <= width:
        return text
    while text and width_of(f"{text}\u2026", size) > width:
        text = text[:-1]
    return f"{text.rstrip()}\u2026"


def _wrap(words: Sequence[str], width: float, size: float) -> list[str]:
    lines: list[str] = []
    line = ""
    for word in words:
        longer = f"{line} {word}" if line else word
        if width_of(longer, size) <= width:
            line = longer
            continue
        if line:
            lines.append(line)
        *whole, line = _broken(word, width, size)
        lines += whole
    return [*lines, line] if line else lines


def _broken(word: str, width: float, size: float) -> list[str]:
    """A word in parts that fit; one that does fit is one part."""
    parts = []
    while width_of(word, size) > width and len(word) > 1:
        fits = _fitting(word, width, size)
        parts.append(word[:fits])
        word = word[fits:]
    return [*parts, word]


def _fitting(word: str, width: float, size: float) -> int:
    """How many letters of a long word go on a line: up to a break inside of it, if there is one."""
    fits = 1
    while fits < len(word) and width_of(word[: fits + 1], size) <= width:
        fits += 1
    for at in range(fits, fits // 2, -1):
        humps = word[at - 1].islower() and word[at : at + 1].isupper()
        if humps or not word[at - 1].isalnum():
            return at
    return fits
