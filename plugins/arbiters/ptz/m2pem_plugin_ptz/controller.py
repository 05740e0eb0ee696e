"""Runs the behaviors of one camera, one at a time.

A hold takes effect at once and keeps the progress; a picture that is being taken is finished. A
cancel, or another behavior, ends the current one before anything else begins.
"""

import asyncio
import logging
import math
from dataclasses import dataclass

from m2pem.api import BehaviorId, BehaviorState, BehaviorTracker, LatestTask, Limits
from m2pem.api.latest_task import cancel_and_wait
from m2pem_plugin_ptz.behaviors.behavior import LEAST_SHARE, REPORTED_SHARE, TICK_S, Behavior
from m2pem_plugin_ptz.camera_model.frames import angle_between
from m2pem_plugin_ptz.camera_model.model import CameraModel
from m2pem_plugin_ptz.drivers.driver import FOUND_WITHIN_S, CameraError, Discovering
from m2pem_plugin_ptz.settings import DriverName

STOP_SHARE = 0.8
"""A stop that takes more than this part of the cancel timeout has failed."""

_POLL_S = 0.1
REST_S = 0.3
REST_RAD = math.radians(0.3)
"""A camera that reports directions within this angle for that time rests."""


@dataclass(slots=True)
class _Task:
    """The current behavior. `elapsed_s`: its time without holds. `adopted`: it was running before a
    restart, and is not begun again."""

    id: BehaviorId
    behavior: Behavior
    elapsed_s: float = 0.0
    adopted: bool = False
    cancelled: bool = False


