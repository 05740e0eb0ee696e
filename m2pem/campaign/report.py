"""What the report of a campaign says: sections with tables and charts, for any writer."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean

from m2pem.campaign.campaign import CampaignResult
from m2pem.campaign.charts import Chart, Histogram, Intervals, Mark
from m2pem.campaign.runs import Order, Row, replay_command
from m2pem.campaign.statistics import (
    CONFIDENCE,
    Estimate,
    Interval,
    compared,
    effects,
    ends,
    failure,
    is_good,
    quantiles,
    rehearsed,
    requirements,
    weight_of,
    weighted,
    worst,
)

WORST = 5
"""So many of the worst runs are written as answers files."""

MOST_EFFECTS = 15

RARE = 0.005
"""Probabilities below have a power of ten."""


@dataclass(frozen=True, slots=True)
class Table:
    """Cells by rows; the first cell names its row."""

    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True, slots=True)
class Section:
    """`before`, `after`: paragraphs around the table. `commands`: to be typed, after these."""

    title: str
    before: tuple[str, ...]
    table: Table
    after: tuple[str, ...] = ()
    commands: tuple[str, ...] = ()
    chart: Chart | None = None


@dataclass(frozen=True, slots=True)
class Report:
    """A whole report, without any markup."""

    title: str
    paragraphs: tuple[str, ...]
    sections: tuple[Section, ...]


def answers_name(row: Row) -> str:
    """Return the answers file of a run, in the campaign's folder."""
    return f"worst/run-{row['run']}.yaml"


def report_of(
    result: CampaignResult, other: CampaignResult | None = None, folder: Path | None = None
) -> Report:
    """Return the report. `other`: the campaign that it is compared with. `folder`: where the
    worst runs are, as answers files."""
    rows = rehearsed(result.rows)
    paragraphs = [
        f"{len(rows):,} runs of {result.wanted:,}, seed {result.order.seed}. Intervals are of "
        f"{CONFIDENCE:.0%} confidence."
    ]
    if weighted(rows):
        mean = fmean(map(weight_of, rows))
        paragraphs.append(
            "What is sampled was drawn with another probability than its own: each run counts by "
            f"its weight. The mean weight is {mean:.3f}; far from 1, there are too few runs."
        )
    if failed := [row for row in result.rows if row["error"]]:
        first = failed[0]
        paragraphs.append(
            f"{len(failed)} runs could not be rehearsed; the first is run {first['run']}: "
            f"{first['error']}"
        )
    if result.decision:
        paragraphs.append(
            f"Sequential test: {result.decision} after {result.decided_after:,} runs."
        )
    sections = []
    if rows:
        sections = [
            _ends(rows),
            *_requirements(rows, result.order.required),
            _quantities(rows),
            *_effects(rows),
            *([] if other is None else [_difference(result, other)]),
            *([] if folder is None else [_worst(rows, result.order, folder)]),
        ]
    title = f"Campaign of {result.order.mission.file}"
    return Report(title, tuple(paragraphs), tuple(sections))


def _table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> Table:
    """Return a table without columns in which no row has anything."""
    listed = [tuple(row) for row in rows]
    kept = [place for place in range(len(columns)) if any(row[place] for row in listed)]
    return Table(
        tuple(columns[place] for place in kept),
        tuple(tuple(row[place] for place in kept) for row in listed),
    )


def _ends(rows: Sequence[Row]) -> Section:
    counted = [*ends(rows).items(), (("any failure", ""), failure(rows))]
    columns = ("outcome", "end", "runs", "probability", "interval")
    listed = [(*end, f"{each.count:,}", *_probability(each)) for end, each in counted]
    return Section("Ends", (), _table(columns, listed))


def _probability(estimate: Estimate) -> tuple[str, str]:
    rare = 0 < estimate.share < RARE
    share, low, high = (
        f"{each:.2e}" if rare else f"{each:.4f}"
        for each in (estimate.share, estimate.low, estimate.high)
    )
    return share, f"{low} to {high}"


