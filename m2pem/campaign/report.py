"""The report of a campaign: Markdown with plots, the rows, and the worst runs as answers files."""

import math
from collections.abc import Sequence
from pathlib import Path

from m2pem.campaign.campaign import CampaignResult
from m2pem.campaign.folder import write_parquet
from m2pem.campaign.runs import Row, answers_text, replayed
from m2pem.campaign.statistics import (
    CONFIDENCE,
    compared,
    effects,
    ends,
    estimated,
    is_good,
    quantiles,
    rehearsed,
    requirements,
    worst,
)

WORST = 5
"""So many of the worst runs are written as answers files."""

MOST_EFFECTS = 15


def report_lines(result: CampaignResult, other: CampaignResult | None = None) -> list[str]:
    """Return the report as lines of Markdown. `other`: the campaign that it is compared with."""
    rows = rehearsed(result.rows)
    lines = [f"# Campaign of {result.order.mission.file}", ""]
    lines.append(
        f"{len(rows):,} runs of {result.wanted:,}, seed {result.order.seed}. Intervals are of "
        f"{CONFIDENCE:.0%} confidence."
    )
    if failed := [row for row in result.rows if row["error"]]:
        lines += ["", f"{len(failed)} runs could not be rehearsed; the first is run "]
        lines[-1] += f"{failed[0]['run']}: {failed[0]['error']}"
    if result.decision:
        lines += ["", f"Sequential test: {result.decision} after {result.decided_after:,} runs."]
    if not rows:
        return lines
    lines += ["", "## Ends", "", "| outcome | end | runs | probability | interval |"]
    lines.append("|---|---|---|---|---|")
    for (outcome, end), estimate in ends(rows).items():
        lines.append(_row(outcome, end, f"{estimate.count:,}", *_probability(estimate)))
    bad = estimated(sum(not is_good(row) for row in rows), len(rows))
    lines.append(_row("any failure", "", f"{bad.count:,}", *_probability(bad)))
    lines += _requirement_lines(rows, result.order.required)
    lines += ["", "## Times, distances and batteries", "", "| | 5 % | median | 95 % | mean |"]
    lines.append("|---|---|---|---|---|")
    lines.append(_quantiles("time, s", [row["took_s"] for row in rows]))
    keys = dict.fromkeys(key for row in rows for key in row)
    for start, name, factor in (
        ("distance.", "distance of {}, m", 1),
        ("battery.", "battery of {} at the end, %", 100),
    ):
        for key in keys:
            if key.startswith(start):
                shown = name.format(key.removeprefix(start))
                lines.append(_quantiles(shown, [factor * row[key] for row in rows if key in row]))
    lines += _effect_lines(rows)
    if other is not None:
        lines += _difference_lines(result, other)
    return lines


def _probability(estimate: object) -> tuple[str, str]:
    share, _, interval = str(estimate).partition(" ")
    return share, interval.strip("()")


def _requirement_lines(rows: Sequence[Row], required: Sequence[str]) -> list[str]:
    found = requirements(rows)
    if not found:
        return []
    lines = ["", "## Requirements", ""]
    lines.append("| requirement | satisfied | interval | violated | interval |")
    lines.append("|---|---|---|---|---|")
    for name, kept in found.items():
        shown = f"{name} (required)" if name in required else name
        lines.append(_row(shown, *_probability(kept.satisfied), *_probability(kept.violated)))
    if required:
        lines += ["", "A run that violates what is required counts as a failure."]
    return lines


def _effect_lines(rows: Sequence[Row]) -> list[str]:
    found = effects(rows)
    if not found:
        return []
    lines = ["", "## What failures depend on", ""]
    lines.append("| what was drawn | runs | change of failure | interval | of the time, s | rank |")
    lines.append("|---|---|---|---|---|---|")
    for each in found[:MOST_EFFECTS]:
        interval = f"{each.low:+.4f} to {each.high:+.4f}" + ("" if each.certain else " (may be 0)")
        took, rank = _number(each.took_s, "+.1f"), _number(each.rank, "+.2f")
        lines.append(_row(each.name, each.split, f"{each.failure:+.4f}", interval, took, rank))
    return lines


