"""The ground along routes, and how high they are above it.

Heights are bilinear between the samples of a file. So the ground below a straight line is a
parabola from one row or column of samples to the next, and of a corridor, the place nearest to its
vehicle is at a sample or on the rim: the least height that is found is the least there is.

Places are arrays of latitudes and longitudes, (2, n), in WGS-84 degrees. Lines are straight in
degrees. Heights are in metres above mean sea level; NaN: not known.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from m2pem.geo.elevation_files import ElevationFile, Floats, Terrain
from m2pem.geo.local_frame import LatLon, LocalFrame, distance_m, metres_per_degree
from m2pem.mission.geometry import Coordinate, Route

DRIFT_M = 4.0
"""How far from its route an aircraft may be, to both sides and beyond waypoints."""

LONGEST_M = 100.0
"""Of a line: one that is so long is straight in a file's projection to 1 mm."""

_MOST_STEPS = 2_000
"""Of a profile: over a longer route they are longer, but not longer than a line may be."""

_AT_ONCE_M = 10_000.0
"""So much of a route is looked at in one piece, for its memory."""

_LEAST_PART = 1e-9
"""Of a line's length, between two of its pieces."""

_SAME_M = 1e-6

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
    """Return the ground and the altitude along a route: at waypoints and at least every `step_m`;
    between two, the place nearest to the ground if it is nearer than both, and one where the ground
    is not known. A long route has 2,000 longer steps.

    `home_m`: the altitude above mean sea level from which `relative` altitudes count; None: the
    ground at the first waypoint. Altitudes change evenly from one waypoint to the next, those above
    ground over the ground below; where frames differ, above mean sea level. `drift_m`: how far
    beside the route and beyond waypoints the places nearest to the ground may be.

    Raises:
        TerrainError: an elevation file cannot be used.
    """
    waypoints, frame = route.waypoints, route.altitude_frame
    own = np.array([each[2] for each in waypoints], float)
    grounds = terrain.heights_m(*np.array([each[:2] for each in waypoints]).T)
    home = grounds[0] if home_m is None else home_m
    if route.altitude_frames:
        bases = zip(route.frames, grounds, strict=True)
        own += [{"amsl": 0.0, "relative": home, "terrain": each}[base] for base, each in bases]
        frame = "amsl"
    length_m = sum(distance_m(a[:2], b[:2]) for a, b in pairwise(waypoints))
    parts = Parts.of(waypoints, own, min(max(step_m, length_m / _MOST_STEPS), LONGEST_M))
    # A height above ground is the same above any ground.
    weight = 0.0 if frame == "terrain" else 1.0
    opens = parts.of_leg[0] == 0
    waypoint = np.append(np.where(opens, parts.leg, -1), len(route.waypoints) - 1)
    heights = np.append(np.where(opens, own[parts.leg], parts.heights_m[0]), own[-1])
    places = np.append(parts.ends[0], np.array([waypoints[-1][:2]]).T, axis=1)
    grounds = terrain.heights_m(*places)
    above = weight * np.nan_to_num(heights) - grounds
    alongs = np.append(parts.alongs_m[0], parts.alongs_m[1, -1:])
    marks = np.stack([np.arange(len(above)), alongs, *places, grounds, heights, above])
    lows, gaps = [], []
    size = max(1, int(_AT_ONCE_M / (length_m / len(parts.leg) + 1)))
    for first in range(0, len(parts.leg), size):
        some = Parts._make(each[..., first : first + size] for each in parts)
        found = _nearest(terrain, some, drift_m, weight)
        found[0] += first
        lows.append(_least(found))
        gaps.append(_least(found[:, np.isnan(found[4])]))
    low, gap = np.concatenate(lows, axis=1), np.concatenate(gaps, axis=1)
    least = np.fmin(above[:-1], above[1:])[low[0].astype(int)]
    low = low[:, ~np.isnan(low[6]) & ~(low[6] >= least - _SAME_M)]
    gap = gap[:, ~np.isnan(above[:-1] + above[1:])[gap[0].astype(int)]]
    table = np.concatenate([marks, low, gap], axis=1)
    waypoint = np.append(waypoint, np.full(table.shape[1] - len(waypoint), -1))
    order = np.lexsort((table[1], table[0]))
    base = {"amsl": 0.0, "relative": home, "terrain": table[4]}[frame]
    columns = np.stack([*table[1:5], table[5] + base])[:, order].T.tolist()
    return [
        ProfilePoint(
            along_m,
            (latitude_deg, math.remainder(longitude_deg, 360.0)),
            None if math.isnan(ground_m) else ground_m,
            None if math.isnan(altitude_m) else altitude_m,
            None if number < 0 else number,
        )
        for number, (along_m, latitude_deg, longitude_deg, ground_m, altitude_m) in zip(
            waypoint[order].tolist(), columns, strict=True
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
    how far the leg and the shortest way are apart in the middle."""

    leg: Indexes
    of_leg: Floats
    alongs_m: Floats
    ends: Floats
    heights_m: Floats
    apart_m: Floats

    @classmethod
    def of(cls, waypoints: Sequence[Coordinate], heights_m: Floats, longest_m: float) -> "Parts":
        """Return those of a route. `heights_m`: at each waypoint."""
        if len(waypoints) == 1:
            waypoints, heights_m = [*waypoints] * 2, heights_m.repeat(2)
        places = np.array([each[:2] for each in waypoints]).T
        way = np.diff(places)
        way[1] = (way[1] + 180.0) % 360.0 - 180.0
        lengths = np.array([distance_m(a[:2], b[:2]) for a, b in pairwise(waypoints)])
        frames = map(LocalFrame, (places[:, :-1] + way / 2).T.tolist())
        chords = [
            (frame.to_local(a[:2]), frame.to_local(b[:2]))
            for frame, (a, b) in zip(frames, pairwise(waypoints), strict=True)
        ]
        counts = np.ceil(lengths / longest_m).clip(1)
        leg, number = each_of(counts)
        of_leg = np.stack([number, number + 1]) / counts[leg]
        return cls(
            leg,
            of_leg,
            (np.cumsum(lengths) - lengths)[leg] + lengths[leg] * of_leg,
            np.stack([places[:, leg] + way[:, leg] * part for part in of_leg]),
            heights_m[leg] + np.diff(heights_m)[leg] * of_leg,
            np.hypot(*np.mean(chords, axis=1).T)[leg],
        )


def _nearest(terrain: Terrain, parts: Parts, drift_m: float, weight: float) -> Floats:
    """Return places, among them that of each part nearest to the ground, as columns: number of the
    part, along, latitude, longitude, ground, height in the route's frame, above the ground."""
    begin, end = parts.ends
    per_degree = np.array([metres_per_degree(each) for each in begin[0].tolist()]).T
    way_m = (end - begin) * per_degree
    length_m = np.hypot(*way_m)
    way = np.where(length_m > 0, way_m, [[1.0], [0.0]]) / np.where(length_m > 0, length_m, 1.0)
    off = 2 * np.clip(0.5, *parts.of_leg) - 1
    far_m = drift_m and drift_m + parts.apart_m * (1 - off**2)
    ahead = way * far_m / per_degree
    aside = np.stack([-way[1], way[0]]) * far_m / per_degree
    # Beside the way, and around each waypoint.
    opens, closes = (np.flatnonzero(far_m * (each == at)) for at, each in enumerate(parts.of_leg))
    part = np.concatenate([np.arange(len(parts.leg)), opens, closes])
    begins, ends = (
        np.concatenate([way, (begin + by)[:, opens], (end + by)[:, closes]], axis=1)
        for way, by in ((begin, -ahead), (end, ahead))
    )
    alongs, heights = (
        np.concatenate([each, each[[0, 0]][:, opens], each[[1, 1]][:, closes]], axis=1)
        for each in (parts.alongs_m, parts.heights_m)
    )
    counted = weight * np.nan_to_num(heights)
    at, of_part, place, ground = _below(terrain, begins, ends, aside[:, part], counted)
    along, height, above = (
        first[at] + (last - first)[at] * of_part for first, last in (alongs, heights, counted)
    )
    return np.stack([part[at], along, *place, ground, height, above - ground])


def _least(found: Floats) -> Floats:
    """Return the column of each part that is nearest to the ground."""
    ordered = found[:, np.lexsort((found[6], found[0]))]
    return ordered[:, np.unique(ordered[0], return_index=True)[1]]


# --- lines and corridors ------------------------------------------------------------------------


class Pieces(NamedTuple):
    """Pieces of lines, in their order. `begin`, `end`: as parts of the line's length. The ground is
    `middle_m + slope_m * v + bend_m * v**2` for v from -0.5 at the begin to 0.5 at the end."""

    line: Indexes
    begin: Floats
    end: Floats
    middle_m: Floats
    slope_m: Floats
    bend_m: Floats


def pieces(terrain: Terrain, begins: Floats, ends: Floats) -> Pieces:
    """Return the pieces of lines of at most `LONGEST_M` on which the ground is a parabola.

    Raises:
        TerrainError: an elevation file cannot be used.
    """
    every = np.arange(begins.shape[1])
    cuts = [(every, np.zeros(every.shape)), (every, np.ones(every.shape))]
    for file in terrain.files_of(*np.concatenate([begins, ends], axis=1)):
        for turn in file.turns:
            grid = _in_grid(file, (begins, ends), turn)
            size = np.array([[file.rows], [file.columns]])
            near = ((grid.max(axis=0) >= -1) & (grid.min(axis=0) <= size)).all(axis=0)
            for (a, b), last in zip(grid.swapaxes(0, 1), size, strict=True):
                first = np.ceil(np.minimum(a, b)).clip(-1)
                counts = np.floor(np.maximum(a, b)).clip(max=last) - first + 1
                line, step = each_of(np.where(near & (a != b), counts, 0))
                cuts.append((line, (first[line] + step - a[line]) / (b - a)[line]))
    line, part = map(np.concatenate, zip(*cuts, strict=True))
    order = np.lexsort((part, line))
    line, part = line[order], part[order].clip(0, 1)
    kept = (line[1:] == line[:-1]) & (part[1:] - part[:-1] > _LEAST_PART)
    line, begin, end = line[:-1][kept], part[:-1][kept], part[1:][kept]
    # By three places inside: at the ends, heights may leap from one file to the next.
    looks = [begin + (end - begin) * each for each in (1 / 6, 1 / 2, 5 / 6)]
    places = [_at(begins[:, line], ends[:, line], part) for part in looks]
    before, middle, after = terrain.heights_m(*np.concatenate(places, axis=1)).reshape(3, -1)
    bend = 4.5 * (before - 2 * middle + after)
    return Pieces(line, begin, end, middle, 1.5 * (after - before), bend)


def _below(
    terrain: Terrain, begins: Floats, ends: Floats, asides: Floats, heights: Floats
) -> tuple[Indexes, Floats, Floats, Floats]:
    """Return places, among them that of each line's corridor where a vehicle is nearest to the
    ground: the index of the line, how far along it as a part of its length, the place, the ground.

    `asides`: from the line to the right rim. `heights`: (2, n), of the vehicle at begins and ends.
    """
    rims = [(begins, ends)]
    if asides.any():
        right, left = (begins + asides, ends + asides), (begins - asides, ends - asides)
        rims += [right, left, (left[0], right[0]), (left[1], right[1])]
    starts, stops = (np.concatenate(each, axis=1) for each in zip(*rims, strict=True))
    found = pieces(terrain, starts, stops)
    kind, line = np.divmod(found.line, begins.shape[1])
    # Over the whole of the last two rims, the vehicle is at the line's begin, or at its end.
    low, high = np.array([0, 0, 0, 0, 1.0])[kind], np.array([1, 1, 1, 0, 1.0])[kind]
    first, last = (low + (high - low) * each for each in (found.begin, found.end))
    rise = (heights[1] - heights[0])[line] * (last - first) - found.slope_m
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = np.where(found.bend_m < 0, rise / (2 * found.bend_m), 0.5).clip(-0.5, 0.5)
    looks = np.stack([np.full(turn.shape, -0.5), np.full(turn.shape, 0.5), turn])
    above = rise * looks - found.bend_m * looks**2
    at = looks[np.argmin(above, axis=0), np.arange(turn.size)]
    at[np.isnan(found.bend_m)] = 0.0
    part = (found.begin + found.end) / 2 + (found.end - found.begin) * at
    along = (first + last) / 2 + (last - first) * at
    place = _at(starts[:, found.line], stops[:, found.line], part)
    ground = found.middle_m + found.slope_m * at + found.bend_m * at**2
    if len(rims) == 1:
        return line, along, place, ground
    corners = np.stack([*right, *left[::-1]])
    inside, samples = (
        np.concatenate(each) for each in zip(*_samples(terrain, corners), strict=True)
    )
    offset = samples.T - begins[:, inside]
    offset[1] = (offset[1] + 180.0) % 360.0 - 180.0
    way, aside = (ends - begins)[:, inside], asides[:, inside]
    with np.errstate(divide="ignore", invalid="ignore"):
        parts = np.nan_to_num(_cross(offset, aside) / _cross(way, aside)).clip(0, 1)
    return (
        np.concatenate([line, inside]),
        np.concatenate([along, parts]),
        np.concatenate([place, begins[:, inside] + offset], axis=1),
        np.concatenate([ground, terrain.heights_m(*samples.T)]),
    )


def _samples(terrain: Terrain, corners: Floats) -> Iterator[tuple[Indexes, Floats]]:
    """Yield those in quadrilaterals, (4, 2, n): the index of it, and the places, (m, 2)."""
    yield np.zeros(0, int), np.zeros((0, 2))
    for file in terrain.files_of(*np.concatenate(list(corners), axis=1)):
        for turn in file.turns:
            rows, columns = _in_grid(file, corners, turn).swapaxes(0, 1)
            first = np.ceil(rows.min(axis=0)).clip(-1)
            which, step = each_of(np.floor(rows.max(axis=0)).clip(max=file.rows) - first + 1)
            row = first[which] + step
            # Where the row crosses the sides.
            cuts = []
            for a, b in pairwise((0, 1, 2, 3, 0)):
                with np.errstate(divide="ignore", invalid="ignore"):
                    part = (row - rows[a, which]) / (rows[b] - rows[a])[which]
                cut = columns[a, which] + (columns[b] - columns[a])[which] * part
                cuts.append(np.where((part >= 0) & (part <= 1), cut, np.nan))
            first = np.ceil(np.fmin.reduce(cuts)).clip(-1)
            counts = np.floor(np.fmax.reduce(cuts)).clip(max=file.columns) - first + 1
            at, step = each_of(np.nan_to_num(counts))
            yield which[at], np.stack(file.to_places(row[at], first[at] + step), axis=1)


def _in_grid(file: ElevationFile, places: Iterable[Floats], turn: float) -> Floats:
    """Return rows and columns, (k, 2, n); before the grid, if not all of the k places have one."""
    grid = np.stack([file.to_grid(each[0], each[1] + turn) for each in places])
    return np.where(np.isfinite(grid).all(axis=(0, 1)), grid, -9.0)


def each_of(counts: Floats) -> tuple[Indexes, Indexes]:
    """Return each index as often as its count says, and the numbers from 0 beside it."""
    times = counts.clip(0).astype(int)
    index = np.repeat(np.arange(times.size), times)
    return index, np.arange(index.size) - np.repeat(np.cumsum(times) - times, times)


def _at(begins: Floats, ends: Floats, part: Floats) -> Floats:
    return begins + (ends - begins) * part


def _cross(a: Floats, b: Floats) -> Floats:
    product: Floats = a[0] * b[1] - a[1] * b[0]
    return product
