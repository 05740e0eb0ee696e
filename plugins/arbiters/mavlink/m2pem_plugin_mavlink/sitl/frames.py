"""Which program of ArduPilot simulates a frame, and with which parameters.

Source: Tools/autotest/pysim/vehicleinfo.py of ArduPilot.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from m2pem_plugin_mavlink.vehicle.identity import Kind

COPTER, ROVER, PLANE, SUB = "arducopter", "ardurover", "arduplane", "ardusub"

DEFAULTS: Mapping[str, str] = {
    COPTER: "default_params/copter.parm",
    ROVER: "default_params/rover.parm",
    PLANE: "models/plane.parm",
    SUB: "default_params/sub.parm",
}
"""The parameters that the usual frame of a program needs, below Tools/autotest."""


@dataclass(frozen=True, slots=True)
class Frame:
    """A frame of ArduPilot. `name` is its `--model`; `parameters`: files below Tools/autotest."""

    name: str
    program: str
    kind: Kind
    parameters: tuple[str, ...]


def _frame(name: str, program: str, kind: Kind, *more: str) -> Frame:
    return Frame(name, program, kind, (DEFAULTS[program], *more))


FRAMES: Mapping[str, Frame] = {
    frame.name: frame
    for frame in (
        _frame("quad", COPTER, Kind.COPTER),
        _frame("hexa", COPTER, Kind.COPTER, "default_params/copter-hexa.parm"),
        _frame("plane", PLANE, Kind.PLANE),
        Frame("quadplane", PLANE, Kind.VTOL, ("default_params/quadplane.parm",)),
        _frame("rover", ROVER, Kind.ROVER),
        _frame("rover-skid", ROVER, Kind.ROVER, "default_params/rover-skid.parm"),
        _frame("motorboat", ROVER, Kind.BOAT, "default_params/motorboat.parm"),
        _frame("vectored", SUB, Kind.SUB),
    )
}

FRAMES_OF: Mapping[str, tuple[str, ...]] = {
    "air": ("quad", "hexa", "plane", "quadplane"),
    "ground": ("rover", "rover-skid"),
    "surface": ("motorboat",),
    "subsurface": ("vectored",),
}
"""The frames of a domain, the usual one first."""

PX4_MODELS: Mapping[str, str] = {"air": "sihsim_quadx", "ground": "sihsim_rover_ackermann"}
"""The usual model of PX4's own simulation (SIH) of a domain."""
