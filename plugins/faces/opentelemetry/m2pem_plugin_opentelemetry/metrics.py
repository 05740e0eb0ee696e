"""The metrics: one table of what there is, and one snapshot from which both faces are served.

Names are OpenTelemetry's; Prometheus has them with underscores, unit and "_total", as its
compatibility rules say: "m2pem.commit.duration" is `m2pem_commit_duration_seconds`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias

from m2pem import __version__
from m2pem.api.records import RunOutcome
from m2pem.api.statistics import DurationCounts, ExecutiveStatistics
from m2pem.api.telemetry import LinkState
from m2pem_plugin_opentelemetry.run_measures import Histogram, RunMeasures


class Kind(StrEnum):
    """What a metric is."""

    COUNTER = "counter"
    GAUGE = "gauge"
    HISTOGRAM = "histogram"


@dataclass(frozen=True, slots=True)
class Metric:
    """A metric. `unit` is in UCUM: "s", or "{record}", which Prometheus leaves out."""

    name: str
    kind: Kind
    unit: str
    meaning: str
    labels: tuple[str, ...] = ()

    @property
    def prometheus_name(self) -> str:
        """Its name at `/metrics`, without "_total" and "_bucket"."""
        name = self.name.replace(".", "_")
        return f"{name}_seconds" if self.unit == "s" else name


C, G, H = Kind.COUNTER, Kind.GAUGE, Kind.HISTOGRAM

METRICS: Mapping[str, Metric] = {
    metric.name: metric
    for metric in (
        Metric("m2pem.info", G, "", "always 1: what serves", ("version", "fleet")),
        Metric("m2pem.inputs", C, "{input}", "inputs that runs have decided"),
        Metric("m2pem.records", C, "{record}", "records that this gave"),
        Metric("m2pem.commit.duration", H, "s", "commits of the journal"),
        Metric("m2pem.commit.longest", G, "s", "the longest commit"),
        Metric("m2pem.loop.lateness", H, "s", "how late the event loop was"),
        Metric("m2pem.loop.longest", G, "s", "the longest lateness of the event loop"),
        Metric("m2pem.runs", G, "{run}", "runs that go on, by status", ("status",)),
        Metric("m2pem.runs.ended", C, "{run}", "runs that have ended, by outcome", ("outcome",)),
        Metric("m2pem.inbox.length", G, "{input}", "inputs that a run has not decided", ("run",)),
        Metric("m2pem.behaviors", G, "{behavior}", "behaviors under way"),
        Metric("m2pem.prompts", G, "{prompt}", "questions that are open"),
        Metric("m2pem.incidents", G, "{incident}", "incidents that are open"),
        Metric("m2pem.calls.waiting", G, "{call}", "calls of arbiters under way or in a queue"),
        Metric("m2pem.events.waiting", G, "{event}", "events that the slowest subscriber has not"),
        Metric("m2pem.events.cut_off", C, "{subscriber}", "subscribers that were too slow"),
        Metric("m2pem.observers.waiting", G, "{input}", "inputs that observers have not seen"),
        Metric("m2pem.observers.dropped", C, "{input}", "inputs that slow observers do not see"),
        Metric("m2pem.telemetry.dropped", C, "{state}", "states that slow readers do not get"),
        Metric(
            "m2pem.subscription.waiting",
            G,
            "{state}",
            "states that wait in a subscription of telemetry",
            ("subscription",),
        ),
        Metric(
            "m2pem.subscription.dropped",
            G,
            "{state}",
            "states that a subscription which is open has dropped",
            ("subscription",),
        ),
        Metric(
            "m2pem.link", G, "", "1 for the state of the link, 0 for others", ("resource", "state")
        ),
        Metric(
            "m2pem.telemetry.age", G, "s", "since the newest state of a resource", ("resource",)
        ),
        Metric(
            "m2pem.behavior.duration", H, "s", "behaviors, by how they ended", ("behavior", "state")
        ),
        Metric("m2pem.prompt.latency", H, "s", "questions until they were answered"),
        Metric(
            "m2pem.spans", C, "{span}", "spans, by what became of them (face otlp)", ("result",)
        ),
    )
}
"""All metrics, by name; docs/metrics.md has the same table."""

Value: TypeAlias = float | Histogram


@dataclass(frozen=True, slots=True)
class Family:
    """A metric with its values, by the values of its labels."""

    metric: Metric
    points: Sequence[tuple[tuple[str, ...], Value]]


OUTCOMES = tuple(each.value for each in RunOutcome)

SPANS: dict[str, int] = {"exported": 0, "dropped": 0, "failed": 0}
"""What became of spans in this process. dropped: the collector was too slow; failed: it was not
there, or refused them."""


def snapshot(found: ExecutiveStatistics, measures: RunMeasures, fleet: str) -> list[Family]:
    """Return all metrics with their values of now."""
    values: dict[str, Sequence[tuple[tuple[str, ...], Value]]] = {
        "m2pem.info": _one(1, __version__, fleet),
        "m2pem.inputs": _one(found.inputs),
        "m2pem.records": _one(found.records),
        "m2pem.commit.duration": _one(_histogram(found.commits)),
        "m2pem.commit.longest": _one(found.commits.longest_s),
        "m2pem.loop.lateness": _one(_histogram(found.loop)),
        "m2pem.loop.longest": _one(found.loop.longest_s),
        "m2pem.runs": _each(found.runs),
        # All outcomes from the start: Prometheus sees no increase in a counter that begins at 1.
        "m2pem.runs.ended": _each({**dict.fromkeys(OUTCOMES, 0), **found.runs_ended}),
        "m2pem.inbox.length": _each(found.inboxes),
        "m2pem.behaviors": _one(found.behaviors),
        "m2pem.prompts": _one(found.prompts),
        "m2pem.incidents": _one(found.incidents),
        "m2pem.calls.waiting": _one(found.calls_waiting),
        "m2pem.events.waiting": _one(found.events_waiting),
        "m2pem.events.cut_off": _one(found.events_cut_off),
        "m2pem.observers.waiting": _one(found.observers_waiting),
        "m2pem.observers.dropped": _one(found.observations_dropped),
        "m2pem.telemetry.dropped": _one(found.telemetry_dropped),
        "m2pem.subscription.waiting": [
            ((str(number),), each.waiting) for number, each in enumerate(found.subscriptions)
        ],
        "m2pem.subscription.dropped": [
            ((str(number),), each.dropped) for number, each in enumerate(found.subscriptions)
        ],
        "m2pem.link": [
            ((resource, state.value), float(link.state is state))
            for resource, link in found.links.items()
            for state in LinkState
        ],
        "m2pem.telemetry.age": [
            ((resource,), link.age_s)
            for resource, link in found.links.items()
            if link.age_s is not None
        ],
        "m2pem.behavior.duration": list(measures.behaviors().items()),
        "m2pem.prompt.latency": _one(measures.answers()),
        "m2pem.spans": _each(SPANS),
    }
    return [Family(metric, values[name]) for name, metric in METRICS.items()]


def _one(value: Value, *labels: str) -> Sequence[tuple[tuple[str, ...], Value]]:
    return [(labels, value)]


def _each(values: Mapping[str, int]) -> Sequence[tuple[tuple[str, ...], Value]]:
    return [((label,), value) for label, value in values.items()]


def _histogram(counts: DurationCounts) -> Histogram:
    return Histogram(counts.bounds_s, counts.counts, counts.sum_s)
