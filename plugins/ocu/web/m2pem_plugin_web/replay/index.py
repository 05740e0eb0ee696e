"""The index of a run: from where in its records any moment of it is shown.

After each page of records it has the mission time; after every `PAGES` of them a snapshot of the
run's view, and the bars that ended since the snapshot before. Snapshots and bars are compressed: an
index has some kilobytes for a thousand records.
"""

import zlib
from collections import deque
from collections.abc import Iterator, Mapping

import msgspec

import m2pem
from m2pem.api import BehaviorState, Mission, RunId, RunView, StampedRecord
from m2pem.api import records as r
from m2pem.api.view_snapshot import snapshot_of, view_of
from m2pem_plugin_web.live.messages import record_of
from m2pem_plugin_web.replay.spans import OpenSpans, Span, SpanFolder, SpanWindow

PAGE = 1000
"""Records of a page of a replay."""

PAGES = 4
"""Pages from one snapshot to the next."""

MOST_BARS = 1500
"""Bars of a time line; more are thinned."""

NOTABLE = 6
"""Answers and faults that are kept, the last of each."""

STOPS = 500
"""Stops at breakpoints that are kept, the last ones."""

FORMAT = f"6 of m2pem {m2pem.__version__}"

LEVEL = 1
"""Of zlib: the executive waits while a snapshot of a run that goes on is compressed."""

_encode = msgspec.msgpack.Encoder().encode
_spans = msgspec.msgpack.Decoder(list[Span])
_NOTABLE = frozenset((r.PromptAnswered, r.ErrorThrown, r.ServiceEnded, r.BehaviorEnded))
_open_spans = msgspec.msgpack.Decoder(OpenSpans)


class Noted(msgspec.Struct, array_like=True, frozen=True):
    """An answer or a fault: the record as pages show it."""

    seq: int
    is_fault: bool
    line: bytes


class Stop(msgspec.Struct, frozen=True):
    """A stop of a run that was debugged, at record `seq`. Fields as in `BreakpointReached`."""

    seq: int
    t: float
    reason: r.StopReason
    process: str
    element: str
    condition: str


class Block(msgspec.Struct, array_like=True, frozen=True):
    """The run after record `seq`. `from_s`: when the first of its bars began.

    `view`: of `snapshot_of`; `spans`: the bars that ended since the block before; `going_on`: those
    that had not ended. All three are compressed.
    """

    seq: int
    t_s: float
    from_s: float
    view: bytes
    spans: bytes
    going_on: bytes

    def ended(self) -> list[Span]:
        """Return the bars that ended in it."""
        return _spans.decode(zlib.decompress(self.spans))

    def open_spans(self) -> OpenSpans:
        """Return the bars that had not ended."""
        return _open_spans.decode(zlib.decompress(self.going_on))


class Index(msgspec.Struct, array_like=True):
    """The index of the first `seq` records of a run. `times`: mission time after each page, which
    has `page` records."""

    run: RunId
    started_us: int
    page: int = PAGE
    seq: int = 0
    t_s: float = 0.0
    times: list[float] = []
    blocks: list[Block] = []
    tail: Block | None = None
    """The end, unless a block is there."""
    rows: list[str] = []
    notable: list[Noted] = []
    """The last answers and the last faults."""
    stops: list[Stop] = []
    """The last stops."""
    overview: list[Span] = []
    """The bars of the whole run, thinned."""
    is_thinned: bool = False

    def view_before(
        self, seq: int, mission: Mission | None, names: Mapping[str, str] | None
    ) -> RunView | None:
        """Return the nearest view at or before a record; None: the run's beginning is nearer."""
        found = None
        for block in self._marks():
            if block.seq > seq:
                break
            found = block
        return view_of(zlib.decompress(found.view), mission, names) if found is not None else None

    def _marks(self) -> Iterator[Block]:
        yield from self.blocks
        if self.tail is not None:
            yield self.tail

    def window(self, from_s: float, to_s: float) -> Iterator[list[Span]]:
        """Yield the bars that may be in a time window, block by block."""
        last = self.tail or (self.blocks[-1] if self.blocks else None)
        for block in self._marks():
            if block.t_s >= from_s and block.from_s <= to_s:
                yield block.ended()
        if last is not None:
            yield [span for spans in last.open_spans().open.values() for span in spans]


