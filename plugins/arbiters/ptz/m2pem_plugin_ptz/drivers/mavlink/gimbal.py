"""Being in control of a gimbal: its manager obeys who is, and there may be other stations."""

import asyncio
import math
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import Any

from m2pem_plugin_mavlink import (
    Address,
    ExchangeError,
    Message,
    RefusedError,
    SetMessageInterval,
    gimbal,
    gimbal_status,
    message_type,
)

from m2pem_plugin_ptz.drivers.mavlink.context import Direction, Post
from m2pem_plugin_ptz.drivers.mavlink.settings import Yaw
from m2pem_plugin_ptz.gimbal import Ramp, Reach

RELEASE_WITHIN_S = 1.0
"""Of real time: nobody waits longer for a gimbal to be left to others."""

NOBODY = 0


class GimbalControl:
    """Control is taken when it is needed, from nobody. `device`: of the manager's gimbals."""

    def __init__(self, post: Post, manager: Address, device: int) -> None:
        self._post = post
        self._manager, self._device = manager, device
        self._own = Address(post.settings.gcs_system_id, post.settings.own_component)
        self._ours = False
        self._other: Address | None = None
        self._taking: asyncio.Task[None] | None = None

    @property
    def refusal(self) -> str:
        """Why the gimbal is not to be moved; "" if it may be."""
        if self._other is None:
            return ""
        system, component = self._other
        return (
            f"another ground station (system {system}, component {component}) controls the gimbal, "
            "and must release it first"
        )

    def told(self, controller: Address | None) -> None:
        """The manager has said who is in control."""
        if controller is None:
            return
        before = self._other
        is_other = controller.system != NOBODY and controller != self._own
        self._other = controller if is_other else None
        if controller != self._own:
            self._ours = False
        if self._other is not None and self._other != before:
            self._post.logger.warning("%s: %s", self._post.resource, self.refusal)

    async def take(self) -> None:
        """Be in control; whoever else is asking meanwhile waits for the same answer.

        Raises:
            ExchangeError: the manager refuses, or does not answer.
        """
        if self._ours:
            return
        if self._taking is None or self._taking.done():
            self._taking = asyncio.get_running_loop().create_task(self._take())
            # Whoever asked may be gone by now, with another order.
            self._taking.add_done_callback(lambda done: done.cancelled() or done.exception())
        await asyncio.shield(self._taking)

    async def _take(self) -> None:
        command = gimbal.take_control(self._manager, self._own, self._device)
        await self._post.link.perform(command)
        self._ours = True

    async def close(self) -> None:
        """Leave the gimbal to others."""
        if self._taking is not None:
            self._taking.cancel()
            await asyncio.gather(self._taking, return_exceptions=True)
        if self._ours:
            try:
                async with asyncio.timeout(RELEASE_WITHIN_S):
                    await self._post.link.perform(gimbal.release(self._manager, self._device))
            except (ExchangeError, TimeoutError) as error:
                self._post.logger.debug("%s: not released: %s", self._post.resource, error)


ATTITUDE_EVERY_S, STATUS_EVERY_S = 0.1, 1.0
ATTEND_S = 1.0
SILENT_S = 2.5
"""After so long without an attitude it is asked for again: the manager may have been restarted."""

STEP_S = 0.1
"""A gimbal that is not to turn quickly is given its way in steps of so long."""

QUIET_S = 0.3
"""An aim that has stood for so long is given again by a command that is answered: the messages
before are not."""

FORGOTTEN_S = 1.0
"""What was ordered longer ago than this is no longer where the gimbal is on its way from."""

HIGHEST_DEVICE = 6
"""Gimbals with higher ids are components of their own, and say 0 for their device."""

_ATTITUDE = message_type("GIMBAL_DEVICE_ATTITUDE_STATUS").id
_STATUS = message_type("GIMBAL_MANAGER_STATUS").id


@dataclass(frozen=True, slots=True)
class _Found:
    gimbal: gimbal.Gimbal
    control: GimbalControl