def _difference_lines(result: CampaignResult, other: CampaignResult) -> list[str]:
    difference = compared(other.rows, result.rows)
    lines = ["", f"## Against {other.order.mission.file}", ""]
    lines.append(
        f"{difference.pairs:,} pairs of runs with the same random numbers; this less that."
    )
    lines += ["", "| | difference | interval |", "|---|---|---|"]
    for name, values, shape in (
        ("probability of failure", difference.failure, "+.4f"),
        ("time of runs that are good in both, s", difference.took_s, "+.2f"),
    ):
        mean, low, high = (_number(each, shape) for each in values)
        lines.append(_row(name, mean, f"{low} to {high}"))
    return lines


def _row(*cells: str) -> str:
    return f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |"


def _quantiles(name: str, values: Sequence[float]) -> str:
    found = quantiles(values)
    numbers = (found.low, found.median, found.high, found.mean)
    return _row(name, *(f"{each:.1f}" for each in numbers))


def _number(value: float, shape: str) -> str:
    return "" if math.isnan(value) else format(value, shape)


def write_report(folder: Path, result: CampaignResult, other: CampaignResult | None = None) -> None:
    """Write `report.md`, its plots if matplotlib is there, `runs.parquet`, and the worst runs as
    answers files."""
    rows = rehearsed(result.rows)
    lines = report_lines(result, other)
    if rows:
        lines += ["", "## Worst runs", ""]
        for row in worst(rows, WORST):
            run = row["run"]
            drawn, _ = replayed(result.order, run)
            file = folder / "worst" / f"run-{run}.yaml"
            file.parent.mkdir(exist_ok=True)
            remark = f"Run {run} of a campaign of {result.order.mission.file}: {row['outcome']}"
            file.write_text(answers_text(drawn, remark), encoding="utf-8")
            lines.append(
                f"- run {run}: {row['outcome']} ({row['end']}) after {row['took_s']:.1f} s: "
                f"`m2pem simulate ... --answers worst/{file.name}`"
            )
        lines += _plots(folder, rows)
        write_parquet(folder / "runs.parquet", result.rows)
    (folder / "report.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


def _plots(folder: Path, rows: Sequence[Row]) -> list[str]:
    try:
        from matplotlib.figure import Figure  # noqa: PLC0415  # an extra, slow to load
    except ModuleNotFoundError:
        return []
    figure = Figure(figsize=(7, 3), layout="constrained")
    axes = figure.subplots()
    groups = [[row["took_s"] for row in rows if is_good(row) is good] for good in (True, False)]
    axes.hist(groups, bins=40, stacked=True, label=["good", "failed"], color=["C0", "C3"])
    axes.set_xlabel("time until the end, s")
    axes.set_ylabel("runs")
    axes.legend()
    figure.savefig(folder / "times.svg", metadata={"Date": None})
    lines = ["", "![Times](times.svg)"]
    found = effects(rows)[:MOST_EFFECTS][::-1]
    if found:
        figure = Figure(figsize=(7, 1 + 0.35 * len(found)), layout="constrained")
        axes = figure.subplots()
        places = range(len(found))
        middle = [each.failure for each in found]
        spans = [
            [each.failure - each.low for each in found],
            [each.high - each.failure for each in found],
        ]
        axes.errorbar(middle, places, xerr=spans, fmt="o", capsize=3)
        axes.axvline(0, color="grey", linewidth=0.8)
        axes.set_yticks(places, [f"{each.name}: {each.split}" for each in found])
        axes.set_xlabel("change of the probability of failure")
        figure.savefig(folder / "effects.svg", metadata={"Date": None})
        lines += ["", "![What failures depend on](effects.svg)"]
    return lines
