"""Who did what when: the bars of a time line, made of records, and thinned to what a page shows.

`records/spans.ts` makes the same bars of a run that goes on; a test compares the two.
"""

from collections.abc import Callable, Iterable
from typing import Any

import msgspec

from m2pem.api import StampedRecord
from m2pem.api import records as r

PROMPTS = "prompts"
WAITS = "waits"
SERVICES = "services"

_ENDS = {
    "SUCCEEDED": "succeeded",
    "CANCELLED": "cancelled",
    "FAILED": "failed",
    "REJECTED": "failed",
    "LOST": "failed",
}
_WORST = ("failed", "unknown", "cancelled", "succeeded", "")


class Span(msgspec.Struct):
    """A bar. Times are mission time in seconds; `to` None: it has not ended.

    `end`: "succeeded", "failed", "cancelled"; "" while it goes on. `count`: how many bars of a row
    it stands for, which are too short to be seen; then `element` and `label` are "" if they differ.
    """

    id: str
    kind: str
    row: str
    label: str
    process: str
    element: str
    from_: float = msgspec.field(name="from")
    to: float | None = None
    end: str = ""
    reason: str = ""
    count: int = 1


class Asked(msgspec.Struct, array_like=True):
    """A task that asked for vehicles or payloads, and may have to wait for them."""

    name: str
    process: str
    element: str
    t_s: float


class OpenSpans(msgspec.Struct, array_like=True):
    """What has not ended, by kind and id: from here a `SpanFolder` goes on."""

    open: dict[str, list[Span]] = {}
    asked: dict[str, Asked] = {}


class SpanFolder:
    """Makes bars of the records of a run, taken in order. `finished`: those that have ended."""

    def __init__(self, going_on: OpenSpans | None = None) -> None:
        self.going_on = going_on or OpenSpans({}, {})
        self.finished: list[Span] = []
        self.rows: set[str] = set()

    def add(self, stamped: StampedRecord) -> None:
        """Take the next record."""
        fold = _FOLDS.get(type(stamped.record))
        if fold is not None:
            fold(self, stamped.t_s, stamped.record)

    def _begin(
        self, kind: str, id_: str, label: str, rows: Iterable[str], at: Any, t_s: float
    ) -> None:
        spans = [
            Span(f"{kind}:{id_}:{row}", kind, row, label, at.process, at.element, t_s)
            for row in rows
        ]
        self.rows.update(each.row for each in spans)
        self.going_on.open[f"{kind}:{id_}"] = spans

    def _finish(self, key: str, t_s: float, end: str, reason: str = "") -> None:
        for span in self.going_on.open.pop(key, ()):
            span.to, span.end, span.reason = t_s, end, reason
            self.finished.append(span)

    # --- by record ------------------------------------------------------------------------------

    def _behavior_requested(self, t_s: float, record: r.BehaviorRequested) -> None:
        self._begin("behavior", record.behavior, record.name, record.resources, record, t_s)

    def _behavior_ended(self, t_s: float, record: r.BehaviorEnded) -> None:
        end = _ENDS.get(record.state.value, "unknown")
        reason = ": ".join(filter(None, (record.code, record.reason)))
        self._finish(f"behavior:{record.behavior}", t_s, end, reason)

    def _allocation_requested(self, t_s: float, record: r.AllocationRequested) -> None:
        asked = Asked(record.name, record.process, record.element, t_s)
        self.going_on.asked[record.allocation] = asked

    def _allocation_delayed(self, _: float, record: r.AllocationDelayed) -> None:
        """A task waits from when it asked."""
        id_ = record.allocation
        asked = self.going_on.asked.get(id_)
        if asked is not None and f"wait:{id_}" not in self.going_on.open:
            self._begin("wait", id_, asked.name, (WAITS,), asked, asked.t_s)

    def _resources_allocated(self, t_s: float, record: r.ResourcesAllocated) -> None:
        resources = [each for chosen in record.roles.values() for each in chosen]
        self._end_wait(record.allocation, t_s, "succeeded", ", ".join(resources))

    def _allocation_ended(self, t_s: float, record: r.AllocationEnded) -> None:
        end = "failed" if record.code else "cancelled"
        self._end_wait(record.allocation, t_s, end, record.code)

    def _end_wait(self, allocation: str, t_s: float, end: str, reason: str) -> None:
        self.going_on.asked.pop(allocation, None)
        self._finish(f"wait:{allocation}", t_s, end, reason)

    def _prompt_opened(self, t_s: float, record: r.PromptOpened) -> None:
        self._begin("prompt", record.prompt, record.text, (PROMPTS,), record, t_s)

    def _prompt_answered(self, t_s: float, record: r.PromptAnswered) -> None:
        reason = f"{record.decision} ({record.by})"
        self._finish(f"prompt:{record.prompt}", t_s, "succeeded", reason)

    def _prompt_withdrawn(self, t_s: float, record: r.PromptWithdrawn) -> None:
        self._finish(f"prompt:{record.prompt}", t_s, "cancelled")

    def _service_requested(self, t_s: float, record: r.ServiceRequested) -> None:
        self._begin("service", record.service, record.name, (SERVICES,), record, t_s)

    def _service_ended(self, t_s: float, record: r.ServiceEnded) -> None:
        end = "failed" if record.code else "succeeded"
        self._finish(f"service:{record.service}", t_s, end, record.code)

    def _service_withdrawn(self, t_s: float, record: r.ServiceWithdrawn) -> None:
        self._finish(f"service:{record.service}", t_s, "cancelled")


