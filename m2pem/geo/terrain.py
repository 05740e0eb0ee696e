"""The ground along routes, and how high they are above it.

Heights are bilinear between the samples of a file. So the ground below a straight line is a
parabola from one row or column of samples to the next, and of a corridor, the place nearest to its
vehicle is at a sample or on the rim: the least height that is found is the least there is.

Places are arrays of latitudes and longitudes in WGS-84 degrees, (2, n); a height that is not known
is NaN.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pyproj import Geod

from m2pem.geo.elevation_files import Floats, Terrain, turned
from m2pem.geo.local_frame import LatLon
from m2pem.mission.geometry import Coordinate, Route

DRIFT_M = 4.0
"""How far from its route an aircraft may be, to both sides and beyond waypoints."""

LONGEST_M = 100.0
"""Of a line: one that is so long is straight in degrees, and in a file's projection, to 1 mm."""

_MOST_STEPS = 2_000
"""Of a profile: over a longer route they are longer, but not longer than a line may be."""

_AT_ONCE_M = 2_000.0
"""So much of a route is looked at in one piece, for its memory."""

_LEAST_PART = 1e-9
"""Of a line's length, between two of its pieces."""

_EARTH = Geod(ellps="WGS84")

Indexes: TypeAlias = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class ProfilePoint:
    """A place along a route. `along_m`: from its beginning. `ground_m`, `altitude_m`: above mean
    sea level; None: not known. `waypoint`: its index, if it is one."""

    along_m: float
    place: LatLon
    ground_m: float | None
    altitude_m: float | None
    waypoint: int | None = None

    @property
    def above_ground_m(self) -> float | None:
        """Return the height above ground; None: it is not known."""
        if self.ground_m is None or self.altitude_m is None:
            return None
        return self.altitude_m - self.ground_m


def profile(
    route: Route,
    terrain: Terrain,
    step_m: float = 30.0,
    home_m: float | None = None,
    drift_m: float = DRIFT_M,
) -> list[ProfilePoint]:
    """Return the ground and the altitude along a route: at waypoints, at least every `step_m`, and
    from each of these places to the next, where the route is nearest to the ground, and one where
    the ground is not known.

    `home_m`: the altitude above mean sea level from which `relative` altitudes count; None: the
    ground at the first waypoint. Altitudes change evenly from one waypoint to the next, those above
    ground over the ground below; where frames differ, above mean sea level. `drift_m`: how far
    beside the route and beyond waypoints the places nearest to the ground may be.

    Raises:
        TerrainError: an elevation file cannot be used.
    """
    waypoints, frame = route.waypoints, route.altitude_frame
    own = np.array([each[2] for each in waypoints], float)
    grounds = terrain.heights_m(np.array([each[:2] for each in waypoints]).T)
    home = grounds[0] if home_m is None else home_m
    if route.altitude_frames:
        bases = zip(route.frames, grounds, strict=True)
        own += [{"amsl": 0.0, "relative": home, "terrain": each}[base] for base, each in bases]
        frame = "amsl"
    length_m = float(Parts.of(waypoints, own, math.inf).alongs_m[1, -1])
    step_m = min(max(step_m, length_m / _MOST_STEPS), LONGEST_M)
    parts = Parts.of(waypoints, own, step_m)
    count = parts.leg.size
    # The places as columns: number of the part, along, latitude, longitude, ground, height.
    ends = np.append(parts.ends[0], np.array([waypoints[-1][:2]]).T, axis=1)
    alongs = np.append(parts.alongs_m[0], parts.alongs_m[1, -1])
    opens = parts.of_leg[0] == 0
    heights = np.append(np.where(opens, own[parts.leg], parts.heights_m[0]), own[-1])
    found = [np.stack([np.arange(count + 1), alongs, *ends, terrain.heights_m(ends), heights])]
    # A height above ground is the same above any ground.
    weight = 0.0 if frame == "terrain" else 1.0
    size = math.ceil(_AT_ONCE_M / step_m)
    for first in range(0, count, size):
        some = Parts._make(each[..., first : first + size] for each in parts)
        found += _nearest(terrain, some, first, drift_m, weight)
    table = np.concatenate(found, axis=1)
    waypoint = np.full(table.shape[1], -1)
    waypoint[: count + 1] = [*np.where(opens, parts.leg, -1), len(waypoints) - 1]
    order = np.lexsort((table[1], table[0]))
    table[5] += {"amsl": 0.0, "relative": home, "terrain": table[4]}[frame]
    known = np.where(np.isnan(table), np.array(None), table)[1:, order].T.tolist()
    return [
        ProfilePoint(along_m, (lat, math.remainder(lon, 360.0)), ground_m, altitude_m, number)
        for number, (along_m, lat, lon, ground_m, altitude_m) in zip(
            np.where(waypoint < 0, np.array(None), waypoint)[order].tolist(), known, strict=True
        )
    ]


def lowest(points: Sequence[ProfilePoint]) -> ProfilePoint | None:
    """Return where a route is nearest to the ground; None: it is not known anywhere."""
    known = (each for each in points if each.above_ground_m is not None)
    return min(known, key=lambda each: each.above_ground_m or 0.0, default=None)


