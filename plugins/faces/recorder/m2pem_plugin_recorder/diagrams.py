"""Diagrams of missions as recordings have them."""

from m2pem.api import Mission
from m2pem.diagram import draw


def diagram_of(mission: Mission) -> str:
    """Return the diagram of a mission's own file as SVG; "" if it cannot be laid out."""
    try:
        return draw(mission.source)
    except ValueError:
        return ""
