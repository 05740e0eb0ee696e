"""Drives a plain base: reads odometry, and publishes velocities 20 times a second.

The vehicle knows nothing of behaviors. Only this driver knows a goal, and it stops the base when it
is closed.
"""

import asyncio
import contextlib
import math
from collections.abc import Mapping
from uuid import UUID

from m2pem.api import (
    ArbiterContext,
    BehaviorRequest,
    BehaviorState,
    Clock,
    Fence,
    GeoPosition,
    LinkState,
    ResolvedValue,
    ResourceId,
    VehicleState,
    known_yaw_rad,
)
from m2pem.api.latest_task import cancel_and_wait
from m2pem.api.remember import remember
from m2pem_plugin_ros.behaviors import (
    STALE_S,
    STANDING,
    LocalParameters,
    Motion,
    Observation,
    Pilot,
    RefusedError,
    Step,
    Target,
    Teleop,
    make_motion,
)
from m2pem_plugin_ros.behaviors.motion_state import Place
from m2pem_plugin_ros.drivers.base.topics import CommandTopic, TeleopTopic
from m2pem_plugin_ros.drivers.driver import DriverSetup, Health, Order, Outcome
from m2pem_plugin_ros.frames import to_geodetic, to_local
from m2pem_plugin_ros.pose import Pose, Twist

STEP_S = 0.05
IDLE_STEP_S = 0.2
"""Periods of the control loop while the base is driven, and while it is not."""

OTHERS_EVERY_S = 1.0
"""Period of the check for other publishers of commands."""

POSE_WITHIN_S = 2.0
"""`query` waits this long for a pose."""

FARTHEST_M = 100_000.0

REMEMBERED = 1000


