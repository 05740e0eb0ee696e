"""The streams that are requested from a vehicle: intervals, and when to request them again."""

from collections.abc import Mapping
from types import MappingProxyType

from m2pem_plugin_mavlink.protocol.messages import message_type
from m2pem_plugin_mavlink.vehicle.identity import Firmware

SILENT_INTERVALS = 4.0
SILENT_AT_LEAST_S = 3.0
"""A stream that has not come for this many of its intervals, and seconds, has stopped."""

ASK_AGAIN_S = 5.0

_COMMON = {
    "SYS_STATUS": 1.0,
    "GPS_RAW_INT": 1.0,
    "ATTITUDE": 0.25,
    "LOCAL_POSITION_NED": 0.25,
    "GLOBAL_POSITION_INT": 0.25,
    "MISSION_CURRENT": 1.0,
    "BATTERY_STATUS": 2.0,
    "HOME_POSITION": 2.0,
    "EXTENDED_SYS_STATE": 0.5,
    "POSITION_TARGET_GLOBAL_INT": 1.0,
}
_SOMETIMES = frozenset({message_type("POSITION_TARGET_GLOBAL_INT").id})
"""Come only while there is a target: their silence does not mean that a request was lost."""
_OWN = {
    Firmware.ARDUPILOT: {"EKF_STATUS_REPORT": 1.0, "TERRAIN_REPORT": 1.0, "FENCE_STATUS": 1.0},
    Firmware.PX4: {"ESTIMATOR_STATUS": 1.0, "ALTITUDE": 1.0},
}


def telemetry_streams(firmware: Firmware) -> Mapping[int, float]:
    """Return the ids of the messages that `AutopilotState` needs, and their intervals in
    seconds."""
    named = {**_COMMON, **_OWN[firmware]}
    return MappingProxyType({message_type(name).id: each for name, each in named.items()})


class RequestedStreams:
    """The requested streams and whether they arrive, without I/O.

    A vehicle that restarts forgets requests, and the restart may go unnoticed: so a stream that has
    stopped is requested again until it is refused. `refused` is not requested again until the next
    boot.
    """

    def __init__(self, wanted: Mapping[int, float]) -> None:
        self.wanted = dict(wanted)
        self.refused: set[int] = set()
        self._requested_s: dict[int, float] = {}

    def forget(self) -> None:
        """The vehicle has restarted and lost all requests."""
        self.refused.clear()
        self._requested_s.clear()

    def due(self, came_s: Mapping[int, float], now_s: float) -> list[int]:
        """Return the messages to request now; `came_s`: when each came last.

        A requested message that never came is not requested again: it comes when its content
        exists, such as a home position.
        """
        due: list[int] = []
        for id_, interval_s in self.wanted.items():
            requested_s = self._requested_s.get(id_)
            if id_ in self.refused:
                continue
            if requested_s is None:
                due.append(id_)
                continue
            came = None if id_ in _SOMETIMES else came_s.get(id_)
            silent_s = max(SILENT_INTERVALS * interval_s, SILENT_AT_LEAST_S)
            if came is not None and now_s - max(came, requested_s) > max(silent_s, ASK_AGAIN_S):
                due.append(id_)
        # What has lost other requests has lost these, too.
        return [*due, *((_SOMETIMES & set(self.wanted)) - set(due) - self.refused)] if due else due

    def requested(self, id_: int, now_s: float) -> None:
        """Note that the vehicle has accepted a request."""
        self._requested_s[id_] = now_s

    def unanswered(self, id_: int) -> None:
        """The vehicle has not answered a request; it will be repeated."""
        self._requested_s.pop(id_, None)
