"""Follows an executive: a picture of each run, and the prompts that stand.

Nobody waits for this: what comes too fast is cut off, and read from the journal afterwards, so
that every record is counted.
"""

import asyncio
import logging
from collections.abc import AsyncIterator
from dataclasses import replace
from typing import Protocol

from m2pem.api import (
    Alert,
    BehaviorState,
    MissionControl,
    Notice,
    OpenPrompt,
    PromptClosed,
    RunId,
    RunStatus,
    RunSummary,
    StampedRecord,
)
from m2pem.api import records as r
from m2pem.errors import M2pemError, OperatorError
from m2pem_plugin_web.live.picture import Picture

BACKLOG = 100_000
"""Notices that may wait; beyond that they are read from the journal."""

REMEMBERED_RUNS = 100
"""Runs that have ended and are still told of; the journal has all."""

BREATH = 200
"""Notices that are taken before others may do something."""

AGAIN_S = 1.0
"""After it could not be followed."""

PAGE = 1000

log = logging.getLogger("m2pem.ocu.web")


class Listener(Protocol):
    """Who wants to know at once."""

    def asked(self, prompt: OpenPrompt) -> None:
        """A prompt opened."""
        ...

    def closed(self, closed: PromptClosed) -> None:
        """It was answered or withdrawn."""
        ...

    def alerted(self, alert: Alert) -> None:
        """The executive warns of something that is in no run's records."""
        ...

    def failed(self, run: RunId, text: str) -> None:
        """Something went wrong that operators ought to hear of."""
        ...


class Feed:
    """Notices begin when this is made, so that nothing is missed before `follow`."""

    def __init__(self, control: MissionControl, listener: Listener) -> None:
        self.pictures: dict[RunId, Picture] = {}
        self.prompts: dict[tuple[RunId, str], OpenPrompt] = {}
        self._control = control
        self._listener = listener
        self._notices: AsyncIterator[Notice] = control.subscribe(size=BACKLOG)
        self._loading = asyncio.Lock()

    async def follow(self) -> None:
        """Follow until the executive ends."""
        while True:
            try:
                await self._look_around()
                taken = 0
                pictures = self.pictures
                async for notice in self._notices:
                    if type(notice) is not StampedRecord:
                        await self._prompt(notice)
                    elif (
                        type(notice.record) not in OF_FAULTS
                        and (picture := pictures.get(notice.run)) is not None
                        and notice.seq == picture.seq + 1
                    ):
                        picture.apply(notice)  # nearly all of them: it must cost little
                    else:
                        await self._record(notice)
                    taken += 1
                    if taken % BREATH == 0:
                        await asyncio.sleep(0)
            except M2pemError as error:
                log.warning("%s", error)
                await asyncio.sleep(AGAIN_S)
                self._notices = self._control.subscribe(size=BACKLOG)
            else:
                return

    async def load(self, run: RunId) -> Picture:
        """The picture of a run, up to its last record; also of one that has ended.

        Raises:
            M2pemError: there is no such run, or it cannot be read.
        """
        async with self._loading:
            picture = self.pictures.get(run)
            if picture is None:
                summaries = {each.run: each for each in await self._control.runs()}
                if run not in summaries:
                    raise OperatorError(f"the journal has no run {run}")
                picture = Picture(summaries[run])
                await self._read_on(picture)
                if summaries[run].status is RunStatus.INTERRUPTED:
                    picture.interrupted()
                picture.dirty_summary = False
                self._remember(picture)
            return picture

    # --- what there is already ------------------------------------------------------------------

    async def _look_around(self) -> None:
        """The runs that have not ended, up to now: at the beginning, and after some was missed."""
        for summary in await self._control.runs():
            picture = self.pictures.get(summary.run)
            if picture is not None and not picture.summary.status.ended:
                await self._read_on(picture, tell=True)
            elif picture is None and not summary.status.ended:
                await self.load(summary.run)
        standing = {(each.run, each.prompt) for each in self._control.prompts()}
        for key in self.prompts.keys() - standing:
            self._close(PromptClosed(*key))

    async def _read_on(self, picture: Picture, *, tell: bool = False) -> None:
        """From where a page ended: a journal cannot be read from anywhere else. Some are known.

        `tell`: what went wrong is news.
        """
        run = picture.summary.run
        while page := await self._control.records(run, picture.page_seq, PAGE):
            for stamped in page:
                if stamped.seq > picture.seq:
                    self._apply(picture, stamped, tell=tell)
            picture.page_seq = page[-1].seq
            await asyncio.sleep(0)

    def _remember(self, picture: Picture) -> None:
        self.pictures[picture.summary.run] = picture
        over = [run for run, each in self.pictures.items() if each.summary.status.ended]
        for run in over[:-REMEMBERED_RUNS]:
            del self.pictures[run]

    # --- what happens ---------------------------------------------------------------------------

    async def _record(self, stamped: StampedRecord) -> None:
        picture = self.pictures.get(stamped.run)
        if picture is None:
            picture = await self._meet(stamped)
        if stamped.seq == picture.seq + 1:
            self._apply(picture, stamped, tell=True)
        elif stamped.seq > picture.seq:
            await self._read_on(picture, tell=True)

    async def _meet(self, stamped: StampedRecord) -> Picture:
        """A run that is new here: from its start, or taken up by this executive."""
        if not isinstance(stamped.record, r.RunStarted):
            return await self.load(stamped.run)
        summary = RunSummary(stamped.run, "", "", RunStatus.RUNNING, 0)
        try:
            name = (await self._control.mission(stamped.run)).file
            began_us = {each.run: each.began_us for each in await self._control.runs()}
            summary = replace(summary, mission=name, began_us=began_us.get(stamped.run, 0))
        except M2pemError as error:
            log.warning("%s: its diagram cannot be read: %s", stamped.run, error)
        picture = Picture(summary)
        self._remember(picture)
        return picture

    def _apply(self, picture: Picture, stamped: StampedRecord, *, tell: bool) -> None:
        picture.apply(stamped)
        if tell and type(stamped.record) in OF_FAULTS:
            text = _what_went_wrong(stamped.record)
            if text:
                self._listener.failed(stamped.run, text)

    async def _prompt(self, notice: Notice) -> None:
        match notice:
            case OpenPrompt(run=run, prompt=prompt):
                if run not in self.pictures:
                    await self.load(run)
                if (run, prompt) not in self.prompts:
                    self.prompts[run, prompt] = notice
                    self._listener.asked(notice)
            case PromptClosed():
                self._close(notice)
            case Alert():
                self._listener.alerted(notice)

    def _close(self, closed: PromptClosed) -> None:
        if self.prompts.pop((closed.run, closed.prompt), None) is not None:
            self._listener.closed(closed)


OF_FAULTS = frozenset((r.BehaviorEnded, r.ErrorThrown, r.RunEnded))


def _what_went_wrong(record: r.Record) -> str:
    """For people; "": nothing that the mission does not handle."""
    match record:
        case r.BehaviorEnded(state=BehaviorState.LOST, behavior=behavior, reason=reason):
            return f"{behavior} is lost: {reason}"
        case r.ErrorThrown(code=code, element=element, reason=reason, caught_by=""):
            return f"{element}: error {code} is handled nowhere: {reason}"
        case r.RunEnded(outcome=r.RunOutcome.FAILED, detail=detail):
            return f"the run has failed: {detail}"
    return ""