class BaseDriver:
    """Implements `Driver` for a base that takes velocities."""

    def __init__(self, setup: DriverSetup) -> None:
        self._setup = setup
        self._loop = asyncio.get_running_loop()
        self._timer = ControlTimer(setup.context.clock)
        self._name = setup.connection.resource
        self._bounds = setup.settings.bounds
        self._surroundings = Surroundings(setup.context, setup.connection.fence)
        self._pilot = Pilot(self._bounds, self._surroundings.outside_m)
        self._ended: dict[UUID, Outcome] = {}
        self._progress_reported: UUID | None = None
        self._interrupted: UUID | None = None
        self._warned_goal: UUID | None = None
        self._checked_s = -math.inf
        self._problem = ""
        self._task: asyncio.Task[None] | None = None

    async def open(self) -> None:
        self._commands = CommandTopic(self._setup.ros, self._setup.settings)
        self._teleop = TeleopTopic(self._setup.ros, self._setup.settings)
        self._task = self._loop.create_task(self._drive())

    @property
    def health(self) -> Health:
        """The base is ready while odometry arrives."""
        where = self._setup.localization
        reasons: tuple[str, ...] = ()
        if where.wrong_frame:
            reasons = (where.wrong_frame,)
        elif where.pose is None:
            reasons = ("its position is not known yet",)
        elif not self._is_fresh():
            reasons = (
                f"odometry is {where.age_s:.1f} s old: the base stops until new odometry comes",
            )
        return Health(self._mode(), not reasons, reasons)

    # --- orders ---------------------------------------------------------------------------------

    def missing(self, request: BehaviorRequest) -> str:
        """Return which topic of the base is not there yet."""
        del request
        where, settings = self._setup.localization, self._setup.settings
        if where.pose is None and not where.wrong_frame:
            return f"odometry on {settings.topic(settings.topics.odom)}"
        return "" if self._commands.is_subscribed else f"a subscriber to {self._commands.name}"

    def refusal(self, request: BehaviorRequest) -> str:
        """Return why a plain base cannot do the request, or not from where it is; "" if it can."""
        if wrong := self._setup.localization.wrong_frame:
            return wrong
        pose = self._setup.localization.pose
        if pose is None:
            settings = self._setup.settings
            topic = settings.topic(settings.topics.odom)
            return f"its position is not known yet: no odometry on {topic}"
        try:
            motion = self._motion(request)
        except RefusedError as error:
            return str(error)
        if motion.target and self._surroundings.vehicle(motion.target) is None:
            return f"parameter 'target': {motion.target} has sent no position"
        here = (pose.east_m, pose.north_m)
        for place in motion.places:
            if math.dist(here, place) > FARTHEST_M:
                away_km = math.dist(here, place) / 1000
                most_km = FARTHEST_M / 1000
                return f"the target is {away_km:.0f} km away; at most {most_km:g} km are allowed"
        return ""

    def begin(self, order: Order) -> None:
        if order.goal == self._pilot.goal:
            return
        try:
            motion = self._motion(order.request)
        except RefusedError as error:
            outcome = Outcome(BehaviorState.REJECTED, "REJECTED", str(error))
            self._loop.call_soon(self._setup.events.ended, order.goal, outcome)
            return
        if order.goal == self._interrupted:
            motion.take_up()
        self._pilot.begin(order.goal, motion)

    def end(self, goal: UUID) -> None:
        """Stop, and report the end when the base stands; at once if it is driven for another goal.

        A base without a goal may still move: its connection was lost, or its process has ended.
        """
        if goal == self._pilot.goal:
            self._pilot.end(goal)
            return
        ended = self._ended.get(goal)
        if ended is None and self._pilot.goal is None:
            self._pilot.stop_for(goal)
            return
        if ended is None:
            reason = "the base no longer executed this goal"
            ended = Outcome(BehaviorState.CANCELLED, "", reason)
        self._loop.call_soon(self._setup.events.ended, goal, ended)

    def adjust(self, goal: UUID, parameters: Mapping[str, ResolvedValue]) -> None:
        """Change the speed, `tolerance` of goto, or `offset` and `bearing` of follow."""
        if goal == self._pilot.goal:
            self._pilot.adjust(self._local(parameters))

    def hold(self) -> None:
        self._pilot.hold()

    def resume(self) -> None:
        self._pilot.resume()

    async def query(self, order: Order) -> Outcome:
        """Return the state of a goal. A goal of an earlier process counts as done if the base
        stands at its end. If it is begun again, it continues from where the base stands."""
        if order.goal == self._pilot.goal:
            return Outcome(BehaviorState.RUNNING)
        ended = self._ended.get(order.goal)
        if ended is not None:
            return ended
        deadline_s = self._timer.now_s + POSE_WITHIN_S
        while not self._is_fresh() and self._timer.now_s < deadline_s:
            await self._timer.wait(STEP_S)
        pose, twist = self._setup.localization.pose, self._setup.localization.twist
        if pose is not None and self._is_fresh() and _stands(twist):
            with contextlib.suppress(RefusedError):
                if self._motion(order.request).ends_at(pose):
                    return Outcome(BehaviorState.SUCCEEDED)
        self._interrupted = order.goal
        return Outcome(BehaviorState.UNKNOWN, "", "the base was not commanded meanwhile")

    def claim(self, run: UUID, epoch: int) -> None:
        """Do nothing: a base knows no epochs."""

    def abandon(self) -> None:
        self._pilot.drop()

    async def close(self) -> None:
        """Stop the base if it is driven, and close."""
        task, self._task = self._task, None
        if task is None:
            return
        await cancel_and_wait(task)
        if self._pilot.busy:
            self._pilot.drop()
            await self._commands.stop()

    # --- driving --------------------------------------------------------------------------------

    async def _drive(self) -> None:
        while True:
            try:
                self._step()
            except Exception as error:  # an error must not leave the base moving
                self._broken(error)
            await self._timer.wait(STEP_S if self._pilot.busy else IDLE_STEP_S)

    def _step(self) -> None:
        where = self._setup.localization
        age_s = self._timer.forgive(where.age_s)
        step = self._pilot.step(
            Observation(
                now_s=self._timer.now_s,
                pose=where.pose,
                twist=where.twist,
                age_s=age_s,
                target=self._surroundings.vehicle(self._pilot.target),
                joystick=self._teleop.twist,
                joystick_age_s=self._teleop.age_s,
            )
        )
        if step.twist is not None and self._setup.context.may_send():
            self._commands.send(step.twist)
            self._check_for_other_publishers()
        if age_s <= STALE_S and where.pose is not None:
            self._setup.events.alive()
            self._report_progress()
        self._report_ending(step)

    def _report_ending(self, step: Step) -> None:
        if step.goal is not None and step.ending is not None:
            ending = step.ending
            outcome = Outcome(ending.state, ending.code, ending.reason)
            remember(self._ended, step.goal, outcome, REMEMBERED)
            self._setup.events.ended(step.goal, outcome)

    def _report_progress(self) -> None:
        goal = self._pilot.goal
        if goal is not None and goal != self._progress_reported:
            self._progress_reported = goal
            self._setup.events.progress(goal)

    def _broken(self, error: Exception) -> None:
        problem = f"internal error of m2pem: {type(error).__name__}: {error}"
        if problem != self._problem:
            self._problem = problem
            self._setup.context.logger.error("%s: %s", self._name, problem, exc_info=error)
        self._pilot.fail(problem)
        if self._pilot.busy:
            self._commands.send(Twist())

    def _check_for_other_publishers(self) -> None:
        """Warn if another node publishes commands for the base."""
        goal, now_s = self._pilot.goal, self._timer.now_s
        if goal is None or goal == self._warned_goal or now_s - self._checked_s < OTHERS_EVERY_S:
            return
        self._checked_s = now_s
        if others := self._commands.others():
            self._warned_goal = goal
            self._setup.context.logger.warning(
                "%s: %d others publish on %s while m2pem drives the base",
                self._name,
                others,
                self._commands.name,
            )

    # --- what is known --------------------------------------------------------------------------

    def _is_fresh(self) -> bool:
        return self._timer.forgive(self._setup.localization.age_s) <= STALE_S

    def _mode(self) -> str:
        if self._pilot.held:
            return "hold"
        if self._pilot.motion is None:
            return "standby"
        return "manual" if self._pilot.motion.name == Teleop.name else "auto"

    def _motion(self, request: BehaviorRequest) -> Motion:
        return make_motion(request.behavior, self._local(request.parameters), self._bounds)

    def _local(self, parameters: Mapping[str, ResolvedValue]) -> LocalParameters:
        return LocalParameters(parameters, self._surroundings.level, self._name)


