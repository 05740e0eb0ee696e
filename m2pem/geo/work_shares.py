"""Shares of work by speed and reach, and who does which of the lengths in a row."""

import math
from collections.abc import Sequence


def split(whole: float, weights: Sequence[float], reaches: Sequence[float]) -> list[float] | None:
    """Return shares that add up to `whole`; None: the sum of the reaches is less than `whole`.

    A share is proportional to its weight, but at most its reach; the others take the rest.
    """
    if sum(reaches) < whole:
        return None
    shares = [0.0] * len(weights)
    open_ = [index for index, weight in enumerate(weights) if weight > 0]
    left = whole
    while open_:
        each = left / sum(weights[index] for index in open_)
        full = [index for index in open_ if reaches[index] < each * weights[index]]
        for index in full or open_:
            shares[index] = reaches[index] if full else each * weights[index]
            left -= shares[index]
        open_ = [index for index in open_ if index not in full] if full else []
    return shares


def owners(lengths: Sequence[float], shares: Sequence[float]) -> list[int]:
    """Return the owner of each length in a row, so that the owners' sums approximate the shares.

    No owner gets more than its share and the longest of the lengths.
    """
    whole = sum(lengths) or 1.0
    bounds = [sum(shares[: index + 1]) / sum(shares) for index in range(len(shares))]
    last = max(index for index, share in enumerate(shares) if share > 0)
    found = []
    done = 0.0
    for length in lengths:
        middle = (done + length / 2) / whole
        at = next((i for i, b in enumerate(bounds) if middle <= b and shares[i] > 0), last)
        found.append(at)
        done += length
    return found


def reach_m(lasts_s: float | None, way_s: float, speed_m_s: float) -> float:
    """Return the distance that a vehicle can survey in `lasts_s`, `way_s` of which is travel."""
    return math.inf if lasts_s is None else max(0.0, lasts_s - way_s) * speed_m_s
