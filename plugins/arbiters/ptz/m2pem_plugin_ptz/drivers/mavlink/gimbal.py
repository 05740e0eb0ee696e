"""The gimbal of a MAVLink camera: its control, its direction and its commands (gimbal protocol)."""

import asyncio
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

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

from m2pem.api.latest_task import LatestTask, cancel_and_wait
from m2pem_plugin_ptz.drivers.mavlink.context import CameraContext, Direction
from m2pem_plugin_ptz.drivers.mavlink.settings import Yaw
from m2pem_plugin_ptz.gimbal import Ramp, Reach

RELEASE_WITHIN_S = 1.0
"""Real seconds to release the control of the gimbal."""

NO_CONTROLLER = 0


class GimbalControl:
    """The control of a gimbal. It is acquired when it is needed, if no other station has it.
    `device`: of the manager's gimbals."""

    def __init__(self, context: CameraContext, manager: Address, device: int) -> None:
        self._context = context
        self._manager, self._device = manager, device
        self._own = Address(context.settings.gcs_system_id, context.settings.own_component)
        self._in_control = False
        self._other: Address | None = None
        self._taking: asyncio.Task[None] | None = None

    @property
    def refusal(self) -> str:
        """Why the gimbal must not be moved; "" if it may be."""
        if self._other is None:
            return ""
        system, component = self._other
        return (
            f"another ground station (system {system}, component {component}) controls the gimbal, "
            "and must release it first"
        )

    def control_changed(self, controller: Address | None) -> None:
        """Process the controller that the manager reports."""
        if controller is None:
            return
        before = self._other
        is_other = controller.system != NO_CONTROLLER and controller != self._own
        self._other = controller if is_other else None
        if controller != self._own:
            self._in_control = False
        if self._other is not None and self._other != before:
            self._context.logger.warning("%s: %s", self._context.resource, self.refusal)

    async def take(self) -> None:
        """Acquire control of the gimbal. Concurrent callers wait for the same answer.

        Raises:
            ExchangeError: the manager refused, or did not answer.
        """
        if self._in_control:
            return
        if self._taking is None or self._taking.done():
            self._taking = asyncio.get_running_loop().create_task(self._take())
            # The task that requested control may have been replaced by another command.
            self._taking.add_done_callback(lambda done: done.cancelled() or done.exception())
        await asyncio.shield(self._taking)

    async def _take(self) -> None:
        command = gimbal.take_control(self._manager, self._own, self._device)
        await self._context.link.perform(command)
        self._in_control = True

    async def close(self) -> None:
        """Release control of the gimbal."""
        await cancel_and_wait(self._taking)
        if self._in_control:
            try:
                async with asyncio.timeout(RELEASE_WITHIN_S):
                    await self._context.link.perform(gimbal.release(self._manager, self._device))
            except (ExchangeError, TimeoutError) as error:
                self._context.logger.debug(
                    "%s: control of the gimbal not released: %s", self._context.resource, error
                )


ATTITUDE_EVERY_S, STATUS_EVERY_S = 0.1, 1.0
ATTEND_S = 1.0
SILENT_S = 2.5
"""After this time without an attitude it is requested again, as the manager may have restarted."""

STEP_S = 0.1
"""A slow turn is commanded in steps of this time."""

QUIET_S = 0.3
"""A direction that is unchanged for this time is sent again as a command with an acknowledgment,
which the messages before do not have."""

FORGOTTEN_S = 1.0
"""A turn begins at the direction of the last command, unless the command is older than this."""

HIGHEST_DEVICE = 6
"""Gimbals with higher ids are components of their own, whose device id is 0."""

_ATTITUDE = message_type("GIMBAL_DEVICE_ATTITUDE_STATUS").id
_STATUS = message_type("GIMBAL_MANAGER_STATUS").id


@dataclass(frozen=True, slots=True)
class _Found:
    gimbal: gimbal.Gimbal
    control: GimbalControl


