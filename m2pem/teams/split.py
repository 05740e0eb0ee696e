"""Who does how much of something: as the weights have it, and no more than each can."""

import math
from collections.abc import Sequence


def split(whole: float, weights: Sequence[float], reaches: Sequence[float]) -> list[float] | None:
    """The share of each, their sum the whole; None: all of them together cannot do it.

    A share is as its weight, or its reach where that is less; what is left is for the others.
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
    """Whose each of some lengths in a row is, so that together they are nearly as the shares.

    Nobody has more than a share and the longest of the lengths.
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
    """How far a vehicle can go that lasts so long, if it is so long under way there and back."""
    return math.inf if lasts_s is None else max(0.0, lasts_s - way_s) * speed_m_s
