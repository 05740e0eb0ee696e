"""The modes that the systems of the face announce.

The autopilot is MAV_AUTOPILOT_GENERIC: m2pem is neither ArduPilot nor PX4. MAVSDK reads the modes
of all autopilots but ArduPilot as those of PX4, so the numbers are PX4's; QGroundControl asks for
AVAILABLE_MODES and shows the names. pymavlink and MAVProxy read the modes of all autopilots but PX4
as those of ArduPilot: stations that ask for data streams, which only ArduPilot has, are sent
ArduPilot's numbers. pymavlink has AVAILABLE_MODES in the dialect `development` only.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.protocol.messages import Message, MessageType, message_type_of
from m2pem_plugin_mavlink.vehicle.driver import FlightMode
from m2pem_plugin_mavlink.vehicle.identity import Firmware, Identity, Kind, identity, kind_of
from m2pem_plugin_mavlink.vehicle.modes import (
    PX4_AUTO,
    PX4_MANUAL,
    PX4_OFFBOARD,
    modes_of,
    px4_mode,
)

AVAILABLE_MODES = 435
CURRENT_MODE = 436
NOT_USER_SELECTABLE = 2
"""MAV_MODE_PROPERTY: ground stations do not offer it."""


@dataclass(frozen=True, slots=True)
class Mode:
    """`number`: PX4's. `standard`: MAV_STANDARD_MODE, 0: none. `purpose`: by which ArduPilot's
    number is found. `behavior`: what commanding it means, `RUN_PLAN`: the run of its
    plan; "": it cannot be commanded."""

    number: int
    name: str
    standard: int
    purpose: FlightMode
    behavior: str = ""


RUN_PLAN = "run_plan"
GUIDE = "guide"
"""Commanding ArduPilot's GUIDED: what the vehicle does ends, and it waits for targets."""

HOLD = Mode(px4_mode(PX4_AUTO, 3), "Hold", 0, FlightMode.HOLD, "hold")
MISSION = Mode(px4_mode(PX4_AUTO, 4), "Mission", 6, FlightMode.MISSION, RUN_PLAN)
RETURN = Mode(px4_mode(PX4_AUTO, 5), "Return", 5, FlightMode.RETURN, "return_to_launch")
LAND = Mode(px4_mode(PX4_AUTO, 6), "Land", 7, FlightMode.LAND, "land")
TAKEOFF = Mode(px4_mode(PX4_AUTO, 2), "Takeoff", 8, FlightMode.TAKEOFF)
GUIDED = Mode(px4_mode(PX4_OFFBOARD), "Guided", 0, FlightMode.GUIDED)
MANUAL = Mode(px4_mode(PX4_MANUAL), "Manual", 0, FlightMode.MANUAL)

MODES = (HOLD, MISSION, RETURN, LAND, TAKEOFF, GUIDED, MANUAL)
BY_NUMBER: Mapping[int, Mode] = {mode.number: mode for mode in MODES}

_BY_BEHAVIOR: Mapping[str, Mode] = {
    "hold": HOLD,
    "drive_stop": HOLD,
    "takeoff": TAKEOFF,
    "land": LAND,
    "return_to_launch": RETURN,
    "single_vehicle_routing": MISSION,
    "area_survey": MISSION,
    "run_onboard_mission": MISSION,
    "teleop": MANUAL,
}


def mode_of(behavior: str, operator: str) -> Mode:
    """Return the mode of a vehicle, given the behavior that it carries out ("": none) and the
    operator who has taken it ("": nobody)."""
    if behavior:
        return _BY_BEHAVIOR.get(behavior, GUIDED)
    return MANUAL if operator else HOLD


OTHER_WAYS = ("SMART_RTL", "AUTO_RTL", "QRTL", "AUTOLAND", "LOITER_ALT_QLAND")
"""Modes of ArduPilot that return or land in another way than m2pem's behaviors; QLAND, too, of a
plane, which lands by the sequence of its mission."""


def by_ardupilot_number(number: int, type_: int) -> tuple[str, Mode | None]:
    """Return ArduPilot's name of a mode of a MAV_TYPE, and what commanding it means; None:
    nothing."""
    known = identity(dialect.MAV_AUTOPILOT_ARDUPILOTMEGA, type_)
    if known is None:
        return f"mode {number}", None
    modes = modes_of(known)
    name, purpose = modes.name(number), modes.purpose(number)
    means = next((each for each in MODES if each.purpose is purpose), None)
    means = means if means is None or means.behavior or means is GUIDED else None
    is_other = name in OTHER_WAYS or (name == "QLAND" and known.kind is Kind.PLANE)
    return name, None if is_other else means


def px4_name(number: int) -> str:
    """Return PX4's name of a mode; "": it has none."""
    return modes_of(Identity(Firmware.PX4, Kind.COPTER)).names.get(number, "")


@cache
def _types() -> tuple[MessageType, MessageType]:
    from pymavlink.dialects.v20 import development  # noqa: PLC0415  # few ask for it

    available, current = (development.mavlink_map[id_] for id_ in (AVAILABLE_MODES, CURRENT_MODE))
    return message_type_of(available), message_type_of(current)


def available_mode(index: int) -> Message:
    """Return AVAILABLE_MODES of one mode; `index` counts from 1."""
    mode = MODES[index - 1]
    return _types()[0].make(
        number_modes=len(MODES),
        mode_index=index,
        standard_mode=mode.standard,
        custom_mode=mode.number,
        properties=0 if mode.behavior else NOT_USER_SELECTABLE,
        mode_name=mode.name.encode(),
    )


def current_mode(mode: Mode) -> Message:
    """Return CURRENT_MODE."""
    return _types()[1].make(
        standard_mode=mode.standard, custom_mode=mode.number, intended_custom_mode=mode.number
    )


def renumbered(heartbeat: Message) -> Message:
    """Return a HEARTBEAT with ArduPilot's number of the mode; GUIDED's, if it has no such mode."""
    mode = BY_NUMBER.get(heartbeat.custom_mode)
    if mode is None:
        return heartbeat  # of a camera
    modes = modes_of(Identity(Firmware.ARDUPILOT, kind_of(heartbeat.type)))
    number = modes.for_purpose(mode.purpose)
    number = modes.number("GUIDED") if number is None else number
    return heartbeat._replace(custom_mode=number)
