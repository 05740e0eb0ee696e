"""What the rows of a campaign say: probabilities with their intervals, and what they depend on."""

import math
from bisect import bisect_left
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import accumulate
from statistics import NormalDist

from m2pem.campaign.runs import Row
from m2pem.campaign.variations import shown

CONFIDENCE = 0.95

Interval = tuple[float, float, float]
"""A value, and the interval that it lies in: (value, low, high)."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """A probability: that of `count` of `runs`, and the interval it lies in with `CONFIDENCE`.
    `share`: the most likely value."""

    count: int
    runs: int
    low: float
    high: float
    share: float

    def __str__(self) -> str:
        return f"{self.share:.4f} ({self.low:.4f} to {self.high:.4f})"


def estimated(count: int, runs: int) -> Estimate:
    """Return an estimate, with the exact interval (Clopper and Pearson 1934)."""
    from scipy.stats import binomtest  # noqa: PLC0415  # an extra, slow to load

    if not runs:
        return Estimate(0, 0, 0.0, 1.0, math.nan)
    interval = binomtest(count, runs).proportion_ci(CONFIDENCE, method="exact")
    return Estimate(count, runs, float(interval.low), float(interval.high), count / runs)


def weight_of(row: Row) -> float:
    """Return how much a run counts; see `DrawnRun`."""
    return float(row.get("weight", 1.0))


def weighted(rows: Iterable[Row]) -> bool:
    """Whether runs were drawn with other probabilities than their own."""
    return any(weight_of(row) != 1 for row in rows)


def probability(rows: Sequence[Row], holds: Callable[[Row], bool]) -> Estimate:
    """Return how likely a run is such.

    Of weighted runs, that of the rarer side, such runs or the others, is the mean of its weights,
    with the interval of Fay and Feuer (1997); without any, by the highest weight.
    """
    such = [row for row in rows if holds(row)]
    if not weighted(rows):
        return estimated(len(such), len(rows))
    others = [row for row in rows if not holds(row)]
    sums = [math.fsum(map(weight_of, each)) for each in (such, others)]
    most = max(map(weight_of, rows))
    if sums[0] <= sums[1]:
        share, low, high = _weighted_mean(such, len(rows), most)
    else:
        share, low, high = (1 - each for each in _weighted_mean(others, len(rows), most))
        low, high = high, low
    return Estimate(len(such), len(rows), low, high, share)


def _weighted_mean(such: Sequence[Row], runs: int, most: float) -> Interval:
    from scipy.stats import chi2  # noqa: PLC0415  # an extra

    weights = [weight_of(row) / runs for row in such]
    mean, variance = math.fsum(weights), math.fsum(each**2 for each in weights)
    highest = max(weights, default=most / runs)
    tail = (1 - CONFIDENCE) / 2
    low = 0.0
    if mean > 0:
        low = float(chi2.ppf(tail, 2 * mean**2 / variance)) * variance / (2 * mean)
    above, spread = mean + highest, variance + highest**2
    high = float(chi2.ppf(1 - tail, 2 * above**2 / spread)) * spread / (2 * above)
    return mean, low, min(1.0, high)


def is_good(row: Row) -> bool:
    """Whether the mission ended as it is drawn, and violates nothing that is required."""
    return row.get("good") is True


@dataclass(frozen=True, slots=True)
class Quantiles:
    """Of a quantity over all runs."""

    low: float
    median: float
    high: float
    mean: float


def quantiles(values: Sequence[float], weights: Sequence[float] = ()) -> Quantiles:
    """Return the 5 %, 50 % and 95 % quantiles, and the mean; there is at least one value.
    `weights`: of each value, if they are not equal."""
    if len({*weights}) > 1:
        return _weighted_quantiles(sorted(zip(values, weights, strict=True)))
    ordered = sorted(values)

    def at(share: float) -> float:
        place = share * (len(ordered) - 1)
        low = math.floor(place)
        high = min(low + 1, len(ordered) - 1)
        return ordered[low] + (ordered[high] - ordered[low]) * (place - low)

    return Quantiles(at(0.05), at(0.5), at(0.95), math.fsum(ordered) / len(ordered))


def _weighted_quantiles(ordered: Sequence[tuple[float, float]]) -> Quantiles:
    total = math.fsum(weight for _, weight in ordered)
    below = [*accumulate(weight for _, weight in ordered)]

    def at(share: float) -> float:
        return ordered[min(bisect_left(below, share * total), len(ordered) - 1)][0]

    mean = math.fsum(value * weight for value, weight in ordered) / total
    return Quantiles(at(0.05), at(0.5), at(0.95), mean)


@dataclass(frozen=True, slots=True)
class Effect:
    """How a drawn quantity changes a probability of failure and a duration.

    `split`: how the runs are halved: those with it and without, or above the median and not above.
    `share`: of all runs, those that have it. `failure`, within `low` and `high` (Newcombe 1998):
    the difference of both probabilities; `took_s`: of the mean durations of good runs (Welch 1947).
    `rank`: Spearman's correlation with failure; nan of a quantity that is no number. Weighted runs
    have neither the interval of the time nor a rank, and count as so many runs as would be as
    uncertain (Kish 1965).
    """

    name: str
    split: str
    share: float
    failure: float
    low: float
    high: float
    took_s: Interval
    rank: float

    @property
    def certain(self) -> bool:
        """Whether the interval leaves out that it has no effect."""
        return self.low > 0 or self.high < 0

    @property
    def cost(self) -> float:
        """How much less likely failure would be without it."""
        return self.share * self.failure


def effects(rows: Sequence[Row]) -> list[Effect]:
    """Return the effect of each drawn quantity: those that are certain before the others, and that
    with the highest cost first."""
    names = dict.fromkeys(key for row in rows for key in row if key.startswith("drawn."))
    found = [effect for name in names for effect in _effects_of(name, rows)]
    return sorted(found, key=lambda each: (not each.certain, -abs(each.cost), each.name))


def _effects_of(name: str, rows: Sequence[Row]) -> Iterable[Effect]:
    known = [row for row in rows if name in row]
    values = [row[name] for row in known]
    drawn = name.removeprefix("drawn.")
    if len(set(values)) < 2:
        return
    total = math.fsum(map(weight_of, rows))
    if isinstance(values[0], float):
        from scipy.stats import spearmanr  # noqa: PLC0415  # an extra

        median = quantiles(values).median
        failures = [not is_good(row) for row in known]
        rank = math.nan
        if len(set(failures)) > 1 and not weighted(known):
            rank = float(spearmanr(values, failures).statistic)
        above = [each > median for each in values]
        yield _effect(drawn, f"above {shown(drawn, median)}", known, above, rank, total)
    elif isinstance(values[0], bool):
        yield _effect(drawn, "with it", known, values, math.nan, total)
    else:
        for choice in sorted(set(values)):
            chosen = [each == choice for each in values]
            yield _effect(drawn, f"{choice}", known, chosen, math.nan, total)


def _effect(
    name: str, split: str, rows: Sequence[Row], with_it: Sequence[bool], rank: float, total: float
) -> Effect:
    """`rows`: those for which it was drawn. `total`: the weight of all."""
    groups: list[list[Row]] = [[], []]
    for row, within in zip(rows, with_it, strict=True):
        groups[within].append(row)
    without, within_ = (_failures(group) for group in groups)
    low, high = _newcombe(within_, without)
    good = [[row for row in group if is_good(row)] for group in groups]
    return Effect(
        name,
        split,
        math.fsum(map(weight_of, groups[1])) / total,
        within_[0] - without[0],
        low,
        high,
        _took_s(good[1], good[0]),
        rank,
    )


def _failures(rows: Sequence[Row]) -> tuple[float, float]:
    """Return the share of the runs that failed, and as how many runs they count."""
    weights = [weight_of(row) for row in rows]
    total = math.fsum(weights)
    if not total:
        return 0.0, 0.0
    failed = math.fsum(weight_of(row) for row in rows if not is_good(row))
    return failed / total, total**2 / math.fsum(each**2 for each in weights)


def _newcombe(first: tuple[float, float], second: tuple[float, float]) -> tuple[float, float]:
    """Return the interval of the difference of two probabilities, by those of Wilson (1927)."""
    if not first[1] or not second[1]:
        return -1.0, 1.0
    (p, _), (q, _) = first, second
    (a_low, a_high), (b_low, b_high) = _wilson(*first), _wilson(*second)
    low = p - q - math.sqrt((p - a_low) ** 2 + (b_high - q) ** 2)
    high = p - q + math.sqrt((a_high - p) ** 2 + (q - b_low) ** 2)
    return low, high


def _wilson(share: float, runs: float) -> tuple[float, float]:
    """Return the interval of a probability; scipy's takes whole numbers of runs only."""
    z = NormalDist().inv_cdf((1 + CONFIDENCE) / 2)
    middle = (share + z**2 / (2 * runs)) / (1 + z**2 / runs)
    half = z / (1 + z**2 / runs) * math.sqrt(share * (1 - share) / runs + (z / (2 * runs)) ** 2)
    return max(0.0, middle - half), min(1.0, middle + half)


