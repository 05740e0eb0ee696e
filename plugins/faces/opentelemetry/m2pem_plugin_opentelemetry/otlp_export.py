"""Sends spans and metrics to a collector, from a thread of its own: nothing waits for it.

Spans wait in a bounded queue. When it is full, or when the collector does not take them, they are
dropped, and counted. Of metrics, only the newest snapshot waits.
"""

import logging
import threading
import time
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from opentelemetry import trace
from opentelemetry.exporter.otlp.proto.http.metric_exporter import OTLPMetricExporter
from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
from opentelemetry.sdk.metrics import Exemplar as SdkExemplar
from opentelemetry.sdk.metrics.export import (
    AggregationTemporality,
    Gauge,
    HistogramDataPoint,
    MetricsData,
    NumberDataPoint,
    ResourceMetrics,
    ScopeMetrics,
    Sum,
)
from opentelemetry.sdk.metrics.export import Histogram as SdkHistogram
from opentelemetry.sdk.metrics.export import Metric as SdkMetric
from opentelemetry.sdk.resources import Resource
from opentelemetry.sdk.trace import Event as SdkEvent
from opentelemetry.sdk.trace import ReadableSpan
from opentelemetry.sdk.trace.export import SpanExportResult
from opentelemetry.sdk.util.instrumentation import InstrumentationScope

from m2pem import __version__
from m2pem_plugin_opentelemetry.metrics import SPANS, Family, Kind, Metric
from m2pem_plugin_opentelemetry.run_measures import Exemplar, Histogram
from m2pem_plugin_opentelemetry.spans import Span

log = logging.getLogger("m2pem.otlp")

BATCH = 512
LINGER_S = 0.5
"""How long spans wait for others to be sent with."""

SCOPE = InstrumentationScope("m2pem", __version__)

NS_PER_US = 1000


@dataclass(frozen=True, slots=True)
class Collector:
    """Where to send. `endpoint` "": as the variables OTEL_EXPORTER_OTLP_... say, else this host.

    `timeout_s`: for a request with its repetitions.
    """

    endpoint: str
    timeout_s: float
    resource: Mapping[str, str]

    def url(self, path: str) -> str | None:
        """The address of a signal: "v1/traces"."""
        return f"{self.endpoint.rstrip('/')}/{path}" if self.endpoint else None


class OtlpExport:
    """The thread that sends. `queue_size`: spans that wait at most.

    From any thread: `add`, `put`. `began_us`: when the metrics began to be counted.
    """

    def __init__(self, collector: Collector, queue_size: int) -> None:
        self._resource = Resource.create(dict(collector.resource))
        timeout_s = collector.timeout_s
        self._to_traces = OTLPSpanExporter(collector.url("v1/traces"), timeout=timeout_s)
        self._to_metrics = OTLPMetricExporter(collector.url("v1/metrics"), timeout=timeout_s)
        self._where = collector.endpoint or "its address of the environment"
        self._fails = False
        self._size = queue_size
        self._spans: deque[Span] = deque()
        self._metrics: Sequence[Family] | None = None
        self._began_ns = time.time_ns()
        self._news = threading.Condition()
        self._ends = False
        self._thread = threading.Thread(target=self._send_all, name="otlp", daemon=True)

    def start(self) -> None:
        """Send from now on."""
        # It logs each attempt that fails, which is said once here, and counted in `SPANS`.
        logging.getLogger("opentelemetry").setLevel(logging.CRITICAL)
        self._thread.start()

    def add(self, span: Span) -> None:
        """Have a span sent; never waits."""
        with self._news:
            if len(self._spans) >= self._size:
                SPANS["dropped"] += 1
                return
            self._spans.append(span)
            self._news.notify()

    def put(self, metrics: Sequence[Family]) -> None:
        """Have metrics sent, instead of older ones that still wait; never waits."""
        with self._news:
            self._metrics = metrics
            self._news.notify()

    def close(self, within_s: float) -> None:
        """Send what waits, within a bound, and end. Blocks."""
        with self._news:
            self._ends = True
            self._news.notify()
        self._thread.join(within_s)
        self._to_traces.shutdown()  # type: ignore[no-untyped-call]
        self._to_metrics.shutdown()
        with self._news:
            SPANS["dropped"] += len(self._spans)
            self._spans.clear()

    def _send_all(self) -> None:
        while True:
            with self._news:
                while not (self._spans or self._metrics or self._ends):
                    self._news.wait()
                if not self._ends and len(self._spans) < BATCH and not self._metrics:
                    self._news.wait_for(lambda: self._ends or len(self._spans) >= BATCH, LINGER_S)
                batch = [self._spans.popleft() for _ in range(min(BATCH, len(self._spans)))]
                metrics, self._metrics = self._metrics, None
                ends = self._ends
            if batch:
                self._send(batch)
            if metrics:
                self._to_metrics.export(_metrics_data(metrics, self._resource, self._began_ns))
            if ends and not batch:
                return

    def _send(self, batch: Sequence[Span]) -> None:
        result = self._to_traces.export([_readable(span, self._resource) for span in batch])
        sent = result is SpanExportResult.SUCCESS
        with self._news:
            SPANS["exported" if sent else "failed"] += len(batch)
        if sent is self._fails:
            self._fails = not sent
            what = "takes spans again" if sent else "takes no spans; they are lost until it does"
            log.warning("the collector at %s %s", self._where, what)


