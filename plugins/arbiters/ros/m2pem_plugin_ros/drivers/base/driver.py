"""Drives a plain base: odometry comes in, velocities go out, about 20 times a second.

Nothing on the vehicle knows of behaviors. So a goal is known only to the driver that was given it,
and the base is left standing when that driver ends.
"""

import asyncio
import contextlib
import math
from collections import OrderedDict
from collections.abc import Mapping
from uuid import UUID

from m2pem.api import (
    ArbiterContext,
    Area,
    BehaviorRequest,
    BehaviorState,
    Clock,
    Fence,
    GeoPosition,
    LinkState,
    ResolvedValue,
    ResourceId,
    VehicleState,
)
from m2pem_plugin_ros.behaviors import (
    STALE_S,
    STANDING,
    LocalParameters,
    Motion,
    Pilot,
    RefusedError,
    Seen,
    Step,
    Target,
    Teleop,
    make_motion,
)
from m2pem_plugin_ros.behaviors.motion_state import Place
from m2pem_plugin_ros.drivers.base.topics import CommandTopic, StickTopic
from m2pem_plugin_ros.drivers.driver import Health, Order, Outcome, Seat
from m2pem_plugin_ros.frames import to_geodetic, to_local
from m2pem_plugin_ros.pose import Pose, Twist, bow_rad

STEP_S = 0.05
IDLE_STEP_S = 0.2
"""How often it is stepped while it drives, and while it does not."""

OTHERS_EVERY_S = 1.0
"""How often it is looked whether somebody else commands the base too."""

POSE_WITHIN_S = 2.0
"""For so long a pose is waited for when it is to be told how a vehicle stands to a goal."""

FARTHEST_M = 100_000.0


