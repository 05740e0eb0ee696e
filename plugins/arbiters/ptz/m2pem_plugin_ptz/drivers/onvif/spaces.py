"""The coordinate spaces of a camera: conversions of its numbers to angles, rates and zoom factors.

A camera counts in degrees, or in parts of its range (-1 to 1, "generic"), and its zoom in
millimetres of focal length or in parts (0 to 1). Parts are spread evenly over the range that the
camera reports in degrees; otherwise over that of the fleet.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

from m2pem_plugin_ptz.gimbal import Reach

EDGE_RAD = 1e-6
"""Angles this far outside a range count as its end."""

Interval = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Scale:
    """A linear scale: `units = offset + gain * value`, within `units`."""

    gain: float
    offset: float
    units: Interval

    def to_units(self, value: float) -> float:
        """Convert to a number of the camera."""
        return min(max(self.offset + self.gain * value, self.units[0]), self.units[1])

    def to_value(self, units: float) -> float:
        """Convert from a number of the camera."""
        return (units - self.offset) / self.gain

    def values(self, units: Interval | None = None) -> Interval:
        """Return the range of values of a range of numbers, or of all."""
        ends = sorted(map(self.to_value, units or self.units))
        return ends[0], ends[1]


@dataclass(frozen=True, slots=True)
class PanTiltSpace:
    """Positions in rad, or velocities in rad/s."""

    uri: str
    pan: Scale
    tilt: Scale


@dataclass(frozen=True, slots=True)
class ScalarSpace:
    """Zoom factors, or a speed of both axes in rad/s."""

    uri: str
    scale: Scale


@dataclass(frozen=True, slots=True)
class Spaces:
    """The spaces of a camera. `positions` and `zooms`: those in which it may answer; the first is
    used in commands. `velocity`, `speed`: None if it takes none. `default_position`: URI of the
    space of answers without one."""

    reach: Reach
    positions: tuple[PanTiltSpace, ...] = ()
    velocity: PanTiltSpace | None = None
    speed: ScalarSpace | None = None
    zooms: tuple[ScalarSpace, ...] = ()
    default_position: str = ""

    def ptz(self, x: float, y: float, uri: str) -> tuple[float, float] | None:
        """Return pan and tilt in rad, within `reach`; None if the space is not known."""
        space = _named(self.positions, uri or self.default_position)
        if space is None:
            return None
        return wrap_into(space.pan.to_value(x), self.reach.pan_rad), space.tilt.to_value(y)

    def zoom(self, x: float, uri: str) -> float | None:
        """Return the zoom factor; None if the space is not known."""
        space = _named(self.zooms, uri)
        return None if space is None else max(1.0, space.scale.to_value(x))

    def position(self, pan_rad: float, tilt_rad: float) -> dict[str, object]:
        """Return a position for a command. There must be `positions`."""
        space = self.positions[0]
        pan = wrap_into(pan_rad, space.pan.values())
        return {
            "x": space.pan.to_units(pan),
            "y": space.tilt.to_units(tilt_rad),
            "space": space.uri,
        }


def last_part(uri: str) -> str:
    """Return the last part of a space's URI in lower case; cameras write the rest differently."""
    return uri.strip().rsplit("/", 1)[-1].lower()


def wrap_into(angle_rad: float, interval: Interval) -> float:
    """Return the same direction, by whole turns as near to the interval as possible."""
    low, high = interval
    if low - EDGE_RAD <= angle_rad <= high + EDGE_RAD:
        return angle_rad
    return angle_rad + math.tau * round(((low + high) / 2 - angle_rad) / math.tau)


Space = TypeVar("Space", PanTiltSpace, ScalarSpace)


def _named(spaces: Sequence[Space], uri: str) -> Space | None:
    if not spaces:
        return None
    if not uri:
        # The generic space is the one that every camera has.
        return next((each for each in spaces if "generic" in each.uri.lower()), spaces[0])
    return next((each for each in spaces if last_part(each.uri) == last_part(uri)), None)


FULL_CIRCLE_RAD = math.tau - 0.02
"""Cameras that turn all round often report 359.9 degrees."""