def _stands(twist: Twist | None) -> bool:
    return (
        twist is not None and abs(twist.forward_m_s) < STANDING and abs(twist.yaw_rad_s) < STANDING
    )


LEAST_S = 0.02
"""Shortest time between two commands in real seconds, however fast the clock is."""

LATENESS_S = 0.5
"""A message may be this late in real seconds because the computer is slow."""


class ControlTimer:
    """Times the control loop by a clock that may be faster than real time."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._loop = asyncio.get_running_loop()
        self._began_s = self.now_s
        self._real_began_s = self._loop.time()

    @property
    def now_s(self) -> float:
        return self._clock.now_us() / 1e6

    async def wait(self, seconds: float) -> None:
        """Wait for so many seconds of the clock, and at least LEAST_S in real time."""
        since = self._loop.time()
        await self._clock.sleep(seconds)
        rest = LEAST_S - (self._loop.time() - since)
        if rest > 0:
            await asyncio.sleep(rest)

    def forgive(self, age_s: float) -> float:
        """Return the age, bounded by `STALE_S` if the message arrived only now in real time."""
        real_s = self._loop.time() - self._real_began_s
        speed = (self.now_s - self._began_s) / real_s if real_s > LEAST_S else 1.0
        return min(age_s, STALE_S) if age_s <= LATENESS_S * speed else age_s


class Surroundings:
    """Positions and other vehicles in the local frame, by the bus, the origin and the fence of the
    fleet."""

    def __init__(self, context: ArbiterContext, fence: Fence | None = None) -> None:
        self._context = context
        self._fence = fence

    def outside_m(self, place: Place) -> float:
        """Return how far a position is outside the fence; 0 inside, or without a fence."""
        if self._fence is None:
            return 0.0
        position = to_geodetic(*place, 0.0, self._context.origin)
        return self._fence.outside_m((position.latitude_deg, position.longitude_deg))

    def level(self, latitude_deg: float, longitude_deg: float) -> tuple[float, float]:
        """Return east and north of the origin, in metres."""
        origin = self._context.origin
        east, north, _ = to_local(GeoPosition(latitude_deg, longitude_deg, origin[2]), origin)
        return east, north

    def vehicle(self, name: str) -> Target | None:
        """Return the state of another vehicle; None if it was never received, or is lost."""
        state = self._context.bus.latest(ResourceId(name)) if name else None
        if not isinstance(state, VehicleState) or state.position is None:
            return None
        if state.link is LinkState.LOST:
            return None
        east, north = self.level(state.position.latitude_deg, state.position.longitude_deg)
        east_m_s, north_m_s, _ = state.velocity_enu_m_s or (0.0, 0.0, 0.0)
        yaw = known_yaw_rad(state)
        age_s = max(0.0, (self._context.clock.now_us() - state.time_us) / 1e6)
        if not math.isfinite(east + north + east_m_s + north_m_s + yaw):
            return None
        return Target(Pose(east, north, yaw), east_m_s, north_m_s, age_s)
