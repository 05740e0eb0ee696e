"""Detector payloads: what they find, by time and by coming near."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from m2pem.api.simulator_settings import Coordinates
from m2pem.api.telemetry import Detection, GeoPosition
from m2pem.mission.catalogue import ResourceId
from m2pem.simulation.event_queue import EventQueue, TimedCall
from m2pem.simulation.frame import FlatFrame
from m2pem.simulation.payloads import SimPayload
from m2pem.simulation.vehicles import SimVehicle
from m2pem.units import US_PER_S

STEPS_AT_ONCE = 500
_SHORTEST_STEP_S = 0.02


@dataclass(slots=True)
class _Detector:
    payload: SimPayload
    carrier: SimVehicle | None
    found: set[int] = field(default_factory=set)
    entries: list[TimedCall] = field(default_factory=list)


class Detectors:
    """`found` is called with every detection, once for each thing that is planned or planted.

    A target counts as reached by distance on the map. `began_us` is when the simulation began, from
    which planned detections count. `known`, `keep`: which things a payload has found before.
    """

    def __init__(
        self,
        bodies: Mapping[ResourceId, SimVehicle | SimPayload],
        frame: FlatFrame,
        event_queue: EventQueue,
        found: Callable[[SimPayload, Detection, int], None],
        keep: Callable[[ResourceId, Iterable[int]], None],
    ) -> None:
        self._frame = frame
        self._event_queue = event_queue
        self._found = found
        self._keep = keep
        self._detectors: list[_Detector] = []
        for body in bodies.values():
            if isinstance(body, SimPayload) and body.detector:
                carrier = bodies.get(body.carrier)
                vehicle = carrier if isinstance(carrier, SimVehicle) else None
                self._detectors.append(_Detector(body, vehicle))

    def begin(self, began_us: int, known: Callable[[ResourceId], Iterable[int]]) -> None:
        """Schedule what is planned, and look out for what is planted, also what is past."""
        for detector in self._detectors:
            settings = detector.payload.settings
            detector.found = set(known(detector.payload.id))
            for number, planned in enumerate(settings.detections):
                if number not in detector.found:
                    at_us = began_us + round(planned.at_s * US_PER_S)
                    self._event_queue.at(at_us, self._finder(detector, number))
            if detector.carrier is not None:
                self._look(detector, detector.carrier.track.started_us)

    def moved(self, vehicle: ResourceId, now_us: int) -> None:
        """The motion of a vehicle has changed."""
        for detector in self._detectors:
            if detector.payload.carrier == vehicle:
                self._look(detector, now_us)

    def vehicle_moved(self, vehicle: ResourceId, position: GeoPosition, now_us: int) -> None:
        """A vehicle that is not simulated has moved: its detector may find something."""
        for detector in self._detectors:
            if detector.payload.carrier == vehicle and detector.carrier is None:
                place = self._frame.to_place(position.latlon)
                reach = detector.payload.settings.detection_range_m
                for number, target in self._unfound(detector):
                    if math.dist(place, target) <= reach:
                        self._find(detector, number, now_us)

    @property
    def strangers(self) -> bool:
        """Whether a detector is on a vehicle that is not simulated."""
        return any(
            detector.carrier is None and detector.payload.settings.targets
            for detector in self._detectors
        )

    @property
    def searching(self) -> bool:
        """Whether a vehicle at work carries a detector that has not found all that is planted."""
        return any(
            detector.carrier is not None
            and detector.carrier.behavior
            and any(True for _ in self._unfound(detector))
            for detector in self._detectors
        )

    def _unfound(self, detector: _Detector) -> Iterable[tuple[int, tuple[float, float]]]:
        settings = detector.payload.settings
        for index, target in enumerate(settings.targets):
            number = len(settings.detections) + index
            if number not in detector.found:
                yield number, self._frame.to_place(target.position[:2])

    def _look(self, detector: _Detector, now_us: int) -> None:
        for entry in detector.entries:
            entry.cancel()
        detector.entries.clear()
        if detector.carrier is None:
            return
        for number, target in self._unfound(detector):
            reach = detector.payload.settings.detection_range_m
            at_us, near = _approach(detector.carrier, target, reach, now_us)
            if at_us is not None:
                call = self._finder(detector, number) if near else self._looker(detector)
                detector.entries.append(self._event_queue.at(at_us, call, background=not near))

    def _finder(self, detector: _Detector, number: int) -> Callable[[int], None]:
        return lambda at_us: self._find(detector, number, at_us)

    def _looker(self, detector: _Detector) -> Callable[[int], None]:
        return lambda at_us: self._look(detector, at_us)

    def _find(self, detector: _Detector, number: int, at_us: int) -> None:
        payload = detector.payload
        if number in detector.found:
            return
        detector.found.add(number)
        self._keep(payload.id, detector.found)
        planned = payload.settings.detections
        if number < len(planned):
            type_, position = planned[number].type, planned[number].position
        else:
            target = payload.settings.targets[number - len(planned)]
            type_, position = target.type, target.position
        where = self._where(detector, position, at_us)
        if where is not None:
            self._found(payload, Detection(type_, payload.id, where, at_us), at_us)

    def _where(
        self, detector: _Detector, position: Coordinates | None, at_us: int
    ) -> GeoPosition | None:
        if position is None:
            if detector.carrier is None:
                return GeoPosition(*self._frame.origin)
            return self._frame.to_position(detector.carrier.pose(at_us).place)
        altitude = self._frame.origin[2] if position[2] is None else position[2]
        return GeoPosition(position[0], position[1], altitude)


def _approach(
    vehicle: SimVehicle, target: tuple[float, float], reach_m: float, now_us: int
) -> tuple[int | None, bool]:
    """When the vehicle is within reach (True), or when to look again (False); None: never.

    Nothing moves faster than full speed, so that as much time can be skipped as the distance takes.
    """
    track = vehicle.track
    end_us = track.end_us
    if end_us is None and track.warp.target == 0:
        end_us = track.warp.settled_us
    speed = vehicle.kinematics.max_speed_m_s
    at_us = now_us
    for _ in range(STEPS_AT_ONCE):
        missing = math.dist(vehicle.pose(at_us).place[:2], target) - reach_m
        if missing <= 1e-6:
            return at_us, True
        if end_us is not None and at_us >= end_us:
            return None, False
        at_us += math.ceil(max(_SHORTEST_STEP_S, missing / speed) * US_PER_S)
        if end_us is not None:
            at_us = min(at_us, end_us)
    return at_us, False
