"""Who works one camera: one behavior at a time, from its beginning to its end.

A hold takes effect at once and keeps what is done; a picture that is being taken is finished. A
cancel, or another behavior, ends what is done before anything else is begun.
"""

import asyncio
import logging
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from m2pem.api import BehaviorId, BehaviorState, BehaviorTracker, Limits
from m2pem_plugin_ptz.behaviors.behavior import TICK_S, Behavior, BehaviorFailedError
from m2pem_plugin_ptz.camera_model.model import Sight
from m2pem_plugin_ptz.drivers.driver import CameraError

STOP_SHARE = 0.8
"""Of the time in which a cancelled camera must be free: a stop that takes longer has failed."""

_HEARD_EVERY_S = 0.1


@dataclass(slots=True)
class _Task:
    """A behavior that goes on. `elapsed_s`: of which so much has passed, without holds. `adopted`:
    it was found going on, and is not begun again."""

    id: BehaviorId
    behavior: Behavior
    elapsed_s: float = 0.0
    adopted: bool = False
    cancelled: bool = False


class Camera:
    """Works a camera; what becomes of it goes to the ledger. `heard_us`: when it was heard last."""

    def __init__(
        self, sight: Sight, ledger: BehaviorTracker, limits: Limits, logger: logging.Logger
    ) -> None:
        self.sight = sight
        self.driver = sight.driver
        self.heard_us: int | None = None
        self._ledger = ledger
        self._limits = limits
        self._logger = logger
        self._clock = sight.context.clock
        self._task: _Task | None = None
        self._leaving: list[Behavior] = []
        self._held = False
        self._work: set[asyncio.Task[None]] = set()

    @property
    def behavior(self) -> str:
        """The name of what it does now, or ""."""
        return self._task.behavior.name if self._task is not None else ""

    async def knows(self, within_s: float | None = None) -> bool:
        """Wait until it is known where it looks; False: not within so many seconds."""
        limit_us = None if within_s is None else self.sight.now_us + round(within_s * 1e6)
        while self.driver.look is None:
            if limit_us is not None and self.sight.now_us >= limit_us:
                return False
            await self._clock.sleep(_HEARD_EVERY_S)
        return True

    # --- what may be asked ----------------------------------------------------------------------

    def take(self, id_: BehaviorId, behavior: Behavior) -> None:
        """Do this from now on, in place of what it does."""
        if self._task is not None:
            self._leaving.append(self._task.behavior)
        self._task = task = _Task(id_, behavior)
        self._held = False
        self._replace(lambda: self._do(task))

    def adopt(self, id_: BehaviorId, behavior: Behavior, elapsed_s: float) -> None:
        """It was found doing it, and is to go on."""
        self._task = task = _Task(id_, behavior, elapsed_s, adopted=True)
        self._held = False
        self._replace(lambda: self._do(task))

    def cancel(self, id_: BehaviorId) -> None:
        """Stop, and be free."""
        task = self._task
        if task is not None and task.id == id_ and not task.cancelled:
            task.cancelled = True
            self._replace(lambda: self._cancel(task))

    def hold(self) -> None:
        """Stop turning and zooming, and keep the behavior."""
        self._held = True
        self.driver.halt()

    def resume(self) -> None:
        """Go on with the behavior."""
        self._held = False

    def drop(self) -> None:
        """It cannot be reached: its behavior is nobody's any more."""
        self._task = None
        self._leaving.clear()
        self._held = False
        for work in self._work:
            work.cancel()

    async def close(self) -> None:
        """Leave the camera as it is."""
        works = list(self._work)
        for work in works:
            work.cancel()
        await asyncio.gather(*works, return_exceptions=True)

    # --- one thing at a time --------------------------------------------------------------------

    def _replace(self, work: Callable[[], Awaitable[None]]) -> None:
        before = set(self._work)
        for task in before:
            task.cancel()
        task = asyncio.get_running_loop().create_task(self._after(before, work))
        self._work.add(task)
        task.add_done_callback(self._work.discard)

    async def _after(
        self, before: set[asyncio.Task[None]], work: Callable[[], Awaitable[None]]
    ) -> None:
        if before:
            await asyncio.wait(before)
        await work()

    # --- what is done ---------------------------------------------------------------------------

    async def _do(self, task: _Task) -> None:
        try:
            await self._make_way()
            await self.knows()
            if not task.adopted:
                await self._released()
                await task.behavior.begin()
            self._ledger.progress(task.id)
            await self._steps(task)
            await task.behavior.leave()
        except (BehaviorFailedError, CameraError) as error:
            await self._fail(task, error.reason, error.code)
        except asyncio.CancelledError:
            raise
        except Exception as error:  # one camera's bug must not hang its mission
            self._logger.exception("%s: %s", self.sight.resource, task.behavior.name)
            await self._fail(task, f"m2pem is wrong: {type(error).__name__}: {error}")
        else:
            self._over(task, BehaviorState.SUCCEEDED)

    async def _steps(self, task: _Task) -> None:
        while True:
            await self._released()
            began_us = self.sight.now_us
            if await task.behavior.step(task.elapsed_s):
                return
            await self._clock.sleep(TICK_S)
            task.elapsed_s += (self.sight.now_us - began_us) / 1e6

    async def _released(self) -> None:
        while self._held:
            await self._clock.sleep(TICK_S)

    async def _make_way(self) -> None:
        """What takes over must not let the old motion or recording go on."""
        while self._leaving:
            before = self._leaving[0]
            if before.turns:
                self.driver.halt()
            try:
                await before.leave()
            except CameraError as error:
                self._logger.error("%s: %s: %s", self.sight.resource, before.name, error)
            self._leaving.pop(0)

    async def _leave(self, behavior: Behavior) -> None:
        await self._make_way()
        await behavior.leave()

    async def _cancel(self, task: _Task) -> None:
        if task.behavior.turns:
            self.driver.halt()
        leave = asyncio.get_running_loop().create_task(self._leave(task.behavior))
        limit_s = STOP_SHARE * self._limits.cancel_timeout_s
        late = asyncio.get_running_loop().create_task(self._clock.sleep(limit_s))
        try:
            await asyncio.wait([leave, late], return_when=asyncio.FIRST_COMPLETED)
            if not leave.done():
                reason = f"it did not stop within {limit_s:g} s of the cancel"
                self._over(task, BehaviorState.FAILED, "TIMEOUT", reason)
            elif (error := leave.exception()) is not None:
                self._over(task, BehaviorState.FAILED, "", f"it would not stop: {error}")
            else:
                self._over(task, BehaviorState.CANCELLED)
        finally:
            for work in (leave, late):
                work.cancel()
            await asyncio.gather(leave, late, return_exceptions=True)

    async def _fail(self, task: _Task, reason: str, code: str = "") -> None:
        """What has failed half-way must not go on."""
        if task.behavior.turns:
            self.driver.halt()
        try:
            await task.behavior.leave()
        except CameraError as error:
            self._logger.error("%s: does not stop: %s", self.sight.resource, error)
        self._over(task, BehaviorState.FAILED, code, reason)

    def _over(self, task: _Task, state: BehaviorState, code: str = "", reason: str = "") -> None:
        if self._task is task:
            self._task = None
        self._ledger.end(task.id, state, code, reason, task.behavior.outputs())
