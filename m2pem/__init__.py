"""m2pem: a mission executive for teams of unmanned vehicles.

A mission is a BPMN 2.0 diagram; m2pem checks it against a fleet, rehearses it on a virtual clock
and executes it with tokens. Start with `load_mission` and `load_fleet`, or with the command line.
"""

from pathlib import Path
from typing import TYPE_CHECKING

from m2pem.hookspecs import hookimpl

if TYPE_CHECKING:
    from m2pem.model.elements import Mission

__version__ = "0.1.0"

__all__ = ["__version__", "hookimpl", "load_mission"]


def load_mission(path: str | Path) -> "Mission":
    """Read a mission from a BPMN 2.0 file.

    Raises:
        MissionError: the file cannot be read or executed; it carries every finding.
    """
    # XML parsing is imported here, so that the command line starts fast without it.
    from m2pem.model.bpmn import read_mission  # noqa: PLC0415

    return read_mission(path)
