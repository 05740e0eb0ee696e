"""Draws a mission: its diagram as a picture."""

from collections.abc import Iterable
from pathlib import Path

from m2pem.api.authoring import MissionSource
from m2pem.diagram.mission_files import draw_mission
from m2pem.mission.mission import Mission
from m2pem.scripting.html import Svg
from m2pem.scripting.sources import load_mission


def draw(mission: MissionSource | Mission, search_path: Iterable[str | Path] = ()) -> Svg:
    """Return the diagram of a mission's own file as SVG, which a notebook shows as a picture.

    Raises:
        MissionError: it cannot be read, or is wrong; with every finding.
        ValueError: the file has no diagram, and cannot be laid out.
    """
    return Svg(draw_mission(load_mission(mission, search_path))[""])