class BaseDriver:
    """Implements `Driver` for a base that takes velocities (docs/ros.md, "A plain base")."""

    def __init__(self, seat: Seat) -> None:
        self._seat = seat
        self._loop = asyncio.get_running_loop()
        self._pace = Pace(seat.context.clock)
        self._name = seat.connection.resource
        self._bounds = seat.settings.bounds
        self._surroundings = Surroundings(seat.context, seat.connection.fence)
        self._pilot = Pilot(self._bounds, self._surroundings.outside_m)
        self._ended = EndedGoals()
        self._progress_told: UUID | None = None
        self._interrupted: UUID | None = None
        self._warned: UUID | None = None
        self._looked_s = -math.inf
        self._trouble = ""
        self._task: asyncio.Task[None] | None = None

    async def open(self) -> None:
        """Listen, and be ready to drive."""
        self._commands = CommandTopic(self._seat.ros, self._seat.settings)
        self._stick = StickTopic(self._seat.ros, self._seat.settings)
        self._task = self._loop.create_task(self._drive())

    @property
    def health(self) -> Health:
        """Ready as long as odometry comes."""
        where = self._seat.localization
        reasons: tuple[str, ...] = ()
        if where.pose is None:
            reasons = ("its position is not known yet",)
        elif not self._is_fresh():
            reasons = (f"odometry is {where.age_s:.1f} s old: it stands until it is heard again",)
        return Health(self._mode(), not reasons, reasons)

    # --- orders ---------------------------------------------------------------------------------

    def refusal(self, request: BehaviorRequest) -> str:
        """What a plain base cannot do, or not from where it is."""
        pose = self._seat.localization.pose
        if pose is None:
            settings = self._seat.settings
            topic = settings.topic(settings.topics.odom)
            return f"its position is not known yet: no odometry was heard on {topic}"
        try:
            motion = self._motion(request)
        except RefusedError as error:
            return str(error)
        if motion.target and self._surroundings.vehicle(motion.target) is None:
            return f"parameter 'target': {motion.target} has not been heard"
        here = (pose.east_m, pose.north_m)
        for place in motion.places:
            if math.dist(here, place) > FARTHEST_M:
                away_km = math.dist(here, place) / 1000
                return f"it is to go {away_km:.0f} km; at most {FARTHEST_M / 1000:g} km are driven"
        return ""

    def begin(self, order: Order) -> None:
        """Drive so from the next step on."""
        if order.goal == self._pilot.goal:
            return
        try:
            motion = self._motion(order.request)
        except RefusedError as error:
            outcome = Outcome(BehaviorState.REJECTED, "REJECTED", str(error))
            self._loop.call_soon(self._tell_ended, order.goal, outcome)
            return
        if order.goal == self._interrupted:
            motion.take_up()
        self._pilot.begin(order.goal, motion)

    def end(self, goal: UUID) -> None:
        """Stop, and tell when it stands; at once if the base is driven for another goal.

        A base that nobody drives may still move: its link was lost, or its program has ended.
        """
        if goal == self._pilot.goal:
            self._pilot.end(goal)
            return
        ended = self._ended.outcome(goal)
        if ended is None and self._pilot.goal is None:
            self._pilot.stop_for(goal)
            return
        if ended is None:
            reason = "the base was not driven for it any more"
            ended = Outcome(BehaviorState.CANCELLED, "", reason)
        self._loop.call_soon(self._tell_ended, goal, ended)

    def adjust(self, goal: UUID, parameters: Mapping[str, ResolvedValue]) -> None:
        """Speed; `tolerance` of goto; `offset` and `bearing` of follow."""
        if goal == self._pilot.goal:
            self._pilot.adjust(self._local(parameters))

    def hold(self) -> None:
        """Stand, and keep the goal."""
        self._pilot.hold()

    def resume(self) -> None:
        """Go on with it."""
        self._pilot.resume()

    async def look(self, order: Order) -> Outcome:
        """A goal of an earlier process is not known here: then only where the base stands tells,
        and only if it can. If it is begun once more, it goes on from there."""
        if order.goal == self._pilot.goal:
            return Outcome(BehaviorState.RUNNING)
        ended = self._ended.outcome(order.goal)
        if ended is not None:
            return ended
        deadline_s = self._pace.now_s + POSE_WITHIN_S
        while not self._is_fresh() and self._pace.now_s < deadline_s:
            await self._pace.wait(STEP_S)
        pose, twist = self._seat.localization.pose, self._seat.localization.twist
        if pose is not None and self._is_fresh() and _stands(twist):
            with contextlib.suppress(RefusedError):
                if self._motion(order.request).ends_at(pose):
                    return Outcome(BehaviorState.SUCCEEDED)
        self._interrupted = order.goal
        return Outcome(BehaviorState.UNKNOWN, "", "nobody has driven the base meanwhile")

    def forget(self) -> None:
        """It is driven for nothing any more."""
        self._pilot.drop()

    async def close(self) -> None:
        """Let go; a base that is driven is left standing."""
        task, self._task = self._task, None
        if task is None:
            return
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        if self._pilot.busy:
            self._pilot.drop()
            await self._commands.stop()

    # --- driving --------------------------------------------------------------------------------

    async def _drive(self) -> None:
        while True:
            try:
                self._step()
            except Exception as error:  # a bug must not leave a base on its way
                self._broken(error)
            await self._pace.wait(STEP_S if self._pilot.busy else IDLE_STEP_S)

    def _step(self) -> None:
        where = self._seat.localization
        age_s = self._pace.forgive(where.age_s, STALE_S)
        step = self._pilot.step(
            Seen(
                now_s=self._pace.now_s,
                pose=where.pose,
                twist=where.twist,
                age_s=age_s,
                target=self._surroundings.vehicle(self._pilot.target),
                stick=self._stick.twist,
                stick_age_s=self._stick.age_s,
            )
        )
        if step.twist is not None:
            self._commands.send(step.twist)
            self._look_for_others()
        if age_s <= STALE_S and where.pose is not None:
            self._seat.told.heard()
            self._tell_progress()
        self._tell(step)

    def _tell(self, step: Step) -> None:
        if step.goal is not None and step.ending is not None:
            ending = step.ending
            outcome = Outcome(ending.state, ending.code, ending.reason)
            self._ended.add(step.goal, outcome)
            self._tell_ended(step.goal, outcome)

    def _tell_progress(self) -> None:
        goal = self._pilot.goal
        if goal is not None and goal != self._progress_told:
            self._progress_told = goal
            self._seat.told.progress(goal)

    def _tell_ended(self, goal: UUID, outcome: Outcome) -> None:
        self._seat.told.ended(goal, outcome)

    def _broken(self, error: Exception) -> None:
        trouble = f"m2pem is wrong: {type(error).__name__}: {error}"
        if trouble != self._trouble:
            self._trouble = trouble
            self._seat.context.logger.error("%s: %s", self._name, trouble, exc_info=error)
        self._pilot.fail(trouble)
        if self._pilot.busy:
            self._commands.send(Twist())

    def _look_for_others(self) -> None:
        """Two who command one base make it do what neither wants."""
        goal, now_s = self._pilot.goal, self._pace.now_s
        if goal is None or goal == self._warned or now_s - self._looked_s < OTHERS_EVERY_S:
            return
        self._looked_s = now_s
        if others := self._commands.others():
            self._warned = goal
            self._seat.context.logger.warning(
                "%s: %d others publish on %s while m2pem drives the base",
                self._name,
                others,
                self._commands.name,
            )

    # --- what is known --------------------------------------------------------------------------

    def _is_fresh(self) -> bool:
        return self._pace.forgive(self._seat.localization.age_s, STALE_S) <= STALE_S

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


