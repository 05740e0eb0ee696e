"""The messages of telemetry: each state as m2pem has it, and in Foxglove's and ROS's schemas."""

import logging
from collections.abc import Iterator, Sequence

import msgspec

from m2pem.api import US_PER_S, LocalFrame, PayloadState, TeamState, Telemetry, VehicleState
from m2pem_plugin_recorder import foxglove_messages, ros_messages
from m2pem_plugin_recorder.channels import ChannelMessage, TelemetryMessage, telemetry_channel

log = logging.getLogger("m2pem.face.recorder")

_encode = msgspec.json.Encoder().encode


def _key(state: Telemetry) -> str:
    return state.behavior if isinstance(state, TeamState) else state.resource


class RateLimit:
    """Lets at most `rate_hz` states of each resource pass, by the times of the states."""

    def __init__(self, rate_hz: float) -> None:
        self._every_us = US_PER_S / rate_hz
        self._due_us: dict[str, float] = {}

    def passes(self, state: Telemetry) -> bool:
        """Whether a state is due. A detection always is, as no other state has it."""
        if isinstance(state, PayloadState) and state.detections:
            return True
        key = _key(state)
        due_us = self._due_us.get(key)
        # A clock that was set back must not silence a vehicle.
        if due_us is None or state.time_us < due_us - 2 * self._every_us:
            due_us = state.time_us
        if state.time_us < due_us:
            return False
        # Steady: a jitter of the sender does not lower the rate.
        self._due_us[key] = max(due_us + self._every_us, state.time_us + self._every_us / 2)
        return True


class TelemetryEncoder:
    """Encodes states. `ros`: in ROS 2's schemas, too."""

    def __init__(self, frame: LocalFrame, *, ros: bool = True) -> None:
        self._frame = frame
        self._ros = ros
        self._refused: set[str] = set()

    def messages(self, state: Telemetry) -> Sequence[ChannelMessage]:
        """Return the messages of a state; none of a kind that this release does not know.

        None, too, of a state that no schema can hold, such as one of the year 40000 or with an
        infinite heading: what one device sends must not end the recording of all.
        """
        try:
            return list(self._messages(state))
        except (ValueError, OverflowError) as error:
            key = _key(state)
            if key not in self._refused:
                self._refused.add(key)
                log.warning("%s: a state is left out: %s", key, error, extra={"resource": key})
            return ()

    def _messages(self, state: Telemetry) -> Iterator[ChannelMessage]:
        match state:
            case VehicleState():
                yield self._own("vehicle", state)
                yield from foxglove_messages.vehicle_messages(state, self._frame)
                if self._ros:
                    yield from ros_messages.vehicle_messages(state, self._frame)
            case PayloadState():
                yield self._own("payload", state)
                yield from foxglove_messages.footprint_messages(state, self._frame)
            case TeamState():
                yield self._own("team", state)

    def _own(self, kind: str, state: VehicleState | PayloadState | TeamState) -> ChannelMessage:
        return ChannelMessage(
            telemetry_channel(), state.time_us, _encode(TelemetryMessage(kind, state))
        )
