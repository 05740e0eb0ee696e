"""Drives a base in the plane, one motion at a time: where it is comes in, a command goes out.

There is no clock here and nothing is waited for, so that a step can be tried for any moment. What
is not known is not driven on: without a pose that is fresh the command is zero.
"""

import math
from collections.abc import Callable
from uuid import UUID

from m2pem.api import BehaviorState
from m2pem_plugin_ros.behaviors.monitors import MARGIN, STUCK_S, FenceWatch, PoseGate, StuckWatch
from m2pem_plugin_ros.behaviors.motion import Motion
from m2pem_plugin_ros.behaviors.motion_state import (
    STAND,
    Ending,
    Place,
    Scene,
    Seen,
    Step,
    Wish,
    place_of,
    sane_twist,
)
from m2pem_plugin_ros.behaviors.parameters import LocalParameters
from m2pem_plugin_ros.behaviors.steering import Governor
from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.settings import Bounds

STALE_S = 0.5
"""A pose, and what a stick says, is gone by when it is older."""

STANDING = 0.08
"""Who moves no faster than that, in m/s and rad/s, stands."""

STOOD_S = 1.0
"""Without a twist, a base is taken to stand so long after it was told to."""

QUIET_S = 2.0
"""For so long a base that stands is told zero; then others may command it."""

STOP_WITHIN_S = 5.0
"""A base that takes so much longer than it should to stop does not stop."""

LONGEST_STEP_S = 0.5
FOUND_M = 1.0