class CameraController:
    """Runs the behaviors of a camera, and reports their ends to the tracker. `last_contact_us`:
    time of the last message."""

    def __init__(
        self, model: CameraModel, tracker: BehaviorTracker, limits: Limits, logger: logging.Logger
    ) -> None:
        self.model = model
        self.driver = model.driver
        self.last_contact_us: int | None = None
        self._tracker = tracker
        self._limits = limits
        self._logger = logger
        self._clock = model.context.clock
        self._task: _Task | None = None
        self._replaced: list[Behavior] = []
        self._held = False
        self.is_awaited = False
        """Whether a behavior waits for the camera, which is not discovered yet."""
        self._work = LatestTask()

    @property
    def behavior(self) -> str:
        """The name of the current behavior, or ""."""
        return self._task.behavior.name if self._task is not None else ""

    async def wait_for_ptz(self, within_s: float | None = None) -> bool:
        """Wait until the direction of the camera is known. Return False after `within_s`."""
        limit_us = None if within_s is None else self.model.now_us + round(within_s * 1e6)
        while self.driver.ptz is None:
            if limit_us is not None and self.model.now_us >= limit_us:
                return False
            await self._clock.sleep(_POLL_S)
        return True

    # --- requests -------------------------------------------------------------------------------

    def take(self, id_: BehaviorId, behavior: Behavior) -> None:
        """Start a behavior in place of the current one."""
        if self._task is not None:
            self._replaced.append(self._task.behavior)
        self._task = task = _Task(id_, behavior)
        self._held = False
        self._work.replace(lambda: self._run(task))

    def adopt(self, id_: BehaviorId, behavior: Behavior, elapsed_s: float) -> None:
        """Continue a behavior that was running before a restart."""
        self._task = task = _Task(id_, behavior, elapsed_s, adopted=True)
        self._held = False
        self._work.replace(lambda: self._run(task))

    def cancel(self, id_: BehaviorId) -> None:
        """Stop a behavior."""
        task = self._task
        if task is not None and task.id == id_ and not task.cancelled:
            task.cancelled = True
            self._work.replace(lambda: self._cancel(task))

    def hold(self) -> None:
        """Stop turning and zooming, and keep the behavior."""
        self._held = True
        self.driver.halt()

    def resume(self) -> None:
        """Continue the behavior."""
        self._held = False

    def drop(self) -> None:
        """Drop the behavior of a camera that is lost; what was seen of it last is reported."""
        if self._task is not None:
            self._report_left(self._task, LEAST_SHARE)
        self._task = None
        self._replaced.clear()
        self._held = False
        self._work.cancel()

    async def close(self) -> None:
        """Close. The camera stays as it is."""
        await self._work.close()

    # --- execution ------------------------------------------------------------------------------

    async def _run(self, task: _Task) -> None:
        try:
            await self._end_replaced()
            await self._until_found(task)
            await self.wait_for_ptz()
            if not task.adopted:
                await self._wait_while_held()
                await task.behavior.begin()
            self._tracker.progress(task.id)
            await self._steps(task)
            await task.behavior.leave()
        except CameraError as error:
            await self._fail(task, error.reason, error.code)
        except asyncio.CancelledError:
            raise
        except Exception as error:  # an error of one camera must not block its mission
            self._logger.exception("%s: %s", self.model.resource, task.behavior.name)
            await self._fail(task, f"internal error of m2pem: {type(error).__name__}: {error}")
        else:
            self._end(task, BehaviorState.SUCCEEDED)

    async def _until_found(self, task: _Task) -> None:
        driver, name, loop = self.driver, task.behavior.name, asyncio.get_running_loop()
        if not isinstance(driver, Discovering) or not (missing := driver.missing(name)):
            return
        self._logger.warning(
            "%s: %s waits: not discovered yet: %s", self.model.resource, task.id, missing
        )
        end_s, self.is_awaited = loop.time() + FOUND_WITHIN_S, True
        try:
            while missing := driver.missing(name):
                if loop.time() >= end_s:
                    reason = f"not discovered within {FOUND_WITHIN_S:g} s: {missing}"
                    raise CameraError(reason, "REJECTED")
                await asyncio.sleep(_POLL_S)
        finally:
            self.is_awaited = False
        if not task.adopted and (reason := task.behavior.refusal()):
            raise CameraError(reason, "REJECTED")

    async def _steps(self, task: _Task) -> None:
        while True:
            await self._wait_while_held()
            began_us = self.model.now_us
            if await task.behavior.step(task.elapsed_s):
                return
            self._report_left(task)
            await self._clock.sleep(TICK_S)
            task.elapsed_s += (self.model.now_us - began_us) / 1e6

    def _report_left(self, task: _Task, least: float = REPORTED_SHARE) -> None:
        left = task.behavior.left(least)
        if left is not None:
            self._tracker.remains(task.id, left)

    async def _wait_while_held(self) -> None:
        while self._held or not self.model.context.may_send():
            await self._clock.sleep(TICK_S)

    async def _end_replaced(self) -> None:
        """End the motions and recordings of replaced behaviors."""
        while self._replaced:
            before = self._replaced[0]
            if before.turns:
                self.driver.halt()
            try:
                await before.leave()
            except CameraError as error:
                self._logger.error("%s: %s: %s", self.model.resource, before.name, error)
            self._replaced.pop(0)

    async def _leave(self, behavior: Behavior) -> None:
        await self._end_replaced()
        await behavior.leave()
        # A gimbal that keeps its heading turns with its vehicle.
        if behavior.turns and self.model.settings.driver is not DriverName.MAVLINK:
            await self._rest()

    async def _rest(self) -> None:
        """Wait until the camera reports that it does not turn."""
        at, since_us = self.driver.ptz, self.model.now_us
        contact_us = self.last_contact_us
        while self.model.now_us - since_us < REST_S * 1e6 or self.last_contact_us == contact_us:
            await self._clock.sleep(_POLL_S)
            now = self.driver.ptz
            if at is None or now is None:
                return
            if angle_between((at.pan_rad, at.tilt_rad), (now.pan_rad, now.tilt_rad)) > REST_RAD:
                at, since_us, contact_us = now, self.model.now_us, self.last_contact_us

    async def _cancel(self, task: _Task) -> None:
        if task.behavior.turns:
            self.driver.halt()
        leave = asyncio.get_running_loop().create_task(self._leave(task.behavior))
        limit_s = STOP_SHARE * self._limits.cancel_timeout_s
        late = asyncio.get_running_loop().create_task(self._clock.sleep(limit_s))
        try:
            await asyncio.wait([leave, late], return_when=asyncio.FIRST_COMPLETED)
            if not leave.done():
                reason = f"the camera did not stop within {limit_s:g} s of the cancel"
                self._end(task, BehaviorState.FAILED, "TIMEOUT", reason)
            elif (error := leave.exception()) is not None:
                self._end(task, BehaviorState.FAILED, "", f"the camera did not stop: {error}")
            else:
                self._end(task, BehaviorState.CANCELLED)
        finally:
            await cancel_and_wait(leave, late)

    async def _fail(self, task: _Task, reason: str, code: str = "") -> None:
        """Stop a failed behavior."""
        if task.behavior.turns:
            self.driver.halt()
        try:
            await task.behavior.leave()
        except CameraError as error:
            self._logger.error("%s: the camera does not stop: %s", self.model.resource, error)
        self._end(task, BehaviorState.FAILED, code, reason)

    def _end(self, task: _Task, state: BehaviorState, code: str = "", reason: str = "") -> None:
        if self._task is task:
            self._task = None
        if state is BehaviorState.FAILED:
            self._report_left(task, LEAST_SHARE)
        self._tracker.end(task.id, state, code, reason, task.behavior.outputs())