def _took_s(first: Sequence[Row], second: Sequence[Row]) -> Interval:
    if weighted([*first, *second]):
        if not first or not second:
            return math.nan, math.nan, math.nan
        return _mean_took_s(first) - _mean_took_s(second), math.nan, math.nan
    return _welch(*([row["took_s"] for row in group] for group in (first, second)))


def _mean_took_s(rows: Sequence[Row]) -> float:
    total = math.fsum(map(weight_of, rows))
    return math.fsum(weight_of(row) * row["took_s"] for row in rows) / total


def _welch(first: Sequence[float], second: Sequence[float]) -> Interval:
    """Return the difference of two means, with the interval of Welch's test."""
    from scipy.stats import ttest_ind  # noqa: PLC0415  # an extra

    if not first or not second:
        return math.nan, math.nan, math.nan
    difference = math.fsum(first) / len(first) - math.fsum(second) / len(second)
    if len(first) < 2 or len(second) < 2:
        return difference, math.nan, math.nan
    if len({*first}) == len({*second}) == 1:
        return difference, difference, difference
    interval = ttest_ind(first, second, equal_var=False).confidence_interval(CONFIDENCE)
    return difference, float(interval.low), float(interval.high)


@dataclass(frozen=True, slots=True)
class Difference:
    """Of two campaigns, run by run with the same random numbers: the second less the first.

    `failure`, `took_s`: of the probabilities, and of the durations of runs that are good in both.
    `pairs`: how many runs both have.
    """

    pairs: int
    failure: Interval
    took_s: Interval


