"""Colours and strokes of drawings, and in which of them something is drawn."""

from dataclasses import dataclass

INK = "#22242a"
PAPER = "#ffffff"
FAINT = "#b4b8bf"
PATH = "#1261b5"
PATH_PAPER = "#e6f0fb"
STUCK = "#c62828"
STUCK_PAPER = "#fdeaea"
WAITING = "#b26a00"
WAITING_PAPER = "#fff4e0"


@dataclass(frozen=True, slots=True)
class Ink:
    """What lines, areas and texts are drawn in; `weight` is added to the width of strokes."""

    stroke: str = INK
    fill: str = PAPER
    text: str = INK
    weight: float = 0.0


PLAIN = Ink()
UNREACHED = Ink(FAINT, PAPER, "#8a8f98")
ON_PATH = Ink(PATH, PATH_PAPER, INK, 0.5)
WAITS = Ink(WAITING, WAITING_PAPER, INK, 0.5)
IS_STUCK = Ink(STUCK, STUCK_PAPER, INK, 1.0)
