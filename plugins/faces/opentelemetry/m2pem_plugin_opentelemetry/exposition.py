"""The metrics as `/metrics` has them: Prometheus' text format, or OpenMetrics with exemplars."""

from collections.abc import Iterator, Sequence

from prometheus_client import CollectorRegistry
from prometheus_client.core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    HistogramMetricFamily,
    Metric,
)
from prometheus_client.exposition import choose_encoder
from prometheus_client.registry import Collector
from prometheus_client.samples import Exemplar

from m2pem_plugin_opentelemetry.metrics import Family, Kind
from m2pem_plugin_opentelemetry.run_measures import Exemplar as RunExemplar
from m2pem_plugin_opentelemetry.run_measures import Histogram


def rendered(families: Sequence[Family], accept: str) -> tuple[bytes, str]:
    """Return the page and its content type. `accept`: the header of the request."""
    registry = CollectorRegistry(auto_describe=False)
    registry.register(_Once(families))
    encode, content_type = choose_encoder(accept)
    return encode(registry), content_type


class _Once(Collector):
    def __init__(self, families: Sequence[Family]) -> None:
        self._families = families

    def collect(self) -> Iterator[Metric]:
        return map(_metric, self._families)


def _metric(family: Family) -> Metric:
    known = family.metric
    name, meaning, labels = known.prometheus_name, known.meaning, known.labels
    if known.kind is Kind.HISTOGRAM:
        histograms = HistogramMetricFamily(name, meaning, labels=labels)
        for values, value in family.points:
            if isinstance(value, Histogram):
                histograms.add_metric(values, _buckets(value), value.sum_s)
        return histograms
    kind = CounterMetricFamily if known.kind is Kind.COUNTER else GaugeMetricFamily
    numbers = kind(name, meaning, labels=labels)
    for values, value in family.points:
        if not isinstance(value, Histogram):
            numbers.add_metric(values, value)
    return numbers


def _buckets(value: Histogram) -> list[tuple[str, float] | tuple[str, float, Exemplar]]:
    bounds = [*map(str, value.bounds_s), "+Inf"]
    exemplars = value.exemplars or (None,) * len(bounds)
    return [
        (bound, count) if each is None else (bound, count, _exemplar(each))
        for bound, count, each in zip(bounds, value.counts, exemplars, strict=True)
    ]


def _exemplar(each: RunExemplar) -> Exemplar:
    labels = {
        "trace_id": f"{each.trace_id:032x}",
        "span_id": f"{each.span_id:016x}",
        "seq": str(each.seq),
    }
    return Exemplar(labels, each.value_s, each.at_us / 1_000_000)