# --- spans --------------------------------------------------------------------------------------


def _context(trace_id: int, span_id: int) -> trace.SpanContext:
    return trace.SpanContext(
        trace_id, span_id, is_remote=False, trace_flags=trace.TraceFlags(trace.TraceFlags.SAMPLED)
    )


def _readable(span: Span, resource: Resource) -> ReadableSpan:
    """A span as the SDK has it, whose own spans cannot be given ids nor come from a journal."""
    status = trace.Status(trace.StatusCode.ERROR, span.error) if span.error else trace.Status()
    attributes = dict(span.attributes)
    if span.events_dropped:
        attributes["m2pem.events.dropped"] = span.events_dropped
    return ReadableSpan(
        span.name,
        _context(span.trace_id, span.span_id),
        None if span.parent_id is None else _context(span.trace_id, span.parent_id),
        resource,
        attributes,
        [SdkEvent(each.name, each.attributes, each.at_us * NS_PER_US) for each in span.events],
        [trace.Link(_context(each.trace_id, each.span_id), each.attributes) for each in span.links],
        trace.SpanKind.INTERNAL,
        status=status,
        start_time=span.began_us * NS_PER_US,
        end_time=span.ended_us * NS_PER_US,
        instrumentation_scope=SCOPE,
    )


# --- metrics ------------------------------------------------------------------------------------


def _metrics_data(families: Sequence[Family], resource: Resource, began_ns: int) -> MetricsData:
    now_ns = time.time_ns()
    metrics = [
        SdkMetric(
            each.metric.name,
            each.metric.meaning,
            each.metric.unit,
            _data(each, began_ns, now_ns),
        )
        for each in families
        if each.points
    ]
    return MetricsData([ResourceMetrics(resource, [ScopeMetrics(SCOPE, metrics, "")], "")])


def _data(family: Family, began_ns: int, now_ns: int) -> Sum | Gauge | SdkHistogram:
    metric = family.metric
    cumulative = AggregationTemporality.CUMULATIVE
    if metric.kind is Kind.HISTOGRAM:
        histograms = [
            _histogram(value, _labels(metric, labels), began_ns, now_ns)
            for labels, value in family.points
            if isinstance(value, Histogram)
        ]
        return SdkHistogram(histograms, cumulative)
    numbers = [
        NumberDataPoint(_labels(metric, labels), began_ns, now_ns, value)
        for labels, value in family.points
        if not isinstance(value, Histogram)
    ]
    return Sum(numbers, cumulative, True) if metric.kind is Kind.COUNTER else Gauge(numbers)


def _labels(metric: Metric, values: Sequence[str]) -> dict[str, str]:
    return dict(zip(metric.labels, values, strict=True))


def _histogram(
    value: Histogram, labels: dict[str, str], began_ns: int, now_ns: int
) -> HistogramDataPoint:
    before = (0, *value.counts[:-1])
    buckets = [upto - below for upto, below in zip(value.counts, before, strict=True)]
    return HistogramDataPoint(
        labels,
        began_ns,
        now_ns,
        value.counts[-1],
        value.sum_s,
        buckets,
        value.bounds_s,
        None,  # type: ignore[arg-type]  # the least and the greatest are optional: not known
        None,  # type: ignore[arg-type]
        [_exemplar(each) for each in value.exemplars if each is not None],
    )


def _exemplar(each: Exemplar) -> SdkExemplar:
    filtered: dict[str, str | int] = {"m2pem.run.id": each.run, "m2pem.record.seq": each.seq}
    return SdkExemplar(filtered, each.value_s, each.at_us * NS_PER_US, each.span_id, each.trace_id)
