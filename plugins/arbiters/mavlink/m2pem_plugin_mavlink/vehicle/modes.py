"""The modes of autopilots: numbers (HEARTBEAT.custom_mode), names and purposes."""

from collections.abc import Mapping
from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.vehicle.driver import FlightMode
from m2pem_plugin_mavlink.vehicle.identity import Firmware, Identity, Kind

_GUIDED, _MISSION, _HOLD = FlightMode.GUIDED, FlightMode.MISSION, FlightMode.HOLD
_RETURN, _LAND, _TAKEOFF = FlightMode.RETURN, FlightMode.LAND, FlightMode.TAKEOFF
_ORBIT, _MANUAL = FlightMode.ORBIT, FlightMode.MANUAL


@dataclass(frozen=True, slots=True)
class Modes:
    """The modes of one kind of vehicle. `purposes`: by name; of two modes with the same purpose the
    first one is commanded."""

    names: Mapping[int, str]
    purposes: Mapping[str, FlightMode]

    def name(self, custom_mode: int) -> str:
        """Return the autopilot's own name: "GUIDED", "AUTO.MISSION"; else "mode 99"."""
        return self.names.get(custom_mode, f"mode {custom_mode}")

    def purpose(self, custom_mode: int) -> FlightMode:
        return self.purposes.get(self.names.get(custom_mode, ""), FlightMode.OTHER)

    def number(self, name: str) -> int:
        """Return the custom_mode of a name.

        Raises:
            KeyError: there is no such mode.
        """
        for number, each in self.names.items():
            if each == name:
                return number
        raise KeyError(name)

    def for_purpose(self, mode: FlightMode) -> int | None:
        """Return the custom_mode to command for a purpose; None if there is none."""
        for name, purpose in self.purposes.items():
            if purpose is mode:
                return self.number(name)
        return None


def modes_of(identity: Identity) -> Modes:
    """Return the modes of a vehicle."""
    return _PX4 if identity.firmware is Firmware.PX4 else _ARDUPILOT[identity.kind]


# --- ArduPilot: numbers and names are in the dialect ------------------------------------------


def _ardupilot(enum: str, purposes: Mapping[str, FlightMode]) -> Modes:
    prefix = f"{enum}_"
    entries = {
        number: entry.name.removeprefix(prefix)
        for number, entry in dialect.enums[enum].items()
        if not entry.name.endswith("ENUM_END")
    }
    return Modes(entries, purposes)


_COPTER = _ardupilot(
    "COPTER_MODE",
    {
        "GUIDED": _GUIDED,
        "AUTO": _MISSION,
        # Not LOITER, which obeys the throttle stick: with a low stick the vehicle would descend.
        "BRAKE": _HOLD,
        "LOITER": _HOLD,
        "RTL": _RETURN,
        "SMART_RTL": _RETURN,
        "AUTO_RTL": _RETURN,
        "LAND": _LAND,
        "CIRCLE": _ORBIT,
        **dict.fromkeys(
            (
                "STABILIZE",
                "ALT_HOLD",
                "ACRO",
                "DRIFT",
                "SPORT",
                "FLIP",
                "AUTOTUNE",
                "POSHOLD",
                "FLOWHOLD",
                "ZIGZAG",
                "TURTLE",
            ),
            _MANUAL,
        ),
    },
)
_PLANE_PURPOSES = {
    "GUIDED": _GUIDED,
    "AUTO": _MISSION,
    "LOITER": _HOLD,
    "RTL": _RETURN,
    "QRTL": _RETURN,
    "AUTOLAND": _LAND,
    "QLAND": _LAND,
    "LOITER_ALT_QLAND": _LAND,
    "TAKEOFF": _TAKEOFF,
    "CIRCLE": _ORBIT,
    **dict.fromkeys(
        (
            "MANUAL",
            "STABILIZE",
            "TRAINING",
            "ACRO",
            "FLY_BY_WIRE_A",
            "FLY_BY_WIRE_B",
            "CRUISE",
            "AUTOTUNE",
            "QSTABILIZE",
            "QHOVER",
            "QLOITER",
            "QAUTOTUNE",
            "QACRO",
        ),
        _MANUAL,
    ),
}
_ROVER_PURPOSES = {
    "GUIDED": _GUIDED,
    "AUTO": _MISSION,
    "HOLD": _HOLD,
    "LOITER": _HOLD,
    "RTL": _RETURN,
    "SMART_RTL": _RETURN,
    "CIRCLE": _ORBIT,
    **dict.fromkeys(("MANUAL", "ACRO", "STEERING", "SIMPLE"), _MANUAL),
}
_ARDUPILOT = {
    Kind.COPTER: _COPTER,
    Kind.PLANE: _ardupilot("PLANE_MODE", _PLANE_PURPOSES),
    Kind.VTOL: _ardupilot("PLANE_MODE", {"QLAND": _LAND, **_PLANE_PURPOSES}),
    Kind.ROVER: _ardupilot("ROVER_MODE", _ROVER_PURPOSES),
    # HOLD stops the motor, and a boat then drifts; LOITER keeps its place.
    Kind.BOAT: _ardupilot("ROVER_MODE", {"LOITER": _HOLD, **_ROVER_PURPOSES}),
    Kind.SUB: _ardupilot(
        "SUB_MODE",
        {
            "GUIDED": _GUIDED,
            "AUTO": _MISSION,
            "POSHOLD": _HOLD,
            "SURFACE": _LAND,
            "CIRCLE": _ORBIT,
            **dict.fromkeys(
                ("MANUAL", "STABILIZE", "ALT_HOLD", "ACRO", "SURFTRAK", "MOTORDETECT"), _MANUAL
            ),
        },
    ),
}