class Parts(NamedTuple):
    """A route in n parts. `leg`: the index of the waypoint before. `of_leg`, `alongs_m`: (2, n),
    where each begins and ends, as a part of its leg and from the route's beginning. `ends`: (2, 2,
    n), the places there. `heights_m`: (2, n), in the route's frame; NaN: it has none. `apart_m`:
    how far the shortest way, on which they are, is from the straight line in degrees: autopilots
    take either."""

    leg: Indexes
    of_leg: Floats
    alongs_m: Floats
    ends: Floats
    heights_m: Floats
    apart_m: Floats

    @classmethod
    def of(cls, waypoints: Sequence[Coordinate], heights_m: Floats, longest_m: float) -> "Parts":
        """Return those of a route. `heights_m`: at each waypoint."""
        places = np.array([each[:2] for each in waypoints]).T
        if len(waypoints) == 1:
            places, heights_m = places.repeat(2, axis=1), heights_m.repeat(2)
        begins, ends = places[:, :-1], places[:, 1:]
        azimuths, _, lengths = _EARTH.inv(*begins[::-1], *ends[::-1])
        middles = (begins + np.stack([ends[0], turned(ends[1], begins[1])])) / 2
        *_, apart = _EARTH.inv(*middles[::-1], *_moved(begins, azimuths, lengths / 2)[::-1])
        counts = np.ceil(lengths / longest_m).clip(1)
        leg, number = each_of(counts)
        of_leg = np.stack([number, number + 1]) / counts[leg]
        ways = lengths[leg] * of_leg
        return cls(
            leg,
            of_leg,
            (np.cumsum(lengths) - lengths)[leg] + ways,
            np.stack([_moved(begins[:, leg], azimuths[leg], way) for way in ways]),
            heights_m[leg] + np.diff(heights_m)[leg] * of_leg,
            apart[leg] * (1 - (2 * np.clip(0.5, *of_leg) - 1) ** 2),
        )


def _nearest(
    terrain: Terrain, parts: Parts, number: int, drift_m: float, weight: float
) -> list[Floats]:
    """Return the place of each part's corridor that is nearest to the ground, and one where that is
    not known. `number`: of the first part; `weight`: of heights, 0: all are as near."""
    begin, end = parts.ends
    azimuths, *_ = _EARTH.inv(*begin[::-1], *end[::-1])
    far_m = drift_m and drift_m + parts.apart_m
    ahead, aside = (_moved(begin, azimuths + turn, far_m) - begin for turn in (0, 90))
    # Corridors around lines: of the parts, and across their waypoints.
    opens, closes = (np.flatnonzero(each == at) for at, each in enumerate(parts.of_leg))
    part = np.concatenate([np.arange(parts.leg.size), opens, closes])
    begins, ends = (
        np.concatenate([way, (begin + by)[:, opens], (end + by)[:, closes]], axis=1)
        for way, by in ((begin, -ahead), (end, ahead))
    )
    alongs, heights = (
        np.concatenate([each, each[[0, 0]][:, opens], each[[1, 1]][:, closes]], axis=1)
        for each in (parts.alongs_m, parts.heights_m)
    )
    counted, aside = weight * np.nan_to_num(heights), aside[:, part]
    # The line, and the rim of its corridor: over all of the last two, it is at its begin, or end.
    left, right = (begins - aside, ends - aside), (begins + aside, ends + aside)
    rims = ((begins, ends), left, right, (left[0], right[0]), (left[1], right[1]))
    starts, stops = (np.concatenate(each, axis=1) for each in zip(*rims, strict=True))
    which, first, last, (middle, slope, bend) = pieces(terrain, starts, stops)
    kind, line = np.divmod(which, part.size)
    low, high = np.array([0, 0, 0, 0, 1.0])[kind], np.array([1, 1, 1, 0, 1.0])[kind]
    rise = (counted[1] - counted[0])[line] * (high - low) * (last - first) - slope
    with np.errstate(divide="ignore", invalid="ignore"):
        # Over a hollow, the height is least inside or at an end; over a hill, at an end.
        at = np.where(bend < 0, rise / (2 * bend), np.where(rise < 0, 0.5, -0.5)).clip(-0.5, 0.5)
    at[np.isnan(bend)] = 0.0
    of_rim = (first + last) / 2 + (last - first) * at
    place = starts[:, which] + (stops - starts)[:, which] * of_rim
    inside, of_line, samples = _samples(terrain, begins, ends, aside)
    line = np.append(line, inside)
    of_line = np.append(low + (high - low) * of_rim, of_line)
    ground = np.append(middle + slope * at + bend * at**2, terrain.heights_m(samples))
    along, height, above = (
        first[line] + (last - first)[line] * of_line for first, last in (alongs, heights, counted)
    )
    places = np.append(place, samples, axis=1)
    found = np.stack([part[line] + number, along, *places, ground, height])
    # The first of each part.
    order = np.lexsort((above - ground, found[0]))
    gaps = order[np.isnan(ground[order])]
    return [
        found[:, some[np.unique(found[0, some], return_index=True)[1]]] for some in (order, gaps)
    ]


