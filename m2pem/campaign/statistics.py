"""What the rows of a campaign say: probabilities with their intervals, and what they depend on."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from m2pem.campaign.runs import Row
from m2pem.campaign.variations import shown

CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class Estimate:
    """A probability: that of `count` of `runs`, and the interval it lies in with `CONFIDENCE`."""

    count: int
    runs: int
    low: float
    high: float

    @property
    def share(self) -> float:
        """The most likely value."""
        return self.count / self.runs if self.runs else math.nan

    def __str__(self) -> str:
        return f"{self.share:.4f} ({self.low:.4f} to {self.high:.4f})"


def estimated(count: int, runs: int) -> Estimate:
    """Return an estimate, with the exact interval (Clopper and Pearson 1934)."""
    from scipy.stats import binomtest  # noqa: PLC0415  # an extra, slow to load

    if not runs:
        return Estimate(0, 0, 0.0, 1.0)
    interval = binomtest(count, runs).proportion_ci(CONFIDENCE, method="exact")
    return Estimate(count, runs, float(interval.low), float(interval.high))


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


def quantiles(values: Sequence[float]) -> Quantiles:
    """Return the 5 %, 50 % and 95 % quantiles, and the mean; there is at least one value."""
    ordered = sorted(values)

    def at(share: float) -> float:
        place = share * (len(ordered) - 1)
        low = math.floor(place)
        high = min(low + 1, len(ordered) - 1)
        return ordered[low] + (ordered[high] - ordered[low]) * (place - low)

    return Quantiles(at(0.05), at(0.5), at(0.95), math.fsum(ordered) / len(ordered))


Interval = tuple[float, float, float]
"""A value, and the interval that it lies in: (value, low, high)."""


@dataclass(frozen=True, slots=True)
class Effect:
    """How a drawn quantity changes a probability of failure and a duration.

    `split`: how the runs are halved: those with it and without, or above the median and not above.
    `share`: of the runs that have it. `failure`, within `low` and `high` (Newcombe 1998): the
    difference of the two probabilities; `took_s`: of the mean durations of good runs (Welch 1947).
    `rank`: Spearman's correlation with failure; nan of a quantity that is no number.
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
    if isinstance(values[0], float):
        from scipy.stats import spearmanr  # noqa: PLC0415  # an extra

        median = quantiles(values).median
        failures = [not is_good(row) for row in known]
        rank = math.nan
        if len(set(failures)) > 1:
            rank = float(spearmanr(values, failures).statistic)
        above = [each > median for each in values]
        yield _effect(drawn, f"above {shown(drawn, median)}", known, above, rank)
    elif isinstance(values[0], bool):
        yield _effect(drawn, "with it", known, values, math.nan)
    else:
        for choice in sorted(set(values)):
            yield _effect(drawn, f"{choice}", known, [each == choice for each in values], math.nan)


def _effect(
    name: str, split: str, rows: Sequence[Row], with_it: Sequence[bool], rank: float
) -> Effect:
    groups: list[list[Row]] = [[], []]
    for row, within in zip(rows, with_it, strict=True):
        groups[within].append(row)
    without, within_ = (_failures(group) for group in groups)
    low, high = _newcombe(within_, without)
    times = [[row["took_s"] for row in group if is_good(row)] for group in groups]
    return Effect(
        name,
        split,
        within_[1] / len(rows),
        _share(within_) - _share(without),
        low,
        high,
        _welch(times[1], times[0]),
        rank,
    )


def _failures(rows: Sequence[Row]) -> tuple[int, int]:
    return sum(not is_good(row) for row in rows), len(rows)


def _share(counted: tuple[int, int]) -> float:
    return counted[0] / counted[1] if counted[1] else 0.0


def _newcombe(first: tuple[int, int], second: tuple[int, int]) -> tuple[float, float]:
    """Return the interval of the difference of two probabilities, by those of Wilson (1927)."""
    from scipy.stats import binomtest  # noqa: PLC0415  # an extra

    if not first[1] or not second[1]:
        return -1.0, 1.0
    a, b = (binomtest(*each).proportion_ci(CONFIDENCE, method="wilson") for each in (first, second))
    p, q = _share(first), _share(second)
    low = p - q - math.sqrt((p - a.low) ** 2 + (b.high - q) ** 2)
    high = p - q + math.sqrt((a.high - p) ** 2 + (q - b.low) ** 2)
    return float(low), float(high)


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
    failures = [float(not is_good(b)) - float(not is_good(a)) for a, b in pairs]
    took_s = [b["took_s"] - a["took_s"] for a, b in pairs if is_good(a) and is_good(b)]
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
    counted: Counter[tuple[str, str]] = Counter((row["outcome"], row["end"]) for row in rows)
    return {end: estimated(count, len(rows)) for end, count in counted.most_common()}


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
        said = Counter(row[key] for row in rows if key in row)
        runs = said.total()
        found[key.removeprefix("requirement.")] = Kept(
            estimated(said["satisfied"], runs), estimated(said["violated"], runs)
        )
    return found


def rehearsed(rows: Iterable[Row]) -> list[Row]:
    """Return the rows of runs that could be rehearsed."""
    return [row for row in rows if not row["error"]]


def worst(rows: Sequence[Row], count: int) -> list[Row]:
    """Return the worst runs: those that failed, then the longest."""

    def order(row: Row) -> tuple[bool, float, int]:
        return is_good(row), -(row["took_s"] or 0.0), row["run"]

    return sorted(rows, key=order)[:count]
