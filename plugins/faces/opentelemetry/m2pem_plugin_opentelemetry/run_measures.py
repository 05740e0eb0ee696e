"""Histograms of what runs take: behaviors, and answers of operators. Each bucket keeps an exemplar:
the trace, span and record of the last one that fell into it.
"""

from bisect import bisect_left
from dataclasses import dataclass
from itertools import accumulate

from m2pem.api import records as r
from m2pem_plugin_opentelemetry.spans import Span

BOUNDS_S = (0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 60.0, 180.0, 600.0, 1800.0, 3600.0)

MAX_SERIES = 1000
"""Names of behaviors come from missions: those beyond are counted together, as "other"."""

OTHER = "other"


@dataclass(frozen=True, slots=True)
class Exemplar:
    """One that was measured. `at_us`: microseconds since the Unix epoch."""

    value_s: float
    at_us: int
    trace_id: int
    span_id: int
    run: str
    seq: int


@dataclass(frozen=True, slots=True)
class Histogram:
    """Durations in seconds. `counts` is cumulative and has one more than `bounds_s`: all of them;
    `exemplars` has one for each of these, where there is any."""

    bounds_s: tuple[float, ...]
    counts: tuple[int, ...]
    sum_s: float
    exemplars: tuple[Exemplar | None, ...] = ()


class _Growing:
    def __init__(self) -> None:
        self._counts = [0] * (len(BOUNDS_S) + 1)
        self._exemplars: list[Exemplar | None] = [None] * (len(BOUNDS_S) + 1)
        self._sum_s = 0.0

    def add(self, exemplar: Exemplar) -> None:
        place = bisect_left(BOUNDS_S, exemplar.value_s)
        self._counts[place] += 1
        self._exemplars[place] = exemplar
        self._sum_s += exemplar.value_s

    def now(self) -> Histogram:
        counts = tuple(accumulate(self._counts))
        return Histogram(BOUNDS_S, counts, self._sum_s, tuple(self._exemplars))


class RunMeasures:
    """Counts spans that have ended."""

    def __init__(self) -> None:
        self._behaviors: dict[tuple[str, str], _Growing] = {}
        self._answers = _Growing()

    def count(self, span: Span, record: r.Record) -> None:
        """Count a span, if it is of a kind that is measured; `record` has ended it."""
        if isinstance(record, r.BehaviorEnded):
            name = str(span.attributes.get("m2pem.behavior.name", ""))
            key = name, record.state.value.lower()
            if key not in self._behaviors and len(self._behaviors) >= MAX_SERIES:
                key = OTHER, key[1]
            self._behaviors.setdefault(key, _Growing()).add(_exemplar(span))
        elif isinstance(record, r.PromptAnswered):
            self._answers.add(_exemplar(span))

    def behaviors(self) -> dict[tuple[str, str], Histogram]:
        """How long behaviors took, by name and state in which they ended."""
        return {key: each.now() for key, each in self._behaviors.items()}

    def answers(self) -> Histogram:
        """How long questions waited for their answers."""
        return self._answers.now()


def _exemplar(span: Span) -> Exemplar:
    took_s = (span.ended_us - span.began_us) / 1_000_000
    run = str(span.attributes["m2pem.run.id"])
    return Exemplar(took_s, span.ended_us, span.trace_id, span.span_id, run, span.seq)
