"""The latest states of vehicles, payloads and teams."""

from collections.abc import Callable

import msgspec

from m2pem.api import (
    Detection,
    LinkState,
    MissionControl,
    PayloadState,
    ResourceId,
    TeamState,
    Telemetry,
    VehicleState,
)

BACKLOG = 1000
"""Most states that wait, of a small fleet; of a larger one, two of each resource. Of each only the
last one counts."""

_encode = msgspec.json.Encoder().encode


class LatestStates:
    """The latest state by name, encoded once for all browsers."""

    def __init__(self) -> None:
        self.states: dict[str, Telemetry] = {}
        self.dirty: set[str] = set()
        self._encoded: dict[str, msgspec.Raw] = {}

    def put(self, name: str, state: Telemetry) -> None:
        """Keep a state as the latest."""
        self.states[name] = state
        self._encoded.pop(name, None)
        self.dirty.add(name)

    def forget(self, name: str) -> None:
        """Drop a state."""
        self.states.pop(name, None)
        self._encoded.pop(name, None)
        self.dirty.discard(name)

    def encoded(self, name: str) -> msgspec.Raw | None:
        """Return the latest state as JSON; None if there is none."""
        if name not in self._encoded and name in self.states:
            self._encoded[name] = msgspec.Raw(_encode(self.states[name]))
        return self._encoded.get(name)


class FleetStates:
    """The latest states of a fleet. `lost` is called with each resource whose link is lost, and
    each of `detected` with each detection."""

    def __init__(self, control: MissionControl, lost: Callable[[ResourceId], None]) -> None:
        self.vehicles = LatestStates()
        self.payloads = LatestStates()
        self.teams = LatestStates()
        """By the id of the team's behavior."""
        self.detected: list[Callable[[Detection], None]] = []
        self._lost = lost
        fleet = control.fleet()
        size = max(BACKLOG, 2 * (len(fleet.vehicles) + len(fleet.payloads)))
        self._telemetry = control.telemetry(size=size)

    async def follow(self) -> None:
        """Follow until the executive ends."""
        async for state in self._telemetry:
            match state:
                case VehicleState():
                    self._take(self.vehicles, state)
                case PayloadState():
                    self._take(self.payloads, state)
                    for detection in state.detections:
                        for detected in self.detected:
                            detected(detection)
                case TeamState():
                    self.teams.put(state.behavior, state)

    def _take(self, states: LatestStates, state: VehicleState | PayloadState) -> None:
        before = states.states.get(state.resource)
        was = before.link if isinstance(before, VehicleState | PayloadState) else None
        states.put(state.resource, state)
        if state.link is LinkState.LOST and was is not LinkState.LOST:
            self._lost(state.resource)