class IndexBuilder:
    """Makes the index of a run while its records are applied to its view, in order.

    A record that was taken before is dropped, also one after a gap: `index` is of those before.
    """

    def __init__(self, run: RunId, page: int = PAGE) -> None:
        self._index = Index(run, 0, page, times=[], blocks=[])
        self._block_records = PAGES * page
        self._folder = SpanFolder()
        self._from_s = float("inf")
        self._noted: dict[bool, deque[Noted]] = {
            is_fault: deque(maxlen=NOTABLE) for is_fault in (False, True)
        }
        self._stops: deque[Stop] = deque(maxlen=STOPS)

    @classmethod
    def resumed(
        cls, index: Index, mission: Mission | None
    ) -> "tuple[IndexBuilder, RunView | None]":
        """Return what goes on after the last block of an index, and the view there.

        None: the index has no block, and it begins at the run's first record.
        """
        builder = cls(index.run, index.page)
        if not index.blocks:
            return builder, None
        last = index.blocks[-1]
        mine = builder._index
        mine.blocks, mine.seq, mine.t_s = list(index.blocks), last.seq, last.t_s
        mine.times = index.times[: last.seq // index.page]
        builder._folder = SpanFolder(last.open_spans())
        builder._folder.rows.update(index.rows)
        for noted in index.notable:
            if noted.seq <= last.seq:
                builder._noted[noted.is_fault].append(noted)
        builder._stops.extend(stop for stop in index.stops if stop.seq <= last.seq)
        return builder, view_of(zlib.decompress(last.view), mission)

    @property
    def seq(self) -> int:
        """The last record that was taken."""
        return self._index.seq

    def add(self, view: RunView, stamped: StampedRecord) -> None:
        """Take a record that `view` has just applied."""
        index = self._index
        if stamped.seq != index.seq + 1:
            return
        index.seq, index.t_s = stamped.seq, stamped.t_s
        self._folder.add(stamped)
        if type(stamped.record) in _NOTABLE:
            self._note(view, stamped)
        if isinstance(stamped.record, r.BreakpointReached):
            self._stops.append(_stop(stamped, stamped.record))
        if stamped.seq % index.page == 0:
            index.times.append(stamped.t_s)
            if stamped.seq % self._block_records == 0:
                index.blocks.append(self._block(view))
                self._folder.finished = []

    def index(self, view: RunView) -> Index:
        """Return the index up to the last record, which `view` has applied last.

        Without its overview: see `with_overview`.
        """
        index = self._index
        return Index(
            index.run,
            view.summary.started_us,
            index.page,
            index.seq,
            index.t_s,
            list(index.times),
            list(index.blocks),
            self._block(view) if index.seq % self._block_records else None,
            sorted(self._folder.rows),
            sorted((*self._noted[False], *self._noted[True]), key=lambda each: each.seq),
            list(self._stops),
        )

    def _block(self, view: RunView) -> Block:
        finished = self._folder.finished
        return Block(
            view.seq,
            view.t_s,
            min((each.from_ for each in finished), default=view.t_s),
            zlib.compress(snapshot_of(view), LEVEL),
            zlib.compress(_encode(finished), LEVEL),
            zlib.compress(_encode(self._folder.going_on), LEVEL),
        )

    def _note(self, view: RunView, stamped: StampedRecord) -> None:
        is_fault = not isinstance(stamped.record, r.PromptAnswered)
        if not is_fault or _is_fault(stamped.record):
            noted = Noted(stamped.seq, is_fault, record_of(stamped, view))
            self._noted[is_fault].append(noted)


def _stop(stamped: StampedRecord, record: r.BreakpointReached) -> Stop:
    place = record.process, record.element
    return Stop(stamped.seq, stamped.t_s, record.reason, *place, record.condition)


def _is_fault(record: r.Record) -> bool:
    match record:
        case r.ServiceEnded(code=code):
            return bool(code)
        case r.BehaviorEnded(state=state):
            return state in (BehaviorState.FAILED, BehaviorState.REJECTED, BehaviorState.LOST)
    return isinstance(record, r.ErrorThrown)


def with_overview(index: Index) -> Index:
    """Make the bars of the whole run. It takes a while for a long run: call it in a thread."""
    index.overview, index.is_thinned = bars(index, 0.0, index.t_s)
    return index


def bars(index: Index, from_s: float, to_s: float) -> tuple[list[Span], bool]:
    """Return the bars of a time window, and whether they were thinned."""
    window = SpanWindow(from_s, to_s, MOST_BARS)
    for spans in index.window(from_s, to_s):
        window.add(spans)
    return window.result(), window.is_thinned