@dataclass(frozen=True, slots=True)
class SpaceDescription:
    """The description of a space by the camera: its URI, and the range of each axis."""

    uri: str
    x: Interval
    y: Interval | None = None

    @property
    def in_degrees(self) -> bool:
        """Whether it counts degrees, or degrees per second."""
        name = last_part(self.uri)
        return name.endswith("degrees") or name == "sphericalpositionspace"

    @property
    def in_millimetres(self) -> bool:
        """Whether it counts the focal length."""
        return last_part(self.uri).endswith("millimeter")

    @property
    def in_shares(self) -> bool:
        """Whether it counts parts of the range."""
        return "generic" in last_part(self.uri)


@dataclass(frozen=True, slots=True)
class PtzSpaces:
    """All spaces of the PTZ node and the PTZ configuration of a profile. `limits`: of positions,
    set in the camera by its owner."""

    positions: Sequence[SpaceDescription] = ()
    velocities: Sequence[SpaceDescription] = ()
    speeds: Sequence[SpaceDescription] = ()
    zooms: Sequence[SpaceDescription] = ()
    limits: SpaceDescription | None = None
    default_position: str = ""


def read_spaces(offer: PtzSpaces, fleet: Reach, inverted: frozenset[str] = frozenset()) -> Spaces:
    """Read the spaces. `inverted`: "pan" and "tilt" if they run the other way.

    Raises:
        ValueError: the limits of the camera and those of the fleet do not overlap.
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
    speeds = [
        ScalarSpace(each.uri, _rate(each, each.x, rate, 1.0)) for each in _usable(offer.speeds)
    ]
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


def _usable(spaces: Iterable[SpaceDescription]) -> list[SpaceDescription]:
    """Return the known spaces. Those in degrees come first: they need no range from the fleet."""
    known = [each for each in spaces if each.in_degrees or each.in_shares]
    return sorted(known, key=lambda each: not each.in_degrees)


def _whole(
    spaces: Sequence[SpaceDescription], fleet: Reach, signs: tuple[float, float]
) -> tuple[Interval, Interval]:
    """Return the ranges that parts count."""
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


def _rate(space: SpaceDescription, units: Interval | None, rate_rad_s: float, sign: float) -> Scale:
    units = units or (0.0, 1.0)
    gain = math.degrees(1.0) if space.in_degrees else units[1] / rate_rad_s
    return Scale(sign * gain, 0.0, units)


def _zooms(spaces: Iterable[SpaceDescription], fleet_max: float) -> Iterable[ScalarSpace]:
    known = [each for each in spaces if each.x[1] > each.x[0]]
    for each in sorted(known, key=lambda each: not each.in_millimetres):
        if each.in_millimetres and each.x[0] > 0:
            yield ScalarSpace(each.uri, Scale(each.x[0], 0.0, each.x))
            fleet_max = each.x[1] / each.x[0]
        elif each.in_shares and fleet_max > 1.0:
            gain = (each.x[1] - each.x[0]) / (fleet_max - 1.0)
            yield ScalarSpace(each.uri, Scale(gain, each.x[0] - gain, each.x))


def _zoom_max(zooms: Sequence[ScalarSpace], fleet_max: float) -> float:
    if not zooms:
        return 1.0
    own = zooms[0].scale.values()[1]
    return own if fleet_max <= 1.0 else min(own, fleet_max)


def _within_limits(
    limits: SpaceDescription | None,
    positions: Sequence[PanTiltSpace],
    whole: tuple[Interval, Interval],
) -> tuple[Interval, Interval]:
    if limits is None or limits.y is None:
        return whole
    space = next((each for each in positions if last_part(each.uri) == last_part(limits.uri)), None)
    if space is None:
        return whole
    return (
        _shared("pan", whole[0], space.pan.values(limits.x)),
        _shared("tilt", whole[1], space.tilt.values(limits.y)),
    )


def _shared_pan(own: Interval, fleet: Interval) -> Interval:
    """Return the common pan range. Cameras count pan from 0 to 360 degrees, or from -180 to 180."""
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
            f"the camera can {axis} from {camera}, but the fleet says {said}: correct `reach`"
        )
    return low, high
