"""How a camera counts: its numbers for angles, angular speeds and zoom factors, and back."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

from m2pem_plugin_ptz.gimbal import Reach

EDGE_RAD = 1e-6
"""So far outside a range is still its edge."""

Interval = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Scale:
    """`units = offset + gain * value`, within `units`."""

    gain: float
    offset: float
    units: Interval

    def to_units(self, value: float) -> float:
        """What the camera is told."""
        return min(max(self.offset + self.gain * value, self.units[0]), self.units[1])

    def to_value(self, units: float) -> float:
        """What it means."""
        return (units - self.offset) / self.gain

    @property
    def values(self) -> Interval:
        """All that it can say."""
        ends = sorted(map(self.to_value, self.units))
        return ends[0], ends[1]


@dataclass(frozen=True, slots=True)
class PanTiltSpace:
    """Positions in rad, or velocities in rad/s."""

    uri: str
    pan: Scale
    tilt: Scale


@dataclass(frozen=True, slots=True)
class OneSpace:
    """Zoom factors, or a speed of both axes in rad/s."""

    uri: str
    scale: Scale


@dataclass(frozen=True, slots=True)
class Spaces:
    """How to speak with a camera. `positions` and `zooms`: all in which it may answer, the first is
    the one to be used; `velocity`, `speed` None: it takes none. `default_position`: the URI of the
    space in which it answers without naming one."""

    reach: Reach
    positions: tuple[PanTiltSpace, ...] = ()
    velocity: PanTiltSpace | None = None
    speed: OneSpace | None = None
    zooms: tuple[OneSpace, ...] = ()
    default_position: str = ""

    def look(self, x: float, y: float, uri: str) -> tuple[float, float] | None:
        """Where it looks, in rad, within `reach`; None: the space is not known."""
        space = _named(self.positions, uri or self.default_position)
        if space is None:
            return None
        return into(space.pan.to_value(x), self.reach.pan_rad), space.tilt.to_value(y)

    def zoom(self, x: float, uri: str) -> float | None:
        """The zoom factor; None: the space is not known."""
        space = _named(self.zooms, uri)
        return None if space is None else max(1.0, space.scale.to_value(x))

    def position(self, pan_rad: float, tilt_rad: float) -> dict[str, object]:
        """A position as the camera is told it; there must be `positions`."""
        space = self.positions[0]
        pan = into(pan_rad, space.pan.values)
        return {
            "x": space.pan.to_units(pan),
            "y": space.tilt.to_units(tilt_rad),
            "space": space.uri,
        }


def last_part(uri: str) -> str:
    """Of a space's URI, in small letters: not all cameras write the others alike."""
    return uri.strip().rsplit("/", 1)[-1].lower()


def into(angle_rad: float, interval: Interval) -> float:
    """The same direction, a whole number of turns away, as near to the interval as can be."""
    low, high = interval
    if low - EDGE_RAD <= angle_rad <= high + EDGE_RAD:
        return angle_rad
    return angle_rad + math.tau * round(((low + high) / 2 - angle_rad) / math.tau)


Space = TypeVar("Space", PanTiltSpace, OneSpace)


def _named(spaces: Sequence[Space], uri: str) -> Space | None:
    if not spaces:
        return None
    if not uri:
        # The generic space is the one that every camera has.
        return next((each for each in spaces if "generic" in each.uri.lower()), spaces[0])
    return next((each for each in spaces if last_part(each.uri) == last_part(uri)), None)


FULL_CIRCLE_RAD = math.tau - 0.02
"""Cameras that turn all round say 359.9 degrees as often as 360."""


@dataclass(frozen=True, slots=True)
class Described:
    """A space as the camera describes it: its URI, and the range of each axis."""

    uri: str
    x: Interval
    y: Interval | None = None

    @property
    def in_degrees(self) -> bool:
        """It counts degrees, or degrees per second."""
        name = last_part(self.uri)
        return name.endswith("degrees") or name == "sphericalpositionspace"

    @property
    def in_millimetres(self) -> bool:
        """It counts the focal length."""
        return last_part(self.uri).endswith("millimeter")

    @property
    def in_shares(self) -> bool:
        """It counts shares of what the camera can do."""
        return "generic" in last_part(self.uri)


@dataclass(frozen=True, slots=True)
class Offer:
    """All that the PTZ node and the PTZ configuration of a profile say.

    `limits`: of positions, set in the camera by its owner.
    """

    positions: Sequence[Described] = ()
    velocities: Sequence[Described] = ()
    speeds: Sequence[Described] = ()
    zooms: Sequence[Described] = ()
    limits: Described | None = None
    default_position: str = ""


