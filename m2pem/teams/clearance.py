"""Which member of a march waits for which, so that none comes too near to another in the plane.

How far each of two members has gone along its path are the coordinates of a plane, their
coordination space. Zones in it are where the two would be too near to each other. A zone that the
formation enters, as at a sharp turn, is first passed by the member ahead; a zone that the formation
goes around, as where a route crosses itself, by the member that comes first in the formation.
"""

import math
from collections.abc import Callable, Sequence
from itertools import combinations
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from m2pem.geo.lazy_imports import rustworkx, shapely
from m2pem.teams.paths import MemberPath
from m2pem.teams.plan import Marcher

NEAREST_SHARE = 0.84
"""Share of the spacing that is aimed at, to keep a minimum distance of 0.8 in the plane."""

_STEPS = 24
"""Places of a path that are looked at within the minimum distance."""

_OVERLAP_M, _NOTHING_M = 0.01, 1e-6
_SHARP, _BENT = slice(1, 3), slice(3, 5)

_Floats: TypeAlias = NDArray[np.float64]


class Clearance:
    """How far each member may go, by where the others are. `apart_m`: the minimum distance.
    `in_order`: on its way to the route, a member goes before those behind it."""

    def __init__(self, marchers: Sequence[Marcher], apart_m: float, in_order: bool = False) -> None:
        order = sorted(range(len(marchers)), key=lambda index: marchers[index].back_m)
        self._yields: dict[int, list[tuple[int, _Floats, _Floats]]] = {each: [] for each in order}
        for first, second in combinations(order, 2):
            pair = _Pair(marchers[first], marchers[second], apart_m)
            zone, own_m, from_m, to_m = pair.rows()
            early = _lead_m(marchers[first], from_m) < _lead_m(marchers[second], own_m)
            ahead = np.isin(zone, zone[early])
            if in_order:
                ahead |= ~np.isin(zone, zone[np.isin(to_m, pair.ends_m[-1:])])
            # Nor does one pass the place where the other begins, before that is far enough; but
            # where both begin too near to each other.
            near = ((from_m == 0.0) & (own_m == 0.0)).any()
            begins = ahead | ((from_m == 0.0) & ~near)
            self._add(second, first, own_m[begins], to_m[begins])
            zone_too, own_m, from_m, to_m = pair.rows(swapped=True)
            behind = ~np.isin(zone_too, zone[ahead])
            begins = behind | ((from_m == 0.0) & ~near)
            self._add(first, second, own_m[begins], to_m[begins])

    def _add(self, member: int, other: int, own_m: _Floats, others_m: _Floats) -> None:
        """Note that a member waits at each of these places until the other one has gone so far."""
        if len(own_m):
            order = own_m.argsort()
            passed_m = np.maximum.accumulate(others_m[order]) + _OVERLAP_M
            self._yields[member].append((other, passed_m, own_m[order]))

    def limit_m(self, member: int, place_m: Callable[[int], float]) -> float:
        """How far along its path a member may go. `place_m`: where another is on its own path."""
        limits_m = (
            float(np.interp(place_m(other), passed_m, own_m, right=math.inf))
            for other, passed_m, own_m in self._yields[member]
        )
        return min(limits_m, default=math.inf)

    def reached_m(
        self, at_m: Sequence[float], ends_m: Sequence[float], short_m: float
    ) -> Sequence[float]:
        """How far along their paths the members get at most, from where they are.

        `short_m`: how far before the place where it must stop a member may come to a stop.
        """
        while True:
            limits_m = [self.limit_m(index, at_m.__getitem__) for index in range(len(at_m))]
            then_m = [
                max(at, end if limit >= end else limit - short_m)
                for at, end, limit in zip(at_m, ends_m, limits_m, strict=True)
            ]
            if max(b - a for a, b in zip(at_m, then_m, strict=True)) < _NOTHING_M:
                return then_m
            at_m = then_m


def _lead_m(marcher: Marcher, along_m: _Floats) -> _Floats:
    """Where the lead is when a member is there, if both keep their places."""
    return np.interp(along_m, marcher.path.corners_m, marcher.path.marks_m) + marcher.back_m