KEPT = 1000


class EndedGoals:
    """The latest of them."""

    def __init__(self) -> None:
        self._outcomes: OrderedDict[UUID, Outcome] = OrderedDict()

    def add(self, goal: UUID, outcome: Outcome) -> None:
        """One more; the oldest goes when there are too many."""
        self._outcomes[goal] = outcome
        if len(self._outcomes) > KEPT:
            self._outcomes.popitem(last=False)

    def outcome(self, goal: UUID) -> Outcome | None:
        """How a goal has ended; None: it is not known here."""
        return self._outcomes.get(goal)


LEAST_S = 0.02
"""Real seconds between two commands, however fast the clock is."""

PATIENCE_S = 0.5
"""Real seconds in which a message may be late, for no other reason than that computers are slow."""


class Pace:
    """Belongs to the running event loop."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._loop = asyncio.get_running_loop()
        self._began_s = self.now_s
        self._real_began_s = self._loop.time()

    @property
    def now_s(self) -> float:
        """Seconds of the clock."""
        return self._clock.now_us() / 1e6

    async def wait(self, seconds: float) -> None:
        """For so many seconds of the clock, and LEAST_S real ones at least."""
        since = self._loop.time()
        await self._clock.sleep(seconds)
        rest = LEAST_S - (self._loop.time() - since)
        if rest > 0:
            await asyncio.sleep(rest)

    def forgive(self, age_s: float, stale_s: float) -> float:
        """An age of the clock, but no more than `stale_s` of what has just come in real time."""
        real_s = self._loop.time() - self._real_began_s
        speed = (self.now_s - self._began_s) / real_s if real_s > LEAST_S else 1.0
        return min(age_s, stale_s) if age_s <= PATIENCE_S * speed else age_s


class Surroundings:
    """As the fleet's bus, origin and fence say."""

    def __init__(self, context: ArbiterContext, fence: Area | None = None) -> None:
        self._context = context
        self._fence = None if fence is None else Fence(fence)

    def outside_m(self, place: Place) -> float:
        """How far a place is outside the fence; 0 inside, or if there is none."""
        if self._fence is None:
            return 0.0
        position = to_geodetic(*place, 0.0, self._context.origin)
        return self._fence.outside_m((position.latitude_deg, position.longitude_deg))

    def level(self, latitude_deg: float, longitude_deg: float) -> tuple[float, float]:
        """East and north of the origin, in metres."""
        origin = self._context.origin
        east, north, _ = to_local(GeoPosition(latitude_deg, longitude_deg, origin[2]), origin)
        return east, north

    def vehicle(self, name: str) -> Target | None:
        """Another vehicle; None: it was never heard, or is not any more."""
        state = self._context.bus.latest(ResourceId(name)) if name else None
        if not isinstance(state, VehicleState) or state.position is None:
            return None
        if state.link is LinkState.LOST:
            return None
        east, north = self.level(state.position.latitude_deg, state.position.longitude_deg)
        east_m_s, north_m_s, _ = state.velocity_enu_m_s or (0.0, 0.0, 0.0)
        yaw = bow_rad(state)
        age_s = max(0.0, (self._context.clock.now_us() - state.time_us) / 1e6)
        if not math.isfinite(east + north + east_m_s + north_m_s + yaw):
            return None
        return Target(Pose(east, north, yaw), east_m_s, north_m_s, age_s)
