"""Whether a vehicle may be armed, and the reasons if not, for people.

ArduPilot is believed on its estimator before its pre-arm bit: that is set in STABILIZE long before
there is a position, and GUIDED cannot be armed without one.
"""

from collections.abc import Iterable, Iterator

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.vehicle.driver import Readiness
from m2pem_plugin_mavlink.vehicle.identity import Firmware
from m2pem_plugin_mavlink.vehicle.state import AutopilotState

LOW_BATTERY = 0.15
"""Least battery charge for arming, as a fraction."""

TEXTS_WITHIN_S = 35.0
"""Seconds for which texts count: an autopilot repeats the reasons every 30 s."""

_HAS_POSITION = dialect.EKF_POS_HORIZ_ABS
_NO_POSITION = dialect.EKF_CONST_POS_MODE
_FIX_3D = dialect.GPS_FIX_TYPE_3D_FIX
_REFUSALS = {
    Firmware.ARDUPILOT: ("PreArm: ", "Arm: "),
    Firmware.PX4: ("Preflight Fail: ", "Preflight: ", "Arming denied: ", "Arming denied! "),
}


def readiness(
    firmware: Firmware, state: AutopilotState, texts: Iterable[str], now_s: float
) -> Readiness:
    """Return whether the vehicle may be armed now; `texts`: those of the last `TEXTS_WITHIN_S`,
    newest last.

    A vehicle that is armed already is ready.
    """
    if state.armed:
        return Readiness(True)
    if state.heartbeat_s is None:
        return Readiness(False, ("link: no heartbeat yet",))
    reasons = (*unlocated(firmware, state, now_s), *_reasons(firmware, state, texts))
    return Readiness(not reasons, reasons)


def unlocated(firmware: Firmware, state: AutopilotState, now_s: float) -> tuple[str, ...]:
    """Return why the position is unknown; empty if it is known. Unlike the other reasons, these do
    not depend on the mode."""
    gps = state.gps_fix is not None and state.gps_fix < _FIX_3D
    return (*(("GPS: no 3D fix",) if gps else ()), *_position_reasons(firmware, state, now_s))


def _reasons(firmware: Firmware, state: AutopilotState, texts: Iterable[str]) -> Iterator[str]:
    if state.prearm_passed is False:
        said = list(dict.fromkeys(_refusals(firmware, texts)))
        yield from (f"prearm: {text}" for text in said)
        if not said:
            yield "prearm: a check fails, the vehicle does not report which"
    if state.battery_fraction is not None and state.battery_fraction < LOW_BATTERY:
        yield f"battery at {state.battery_fraction:.0%}".replace("%", " %")


def _position_reasons(firmware: Firmware, state: AutopilotState, now_s: float) -> Iterator[str]:
    """A PX4 that sends no ESTIMATOR_STATUS is believed on its pre-arm bit. PX4 sets
    ESTIMATOR_CONST_POS_MODE whenever it is at rest; on ArduPilot the bit means: no position."""
    waited_s = 0.0 if state.boot_s is None else now_s - state.boot_s
    flags = state.estimator_flags
    if flags is None:
        if firmware is Firmware.ARDUPILOT or state.prearm_passed is None:
            yield f"EKF: no status yet, {waited_s:.0f} s"
    elif not flags & _HAS_POSITION or (flags & _NO_POSITION and firmware is Firmware.ARDUPILOT):
        yield f"EKF: no position yet, {waited_s:.0f} s"
    if firmware is Firmware.PX4 and state.home is None:
        yield f"home: not set yet, {waited_s:.0f} s"


def _refusals(firmware: Firmware, texts: Iterable[str]) -> Iterator[str]:
    for text in texts:
        for prefix in _REFUSALS[firmware]:
            if text.startswith(prefix):
                yield text.removeprefix(prefix).strip()
