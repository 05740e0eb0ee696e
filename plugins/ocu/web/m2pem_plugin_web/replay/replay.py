"""An ended run, opened at any moment: its head, its records by pages, the bars of a time window."""

import asyncio
import time
from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec

from m2pem.api import Mission, RunView, StampedRecord
from m2pem_plugin_web.live.live_run import command, debugging, requirement
from m2pem_plugin_web.live.messages import nested, prompt_record_of
from m2pem_plugin_web.replay.index import Index, IndexBuilder, bars, with_overview
from m2pem_plugin_web.replay.source import RecordSource
from m2pem_plugin_web.rest.record_pages import new_view, with_changes

READ_AT_ONCE = 8000
"""Records of a page of the journal, while an index is made."""

TURN = 50
"""Records after which the event loop may take its turn, which else waits for the interpreter."""

KEPT_VIEWS = 4

_encode = msgspec.json.Encoder().encode

Progress = Callable[[int], None]


@dataclass(slots=True, eq=False)
class Replay:
    """An ended run with its index."""

    source: RecordSource
    index: Index
    mission: Mission | None
    _views: OrderedDict[int, RunView]

    @classmethod
    async def open(cls, source: RecordSource, known: Index | None, progress: Progress) -> "Replay":
        """Return the replay of a run. `known`: an index of its first records, which is gone on
        with. `progress` is called with the number of records that are indexed.

        Raises:
            M2pemError: the records cannot be read.
        """
        mission = await source.mission()
        last = source.summary.records
        if known is None or known.seq != last:
            known = await _made(source, known, mission, progress)
        return cls(source, known, mission, OrderedDict())

    def head(self) -> dict[str, Any]:
        """Return what a page needs to begin with, for JSON."""
        index = self.index
        return {
            "records": index.seq,
            "end": index.t_s,
            "page": index.page,
            "times": index.times,
            "rows": index.rows,
            "spans": index.overview,
            "thinned": index.is_thinned,
            "notable": [msgspec.Raw(each.line) for each in index.notable],
            "stops": index.stops,
        }

    async def page(self, number: int) -> bytes:
        """Return a page of records, from 0 on, and the view before its first one, as JSON."""
        start = min(number * self.index.page, self.index.seq)
        view = self._views.pop(start, None)
        if view is None:
            view = self.index.view_before(start, self.mission, self.source.names)
        if view is None:
            view = new_view(self.source.summary, self.mission, self.source.names)
        end = min(start + self.index.page, self.index.seq)
        records = await self.source.between(view.seq, end)
        content = await asyncio.to_thread(_page_of, view, records, start)
        self._views[end] = view
        while len(self._views) > KEPT_VIEWS:
            self._views.popitem(last=False)
        return content

    async def bars(self, from_s: float, to_s: float) -> bytes:
        """Return the bars of a time window, as JSON."""
        spans, is_thinned = await asyncio.to_thread(bars, self.index, from_s, to_s)
        return _encode({"spans": spans, "thinned": is_thinned})


async def _made(
    source: RecordSource, known: Index | None, mission: Mission | None, progress: Progress
) -> Index:
    """Make an index, from where another one ends."""
    builder, view = IndexBuilder(source.summary.run), None
    if known is not None:
        builder, view = IndexBuilder.resumed(known, mission)
    if view is None:
        view = new_view(source.summary, mission, source.names)
    last = source.summary.records
    # The end of a block may be within an input; its other records come with `between`.
    read: Sequence[StampedRecord] = await source.between(builder.seq, builder.seq + 1)
    while read:
        await asyncio.to_thread(_take, builder, view, read)
        progress(builder.seq)
        if builder.seq >= last:
            break
        read = await source.between(builder.seq, min(last, builder.seq + READ_AT_ONCE))
    return await asyncio.to_thread(with_overview, builder.index(view))


def _take(builder: IndexBuilder, view: RunView, records: Sequence[StampedRecord]) -> None:
    for number, stamped in enumerate(records):
        view.apply(stamped)
        builder.add(view, stamped)
        if number % TURN == 0:
            time.sleep(0)


def _page_of(view: RunView, records: Sequence[StampedRecord], start: int) -> bytes:
    before = 0
    for stamped in records:
        if stamped.seq > start:
            break
        view.apply(stamped)
        before += 1
    state = _encode(state_of(view))
    lines = [msgspec.Raw(each) for each in with_changes(records[before:], view)]
    return _encode({"view": msgspec.Raw(state), "records": lines})


def state_of(view: RunView) -> dict[str, Any]:
    """Return a view as pages hold it, for JSON."""
    return {
        "seq": view.seq,
        "t": view.t_s,
        "status": view.status,
        "detail": view.summary.detail,
        "elements": nested(view.elements.items()),
        "commands": {key: command(each) for key, each in view.behaviors.items()},
        "prompts": {key: prompt_record_of(view.run, each) for key, each in view.prompts.items()},
        "holders": view.holders,
        "requirements": {key: requirement(each) for key, each in view.requirements.items()},
        "debugging": debugging(view),
    }
