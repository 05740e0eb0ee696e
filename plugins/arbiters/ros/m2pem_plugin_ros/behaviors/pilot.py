"""The pilot of a plain base: runs one motion at a time; poses come in, commands go out.

It has no clock and never waits, so that a step can be tested for any time. Without a recent pose,
the command is zero.
"""

import math
from collections.abc import Callable
from uuid import UUID

from m2pem.api import BehaviorState
from m2pem_plugin_ros.behaviors.monitors import (
    MARGIN,
    FenceMonitor,
    PoseFilter,
    StuckMonitor,
)
from m2pem_plugin_ros.behaviors.motion import Motion
from m2pem_plugin_ros.behaviors.motion_state import (
    STANDSTILL,
    DesiredMotion,
    Ending,
    MotionState,
    Observation,
    Place,
    Step,
    position_of,
    sane_twist,
)
from m2pem_plugin_ros.behaviors.parameters import LocalParameters
from m2pem_plugin_ros.behaviors.steering import VelocityLimiter
from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.settings import Bounds

STALE_S = 0.5
"""Older poses and older messages of the joystick are not used."""

STANDING = 0.08
"""A base that moves more slowly than this, in m/s and rad/s, stands."""

STOOD_S = 1.0
"""A base without odometry twist counts as standing this long after the command to stop."""

QUIET_S = 2.0
"""After this time of zero commands to a base that stands, nothing more is published."""

STOP_WITHIN_S = 5.0
"""A base that needs this much longer to stop than its acceleration allows does not stop."""

LONGEST_STEP_S = 0.5
FOUND_M = 1.0


