"""Follows an executive: its runs, the prompts that stand, and each record as it comes."""

import asyncio
import logging
from collections.abc import AsyncIterator, Iterable
from dataclasses import dataclass
from typing import Protocol

from m2pem.api import (
    Alert,
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
from m2pem.errors import JournalError, M2pemError, OperatorError
from m2pem_plugin_mocu.picture import OF_THE_RUN, OF_TOKENS, Picture

BACKLOG = 100_000
"""Notices that may wait; beyond that they are read from the journal."""

REMEMBERED_RUNS = 100
"""Runs that have ended and are still told of; the journal has all."""

REMEMBERED_PROMPTS = 1000
"""Prompts that no longer stand: who answers one of them late is told who was first."""

BREATH = 200
"""Notices that are taken before others may do something."""

AGAIN_S = 1.0
"""After it could not be followed."""

log = logging.getLogger("m2pem.ocu.mocu")


@dataclass(frozen=True, slots=True)
class Asked:
    """A prompt that stands. `since_us`: when it was heard of, by the clock of this machine."""

    prompt: OpenPrompt
    since_us: int


class Listener(Protocol):
    """Who wants to know at once."""

    def recorded(self, picture: Picture, stamped: StampedRecord) -> None:
        """A record was committed, and the picture has it."""
        ...

    def runs_changed(self) -> None:
        """A run began, ended, or stands otherwise."""
        ...

    def tokens_changed(self) -> None:
        """Tokens or behaviors came or went."""
        ...

    def asked(self, asked: Asked) -> None:
        """A prompt opened."""
        ...

    def closed(self, asked: Asked, closed: PromptClosed) -> None:
        """It was answered or withdrawn."""
        ...


class Feed:
    """`notices` begin when this is made, so that nothing is missed before `follow`."""

    def __init__(self, control: MissionControl) -> None:
        self.pictures: dict[RunId, Picture] = {}
        self.prompts: dict[tuple[RunId, str], Asked] = {}
        self.closed: dict[tuple[RunId, str], PromptClosed] = {}
        self.latest_run: RunId | None = None
        """The last that the journal had when this began."""
        self.taken = 0
        self._control = control
        self._notices: AsyncIterator[Notice] = control.subscribe(size=BACKLOG)

    async def follow(self, listener: Listener, now_us: "Clock") -> None:
        """Follow until the executive ends.

        If it cannot be for a while, what was missed is read from the journal.

        Raises:
            M2pemError: it cannot be reached any more.
        """
        is_new = True
        while True:
            try:
                await (self._look_around() if is_new else self._catch_up(listener))
                is_new = False
                listener.runs_changed()
                async for notice in self._notices:
                    await self._take(notice, listener, now_us)
                    self.taken += 1
                    if self.taken % BREATH == 0:
                        await asyncio.sleep(0)
            except (OperatorError, JournalError) as error:
                log.warning("%s", error)
                await asyncio.sleep(AGAIN_S)
                self._notices = self._control.subscribe(size=BACKLOG)
            else:
                return

    # --- what there is already ------------------------------------------------------------------

    async def _look_around(self) -> None:
        """Know the runs that have not ended, and where the tokens of those are that go on."""
        for summary in await self._control.runs():
            self.latest_run = summary.run
            if summary.status is RunStatus.INTERRUPTED:
                self.pictures[summary.run] = Picture(summary, None)
            elif not summary.status.ended:
                picture = await self._begin(summary)
                async for stamped in self._records(picture):
                    picture.apply(stamped)

    async def _catch_up(self, listener: Listener) -> None:
        """After notices were lost: read on in the journal where each run was left."""
        for summary in await self._control.runs():
            picture = self.pictures.get(summary.run)
            if summary.status is RunStatus.INTERRUPTED:
                self.pictures.setdefault(summary.run, Picture(summary, None))
                continue
            if picture is None and summary.status.ended:
                continue
            if picture is None or picture.mission is None:
                picture = await self._begin(summary)
            async for stamped in self._records(picture):
                self._apply(picture, stamped, listener)
        standing = {(prompt.run, prompt.prompt) for prompt in self._control.prompts()}
        for key in self.prompts.keys() - standing:
            self._close(PromptClosed(*key), listener)

    async def _records(self, picture: Picture) -> AsyncIterator[StampedRecord]:
        """From where a page ended: a journal cannot be read from anywhere else. Some are known."""
        while page := await self._control.records(picture.summary.run, picture.page_seq):
            for stamped in page:
                yield stamped
            picture.page_seq = page[-1].seq

    async def _begin(self, summary: RunSummary) -> Picture:
        try:
            mission = await self._control.mission(summary.run)
        except M2pemError as error:
            log.warning("%s: its diagram cannot be read: %s", summary.run, error)
            mission = None
        if mission is not None and not summary.mission:
            summary = RunSummary(
                summary.run, mission.file, summary.process, summary.status, summary.started_us
            )
        picture = Picture(summary, mission)
        if (known := self.pictures.get(summary.run)) is not None:
            picture.told_seq = known.told_seq
        self.pictures[summary.run] = picture
        return picture

    # --- what happens ---------------------------------------------------------------------------

    async def _take(self, notice: Notice, listener: Listener, now_us: "Clock") -> None:
        match notice:
            case StampedRecord(run=run):
                picture = self.pictures.get(run) or await self._meet(notice)
                if picture.mission is None and isinstance(notice.record, r.RunClaimed):
                    picture = await self._meet(notice)
                self._apply(picture, notice, listener)
            case OpenPrompt(run=run, prompt=prompt):
                if (run, prompt) not in self.prompts:
                    asked = self.prompts[run, prompt] = Asked(notice, now_us())
                    listener.asked(asked)
            case PromptClosed():
                self._close(notice, listener)
            case Alert(run=run, text=text):
                log.error("%s", f"{run}: {text}" if run else text)

    async def _meet(self, stamped: StampedRecord) -> Picture:
        """A run that is new here: from its start, or taken up by this executive."""
        if isinstance(stamped.record, r.RunStarted):
            return await self._begin(RunSummary(stamped.run, "", "", RunStatus.RUNNING, 0))
        summaries = {summary.run: summary for summary in await self._control.runs()}
        picture = await self._begin(
            summaries.get(stamped.run) or RunSummary(stamped.run, "", "", RunStatus.RUNNING, 0)
        )
        async for earlier in self._records(picture):
            if earlier.seq >= stamped.seq:
                break
            picture.apply(earlier)
        return picture

    def _apply(self, picture: Picture, stamped: StampedRecord, listener: Listener) -> None:
        is_new = picture.apply(stamped)
        if stamped.seq > picture.told_seq:
            picture.told_seq = stamped.seq
            listener.recorded(picture, stamped)
        if not is_new:
            return
        record = stamped.record
        match record:
            case r.PromptAnswered(prompt=prompt, decision=decision, by=by):
                self._close(PromptClosed(stamped.run, prompt, decision, by), listener)
            case r.PromptWithdrawn(prompt=prompt):
                self._close(PromptClosed(stamped.run, prompt), listener)
            case r.RunEnded():
                self._close_all_of(stamped.run, listener)
                self._forget_the_oldest()
        if isinstance(record, OF_THE_RUN):
            listener.runs_changed()
        if isinstance(record, OF_TOKENS):
            listener.tokens_changed()

    def _close(self, closed: PromptClosed, listener: Listener) -> None:
        key = (closed.run, closed.prompt)
        asked = self.prompts.pop(key, None)
        if asked is not None:
            self.closed[key] = closed
            if len(self.closed) > REMEMBERED_PROMPTS:
                del self.closed[next(iter(self.closed))]
            listener.closed(asked, closed)

    def _close_all_of(self, run: RunId, listener: Listener) -> None:
        for key in [key for key in self.prompts if key[0] == run]:
            self._close(PromptClosed(*key), listener)

    def _forget_the_oldest(self) -> None:
        over = [each for each in self.pictures.values() if each.summary.status.ended]
        for picture in over[:-REMEMBERED_RUNS]:
            del self.pictures[picture.summary.run]

    def runs(self) -> Iterable[Picture]:
        """The runs, in the order in which they were heard of."""
        return self.pictures.values()


class Clock(Protocol):
    """Microseconds since the Unix epoch."""

    def __call__(self) -> int:
        """The time now."""
        ...