# --- PX4: main mode << 16 | sub mode << 24 ------------------------------------------------------


def px4_mode(main: int, sub: int = 0) -> int:
    """Return the custom_mode of PX4 of a main and a sub mode (px4_custom_mode)."""
    return main << 16 | sub << 24


PX4_MANUAL, PX4_ALTCTL, PX4_POSCTL, PX4_AUTO, PX4_ACRO, PX4_OFFBOARD = 1, 2, 3, 4, 5, 6

_PX4 = Modes(
    {
        px4_mode(PX4_MANUAL): "MANUAL",
        px4_mode(PX4_ALTCTL): "ALTCTL",
        px4_mode(PX4_POSCTL): "POSCTL",
        px4_mode(PX4_POSCTL, 1): "POSCTL.ORBIT",
        px4_mode(PX4_POSCTL, 2): "POSCTL.SLOW",
        px4_mode(PX4_AUTO): "AUTO",
        px4_mode(PX4_AUTO, 1): "AUTO.READY",
        px4_mode(PX4_AUTO, 2): "AUTO.TAKEOFF",
        px4_mode(PX4_AUTO, 3): "AUTO.LOITER",
        px4_mode(PX4_AUTO, 4): "AUTO.MISSION",
        px4_mode(PX4_AUTO, 5): "AUTO.RTL",
        px4_mode(PX4_AUTO, 6): "AUTO.LAND",
        px4_mode(PX4_AUTO, 8): "AUTO.FOLLOW_TARGET",
        px4_mode(PX4_AUTO, 9): "AUTO.PRECLAND",
        px4_mode(PX4_AUTO, 10): "AUTO.VTOL_TAKEOFF",
        px4_mode(PX4_AUTO, 20): "AUTO.DESCEND",
        px4_mode(PX4_ACRO): "ACRO",
        px4_mode(PX4_OFFBOARD): "OFFBOARD",
        px4_mode(7): "STABILIZED",
        px4_mode(8): "RATTITUDE",
        px4_mode(10): "TERMINATION",
    },
    {
        "AUTO.LOITER": _HOLD,
        "OFFBOARD": _GUIDED,
        "AUTO.MISSION": _MISSION,
        "AUTO.TAKEOFF": _TAKEOFF,
        "AUTO.VTOL_TAKEOFF": _TAKEOFF,
        "AUTO.RTL": _RETURN,
        "AUTO.LAND": _LAND,
        "AUTO.PRECLAND": _LAND,
        "AUTO.DESCEND": _LAND,
        "POSCTL.ORBIT": _ORBIT,
        **dict.fromkeys(
            ("MANUAL", "ALTCTL", "POSCTL", "POSCTL.SLOW", "ACRO", "STABILIZED", "RATTITUDE"),
            _MANUAL,
        ),
    },
)