def read_spaces(offer: Offer, fleet: Reach, inverted: frozenset[str] = frozenset()) -> Spaces:
    """What they mean. `inverted`: "pan" and "tilt" if they run the other way.

    Raises:
        ValueError: what the camera reaches and what the fleet says do not meet.
    """
    signs = (-1.0 if "pan" in inverted else 1.0, -1.0 if "tilt" in inverted else 1.0)
    whole = _whole(offer.positions, fleet, signs)
    positions = tuple(
        _position(each.uri, (each.x, each.y), whole if each.in_shares else None, signs)
        for each in _usable(offer.positions)
        if each.y is not None
    )
    rate = fleet.rate_rad_s
    for each in (*offer.speeds, *offer.velocities):
        if each.in_degrees and each.x[1] > 0:
            rate = min(rate, math.radians(each.x[1]))
    velocities = [
        PanTiltSpace(
            each.uri, _rate(each, each.x, rate, signs[0]), _rate(each, each.y, rate, signs[1])
        )
        for each in _usable(offer.velocities)
        if each.y is not None
    ]
    speeds = [OneSpace(each.uri, _rate(each, each.x, rate, 1.0)) for each in _usable(offer.speeds)]
    zooms = tuple(_zooms(offer.zooms, fleet.zoom_max))
    own = _within_limits(offer.limits, positions, whole)
    reach = replace(
        fleet,
        pan_rad=_shared_pan(own[0], fleet.pan_rad),
        tilt_rad=_shared("tilt", own[1], fleet.tilt_rad),
        zoom_max=_zoom_max(zooms, fleet.zoom_max),
        rate_rad_s=rate,
        endless=fleet.endless and own[0][1] - own[0][0] >= FULL_CIRCLE_RAD,
    )
    return Spaces(
        reach,
        positions,
        velocities[0] if velocities else None,
        speeds[0] if speeds else None,
        zooms,
        offer.default_position,
    )


def _usable(spaces: Iterable[Described]) -> list[Described]:
    """Degrees first: they need nobody's word for the range."""
    known = [each for each in spaces if each.in_degrees or each.in_shares]
    return sorted(known, key=lambda each: not each.in_degrees)


def _whole(
    spaces: Sequence[Described], fleet: Reach, signs: tuple[float, float]
) -> tuple[Interval, Interval]:
    """What shares are shares of."""
    for each in spaces:
        if each.in_degrees and each.y is not None:
            return _radians(each.x, signs[0]), _radians(each.y, signs[1])
    return fleet.pan_rad, fleet.tilt_rad


def _radians(degrees: Interval, sign: float) -> Interval:
    ends = sorted(math.radians(each) * sign for each in degrees)
    return ends[0], ends[1]


def _position(
    uri: str,
    units: tuple[Interval, Interval],
    whole: tuple[Interval, Interval] | None,
    signs: tuple[float, float],
) -> PanTiltSpace:
    scales = []
    for axis in (0, 1):
        (low, high), sign = units[axis], signs[axis]
        if whole is None:
            scales.append(Scale(sign * math.degrees(1.0), 0.0, (low, high)))
            continue
        first, last = whole[axis] if sign > 0 else whole[axis][::-1]
        gain = (high - low) / (last - first)
        scales.append(Scale(gain, low - gain * first, (low, high)))
    return PanTiltSpace(uri, scales[0], scales[1])


def _rate(space: Described, units: Interval | None, rate_rad_s: float, sign: float) -> Scale:
    units = units or (0.0, 1.0)
    gain = math.degrees(1.0) if space.in_degrees else units[1] / rate_rad_s
    return Scale(sign * gain, 0.0, units)


def _zooms(spaces: Iterable[Described], fleet_max: float) -> Iterable[OneSpace]:
    known = [each for each in spaces if each.x[1] > each.x[0]]
    for each in sorted(known, key=lambda each: not each.in_millimetres):
        if each.in_millimetres and each.x[0] > 0:
            yield OneSpace(each.uri, Scale(each.x[0], 0.0, each.x))
            fleet_max = each.x[1] / each.x[0]
        elif each.in_shares and fleet_max > 1.0:
            gain = (each.x[1] - each.x[0]) / (fleet_max - 1.0)
            yield OneSpace(each.uri, Scale(gain, each.x[0] - gain, each.x))


def _zoom_max(zooms: Sequence[OneSpace], fleet_max: float) -> float:
    if not zooms:
        return 1.0
    own = zooms[0].scale.values[1]
    return own if fleet_max <= 1.0 else min(own, fleet_max)


def _within_limits(
    limits: Described | None, positions: Sequence[PanTiltSpace], whole: tuple[Interval, Interval]
) -> tuple[Interval, Interval]:
    if limits is None or limits.y is None:
        return whole
    space = next((each for each in positions if last_part(each.uri) == last_part(limits.uri)), None)
    if space is None:
        return whole
    return (
        _shared("pan", whole[0], _values(space.pan, limits.x)),
        _shared("tilt", whole[1], _values(space.tilt, limits.y)),
    )


def _values(scale: Scale, units: Interval) -> Interval:
    ends = sorted(map(scale.to_value, units))
    return ends[0], ends[1]


def _shared_pan(own: Interval, fleet: Interval) -> Interval:
    """Cameras count pan from 0 to 360 degrees as well as from -180 to 180."""
    if fleet[1] - fleet[0] >= FULL_CIRCLE_RAD:
        return own
    turns = (math.tau * count for count in (0, -1, 1))
    moved = [(own[0] + turn, own[1] + turn) for turn in turns]
    return _shared("pan", max(moved, key=lambda each: _overlap(each, fleet)), fleet)


def _overlap(one: Interval, other: Interval) -> float:
    return min(one[1], other[1]) - max(one[0], other[0])


def _shared(axis: str, own: Interval, fleet: Interval) -> Interval:
    low, high = max(own[0], fleet[0]), min(own[1], fleet[1])
    if low >= high:
        camera, said = (
            f"{math.degrees(a):.0f} to {math.degrees(b):.0f} deg" for a, b in (own, fleet)
        )
        raise ValueError(
            f"the camera can {axis} from {camera}, the fleet says {said}: correct `reach`"
        )
    return low, high
