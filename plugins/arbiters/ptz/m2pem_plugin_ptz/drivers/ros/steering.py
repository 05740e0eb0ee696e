"""Moves the joints of a head: what is published, when, until it is there."""

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
from m2pem_plugin_ptz.gimbal import Look, Ramp, Reach

STEP_S = 0.1
"""Joints that know no speed are given their way in steps of so long."""

REPEAT_S = 1.0
"""A head that is not there after so long, and longer than it needs, is told again: its controller
may have begun to listen only now."""

SHORTEST_S = 0.1
"""No way takes less."""

NEAR_RAD, NEAR_ZOOM = math.radians(0.3), 0.02

Job: TypeAlias = Callable[[], Coroutine[Any, Any, None]]
Publish: TypeAlias = Callable[[object], None]


class Steering:
    """`look`: where the head looks, as it said last; `publish`: of a trajectory, or of positions
    (`as_trajectory` False)."""

    def __init__(
        self,
        joints: Joints,
        reach: Reach,
        clock: Clock,
        look: Callable[[], Look | None],
        publish: Publish,
        *,
        as_trajectory: bool,
    ) -> None:
        self._joints = joints
        self._reach = reach
        self._clock = clock
        self._look = look
        self._publish = publish
        self._as_trajectory = as_trajectory
        self._wanted: Look | None = None
        self._ordered: tuple[float, tuple[float, float]] | None = None
        self._job: asyncio.Task[None] | None = None

    def point(self, pan_rad: float, tilt_rad: float, rate_rad_s: float | None) -> None:
        """Turn there, with the zoom as it is or is to be."""
        look = self._look()
        if look is not None:
            zoom = self._wanted.zoom if self._wanted is not None else look.zoom
            self._go(Look(pan_rad, tilt_rad, zoom), rate_rad_s)

    def zoom(self, level: float) -> None:
        """Zoom there, and turn on to where it is to look."""
        look = self._look()
        if look is not None:
            self._go(replace(self._wanted or look, zoom=level), None)

    def halt(self) -> None:
        """Stay as it is."""
        look = self._look()
        self._cancel()
        self._wanted, self._ordered = None, None
        if look is not None:
            self._send(look, SHORTEST_S)

    async def close(self) -> None:
        """Send nothing more."""
        job = self._job
        self._cancel()
        if job is not None:
            await asyncio.gather(job, return_exceptions=True)

    # --- inside ---------------------------------------------------------------------------------

    def _go(self, wanted: Look, rate_rad_s: float | None) -> None:
        self._cancel()
        self._wanted = wanted
        self._job = asyncio.get_running_loop().create_task(self._turn_to(wanted, rate_rad_s))

    def _cancel(self) -> None:
        if self._job is not None:
            self._job.cancel()
            self._job = None

    async def _turn_to(self, wanted: Look, rate_rad_s: float | None) -> None:
        rate = min(rate_rad_s or self._reach.rate_rad_s, self._reach.rate_rad_s)
        look = self._look()
        while look is not None:
            ramp = self._ramp(look, wanted, rate)
            if self._as_trajectory:
                self._send(wanted, max(ramp.seconds, SHORTEST_S))
                await self._clock.sleep(ramp.seconds + REPEAT_S)
            else:
                await self._lead(wanted, ramp, is_slow=rate_rad_s is not None)
            look = self._look()
            if look is not None and self._is_there(look, wanted):
                self._wanted = None
                return

    async def _lead(self, wanted: Look, ramp: Ramp, *, is_slow: bool) -> None:
        while is_slow and not ramp.is_over(self._now_s + STEP_S):
            step = ramp.at(self._now_s + STEP_S)
            self._send(Look(*step, wanted.zoom), STEP_S)
            self._ordered = self._now_s, step
            await self._clock.sleep(STEP_S)
        self._send(wanted, STEP_S)
        self._ordered = self._now_s, (wanted.pan_rad, wanted.tilt_rad)
        await self._clock.sleep(REPEAT_S + (0.0 if is_slow else ramp.seconds))

    def _ramp(self, look: Look, wanted: Look, rate_rad_s: float) -> Ramp:
        start = look.pan_rad, look.tilt_rad
        # Steps that follow each other begin with the last one: the head is a little behind.
        if self._ordered is not None and self._now_s - self._ordered[0] < REPEAT_S:
            start = self._ordered[1]
        end = wanted.pan_rad, wanted.tilt_rad
        return Ramp(start, end, self._now_s, rate_rad_s, self._reach.endless)

    def _send(self, look: Look, seconds: float) -> None:
        positions = self._joints.positions(look)
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

    def _is_there(self, look: Look, wanted: Look) -> bool:
        pan_rad = look.pan_rad - wanted.pan_rad
        if self._reach.endless:
            pan_rad = math.remainder(pan_rad, math.tau)
        zoomed = not self._joints.zooms or abs(look.zoom - wanted.zoom) < NEAR_ZOOM
        return zoomed and max(abs(pan_rad), abs(look.tilt_rad - wanted.tilt_rad)) < NEAR_RAD

    @property
    def _now_s(self) -> float:
        return self._clock.now_us() / 1e6
