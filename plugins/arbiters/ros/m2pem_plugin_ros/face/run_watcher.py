"""What happens in runs that clients of the face have started, for the goals that wait for them."""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager

from m2pem.api import Listener, OpenPrompt, PromptClosed, RunId, RunView, StampedRecord

WAITING = 1000
"""Changes that wait for one goal. Beyond that the oldest are dropped, which only feedback lacks."""


class RunChanges:
    """What changes in a run: new records, and None for its prompts."""

    def __init__(self) -> None:
        self._changes: asyncio.Queue[StampedRecord | None] = asyncio.Queue()

    def put(self, change: StampedRecord | None) -> None:
        """Add a change."""
        if self._changes.qsize() >= WAITING:
            self._changes.get_nowait()
        self._changes.put_nowait(change)

    async def get(self) -> StampedRecord | None:
        """Wait for the next change."""
        return await self._changes.get()

    def clear(self) -> None:
        """Drop the changes that wait."""
        while not self._changes.empty():
            self._changes.get_nowait()


class RunWatcher(Listener):
    """Listens to a follower."""

    def __init__(self) -> None:
        self._watched: dict[RunId, list[RunChanges]] = {}

    @contextmanager
    def watch(self, run: RunId) -> Iterator[RunChanges]:
        """Collect the changes of a run from now on."""
        changes = RunChanges()
        self._watched.setdefault(run, []).append(changes)
        try:
            yield changes
        finally:
            self._watched[run].remove(changes)
            if not self._watched[run]:
                del self._watched[run]

    def recorded(self, view: RunView, stamped: StampedRecord, *, is_new: bool) -> None:
        """Pass a record on."""
        self._put(view.run, stamped)

    def prompt_opened(self, prompt: OpenPrompt) -> None:
        """Note that the prompts of a run have changed."""
        self._put(prompt.run, None)

    def prompt_closed(self, prompt: OpenPrompt, closed: PromptClosed) -> None:
        """Note that the prompts of a run have changed."""
        self._put(prompt.run, None)

    def _put(self, run: RunId, change: StampedRecord | None) -> None:
        for changes in self._watched.get(run, ()):
            changes.put(change)
