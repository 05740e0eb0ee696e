"""Records as the page reads them: each with its sentence, and with what it changes in the view.

A page of the browser replays a run from these changes, so that the fold over records is in one
place: `m2pem.api.RunView`.
"""

import asyncio
from collections import OrderedDict
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from typing import Any

import msgspec

from m2pem.api import Mission, MissionControl, RunId, RunStatus, RunSummary, RunView, StampedRecord
from m2pem.api.records import MissionRevised
from m2pem.api.run_view import Changes
from m2pem.errors import M2pemError
from m2pem_plugin_web.live.live_run import command, debugging, requirement
from m2pem_plugin_web.live.messages import nested, prompt_record_of, record_of

KEPT_VIEWS = 8
"""Views that are kept where a page ended, for the next page."""

PAGE = 1000

NAMED = 20_000
"""The newest records of a run that goes on, which are worded with the names of its view of now."""

AT_ONCE = 100
"""Records that are encoded before other tasks run."""

_encode = msgspec.json.Encoder().encode


class RecordPages:
    """Pages of the records of runs."""

    def __init__(self, control: MissionControl) -> None:
        self._control = control
        self._views: OrderedDict[tuple[RunId, int], RunView] = OrderedDict()

    async def read(self, summary: RunSummary, after: int, limit: int) -> bytes:
        """Return the records after `after`, about `limit` of them, as JSON."""
        page = await self._control.records(summary.run, after, limit)
        view = self._views.pop((summary.run, after), None) or await self._view(summary, after)
        if any(isinstance(each.record, MissionRevised) for each in page):
            with suppress(M2pemError):  # then its names are those of the version before
                view.mission = await self._control.mission(summary.run)
        # In a thread, as thousands of records take longer than the executive may wait.
        content = await asyncio.to_thread(page_of, page, view, limit)
        if page:
            self._views[summary.run, page[-1].seq] = view
        while len(self._views) > KEPT_VIEWS:
            self._views.popitem(last=False)
        return content

    async def read_newest(self, view: RunView, after: int, limit: int) -> bytes:
        """Return records among the newest, worded with the names that their run's view has now.

        They come without what they change in the view: no record before them is read.
        """
        page = await self._control.records(view.run, after, limit)
        records: list[msgspec.Raw] = []
        for first in range(0, len(page), AT_ONCE):
            part = page[first : first + AT_ONCE]
            records += [msgspec.Raw(record_of(each, view)) for each in part]
            await asyncio.sleep(0)
        return _page(records, page, limit)

    async def _view(self, summary: RunSummary, after: int) -> RunView:
        """Return the view after a record; it is made by reading all records before."""
        try:
            mission = await self._control.mission(summary.run)
        except M2pemError:
            mission = None
        view = new_view(summary, mission)
        read = 0
        while read < after and (page := await self._control.records(summary.run, read, PAGE)):
            for stamped in page:
                if stamped.seq <= after:
                    view.apply(stamped)
            read = page[-1].seq
            await asyncio.sleep(0)
        return view


def new_view(
    summary: RunSummary, mission: Mission | None = None, names: Mapping[str, str] | None = None
) -> RunView:
    """Return the view of a run before its first record."""
    begun = RunSummary(
        summary.run, summary.mission, summary.process, RunStatus.RUNNING, summary.started_us
    )
    return RunView(begun, mission, names)


def page_of(page: Sequence[StampedRecord], view: RunView, limit: int) -> bytes:
    """Apply the records of a page to the view before it; return them as JSON."""
    records = [msgspec.Raw(each) for each in with_changes(page, view)]
    return _page(records, page, limit)


def _page(records: Sequence[msgspec.Raw], page: Sequence[StampedRecord], limit: int) -> bytes:
    after_next = page[-1].seq if len(page) >= limit else None
    return _encode({"records": records, "next": after_next})


def with_changes(page: Iterable[StampedRecord], view: RunView) -> Iterable[bytes]:
    """Apply records to the view before them; yield each as JSON, with what it changes."""
    changes = view.changes = Changes()
    for stamped in page:
        status = view.status
        view.apply(stamped)
        more: dict[str, Any] = {}
        if changes.elements:
            more["elements"] = nested((each, view.elements[each]) for each in changes.elements)
        if changes.behaviors:
            more["commands"] = {
                each: command(view.behaviors[each]) if each in view.behaviors else None
                for each in changes.behaviors
            }
        if changes.prompts:
            more["prompts"] = {
                each: prompt_record_of(view.run, view.prompts[each])
                if each in view.prompts
                else None
                for each in changes.prompts
            }
        if changes.requirements:
            more["requirements"] = {
                each: requirement(view.requirements[each]) if each in view.requirements else None
                for each in changes.requirements
            }
        if changes.debugging:
            more["debugging"] = debugging(view)
        if changes.resources:
            more["holders"] = {each: view.holders.get(each) for each in changes.resources}
        if view.status is not status:
            more["status"] = view.status
            more["detail"] = view.summary.detail
        changes.clear()
        yield record_of(stamped, view, changes=more) if more else record_of(stamped, view)
