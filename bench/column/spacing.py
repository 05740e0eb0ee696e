"""How far vehicles of a column are behind each other, along the way that the first one drove."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from bench.column.series import Array, Series

STEP_M = 0.2
"""Places of the way that are nearer to each other are one: a vehicle that stands goes nowhere."""

LEAD_IN_M = 200.0
"""The way goes back so far, straight, behind where the first one began: there the others stood."""

EVERY_S = 0.1


class Way:
    """Where the first vehicle drove. `places`: at least two, in metres."""

    def __init__(self, places: Sequence[tuple[float, float]]) -> None:
        kept = [np.array(places[0])]
        for place in places[1:]:
            if np.linalg.norm(np.array(place) - kept[-1]) >= STEP_M:
                kept.append(np.array(place))
        if len(kept) < 2:
            raise ValueError("the first vehicle did not move")
        ahead = (kept[1] - kept[0]) / np.linalg.norm(kept[1] - kept[0])
        self._places = np.array([kept[0] - LEAD_IN_M * ahead, *kept])
        steps = np.linalg.norm(np.diff(self._places, axis=0), axis=1)
        self._lengths = np.concatenate([[0.0], np.cumsum(steps)])

    def along_m(self, places: Array, start_m: float | None = None) -> Array:
        """How far along it each of a vehicle's places is: the nearest one, but near to the last
        one, so that a way that comes by again is not cut short."""
        found = []
        last_m = start_m
        for place in places:
            last_m = self._nearest_m(place, last_m)
            found.append(last_m)
        return np.array(found)

    def _nearest_m(self, place: Array, near_m: float | None) -> float:
        begins, legs = self._places[:-1], np.diff(self._places, axis=0)
        parts = np.einsum("ij,ij->i", place - begins, legs) / np.einsum("ij,ij->i", legs, legs)
        parts = np.clip(parts, 0.0, 1.0)
        off_m = np.linalg.norm(begins + parts[:, None] * legs - place, axis=1)
        if near_m is not None:
            off_m = np.where(
                (self._lengths[1:] < near_m - 5.0) | (self._lengths[:-1] > near_m + 5.0),
                np.inf,
                off_m,
            )
        leg = int(np.argmin(off_m))
        length = self._lengths[leg + 1] - self._lengths[leg]
        return float(self._lengths[leg] + parts[leg] * length)


def gaps_m(column: Sequence[Series], begin_s: float, end_s: float) -> Array:
    """How far each vehicle is behind the one before it: a row for each moment from `begin_s` to
    `end_s`, a column for each vehicle but the first. Of each, `column` has east and north.

    Raises:
        ValueError: the first one did not move.
    """
    lead = column[0]
    driven = lead.within(lead.times_s[0], end_s)
    way = Way([(float(east), float(north)) for east, north in driven.values[:, :2]])
    moments = np.arange(begin_s, end_s, EVERY_S)
    alongs = [way.along_m(each.at(moments)[:, :2]) for each in column]
    return np.stack([ahead - behind for ahead, behind in pairwise(alongs)], axis=1)