class _Pair:
    """The parts of the coordination space of two members: of each two legs that come near."""

    def __init__(self, first: Marcher, second: Marcher, apart_m: float) -> None:
        self._apart_m = apart_m
        self._paths = a, b = _driven(first.path), _driven(second.path)
        self.ends_m = a[:, 0]
        keys, edges = np.empty(0, int), []
        for style in (_SHARP, _BENT):
            one, other = (
                np.array(shapely.linestrings(np.stack([x[:-1, style], x[1:, style]], 1)))
                for x in (a, b)
            )
            ends_a, ends_b = (np.array(shapely.points(each[:, style])) for each in (a, b))
            i, k = shapely.STRtree(other).query(one, predicate="dwithin", distance=apart_m)
            keys = np.union1d(keys, i * len(b) + k)
            for step, ends, leg in ((len(b), ends_a[i + 1], other[k]), (1, ends_b[k + 1], one[i])):
                linked = (i * len(b) + k)[shapely.distance(ends, leg) < apart_m]
                edges.append(np.stack([linked, linked + step], 1))
        links = np.concatenate(edges)
        links = np.searchsorted(keys, links[np.isin(links, keys).all(1)])
        graph = rustworkx.PyGraph()
        graph.add_nodes_from(range(len(keys)))
        graph.add_edges_from_no_data(list(zip(*links.T.tolist(), strict=True)))
        self._zone = np.empty(len(keys), int)
        for number, parts in enumerate(rustworkx.connected_components(graph)):
            self._zone[list(parts)] = number
        self._legs = divmod(keys, len(b))

    def rows(self, *, swapped: bool = False) -> tuple[NDArray[np.int_], _Floats, _Floats, _Floats]:
        """Return places where the two are too near: the zone, how far the second one is along its
        path, and from where to where the first one is then along its. `swapped`: first for second.
        """
        (other, own), (k, i) = self._paths, self._legs
        if swapped:
            own, other, i, k = other, own, k, i
        lengths_m = np.diff(own[:, 0])[i]
        low, high = self._near(own, other, i, k)
        counts = np.ceil((high - low) * lengths_m / self._apart_m * _STEPS).astype(int) + 1
        part = np.repeat(np.arange(len(i)), counts)
        at = np.arange(len(part)) - (np.cumsum(counts) - counts)[part]
        share = low[part] + at * ((high - low) / np.maximum(counts - 1, 1))[part]
        begin, leg = own[i][part], np.diff(own, axis=0)[i][part]
        rows = begin + share[:, None] * leg
        found = []
        for style in (_SHARP, _BENT):
            ways = np.diff(other[:, style], axis=0)
            long_m = np.hypot(*ways.T)
            unit = (ways / long_m[:, None])[k][part]
            between = rows[:, style] - other[k, style][part]
            foot_m, off2 = _dot(between, unit), _dot(between, between)
            half_m = np.sqrt(np.maximum(0.0, self._apart_m**2 - off2 + foot_m**2))
            low, high = np.maximum(0.0, foot_m - half_m), foot_m + half_m
            high = np.minimum(high, long_m[k][part])
            near = (half_m > 0.0) & (low <= high)
            scale, from_m = (np.diff(other[:, 0]) / long_m)[k][part], other[k, 0][part]
            columns = self._zone[part], rows[:, 0], from_m + low * scale, from_m + high * scale
            found.append([each[near] for each in columns])
        zone, own_m, begins_m, ends_m = (np.concatenate(each) for each in zip(*found, strict=True))
        return zone, own_m, begins_m, ends_m

    def _near(
        self, own: _Floats, other: _Floats, i: NDArray[np.int_], k: NDArray[np.int_]
    ) -> tuple[_Floats, _Floats]:
        """Return the shares of legs of one path between which those of the other one are near."""
        found = []
        for style in (_SHARP, _BENT):
            begin, leg = own[i, style], np.diff(own[:, style], axis=0)[i]
            square_m2 = np.maximum(_dot(leg, leg), _NOTHING_M)
            feet = [_dot(other[k + end, style] - begin, leg) / square_m2 for end in (0, 1)]
            reach = self._apart_m / np.sqrt(square_m2)
            found.append((np.minimum(*feet) - reach, np.maximum(*feet) + reach))
        low, high = np.minimum(*(low for low, _ in found)), np.maximum(*(high for _, high in found))
        return np.clip(low, 0.0, 1.0), np.clip(high, 0.0, 1.0)


def _dot(a: _Floats, b: _Floats) -> _Floats:
    """Return the product of each two vectors."""
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1]


def _driven(path: MemberPath) -> _Floats:
    """Return the rows of a path without repetitions, and at least two of them."""
    rows = np.array(path.rows)
    rows = rows[np.diff(rows[:, 0], prepend=-1.0) > _NOTHING_M]
    return rows if len(rows) > 1 else np.vstack([rows, rows + _OVERLAP_M])