class Pilot:
    """One base. `step` it about 20 times a second, more rarely while it is not `busy`.

    `outside_m`: how far a place is outside of where the base may be, 0 inside; everywhere if None.
    """

    def __init__(self, bounds: Bounds, outside_m: Callable[[Place], float] | None = None) -> None:
        self._bounds = bounds
        self._governor = Governor(bounds)
        self._gate = PoseGate(max(bounds.speed_m_s, bounds.reverse_m_s))
        self._stuck = StuckWatch()
        self._fence = FenceWatch(outside_m or (lambda _: 0.0))
        self._goal: UUID | None = None
        self._motion: Motion | None = None
        self._ending: Ending | None = None
        self._held = False
        self._wished = STAND
        self._stopping_s = 0.0
        self._still_s = 0.0
        self._quiet_s = QUIET_S
        self._last_s: float | None = None
        self._driven_from: Pose | None = None

    # --- what may be asked ----------------------------------------------------------------------

    @property
    def goal(self) -> UUID | None:
        """What it does, or is being stopped from."""
        return self._goal

    @property
    def motion(self) -> Motion | None:
        """How it does that."""
        return self._motion

    @property
    def target(self) -> str:
        """The vehicle that it must be shown, or ""."""
        return self._motion.target if self._motion is not None else ""

    @property
    def held(self) -> bool:
        """Whether it stands until `resume`."""
        return self._held

    @property
    def busy(self) -> bool:
        """Whether it commands the base, if only to stand."""
        return self._goal is not None or self._quiet_s < QUIET_S

    # --- what may be told -----------------------------------------------------------------------

    def begin(self, goal: UUID, motion: Motion) -> None:
        """Do this in place of what it does, without a stop between."""
        self._goal, self._motion, self._ending = goal, motion, None
        self._held = False
        self._wished = STAND
        self._driven_from = None
        self._fence.forget()
        self._speak()

    def end(self, goal: UUID) -> None:
        """Stop, if this is what it does; the ending comes when it stands."""
        if goal == self._goal and self._ending is None:
            self._end_with(Ending(BehaviorState.CANCELLED))

    def stop_for(self, goal: UUID) -> None:
        """Stop the base, which may still move for a goal that was dropped; the ending comes when it
        stands."""
        self._goal, self._motion, self._held = goal, None, False
        self._end_with(Ending(BehaviorState.CANCELLED))

    def fail(self, reason: str) -> None:
        """Stop, and let what it does fail."""
        if self._goal is not None and self._ending is None:
            self._end_with(Ending(BehaviorState.FAILED, "", reason))

    def hold(self) -> None:
        """Stand, and keep the motion with its progress."""
        self._held = True
        self._speak()

    def resume(self) -> None:
        """Go on."""
        self._held = False
        self._speak()

    def adjust(self, parameters: LocalParameters) -> None:
        """Go on with other parameters."""
        if self._motion is not None:
            self._motion.adjust(parameters)

    def drop(self) -> None:
        """Nothing is sent any more, and nothing told."""
        self._goal = self._motion = self._ending = None
        self._held = False
        self._governor.halt()
        self._quiet_s = QUIET_S

    # --- what it does ---------------------------------------------------------------------------

    def step(self, seen: Seen) -> Step:
        """The command for now, and how the motion has ended if it has."""
        dt_s = self._passed(seen.now_s)
        idle = self._goal is None or self._held
        pose = None
        if seen.age_s <= STALE_S:  # not if it is no number
            pose = self._gate.pose(seen.pose, seen.now_s - seen.age_s, strict=not idle)
        if pose is None:
            return self._blind(dt_s)
        twist = sane_twist(seen.twist)
        if not self.busy:
            self._governor.moved_by_others(twist.forward_m_s if twist is not None else 0.0)
            return Step(None)
        stands = self._stands(twist)
        wish = self._wish(seen, pose, twist, stands, dt_s)
        command = self._governor.command(wish, dt_s)
        self._watch(pose, command, wish, dt_s)
        return self._told(command, stands, dt_s)

    def _blind(self, dt_s: float) -> Step:
        busy = self.busy
        command = self._governor.halt()
        self._stuck.forget()
        return self._told(command, False, dt_s) if busy else Step(None)

    def _wish(self, seen: Seen, pose: Pose, twist: Twist | None, stands: bool, dt_s: float) -> Wish:
        motion = self._motion
        if motion is None or self._held or self._ending is not None:
            return STAND
        if self._gate.doubts:  # nothing ends, nor begins, where it may not be
            return self._wished
        if (left_by_m := self._fence.left_by_m(place_of(pose))) > 0:
            reason = f"it is {left_by_m:.1f} m outside the fleet's fence"
            self._end_with(Ending(BehaviorState.FAILED, "", reason))
            return STAND
        self._find(motion, pose, dt_s)
        scene = Scene(
            dt_s=dt_s,
            pose=pose,
            speed_m_s=self._governor.speed_m_s if twist is None else twist.forward_m_s,
            stands=stands,
            bounds=self._bounds,
            target=seen.target,
            stick=sane_twist(seen.stick) if seen.stick_age_s <= STALE_S else None,
        )
        result = motion.step(scene)
        if isinstance(result, Ending):
            self._end_with(result)
            result = STAND
        self._wished = result
        return result

    def _find(self, motion: Motion, pose: Pose, dt_s: float) -> None:
        """Tell the motion if it did not drive here itself."""
        before, self._driven_from = self._driven_from, pose
        if before is None:
            return
        moved = math.dist(place_of(before), place_of(pose))
        if moved > FOUND_M + MARGIN * self._bounds.speed_m_s * dt_s:
            motion.found_at(place_of(pose), moved)

    def _watch(self, pose: Pose, command: Twist, wish: Wish, dt_s: float) -> None:
        steered = self._motion is not None and self._motion.steered
        if not steered or self._held or self._ending is not None or not wish.moves:
            self._stuck.forget()
        elif self._stuck.stuck(pose, command, dt_s):
            reason = f"it was told to move for {STUCK_S:g} s, and has not moved"
            self._end_with(Ending(BehaviorState.FAILED, "ROUTE_BLOCKED", reason))

    def _told(self, command: Twist, stands: bool, dt_s: float) -> Step:
        zero = command.forward_m_s == 0.0 and command.yaw_rad_s == 0.0
        self._still_s = self._still_s + dt_s if zero else 0.0
        silent = self._quiet_s >= QUIET_S
        self._quiet_s = self._quiet_s + dt_s if zero else 0.0
        twist = None if silent and zero else command
        goal, ending = self._goal, self._ending
        if ending is None:
            return Step(twist)
        self._stopping_s += dt_s
        bound = self._bounds.speed_m_s / self._bounds.acceleration_m_s2 + STOP_WITHIN_S
        if not (stands and zero):
            if self._stopping_s < bound:
                return Step(twist)
            if ending.state in (BehaviorState.CANCELLED, BehaviorState.SUCCEEDED):
                reason = f"it is not known to stand {bound:g} s after it was told to"
                ending = Ending(BehaviorState.FAILED, "TIMEOUT", reason)
        self._goal = self._motion = self._ending = None
        return Step(twist, goal, ending)

    def _stands(self, twist: Twist | None) -> bool:
        if twist is None:
            return self._still_s >= STOOD_S
        return abs(twist.forward_m_s) < STANDING and abs(twist.yaw_rad_s) < STANDING

    def _end_with(self, ending: Ending) -> None:
        self._ending = ending
        self._stopping_s = 0.0
        self._speak()

    def _speak(self) -> None:
        self._quiet_s = 0.0
        self._stuck.forget()

    def _passed(self, now_s: float) -> float:
        """Since the last step; a pause of the program is not a long step."""
        before, self._last_s = self._last_s, now_s
        return 0.0 if before is None else max(0.0, min(LONGEST_STEP_S, now_s - before))