class GimbalHead:
    """Directions are as the camera is mounted: see `Look`."""

    def __init__(self, post: Post) -> None:
        self._post = post
        self._status = gimbal_status.GimbalStatus()
        self._found: _Found | None = None
        self._why = ""
        self._ordered: tuple[float, Direction] | None = None
        self._job: asyncio.Task[None] | None = None
        self._attending: asyncio.Task[None] | None = None
        self._stop_listening: Callable[[], None] = lambda: None

    def open(self) -> None:
        """Look for it, and listen."""
        self._stop_listening = self._post.link.listen(gimbal_status.WANTED, self._hear)
        self._attending = asyncio.get_running_loop().create_task(self._attend())

    # --- what is known --------------------------------------------------------------------------

    @property
    def direction(self) -> Direction | None:
        """Where it points, as it said last; None: it has not, or from what is not known.

        PX4 tells it before its manager was found, and could be pointed: then it counts only if the
        search was in vain.
        """
        attitude, is_searching = self._attitude, self._found is None and not self._why
        if attitude is None or is_searching:
            return None
        yaw_rad = attitude.yaw_from_bow_rad
        if yaw_rad is None:
            heading_rad = self._post.carrier.heading_rad
            if attitude.yaw_from_north_rad is None or heading_rad is None:
                return None
            yaw_rad = math.remainder(attitude.yaw_from_north_rad - heading_rad, math.tau)
        return self._post.carrier.from_deck((yaw_rad, attitude.pitch_rad))

    @property
    def is_heard(self) -> bool:
        """Whether it has ever said where it points."""
        return bool(self._status.attitudes)

    def reach(self) -> Reach:
        """What the fleet says, as far as the gimbal goes."""
        reach = self._post.reach
        if self._found is None:
            return reach
        known = self._found.gimbal
        turns_round = known.has_endless_yaw or known.yaw_rad[1] - known.yaw_rad[0] >= math.tau
        return Reach(
            pan_rad=_both(reach.pan_rad, None if turns_round else known.yaw_rad),
            tilt_rad=_both(reach.tilt_rad, known.pitch_rad),
            zoom_max=reach.zoom_max,
            rate_rad_s=reach.rate_rad_s,
            view_rad=reach.view_rad,
            endless=reach.endless and known.has_endless_yaw,
        )

    @property
    def refusal(self) -> str:
        """Why it cannot be pointed; "" if it can."""
        if self._found is None:
            settings = self._post.settings
            what = f"component {settings.gimbal_component} of system {settings.system_id}"
            return f"{what} has not said that it manages a gimbal{self._why}"
        return self._found.control.refusal

    # --- orders ---------------------------------------------------------------------------------

    def point(self, direction: Direction, rate_rad_s: float | None) -> None:
        """Turn there; what was ordered before is over."""
        self._begin(lambda: self._turn_to(direction, rate_rad_s))

    def halt(self) -> None:
        """Turn no further."""
        self._begin(self._stop)

    async def close(self) -> None:
        """Leave it as it is, and to others."""
        self._stop_listening()
        tasks = [each for each in (self._attending, self._job) if each is not None]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        if self._found is not None:
            await self._found.control.close()

    # --- finding and hearing --------------------------------------------------------------------

    def _hear(self, message: Message, sender: Address) -> None:
        self._status.take(message, sender, self._post.now_s())
        if message.TYPE.id == _ATTITUDE:
            if self._attitude is not None:
                self._post.heard()
        elif self._found is not None:
            known = self._found.gimbal
            self._found.control.told(self._status.controller(known.manager, known.device))

    @property
    def _attitude(self) -> gimbal_status.GimbalAttitude | None:
        device = self._found.gimbal.device if self._found is not None else 0
        return self._status.attitude(device if device <= HIGHEST_DEVICE else 0)

    async def _attend(self) -> None:
        while True:
            try:
                if self._found is None:
                    await self._find()
                if self._found is not None:
                    await self._keep_hearing(self._found.gimbal.manager)
            except ExchangeError as error:
                self._why = f" ({error})"
                self._post.logger.debug("%s: gimbal: %s", self._post.resource, error)
            await self._post.clock.sleep(ATTEND_S)

    async def _find(self) -> None:
        settings = self._post.settings
        manager = Address(settings.system_id, settings.gimbal_component)
        known = await self._post.link.perform(gimbal.FindGimbal(manager, settings.gimbal_device))
        self._found = _Found(known, GimbalControl(self._post, manager, known.device))

    async def _keep_hearing(self, manager: Address) -> None:
        attitude = self._attitude
        if attitude is not None and self._post.now_s() - attitude.at_s < SILENT_S:
            return
        await self._post.link.perform(SetMessageInterval(manager, _ATTITUDE, ATTITUDE_EVERY_S))
        try:
            await self._post.link.perform(SetMessageInterval(manager, _STATUS, STATUS_EVERY_S))
        except RefusedError as error:  # then nobody can be seen to take control, but can be felt to
            self._post.logger.debug("%s: gimbal status: %s", self._post.resource, error)

    # --- turning --------------------------------------------------------------------------------

    def _begin(self, job: Callable[[], Coroutine[Any, Any, None]]) -> None:
        if self._job is not None:
            self._job.cancel()
        self._job = asyncio.get_running_loop().create_task(self._carefully(job))

    async def _carefully(self, job: Callable[[], Coroutine[Any, Any, None]]) -> None:
        try:
            await job()
        except ExchangeError as error:
            self._post.logger.warning("%s: gimbal: %s", self._post.resource, error)

    async def _turn_to(self, direction: Direction, rate_rad_s: float | None) -> None:
        found = self._found
        if found is None or found.control.refusal:
            return
        await found.control.take()
        known, link, clock = found.gimbal, self._post.link, self._post.clock
        if rate_rad_s is not None:
            ramp = Ramp(
                self._from_where() or direction,
                direction,
                self._post.now_s(),
                rate_rad_s,
                endless=self.reach().endless,
            )
            while not ramp.is_over(now_s := self._post.now_s()):
                aim = self._aim(known, ramp.at(now_s + STEP_S))
                link.send(gimbal.pointing(known.manager, aim, known.device))
                await clock.sleep(STEP_S)
                self._ordered = self._post.now_s(), ramp.at(self._post.now_s())
        self._ordered = self._post.now_s(), direction
        link.send(gimbal.pointing(known.manager, self._aim(known, direction), known.device))
        await clock.sleep(QUIET_S)
        if not found.control.refusal:
            await link.perform(
                gimbal.point(known.manager, self._aim(known, direction), known.device)
            )

    def _from_where(self) -> Direction | None:
        """Where a new way begins: with the last order, if it is new; else where it points."""
        if self._ordered is not None and self._post.now_s() - self._ordered[0] < FORGOTTEN_S:
            return self._ordered[1]
        return self.direction

    def _aim(self, known: gimbal.Gimbal, direction: Direction) -> gimbal.Aim:
        yaw_rad, pitch_rad = self._post.carrier.from_horizon(direction)
        heading_rad = self._post.carrier.heading_rad
        locks = self._post.settings.yaw is Yaw.NORTH and known.locks_yaw
        if locks and heading_rad is not None:
            return gimbal.Aim(pitch_rad, yaw_rad + heading_rad, gimbal.YawFrame.NORTH)
        return gimbal.Aim(pitch_rad, yaw_rad)

    async def _stop(self) -> None:
        found, direction = self._found, self.direction
        self._ordered = None
        if found is None or found.control.refusal:
            return
        known = found.gimbal
        await found.control.take()
        try:
            await self._post.link.perform(gimbal.stop(known.manager, device=known.device))
        except RefusedError:  # one that knows no rates
            if direction is not None:
                aim = self._aim(known, direction)
                await self._post.link.perform(gimbal.point(known.manager, aim, known.device))


def _both(fleet: tuple[float, float], camera: tuple[float, float] | None) -> tuple[float, float]:
    """What both ranges allow; what is no range is none."""
    if camera is None or not all(map(math.isfinite, camera)) or camera[0] >= camera[1]:
        return fleet
    low, high = max(fleet[0], camera[0]), min(fleet[1], camera[1])
    return (low, high) if low <= high else fleet
