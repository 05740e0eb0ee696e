"""Thinning of tracks: selects the states of vehicles and payloads to keep."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TypeAlias

import msgspec

from m2pem.api import GeoPosition, PayloadState, VehicleState, distance_m
from m2pem_plugin_web.tracks.detections import DetectionEntry

SPACING_S = 1.0
"""Least seconds of mission time between two states of a resource; more in long runs."""

MOVED_M = 0.5
TURNED_RAD = math.radians(5.0)
ZOOMED = 1.05
FASTER_M_S = 0.3

State: TypeAlias = VehicleState | PayloadState


class Sample(msgspec.Struct, frozen=True, omit_defaults=True):
    """The states at a mission time, in seconds, that differ from the ones before, and what was
    detected since then. `more_detections`: how many the track has no entry of."""

    t: float
    vehicles: dict[str, msgspec.Raw]
    payloads: dict[str, msgspec.Raw]
    detections: Sequence[DetectionEntry] = ()
    more_detections: int = 0

    def kinds(self) -> Iterator[tuple[str, dict[str, msgspec.Raw]]]:
        """Yield the kinds of states, each with the states by resource."""
        yield "vehicles", self.vehicles
        yield "payloads", self.payloads


class Thinner:
    """Decides for each state whether to keep it. `spacing_s`: seconds of mission time."""

    def __init__(self, spacing_s: float = SPACING_S) -> None:
        self.spacing_s = spacing_s
        self._kept: dict[str, tuple[float, State]] = {}

    def keep(self, t_s: float, state: State) -> None:
        """Note that a state was kept."""
        self._kept[state.resource] = (t_s, state)

    def wants(self, t_s: float, state: State) -> bool:
        """Return whether to keep a state: the last one of its resource is old, and differs."""
        kept = self._kept.get(state.resource)
        if kept is None:
            return True
        at_s, before = kept
        return state is not before and t_s - at_s >= self.spacing_s and differs(before, state)


def differs(before: State, now: State) -> bool:
    """Return whether a resource has moved, turned, or changed its state or its speed."""
    if before.link is not now.link:
        return True
    match before, now:
        case VehicleState(), VehicleState():
            return (
                before.mode != now.mode
                or _percent(before.battery_fraction) != _percent(now.battery_fraction)
                or _moved(before.position, now.position)
                or _turned(before.yaw_rad, now.yaw_rad)
                or _turned(before.roll_rad, now.roll_rad)
                or _turned(before.pitch_rad, now.pitch_rad)
                or _apart(_speed_m_s(before), _speed_m_s(now), FASTER_M_S)
                or _apart(before.altitude_above_home_m, now.altitude_above_home_m, MOVED_M)
            )
        case PayloadState(), PayloadState():
            return (
                _turned(before.pan_rad, now.pan_rad)
                or _turned(before.tilt_rad, now.tilt_rad)
                or _zoomed(before.zoom, now.zoom)
                or len(before.footprint) != len(now.footprint)
                or any(map(_moved, before.footprint, now.footprint))
            )
    return True


def _percent(fraction: float | None) -> int | None:
    return None if fraction is None or not math.isfinite(fraction) else round(fraction * 100)


def _moved(before: GeoPosition | None, now: GeoPosition | None) -> bool:
    before, now = _known_place(before), _known_place(now)
    if before is None or now is None:
        return before is not now
    places = [(each.latitude_deg, each.longitude_deg) for each in (before, now)]
    return math.hypot(distance_m(*places), now.altitude_m - before.altitude_m) > MOVED_M


def _turned(before: float | None, now: float | None) -> bool:
    before, now = _known(before), _known(now)
    if before is None or now is None:
        return before is not now
    return abs(math.remainder(now - before, math.tau)) > TURNED_RAD


def _zoomed(before: float | None, now: float | None) -> bool:
    before, now = _known(before), _known(now)
    if before is None or now is None:
        return before is not now
    low, high = sorted((before, now))
    return high > low * ZOOMED


def _speed_m_s(state: VehicleState) -> float | None:
    velocity = state.velocity_enu_m_s
    return None if velocity is None else math.hypot(*velocity)


def _apart(before: float | None, now: float | None, most: float) -> bool:
    before, now = _known(before), _known(now)
    if before is None or now is None:
        return before is not now
    return abs(now - before) > most


def _known(value: float | None) -> float | None:
    """Return a value, or None for NaN, which devices send for an unknown one."""
    return value if value is not None and math.isfinite(value) else None


def _known_place(place: GeoPosition | None) -> GeoPosition | None:
    if place is None:
        return None
    numbers = (place.latitude_deg, place.longitude_deg, place.altitude_m)
    return place if all(map(math.isfinite, numbers)) else None


def thinned(samples: Iterable[Sample], spacing_s: float) -> list[Sample]:
    """Return fewer samples: of each resource the last state within each `spacing_s`.

    So a resource stays where it came to rest. There are at most two in any `spacing_s`. All
    detections are kept.
    """
    detections: dict[float, list[DetectionEntry]] = {}
    more, more_s = 0, 0.0
    kept: dict[float, Mapping[str, dict[str, msgspec.Raw]]] = {}
    base: dict[tuple[str, str], float] = {}
    waiting: dict[tuple[str, str], tuple[float, msgspec.Raw]] = {}

    def keep(key: tuple[str, str], t_s: float, state: msgspec.Raw) -> None:
        kept.setdefault(t_s, {"vehicles": {}, "payloads": {}})[key[0]][key[1]] = state
        base[key] = t_s

    for sample in samples:
        if sample.detections:
            detections.setdefault(sample.t, []).extend(sample.detections)
        if sample.more_detections:
            more, more_s = more + sample.more_detections, sample.t
        for kind, states in sample.kinds():
            for name, state in states.items():
                key = (kind, name)
                if key not in base:
                    keep(key, sample.t, state)
                    continue
                if sample.t - base[key] > spacing_s and key in waiting:
                    keep(key, *waiting.pop(key))
                waiting[key] = (sample.t, state)
    for key, (t_s, state) in waiting.items():
        keep(key, t_s, state)
    nothing: Mapping[str, dict[str, msgspec.Raw]] = {"vehicles": {}, "payloads": {}}
    return [
        Sample(
            t_s,
            **kept.get(t_s, nothing),
            detections=detections.get(t_s, ()),
            more_detections=more if more and t_s == more_s else 0,
        )
        for t_s in sorted({*kept, *detections, *([more_s] if more else [])})
    ]
