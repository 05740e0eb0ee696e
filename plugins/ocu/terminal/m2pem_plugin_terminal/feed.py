"""Follows all runs of an executive: their boards, their logs, and the questions that stand."""

import asyncio
from collections import deque
from collections.abc import Callable
from typing import Protocol

from m2pem.api.control import (
    LOGGED,
    Alert,
    MissionControl,
    Notice,
    OpenPrompt,
    PromptClosed,
    RunId,
    StampedRecord,
)
from m2pem.errors import OperatorError
from m2pem_plugin_terminal.board import Board
from m2pem_plugin_terminal.story import Line, tell
from m2pem_plugin_terminal.tree import FADES_FOR_S

LOG_LINES = 2000


class Listener(Protocol):
    """Who wants to know at once what happened."""

    def logged(self, run: RunId, line: Line) -> None:
        """A line was added to the log of a run."""
        ...

    def alerted(self, alert: Alert) -> None:
        """The executive warns of something that is in no run's records."""
        ...

    def asked(self, prompt: OpenPrompt) -> None:
        """A question stands."""
        ...

    def answered(self, prompt: OpenPrompt, closed: PromptClosed) -> None:
        """A question no longer stands."""
        ...

    def began(self, run: RunId) -> None:
        """A run is new here."""
        ...

    def ended(self, run: RunId) -> None:
        """A run has ended."""
        ...


class Feed:
    """`now`: the operator's clock, in seconds."""

    def __init__(
        self, control: MissionControl, listener: Listener, now: Callable[[], float]
    ) -> None:
        self.boards: dict[RunId, Board] = {}
        self.logs: dict[RunId, deque[Line]] = {}
        self.prompts: dict[tuple[RunId, str], OpenPrompt] = {}
        self._control = control
        self._listener = listener
        self._now = now
        self._loading = asyncio.Lock()

    async def follow(self) -> None:
        """Follow until the executive ends.

        Raises:
            M2pemError: it cannot be reached any more.
        """
        while True:
            notices = self._control.subscribe()
            self.prompts.clear()
            for summary in await self._control.runs():
                if not summary.status.ended or summary.run in self.boards:
                    await self.load(summary.run)
            try:
                async for notice in notices:
                    await self._take(notice)
            except OperatorError:
                continue  # too slow a terminal: what was missed is read again
            return

    async def load(self, run: RunId) -> Board:
        """The board of a run, up to its last record; also of one that has ended."""
        async with self._loading:
            board = self.boards.get(run)
            is_new = board is None
            if board is None:
                board = Board(run, await self._control.mission(run))
            log = self.logs.setdefault(run, deque(maxlen=LOG_LINES))
            while page := await self._control.records(run, board.seq):
                for stamped in page:
                    line = tell(board, stamped)
                    if board.apply(stamped, self._now() - FADES_FOR_S) and line is not None:
                        log.append(line)
            self.boards[run] = board
        if is_new:
            self._listener.began(run)
        return board

    async def _take(self, notice: Notice) -> None:
        match notice:
            case StampedRecord(run=run):
                board = self.boards.get(run) or await self.load(run)
                line = tell(board, notice)
                was_over = board.status.ended
                if not board.apply(notice, self._now()):
                    return
                if line is not None:
                    self.logs[run].append(line)
                    self._listener.logged(run, line)
                if board.status.ended and not was_over:
                    self._listener.ended(run)
            case Alert(code=code) if code != LOGGED:  # the log is shown, too
                self._listener.alerted(notice)
            case OpenPrompt(run=run, prompt=prompt):
                self.prompts[run, prompt] = notice
                self._listener.asked(notice)
            case PromptClosed(run=run, prompt=prompt):
                asked = self.prompts.pop((run, prompt), None)
                if asked is not None:
                    self._listener.answered(asked, notice)