def compared(first: Sequence[Row], second: Sequence[Row]) -> Difference:
    """Compare two campaigns of the same seed."""
    others = {row["run"]: row for row in second if not row["error"]}
    pairs = [
        (row, others[row["run"]]) for row in first if not row["error"] and row["run"] in others
    ]
    failures = [weight_of(a) * (float(is_good(a)) - float(is_good(b))) for a, b in pairs]
    good = [(a, b) for a, b in pairs if is_good(a) and is_good(b)]
    each = math.fsum(weight_of(a) for a, _ in good) / len(good) if good else 1.0
    took_s = [weight_of(a) / each * (b["took_s"] - a["took_s"]) for a, b in good]
    return Difference(len(pairs), _mean(failures), _mean(took_s))


def _mean(values: Sequence[float]) -> Interval:
    """Return the mean of paired differences and its interval (Student's t)."""
    from scipy.stats import t  # noqa: PLC0415  # an extra

    count = len(values)
    if not count:
        return math.nan, math.nan, math.nan
    mean = math.fsum(values) / count
    if count < 2:
        return mean, math.nan, math.nan
    deviation = math.sqrt(math.fsum((each - mean) ** 2 for each in values) / (count - 1))
    half = float(t.ppf((1 + CONFIDENCE) / 2, count - 1)) * deviation / math.sqrt(count)
    return mean, mean - half, mean + half


@dataclass(frozen=True, slots=True)
class SequentialTest:
    """Wald's sequential probability ratio test (1945) of "it fails with probability `p1`" against
    "with `p0`", `p0` < `p1`. `alpha`: how likely it says p1 where p0 is; `beta`: p0 where p1 is."""

    p0: float
    p1: float
    alpha: float
    beta: float

    def __post_init__(self) -> None:
        if not 0 < self.p0 < self.p1 < 1:
            raise ValueError("0 < p0 < p1 < 1")
        if not (0 < self.alpha < 0.5 and 0 < self.beta < 0.5):
            raise ValueError("alpha and beta lie between 0 and 0.5")

    def decide(self, failures: Iterable[bool]) -> tuple[str, int]:
        """Return "p0", "p1" or "" (not decided), and how many runs it took, in their order."""
        upper = math.log((1 - self.beta) / self.alpha)
        lower = math.log(self.beta / (1 - self.alpha))
        failed, good = math.log(self.p1 / self.p0), math.log((1 - self.p1) / (1 - self.p0))
        ratio, runs = 0.0, 0
        for each in failures:
            runs += 1
            ratio += failed if each else good
            if ratio >= upper:
                return "p1", runs
            if ratio <= lower:
                return "p0", runs
        return "", runs


def ends(rows: Sequence[Row]) -> Mapping[tuple[str, str], Estimate]:
    """Return the probability of each outcome and end, the most likely first."""
    counted = dict.fromkeys((row["outcome"], row["end"]) for row in rows)
    found = {end: probability(rows, partial(_has_end, end)) for end in counted}
    return dict(sorted(found.items(), key=lambda item: -item[1].share))


def _has_end(end: tuple[str, str], row: Row) -> bool:
    return (row["outcome"], row["end"]) == end


def failure(rows: Sequence[Row]) -> Estimate:
    """Return the probability of failure."""
    return probability(rows, lambda row: not is_good(row))


@dataclass(frozen=True, slots=True)
class Kept:
    """How likely a requirement is satisfied, and violated; in the other runs it is open."""

    satisfied: Estimate
    violated: Estimate


def requirements(rows: Sequence[Row]) -> Mapping[str, Kept]:
    """Return what is known of each requirement, by its id."""
    names = dict.fromkeys(key for row in rows for key in row if key.startswith("requirement."))
    found = {}
    for key in names:
        known = [row for row in rows if key in row]
        satisfied, violated = (
            probability(known, partial(_has_verdict, key, verdict))
            for verdict in ("satisfied", "violated")
        )
        found[key.removeprefix("requirement.")] = Kept(satisfied, violated)
    return found


def _has_verdict(key: str, verdict: str, row: Row) -> bool:
    return bool(row[key] == verdict)


def rehearsed(rows: Iterable[Row]) -> list[Row]:
    """Return the rows of runs that could be rehearsed."""
    return [row for row in rows if not row["error"]]


def worst(rows: Sequence[Row], count: int) -> list[Row]:
    """Return the worst runs: those that failed, then the longest."""

    def order(row: Row) -> tuple[bool, float, int]:
        return is_good(row), -(row["took_s"] or 0.0), row["run"]

    return sorted(rows, key=order)[:count]
