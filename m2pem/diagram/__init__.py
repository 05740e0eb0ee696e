"""Draws BPMN diagrams as SVG, with overlays: a run's path, what is stuck, what is unreached.

    svg = draw(Path("mission.bpmn").read_bytes(), Overlays(stuck={"Join": "waits for ever"}))

A diagram is drawn as its author set it; a file without one is laid out. Nothing but the file's
bytes is looked at: a file need not be a mission that can be executed.
"""

from m2pem.diagram.overlays import Overlays
from m2pem.diagram.painter import paint
from m2pem.diagram.planes import pictures_of

__all__ = ["Overlays", "draw"]


def draw(
    source: bytes,
    overlays: Overlays | None = None,
    *,
    title: str = "",
    note: str = "",
    about: str = "",
) -> str:
    """A BPMN file as SVG: all that its diagrams show, plane by plane.

    Each symbol and line is a group with the element's id as `data-element-id`. `title` and `note`
    are texts above the drawing, `about` goes into the SVG's metadata.

    Raises:
        m2pem.bpmn.xml.XmlError: the bytes are no XML that m2pem reads.
        ValueError: the file has no diagram, and cannot be laid out; the message says why.
    """
    return paint(pictures_of(source), overlays or Overlays(), title=title, note=note, about=about)
