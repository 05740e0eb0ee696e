"""Moves the joints of a pan-tilt unit by trajectories or by positions."""

import asyncio
import math
from collections.abc import Callable, Coroutine
from dataclasses import replace
from typing import Any, TypeAlias

from builtin_interfaces.msg import Duration
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from m2pem.api import Clock
from m2pem_plugin_ptz.drivers.ros.settings import Axis, Joints, nearest_turn
from m2pem_plugin_ptz.gimbal import PanTiltZoom, Ramp, Reach

STEP_S = 0.1
"""Slow turns by positions are commanded in steps of this time."""

REPEAT_S = 1.0
"""A unit that has not arrived this long after the expected time is commanded again, as its
controller may have started later than the command."""

SHORTEST_S = 0.1
"""Shortest duration of a trajectory."""

NEAR_RAD, NEAR_ZOOM = math.radians(0.3), 0.02

Job: TypeAlias = Callable[[], Coroutine[Any, Any, None]]
Publish: TypeAlias = Callable[[object], None]


class JointController:
    """Moves the joints. `ptz` returns the last reported direction. `publish` sends a trajectory, or
    positions if `as_trajectory` is False."""

    def __init__(
        self,
        joints: Joints,
        reach: Reach,
        clock: Clock,
        ptz: Callable[[], PanTiltZoom | None],
        publish: Publish,
        *,
        as_trajectory: bool,
    ) -> None:
        self._joints = joints
        self._reach = reach
        self._clock = clock
        self._look = ptz
        self._publish = publish
        self._as_trajectory = as_trajectory
        self._wanted: PanTiltZoom | None = None
        self._ordered: tuple[float, tuple[float, float]] | None = None
        self._job: asyncio.Task[None] | None = None

    def point(self, pan_rad: float, tilt_rad: float, rate_rad_s: float | None) -> None:
        """Turn to a direction, with the current zoom."""
        ptz = self._look()
        if ptz is not None:
            zoom = self._wanted.zoom if self._wanted is not None else ptz.zoom
            self._go(PanTiltZoom(pan_rad, tilt_rad, zoom), rate_rad_s)

    def zoom(self, level: float) -> None:
        """Zoom to a level, and finish the turn."""
        ptz = self._look()
        if ptz is not None:
            self._go(replace(self._wanted or ptz, zoom=level), None)

    def halt(self) -> None:
        """Stop."""
        ptz = self._look()
        self._cancel()
        self._wanted, self._ordered = None, None
        if ptz is not None:
            self._send(ptz, SHORTEST_S)

    async def close(self) -> None:
        """Send nothing more."""
        job = self._job
        self._cancel()
        if job is not None:
            await asyncio.gather(job, return_exceptions=True)

    # --- inside ---------------------------------------------------------------------------------

    def _go(self, wanted: PanTiltZoom, rate_rad_s: float | None) -> None:
        self._cancel()
        self._wanted = wanted
        self._job = asyncio.get_running_loop().create_task(self._turn_to(wanted, rate_rad_s))

    def _cancel(self) -> None:
        if self._job is not None:
            self._job.cancel()
            self._job = None

    async def _turn_to(self, wanted: PanTiltZoom, rate_rad_s: float | None) -> None:
        rate = min(rate_rad_s or self._reach.rate_rad_s, self._reach.rate_rad_s)
        ptz = self._look()
        while ptz is not None:
            ramp = self._ramp(ptz, wanted, rate)
            if self._as_trajectory:
                self._send(wanted, max(ramp.seconds, SHORTEST_S))
                await self._clock.sleep(ramp.seconds + REPEAT_S)
            else:
                await self._send_steps(wanted, ramp, is_slow=rate_rad_s is not None)
            ptz = self._look()
            if ptz is not None and self._is_there(ptz, wanted):
                self._wanted = None
                return

    async def _send_steps(self, wanted: PanTiltZoom, ramp: Ramp, *, is_slow: bool) -> None:
        while is_slow and not ramp.is_over(self._now_s + STEP_S):
            step = ramp.at(self._now_s + STEP_S)
            self._send(PanTiltZoom(*step, wanted.zoom), STEP_S)
            self._ordered = self._now_s, step
            await self._clock.sleep(STEP_S)
        self._send(wanted, STEP_S)
        self._ordered = self._now_s, (wanted.pan_rad, wanted.tilt_rad)
        await self._clock.sleep(REPEAT_S + (0.0 if is_slow else ramp.seconds))

    def _ramp(self, ptz: PanTiltZoom, wanted: PanTiltZoom, rate_rad_s: float) -> Ramp:
        start = ptz.pan_rad, ptz.tilt_rad
        # Steps that follow each other begin with the last one: the head is a little behind.
        if self._ordered is not None and self._now_s - self._ordered[0] < REPEAT_S:
            start = self._ordered[1]
        end = wanted.pan_rad, wanted.tilt_rad
        return Ramp(start, end, self._now_s, rate_rad_s, self._reach.endless)

    def _send(self, ptz: PanTiltZoom, seconds: float) -> None:
        positions = self._joints.positions(ptz)
        now = self._look()
        if self._reach.endless and now is not None:
            at = self._joints.positions(now)[Axis.PAN]
            positions[Axis.PAN] = nearest_turn(at, positions[Axis.PAN])
        values = [float(each) for each in positions.values()]
        if not self._as_trajectory:
            self._publish(Float64MultiArray(data=values))
            return
        whole_s, rest_s = divmod(seconds, 1.0)
        duration = Duration(sec=int(whole_s), nanosec=int(rest_s * 1e9))
        point = JointTrajectoryPoint(positions=values, time_from_start=duration)
        names = list(self._joints.names.values())
        self._publish(JointTrajectory(joint_names=names, points=[point]))

    def _is_there(self, ptz: PanTiltZoom, wanted: PanTiltZoom) -> bool:
        pan_rad = ptz.pan_rad - wanted.pan_rad
        if self._reach.endless:
            pan_rad = math.remainder(pan_rad, math.tau)
        zoomed = not self._joints.zooms or abs(ptz.zoom - wanted.zoom) < NEAR_ZOOM
        return zoomed and max(abs(pan_rad), abs(ptz.tilt_rad - wanted.tilt_rad)) < NEAR_RAD

    @property
    def _now_s(self) -> float:
        return self._clock.now_us() / 1e6