class Pilot:
    """The pilot of one base. Call `step` 20 times a second, or less often while it is not `busy`.

    `outside_m` returns the distance of a position from the permitted area, 0 inside. None: there is
    no fence.
    """

    def __init__(self, bounds: Bounds, outside_m: Callable[[Place], float] | None = None) -> None:
        self._bounds = bounds
        self._limiter = VelocityLimiter(bounds)
        self._gate = PoseFilter(max(bounds.speed_m_s, bounds.reverse_m_s))
        self._stuck = StuckMonitor()
        self._fence = FenceMonitor(outside_m or (lambda _: 0.0))
        self.goal: UUID | None = None
        """The goal that the base is driven for, or is being stopped for."""
        self.motion: Motion | None = None
        self._ending: Ending | None = None
        self.held = False
        """Whether the base stands until `resume`."""
        self._desired = STANDSTILL
        self._stopping_s = 0.0
        self._still_s = 0.0
        self._quiet_s = QUIET_S
        self._last_s: float | None = None
        self._driven_from: Pose | None = None

    # --- requests -------------------------------------------------------------------------------

    @property
    def target(self) -> str:
        """The vehicle whose state the motion needs, or ""."""
        return self.motion.target if self.motion is not None else ""

    @property
    def busy(self) -> bool:
        """Whether the pilot publishes commands."""
        return self.goal is not None or self._quiet_s < QUIET_S

    # --- commands -------------------------------------------------------------------------------

    def begin(self, goal: UUID, motion: Motion) -> None:
        """Start a motion in place of the current one, without a stop in between."""
        self.goal, self.motion, self._ending = goal, motion, None
        self.held = False
        self._desired = STANDSTILL
        self._driven_from = None
        self._fence.reset()
        self._resume_publishing()

    def end(self, goal: UUID) -> None:
        """Stop the motion of a goal. The ending is reported when the base stands."""
        if goal == self.goal and self._ending is None:
            self._end_with(Ending(BehaviorState.CANCELLED))

    def stop_for(self, goal: UUID) -> None:
        """Stop a base that may still move for a goal that was dropped. The ending is reported when
        it stands."""
        self.goal, self.motion, self.held = goal, None, False
        self._end_with(Ending(BehaviorState.CANCELLED))

    def fail(self, reason: str) -> None:
        """Stop the base, and let its goal fail."""
        if self.goal is not None and self._ending is None:
            self._end_with(Ending(BehaviorState.FAILED, "", reason))

    def hold(self) -> None:
        """Stop the base. The motion keeps its progress."""
        self.held = True
        self._resume_publishing()

    def resume(self) -> None:
        """Continue the motion."""
        self.held = False
        self._resume_publishing()

    def adjust(self, parameters: LocalParameters) -> None:
        """Change parameters of the motion."""
        if self.motion is not None:
            self.motion.adjust(parameters)

    def drop(self) -> None:
        """Publish and report nothing more."""
        self.goal = self.motion = self._ending = None
        self.held = False
        self._limiter.halt()
        self._quiet_s = QUIET_S

    # --- steps --------------------------------------------------------------------------------

    def step(self, seen: Observation) -> Step:
        """Return the command, and how the motion has ended, if it has."""
        dt_s = self._passed(seen.now_s)
        idle = self.goal is None or self.held
        pose = None
        if seen.age_s <= STALE_S:  # False for NaN
            pose = self._gate.pose(seen.pose, seen.now_s - seen.age_s, strict=not idle)
        if pose is None:
            return self._blind(dt_s)
        twist = sane_twist(seen.twist)
        if not self.busy:
            self._limiter.moved_by_others(twist.forward_m_s if twist is not None else 0.0)
            return Step(None)
        stands = self._stands(twist)
        desired = self._desired_motion(seen, pose, twist, stands, dt_s)
        command = self._limiter.command(desired, dt_s)
        self._check_stuck(pose, command, desired, dt_s)
        return self._step_result(command, stands, dt_s)

    def _blind(self, dt_s: float) -> Step:
        busy = self.busy
        command = self._limiter.halt()
        self._stuck.reset()
        return self._step_result(command, False, dt_s) if busy else Step(None)

    def _desired_motion(
        self, seen: Observation, pose: Pose, twist: Twist | None, stands: bool, dt_s: float
    ) -> DesiredMotion:
        motion = self.motion
        if motion is None or self.held or self._ending is not None:
            return STANDSTILL
        if self._gate.doubts:  # outside the fence no motion ends or begins
            return self._desired
        if (left_by_m := self._fence.left_by_m(position_of(pose))) > 0:
            reason = f"it is {left_by_m:.1f} m outside the fleet's fence"
            self._end_with(Ending(BehaviorState.FAILED, "", reason))
            return STANDSTILL
        self._check_jump(motion, pose, dt_s)
        state = MotionState(
            dt_s=dt_s,
            pose=pose,
            speed_m_s=self._limiter.speed_m_s if twist is None else twist.forward_m_s,
            stands=stands,
            bounds=self._bounds,
            target=seen.target,
            joystick=sane_twist(seen.joystick) if seen.joystick_age_s <= STALE_S else None,
        )
        result = motion.step(state)
        if isinstance(result, Ending):
            self._end_with(result)
            result = STANDSTILL
        self._desired = result
        return result

    def _check_jump(self, motion: Motion, pose: Pose, dt_s: float) -> None:
        """Report to the motion a position that the base did not drive to."""
        before, self._driven_from = self._driven_from, pose
        if before is None:
            return
        moved = math.dist(position_of(before), position_of(pose))
        if moved > FOUND_M + MARGIN * self._bounds.speed_m_s * dt_s:
            motion.found_at(position_of(pose), moved)
            self._stuck.reset()

    def _check_stuck(self, pose: Pose, command: Twist, desired: DesiredMotion, dt_s: float) -> None:
        steered = self.motion is not None and self.motion.steered
        if not steered or self.held or self._ending is not None or not desired.moves:
            self._stuck.reset()
        elif reason := self._stuck.stuck(pose, command, dt_s):
            self._end_with(Ending(BehaviorState.FAILED, "ROUTE_BLOCKED", reason))

    def _step_result(self, command: Twist, stands: bool, dt_s: float) -> Step:
        zero = command.forward_m_s == 0.0 and command.yaw_rad_s == 0.0
        self._still_s = self._still_s + dt_s if zero else 0.0
        silent = self._quiet_s >= QUIET_S
        self._quiet_s = self._quiet_s + dt_s if zero else 0.0
        twist = None if silent and zero else command
        goal, ending = self.goal, self._ending
        if ending is None:
            return Step(twist)
        self._stopping_s += dt_s
        bound = self._bounds.speed_m_s / self._bounds.acceleration_m_s2 + STOP_WITHIN_S
        if not (stands and zero):
            if self._stopping_s < bound:
                return Step(twist)
            if ending.state in (BehaviorState.CANCELLED, BehaviorState.SUCCEEDED):
                reason = f"it has not stopped {bound:g} s after the command to stop"
                ending = Ending(BehaviorState.FAILED, "TIMEOUT", reason)
        self.goal = self.motion = self._ending = None
        return Step(twist, goal, ending)

    def _stands(self, twist: Twist | None) -> bool:
        if twist is None:
            return self._still_s >= STOOD_S
        return abs(twist.forward_m_s) < STANDING and abs(twist.yaw_rad_s) < STANDING

    def _end_with(self, ending: Ending) -> None:
        self._ending = ending
        self._stopping_s = 0.0
        self._resume_publishing()

    def _resume_publishing(self) -> None:
        self._quiet_s = 0.0
        self._stuck.reset()

    def _passed(self, now_s: float) -> float:
        """Return the time since the last step. A pause of the program does not count as a long
        step."""
        before, self._last_s = self._last_s, now_s
        return 0.0 if before is None else max(0.0, min(LONGEST_STEP_S, now_s - before))
