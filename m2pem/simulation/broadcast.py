"""Telemetry of simulated resources: at a rate while they work, seldom while they stand."""

from collections.abc import Callable, Iterator, Mapping

from m2pem.api.async_queue import AsyncQueue
from m2pem.api.telemetry import Detection, GeoPosition, PayloadState, VehicleState
from m2pem.mission.catalogue import ResourceId
from m2pem.simulation.event_queue import EventQueue, TimedCall
from m2pem.simulation.executions import Body
from m2pem.simulation.frame import FlatFrame
from m2pem.simulation.payloads import SimPayload
from m2pem.simulation.segments import Look, Vector
from m2pem.simulation.vehicles import SimVehicle
from m2pem.units import US_PER_S

DEFAULT_HZ = 5.0
SLOWEST_HZ = 1.0
"""Of what stands, so that its link is seen to be up."""

WAITING_STATES = 1000
"""Of a small fleet; of a larger one, two of each resource."""


class Broadcast:
    """A rate of 0 reports changes alone, and sets no timer."""

    def __init__(
        self,
        bodies: Mapping[ResourceId, Body],
        rates_hz: Mapping[ResourceId, float],
        frame: FlatFrame,
        event_queue: EventQueue,
        audible: Callable[[ResourceId], bool],
    ) -> None:
        # A state that carries a detection must not be lost to a slow reader.
        self.states: AsyncQueue[VehicleState | PayloadState] = AsyncQueue(
            max(WAITING_STATES, 2 * len(bodies)),
            lambda state: isinstance(state, VehicleState) or not state.detections,
        )
        self._bodies = bodies
        self._rates_hz = rates_hz
        self._frame = frame
        self._event_queue = event_queue
        self._audible = audible
        self._next: dict[ResourceId, TimedCall] = {}
        self._begun = False
        self._seen_from: dict[ResourceId, tuple[Vector, float, Look]] = {}
        self._seen: dict[ResourceId, tuple[GeoPosition, ...]] = {}

    def begin(self, now_us: int) -> None:
        """Report every body, now and from now on."""
        self._begun = True
        for body in self._bodies.values():
            self.send(body, now_us)

    def send(self, body: Body, now_us: int, detections: tuple[Detection, ...] = ()) -> None:
        """Report a body now, and again after its interval; those that were missed are skipped."""
        if not self._begun:
            return
        if self._audible(body.id):
            if isinstance(body, SimPayload):
                seen = self._footprint(body, now_us) if body.settings.footprints else ()
                self.states.put(body.state(now_us, detections, seen))
            else:
                self.states.put(body.state(now_us, self._frame))
        entry = self._next.pop(body.id, None)
        if entry is not None:
            entry.cancel()
        rate = self._rates_hz[body.id]
        if rate > 0:
            busy = bool(body.behavior) or (
                isinstance(body, SimVehicle) and body.pose(now_us).speed > 0
            )
            rate = rate if busy else min(rate, SLOWEST_HZ)
            interval_us = round(US_PER_S / rate)
            missed = max(0, self._event_queue.due_us - now_us) // interval_us
            self._next[body.id] = self._event_queue.at(
                now_us + (1 + missed) * interval_us,
                lambda at_us: self.send(body, at_us),
                background=True,
            )

    def all_at(self, time_us: int) -> Iterator[VehicleState | PayloadState]:
        """How everybody is at a time, before which nothing changes from what is planned now."""
        for body in self._bodies.values():
            if not self._audible(body.id):
                continue
            if isinstance(body, SimPayload):
                yield body.state(time_us, (), self._footprint(body, time_us))
            else:
                yield body.state(time_us, self._frame)

    def _footprint(self, payload: SimPayload, now_us: int) -> tuple[GeoPosition, ...]:
        """None of a payload whose vehicle is not simulated."""
        carrier = self._bodies.get(payload.carrier)
        if not isinstance(carrier, SimVehicle):
            return ()
        pose, look = carrier.pose(now_us), payload.look(now_us)
        seen_from = (pose.place, pose.yaw, look)
        if self._seen_from.get(payload.id) != seen_from:
            self._seen_from[payload.id] = seen_from
            corners = payload.ground(now_us, pose, carrier.home[2])
            self._seen[payload.id] = tuple(self._frame.to_position(corner) for corner in corners)
        return self._seen[payload.id]