def _requirements(rows: Sequence[Row], required: Sequence[str]) -> list[Section]:
    found = requirements(rows)
    if not found:
        return []
    table = _table(
        ("requirement", "satisfied", "interval", "violated", "interval"),
        (
            (
                f"{name} (required)" if name in required else name,
                *_probability(kept.satisfied),
                *_probability(kept.violated),
            )
            for name, kept in found.items()
        ),
    )
    after = ("A run that violates what is required counts as a failure.",) if required else ()
    return [Section("Requirements", (), table, after)]


def _quantities(rows: Sequence[Row]) -> Section:
    weights = [weight_of(row) for row in rows]
    listed = [_quantiles("time, s", [row["took_s"] for row in rows], weights)]
    keys = dict.fromkeys(key for row in rows for key in row)
    for start, name, factor in (
        ("distance.", "distance of {}, m", 1),
        ("battery.", "battery of {} at the end, %", 100),
    ):
        for key in keys:
            if key.startswith(start):
                shown = name.format(key.removeprefix(start))
                values = [factor * row[key] for row in rows]
                listed.append(_quantiles(shown, values, weights))
    good, failed = (
        [row["took_s"] for row in rows if is_good(row) is wanted] for wanted in (True, False)
    )
    return Section(
        "Times, distances and batteries",
        (),
        _table(("quantity", "5 %", "median", "95 %", "mean"), listed),
        chart=Histogram("times", "Times", "time until the end, s", good, failed),
    )


def _quantiles(name: str, values: Sequence[float], weights: Sequence[float]) -> tuple[str, ...]:
    found = quantiles(values, weights)
    numbers = (found.low, found.median, found.high, found.mean)
    return (name, *(f"{each:.1f}" for each in numbers))


def _effects(rows: Sequence[Row]) -> list[Section]:
    found = effects(rows)[:MOST_EFFECTS]
    if not found:
        return []
    title = "What failures depend on"
    columns = (
        *("what was drawn", "runs", "change of failure", "interval", "cost"),
        *("change of time, s", "interval", "rank"),
    )
    listed = [
        (
            each.name,
            each.split,
            f"{each.failure:+.4f}",
            f"{each.low:+.4f} to {each.high:+.4f}" + ("" if each.certain else " (may be 0)"),
            f"{each.cost:+.4f}",
            *_difference_of(each.took_s, "+.1f"),
            _number(each.rank, "+.2f"),
        )
        for each in found
    ]
    intervals = [
        Mark(f"{each.name}: {each.split}", each.failure, each.low, each.high) for each in found
    ]
    chart = Intervals("effects", title, "change of the probability of failure", intervals)
    return [Section(title, (), _table(columns, listed), chart=chart)]


def _difference(result: CampaignResult, other: CampaignResult) -> Section:
    difference = compared(other.rows, result.rows)
    listed = []
    for name, values, shape in (
        ("probability of failure", difference.failure, "+.4f"),
        ("time of runs that are good in both, s", difference.took_s, "+.2f"),
    ):
        listed.append((name, *_difference_of(values, shape)))
    pairs = f"{difference.pairs:,} pairs of runs with the same random numbers; this less that."
    return Section(
        f"Against {other.order.mission.file}",
        (pairs,),
        _table(("quantity", "difference", "interval"), listed),
    )


def _worst(rows: Sequence[Row], order: Order, folder: Path) -> Section:
    listed = [
        (str(row["run"]), row["outcome"], row["end"], f"{row['took_s']:.1f}")
        for row in worst(rows, WORST)
    ]
    commands = (replay_command(order, folder / answers_name(row)) for row in worst(rows, WORST))
    after = (
        "Each command rehearses its run again, in the folder in which the campaign was begun:",
    )
    table = _table(("run", "outcome", "end", "time, s"), listed)
    return Section("Worst runs", (), table, after, tuple(commands))


def _difference_of(values: Interval, shape: str) -> tuple[str, str]:
    value, low, high = (_number(each, shape) for each in values)
    return value, f"{low} to {high}" if low else ""


def _number(value: float, shape: str) -> str:
    return "" if math.isnan(value) else format(value, shape)