# --- lines and corridors ------------------------------------------------------------------------


def pieces(
    terrain: Terrain, begins: Floats, ends: Floats
) -> tuple[Indexes, Floats, Floats, Floats]:
    """Return the pieces of lines of at most `LONGEST_M` on which the ground is a parabola.

    Of each, in their order: the index of the line; where it begins and ends, as parts of the line's
    length; and a, b and c, (3, m): the ground is a + b v + c v**2, v from -0.5 to 0.5.

    Raises:
        TerrainError: an elevation file cannot be used.
    """
    every = np.arange(begins.shape[1])
    cuts = [(every, np.zeros(every.shape)), (every, np.ones(every.shape))]
    for file in terrain.files_of(np.append(begins, ends, axis=1)):
        grid = np.stack([file.to_grid(begins), file.to_grid(ends)])
        low, high = _bounds(grid, file.shape)
        size = np.array(file.shape)[:, None]
        near = ((grid.max(axis=0) >= -1) & (grid.min(axis=0) <= size)).all(axis=0)
        for (a, b), first, last in zip(grid.swapaxes(0, 1), low, high, strict=True):
            line, step = each_of(np.where(near & (a != b), last - first + 1, 0))
            cuts.append((line, (first[line] + step - a[line]) / (b - a)[line]))
    line, part = map(np.concatenate, zip(*cuts, strict=True))
    order = np.lexsort((part, line))
    line, part = line[order], part[order].clip(0, 1)
    kept = (line[1:] == line[:-1]) & (np.diff(part) > _LEAST_PART)
    line, begin, end = line[:-1][kept], part[:-1][kept], part[1:][kept]
    # By three places inside: at the ends, heights may leap from one file to the next.
    looks = (begin + (end - begin) * np.array([[1 / 6], [1 / 2], [5 / 6]])).ravel()
    thrice = np.tile(line, 3)
    places = begins[:, thrice] + (ends - begins)[:, thrice] * looks
    before, middle, after = terrain.heights_m(places).reshape(3, -1)
    curve = np.stack([middle, 1.5 * (after - before), 4.5 * (before - 2 * middle + after)])
    return line, begin, end, curve


def _samples(
    terrain: Terrain, begins: Floats, ends: Floats, asides: Floats
) -> tuple[Indexes, Floats, Floats]:
    """Return those in corridors: the index of it, how far along as a part of its length, and the
    place. `asides`: from the line to its right rim."""
    found: list[Floats] = [np.zeros((4, 0))]
    corners = [way + by for way in (begins, ends) for by in (asides, -asides)]
    way = ends - begins
    for file in terrain.files_of(np.concatenate(corners, axis=1)):
        low, high = _bounds(np.stack([file.to_grid(each) for each in corners]), file.shape)
        rows, columns = (high - low + 1).clip(0)
        at, number = each_of(rows * columns)
        row, column = np.divmod(number, columns[at])
        places = file.to_places(low[:, at] + np.stack([row, column]))
        places[1] = turned(places[1], begins[1, at])
        offset = places - begins[:, at]
        with np.errstate(divide="ignore", invalid="ignore"):
            along = _cross(offset, asides[:, at]) / _cross(way, asides)[at]
            aside = _cross(offset, way[:, at]) / _cross(asides, way)[at]
        inside = (along >= 0) & (along <= 1) & (abs(aside) <= 1)
        found.append(np.stack([at, along, *places])[:, inside])
    index, along, *samples = np.concatenate(found, axis=1)
    return index.astype(int), along, np.stack(samples)


def _bounds(grid: Floats, shape: tuple[int, int]) -> tuple[Floats, Floats]:
    """Return the first and the last rows and columns, (2, n), between places in a grid, (k, 2, n),
    also one before and one after the grid; none where not all of the k are known."""
    known = np.isfinite(grid).all(axis=(0, 1))
    low = np.ceil(grid.min(axis=0)).clip(-1)
    high = np.floor(grid.max(axis=0)).clip(max=np.array(shape)[:, None])
    return np.where(known, low, 0), np.where(known, high, -1)


def each_of(counts: Floats) -> tuple[Indexes, Indexes]:
    """Return each index as often as its count says, and the numbers from 0 beside it."""
    times = counts.clip(0).astype(int)
    index = np.repeat(np.arange(times.size), times)
    return index, np.arange(index.size) - np.repeat(np.cumsum(times) - times, times)


def _moved(places: Floats, azimuths: Floats, by_m: Floats | float) -> Floats:
    """Return the places so far in a direction, in degrees from north."""
    far = np.broadcast_to(by_m, azimuths.shape)
    longitudes, latitudes, _ = _EARTH.fwd(places[1], places[0], azimuths, far)
    return np.stack([latitudes, turned(longitudes, places[1])])


def _cross(a: Floats, b: Floats) -> Floats:
    product: Floats = a[0] * b[1] - a[1] * b[0]
    return product
