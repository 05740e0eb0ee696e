"""Diagrams of missions as recordings have them."""

from functools import lru_cache

from m2pem.api import Mission
from m2pem.diagram import draw

MOST_KEPT = 16
"""Missions whose diagrams are kept: those that start again and again are drawn once."""


def diagram_of(mission: Mission) -> str:
    """Return the diagram of a mission's own file as SVG; "" if it cannot be laid out."""
    return _drawn(mission.source)


@lru_cache(MOST_KEPT)
def _drawn(source: bytes) -> str:
    try:
        return draw(source)
    except ValueError:
        return ""