_FOLDS: dict[type, Callable[[SpanFolder, float, Any], None]] = {
    r.BehaviorRequested: SpanFolder._behavior_requested,
    r.BehaviorEnded: SpanFolder._behavior_ended,
    r.AllocationRequested: SpanFolder._allocation_requested,
    r.AllocationDelayed: SpanFolder._allocation_delayed,
    r.ResourcesAllocated: SpanFolder._resources_allocated,
    r.AllocationEnded: SpanFolder._allocation_ended,
    r.PromptOpened: SpanFolder._prompt_opened,
    r.PromptAnswered: SpanFolder._prompt_answered,
    r.PromptWithdrawn: SpanFolder._prompt_withdrawn,
    r.ServiceRequested: SpanFolder._service_requested,
    r.ServiceEnded: SpanFolder._service_ended,
    r.ServiceWithdrawn: SpanFolder._service_withdrawn,
}


class SpanWindow:
    """The bars of a time window, `most` of them or fewer: short ones that are close to each other
    in a row are merged into one that says how many they are.
    """

    def __init__(self, from_s: float, to_s: float, most: int) -> None:
        self._from_s, self._to_s, self._most = from_s, to_s, most
        self._shortest_s = 0.0
        self._long: list[Span] = []
        self._merged: dict[tuple[str, str, int], Span] = {}

    def add(self, spans: Iterable[Span]) -> None:
        """Take bars, in any order; those outside of the window are dropped."""
        for span in spans:
            if span.from_ <= self._to_s and (span.to is None or span.to >= self._from_s):
                self._put(span)
        while len(self._long) + len(self._merged) > 2 * self._most and self._can_coarsen():
            self._coarsen()

    def result(self) -> list[Span]:
        """Return the bars, by when they began."""
        while len(self._long) + len(self._merged) > self._most and self._can_coarsen():
            self._coarsen()
        return sorted((*self._long, *self._merged.values()), key=lambda each: each.from_)

    @property
    def is_thinned(self) -> bool:
        """Whether bars were merged: a smaller window has more."""
        return any(each.count > 1 for each in self._merged.values())

    def _put(self, span: Span) -> None:
        if span.to is None or span.to - span.from_ >= self._shortest_s:
            self._long.append(span)
            return
        key = (span.row, span.kind, int((span.from_ - self._from_s) // self._shortest_s))
        known = self._merged.get(key)
        self._merged[key] = span if known is None else _merged(known, span)

    def _can_coarsen(self) -> bool:
        return self._shortest_s < 2 * max(self._to_s - self._from_s, 0.001)

    def _coarsen(self) -> None:
        spans = [*self._long, *self._merged.values()]
        finest_s = max(self._to_s - self._from_s, 0.001) / self._most
        self._shortest_s = 2 * self._shortest_s or finest_s
        self._long, self._merged = [], {}
        for span in spans:
            self._put(span)


def _merged(one: Span, other: Span) -> Span:
    first = min(one, other, key=lambda each: each.from_)
    same_place = (one.process, one.element) == (other.process, other.element)
    return Span(
        f"{first.id.removesuffix('+')}+",
        first.kind,
        first.row,
        one.label if one.label == other.label else "",
        first.process if same_place else "",
        first.element if same_place else "",
        first.from_,
        max(one.to or 0.0, other.to or 0.0),
        min(one.end, other.end, key=_WORST.index),
        "",
        one.count + other.count,
    )