class GimbalDriver:
    """Finds and points the gimbal. Directions are those of the mount; see `PanTiltZoom`."""

    def __init__(self, context: CameraContext) -> None:
        self._context = context
        self._status = gimbal_status.GimbalStatus()
        self._found: _Found | None = None
        self._last_error = ""
        self._ordered: tuple[float, Direction] | None = None
        self._work = LatestTask()
        self._attending: asyncio.Task[None] | None = None
        self._stop_listening: Callable[[], None] = lambda: None

    def open(self) -> None:
        """Search the gimbal manager, and subscribe."""
        self._stop_listening = self._context.link.listen(gimbal_status.WANTED, self._on_message)
        self._attending = asyncio.get_running_loop().create_task(self._poll())

    # --- state ----------------------------------------------------------------------------------

    @property
    def direction(self) -> Direction | None:
        """The last reported direction; None if there is none, or its reference is not known.

        PX4 reports it before its manager was found. Then it counts only if the search has failed.
        """
        attitude, is_searching = self._attitude, self._found is None and not self._last_error
        if attitude is None or is_searching:
            return None
        yaw_rad = attitude.yaw_from_vehicle_rad
        if yaw_rad is None:
            heading_rad = self._context.attitude.heading_rad
            if attitude.yaw_from_north_rad is None or heading_rad is None:
                return None
            yaw_rad = math.remainder(attitude.yaw_from_north_rad - heading_rad, math.tau)
        return self._context.attitude.to_mount((yaw_rad, attitude.pitch_rad))

    @property
    def is_received(self) -> bool:
        """Whether the gimbal has ever reported its direction."""
        return bool(self._status.attitudes)

    def reach(self) -> Reach:
        """Return the limits of the fleet, reduced to those of the gimbal."""
        reach = self._context.reach
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
        """Why the gimbal cannot be pointed; "" if it can."""
        if self._found is None:
            settings = self._context.settings
            what = f"component {settings.gimbal_component} of system {settings.system_id}"
            return f"{what} has not reported a gimbal{self._last_error}"
        return self._found.control.refusal

    # --- orders ---------------------------------------------------------------------------------

    def point(self, direction: Direction, rate_rad_s: float | None) -> None:
        """Turn to a direction in place of the last one."""
        turn = partial(self._turn_to, direction, rate_rad_s)
        self._work.replace(partial(self._context.carefully, "gimbal", turn))

    def halt(self) -> None:
        """Stop turning."""
        self._work.replace(partial(self._context.carefully, "gimbal", self._stop))

    async def close(self) -> None:
        """Close, and release the control. The gimbal stays as it is."""
        self._stop_listening()
        await cancel_and_wait(self._attending)
        await self._work.close()
        if self._found is not None:
            await self._found.control.close()

    # --- discovery and messages -----------------------------------------------------------------

    def _on_message(self, message: Message, sender: Address) -> None:
        self._status.take(message, sender, self._context.now_s())
        if message.TYPE.id == _ATTITUDE:
            if self._attitude is not None:
                self._context.on_contact()
        elif self._found is not None:
            known = self._found.gimbal
            self._found.control.control_changed(
                self._status.controller(known.manager, known.device)
            )

    @property
    def _attitude(self) -> gimbal_status.GimbalAttitude | None:
        device = self._found.gimbal.device if self._found is not None else 0
        return self._status.attitude(device if device <= HIGHEST_DEVICE else 0)

    async def _poll(self) -> None:
        while True:
            try:
                if self._found is None:
                    await self._find()
                if self._found is not None:
                    await self._request_messages(self._found.gimbal.manager)
            except ExchangeError as error:
                self._last_error = f" ({error})"
                self._context.logger.debug("%s: gimbal: %s", self._context.resource, error)
            await self._context.clock.sleep(ATTEND_S)

    async def _find(self) -> None:
        settings = self._context.settings
        manager = Address(settings.system_id, settings.gimbal_component)
        known = await self._context.link.perform(gimbal.FindGimbal(manager, settings.gimbal_device))
        self._found = _Found(known, GimbalControl(self._context, manager, known.device))

    async def _request_messages(self, manager: Address) -> None:
        attitude = self._attitude
        if attitude is not None and self._context.now_s() - attitude.at_s < SILENT_S:
            return
        await self._context.link.perform(SetMessageInterval(manager, _ATTITUDE, ATTITUDE_EVERY_S))
        try:
            await self._context.link.perform(SetMessageInterval(manager, _STATUS, STATUS_EVERY_S))
        except RefusedError as error:  # changes of control are then not reported
            self._context.logger.debug("%s: gimbal status: %s", self._context.resource, error)

    # --- turning --------------------------------------------------------------------------------

    async def _turn_to(self, direction: Direction, rate_rad_s: float | None) -> None:
        found = self._found
        if found is None or found.control.refusal:
            return
        await found.control.take()
        known, link, clock = found.gimbal, self._context.link, self._context.clock
        if rate_rad_s is not None:
            ramp = Ramp(
                self._from_where() or direction,
                direction,
                self._context.now_s(),
                rate_rad_s,
                endless=self.reach().endless,
            )
            while not ramp.is_over(now_s := self._context.now_s()):
                aim = self._aim(known, ramp.at(now_s + STEP_S))
                link.send(gimbal.pointing(known.manager, aim, known.device))
                await clock.sleep(STEP_S)
                self._ordered = self._context.now_s(), ramp.at(self._context.now_s())
        self._ordered = self._context.now_s(), direction
        link.send(gimbal.pointing(known.manager, self._aim(known, direction), known.device))
        await clock.sleep(QUIET_S)
        if not found.control.refusal:
            await link.perform(
                gimbal.point(known.manager, self._aim(known, direction), known.device)
            )

    def _from_where(self) -> Direction | None:
        """Return where a turn begins: at the last command, if it is recent; otherwise at the
        reported direction."""
        if self._ordered is not None and self._context.now_s() - self._ordered[0] < FORGOTTEN_S:
            return self._ordered[1]
        return self.direction

    def _aim(self, known: gimbal.Gimbal, direction: Direction) -> gimbal.Aim:
        yaw_rad, pitch_rad = self._context.attitude.to_horizon(direction)
        heading_rad = self._context.attitude.heading_rad
        locks = self._context.settings.yaw is Yaw.NORTH and known.locks_yaw
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
            await self._context.link.perform(gimbal.stop(known.manager, device=known.device))
        except RefusedError:  # one that knows no rates
            if direction is not None:
                aim = self._aim(known, direction)
                await self._context.link.perform(gimbal.point(known.manager, aim, known.device))


def _both(fleet: tuple[float, float], camera: tuple[float, float] | None) -> tuple[float, float]:
    """Return the intersection of two ranges. An invalid range is ignored."""
    if camera is None or not all(map(math.isfinite, camera)) or camera[0] >= camera[1]:
        return fleet
    low, high = max(fleet[0], camera[0]), min(fleet[1], camera[1])
    return (low, high) if low <= high else fleet
