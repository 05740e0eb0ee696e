"""The driver of a vehicle with Nav2: one order at a time.

Each call takes effect at once: the work for the current order, also a call in flight, is cancelled
before anything else is sent. A cancelled call may still have reached Nav2, and is cancelled there.
"""

import asyncio
from collections.abc import Mapping
from dataclasses import dataclass
from uuid import UUID

from m2pem.api import BehaviorRequest, BehaviorState, LatestTask, ResolvedValue
from m2pem.api.remember import remember
from m2pem_plugin_ros.drivers.driver import DriverSetup, Health, Order, Outcome
from m2pem_plugin_ros.drivers.nav2.client import Nav2
from m2pem_plugin_ros.drivers.nav2.errors import NavigationError
from m2pem_plugin_ros.drivers.nav2.goal_client import number_of
from m2pem_plugin_ros.drivers.nav2.tasks import (
    CANCELLED_THERE,
    TASKS,
    Nav2GoalTask,
    Nav2Task,
    TaskContext,
)
from m2pem_plugin_ros.runtime import RosError
from m2pem_plugin_ros.sensors.localization import stands

POLL_EVERY_S = 1.0
POLL_AT_LEAST_S = 0.1
"""In real seconds, however fast the clock is."""

FRESH_S = 1.0
GONE_S = 5.0
"""Real seconds. If Nav2 is silent for this time while the vehicle is received, Nav2 has ended."""

STOP_WITHIN_S = 7.0
"""The vehicle must stand this long after a stop. The timeout of the arbiter is a little longer."""

AGAIN_S = 0.2
REMEMBERED = 100


@dataclass(slots=True)
class _Drive:
    """The current order."""

    order: Order
    task: Nav2Task
    begun: bool = False
    ending: bool = False


class Nav2Driver:
    """Implements `Driver`. Goals of this driver are known by their ids, so that goals of other
    clients are never mistaken for them."""

    def __init__(self, setup: DriverSetup) -> None:
        self._setup = setup
        self._events = setup.events
        self._logger = setup.context.logger
        self._name = setup.connection.resource
        self._nav2: Nav2 | None = None
        self._drive: _Drive | None = None
        self._held = False
        self._ended: dict[UUID, Outcome] = {}
        self._work = LatestTask()
        self._polling: list[asyncio.Task[None]] = []
        self._given_up: dict[UUID, asyncio.Task[None]] = {}
        self._was_lost = False

    async def open(self) -> None:
        """Connect to Nav2.

        Raises:
            RosError: nav2_msgs is not installed.
        """
        settings = self._setup.settings
        self._nav2 = Nav2(
            self._setup.ros,
            settings.namespace,
            self._events.alive,
            self._logger,
            self._setup.context.may_send,
        )
        loop = asyncio.get_running_loop()
        self._polling = [
            loop.create_task(self._poll_nav2(self._nav2)),
            loop.create_task(self._poll_localization(self._nav2)),
        ]

    @property
    def health(self) -> Health:
        if self._nav2 is None:
            return Health()
        problem = self._setup.localization.wrong_frame or self._nav2.problem
        return Health(self._nav2.doing, not problem, (problem,) if problem else ())

    def refusal(self, request: BehaviorRequest) -> str:
        """Return why the request cannot be done; "" if it can. Behaviors that drive need an active
        Nav2."""
        if request.behavior not in TASKS:
            return f"Nav2 cannot do '{request.behavior}'"
        if self._nav2 is None:
            return "the driver is not open"
        try:
            task = self._make_task(self._nav2, Order(request, UUID(int=0), UUID(int=0)))
        except NavigationError as error:
            return error.reason
        return (self._nav2.problem if task.needs_nav2 else "") or task.refusal()

    def missing(self, request: BehaviorRequest) -> str:
        """Return which service or action of Nav2 is not there yet."""
        nav2 = self._nav2
        if nav2 is None or (request.behavior in TASKS and not TASKS[request.behavior].needs_nav2):
            return ""
        if not nav2.state:
            name = self._setup.settings.topic("bt_navigator/get_state")
            return f"an answer of the service {name}"
        try:
            task = self._make_task(nav2, Order(request, UUID(int=0), UUID(int=0)))
        except (KeyError, NavigationError):
            return ""  # a query without its parameters, or a refusal
        client = task.client if isinstance(task, Nav2GoalTask) else None
        return "" if client is None or client.there else f"the action {client.name}"

    # --- orders ---------------------------------------------------------------------------------

    def begin(self, order: Order) -> None:
        if self._nav2 is None:
            return
        try:
            task = self._make_task(self._nav2, order)
        except NavigationError as error:
            self._events.ended(order.goal, Outcome(BehaviorState.REJECTED, "REJECTED", str(error)))
            return
        self._drive = drive = _Drive(order, task)
        self._held = self._was_lost = False
        self._work.replace(lambda: self._run(drive))

    def end(self, goal: UUID) -> None:
        drive, nav2 = self._drive, self._nav2
        if drive is not None and drive.order.goal == goal:
            if not drive.ending:
                drive.ending = True
                self._work.replace(lambda: self._stop_for(drive))
            return
        outcome = self._ended.get(goal, Outcome(BehaviorState.CANCELLED))
        active = nav2 is not None and any(
            number_of(goal, each) is not None for each in nav2.own_goals()
        )
        if nav2 is None or not (active or (self._was_lost and goal not in self._ended)):
            self._events.ended(goal, outcome)
            return
        if goal in self._given_up:
            return
        task = self._work.add(self._cancel_old(nav2, goal, outcome))
        self._given_up[goal] = task
        task.add_done_callback(lambda _: self._given_up.pop(goal, None))

    def adjust(self, goal: UUID, parameters: Mapping[str, ResolvedValue]) -> None:
        if self._drive is not None and self._drive.order.goal == goal:
            self._drive.task.adjust(parameters)

    def hold(self) -> None:
        """Cancel the goals at Nav2, and keep the order."""
        drive = self._drive
        if drive is not None and drive.ending:
            return  # it is being stopped already
        if drive is not None:
            drive.task.held()
        self._held = True
        self._work.replace(lambda: self._stand(drive))

    def resume(self) -> None:
        """Send the rest of the order to Nav2."""
        drive, held = self._drive, self._held
        self._held = False
        if drive is not None and held:
            self._work.replace(lambda: self._run(drive))
        elif held:
            self._work.cancel()  # Nav2 may still be waited for, to be stopped then

    async def query(self, order: Order) -> Outcome:
        """Find the goal by its id among those that Nav2 reports."""
        if self._nav2 is None:
            return Outcome(BehaviorState.UNKNOWN, reason="the driver is not open")
        if order.request.behavior not in TASKS:
            if self._nav2.was_cancelled(order.goal):
                return CANCELLED_THERE
            # An active goal is found when the order is sent again, with all parameters.
            return Outcome(
                BehaviorState.UNKNOWN, reason="the parameters of the behavior are not known"
            )
        try:
            task = self._make_task(self._nav2, order)
            outcome = await task.query()
        except (NavigationError, RosError) as error:
            return Outcome(BehaviorState.UNKNOWN, reason=str(error))
        if outcome.state is BehaviorState.RUNNING:
            self._drive = drive = _Drive(order, task)
            self._held = False
            self._work.replace(lambda: self._run(drive))
        return outcome

    def claim(self, run: UUID, epoch: int) -> None:
        """Do nothing: Nav2 knows no epochs."""

    def abandon(self) -> None:
        """Drop the order. What Nav2 still does for it is cancelled when the vehicle is received
        again."""
        self._drive = None
        self._held = False
        self._was_lost = True
        self._work.cancel()

    async def close(self) -> None:
        for task in self._polling:
            task.cancel()
        await asyncio.gather(self._work.close(), *self._polling, return_exceptions=True)

    # --- execution ------------------------------------------------------------------------------

    async def _run(self, drive: _Drive) -> None:
        try:
            await drive.task.run()
        except NavigationError as error:
            rejected = error.state is BehaviorState.REJECTED and drive.begun
            state = BehaviorState.FAILED if rejected else error.state
            await self._fail(drive, Outcome(state, error.code, error.reason))
        except RosError as error:
            await self._fail(drive, Outcome(BehaviorState.FAILED, "FAILED", str(error)))
        except asyncio.CancelledError:
            raise
        except Exception as error:  # an error of one vehicle must not block its mission
            self._logger.exception("%s: %s", self._name, drive.order.request.behavior)
            reason = f"internal error of m2pem: {type(error).__name__}: {error}"
            await self._fail(drive, Outcome(BehaviorState.FAILED, "FAILED", reason))
        else:
            self._end_drive(drive, Outcome(BehaviorState.SUCCEEDED))

    async def _stop_for(self, drive: _Drive) -> None:
        """Stop Nav2, wait until the vehicle stands, and end the order."""
        problem = ""
        try:
            await self._stop()
        except RosError as error:
            problem = str(error)
        localization, clock = self._setup.localization, self._setup.context.clock
        problem = problem or await stands(localization, clock, STOP_WITHIN_S)
        if problem:
            reason = f"the vehicle did not stop: {problem}"
            self._end_drive(drive, Outcome(BehaviorState.FAILED, "TIMEOUT", reason))
        else:
            self._end_drive(drive, Outcome(BehaviorState.CANCELLED))

    async def _stand(self, drive: _Drive | None) -> None:
        """Stop Nav2 until another call. If another client sends a goal meanwhile, the order has
        ended. Nav2 that is not there may still execute a goal of before: it is stopped when it
        is."""
        stopped, is_late = False, False
        while not stopped:
            if self._nav2 is not None and not self._nav2.is_there:
                is_late = True
                await self._pause()
                continue
            try:
                await self._stop()
                # Not all actions of one that comes late are discovered at once.
                stopped, is_late = not is_late, False
                if not stopped:
                    await self._pause()
            except RosError as error:
                self._logger.error("%s: cannot be held: %s", self._name, error)
                await self._setup.context.clock.sleep(AGAIN_S)
        while drive is not None and self._nav2 is not None:
            try:
                self._nav2.expect_no_other_client()
            except NavigationError as taken:
                self._end_drive(drive, taken.outcome)
                return
            await self._setup.context.clock.sleep(AGAIN_S)

    async def _stop(self) -> None:
        if self._nav2 is not None:
            await self._nav2.stop()

    async def _fail(self, drive: _Drive, outcome: Outcome) -> None:
        """Cancel the goals of a failed order. Goals of other clients go on."""
        if outcome.code != "TAKEN_OVER" and self._nav2 is not None:
            try:
                await self._nav2.stop_own_goals()
            except RosError as error:
                self._logger.error("%s: the vehicle does not stop: %s", self._name, error)
        self._end_drive(drive, outcome)

    async def _cancel_old(self, nav2: Nav2, goal: UUID, outcome: Outcome) -> None:
        """Cancel a goal of an earlier order, until Nav2 confirms it."""
        while True:
            try:
                if self._was_lost and not nav2.other_client():
                    # Another client may have sent goals while Nav2 was silent: cancel all.
                    await nav2.stop()
                else:
                    await nav2.stop_own_goals(lambda active: number_of(goal, active) is not None)
            except RosError as error:
                self._logger.error("%s: %s does not end: %s", self._name, goal, error)
                await self._setup.context.clock.sleep(AGAIN_S)
            else:
                break
        self._was_lost = False
        self._events.ended(goal, outcome)

    def _end_drive(self, drive: _Drive, outcome: Outcome) -> None:
        if self._drive is not drive:
            return
        self._drive = None
        remember(self._ended, drive.order.goal, outcome, REMEMBERED)
        if self._nav2 is not None:
            self._nav2.limit_speed(None)
        self._events.ended(drive.order.goal, outcome)

    def _make_task(self, nav2: Nav2, order: Order) -> Nav2Task:
        def begun() -> None:
            if self._drive is not None and self._drive.order is order:
                self._drive.begun = True
                self._events.progress(order.goal)

        return TASKS[order.request.behavior](TaskContext(self._setup, nav2, order, begun))

    # --- supervision ----------------------------------------------------------------------------

    async def _poll_nav2(self, nav2: Nav2) -> None:
        while True:
            try:
                await nav2.refresh()
                await self._check_drive(nav2)
            except RosError as error:
                self._logger.warning("%s: %s", self._name, error)
            except Exception:  # one invalid answer must not end the supervision
                self._logger.exception("%s: the check of Nav2 failed", self._name)
            await self._pause()

    async def _poll_localization(self, nav2: Nav2) -> None:
        """Report the vehicle as alive while its odometry arrives, however slowly Nav2 answers."""
        while True:
            if self._setup.localization.age_s > FRESH_S:
                nav2.ask_again()
            elif nav2.has_answered:
                self._events.alive()
            await self._pause()

    async def _pause(self) -> None:
        clock = self._setup.context.clock
        await asyncio.gather(clock.sleep(POLL_EVERY_S), asyncio.sleep(POLL_AT_LEAST_S))

    async def _check_drive(self, nav2: Nav2) -> None:
        """Cancel goals without an order, and fail the order if Nav2 has ended."""
        drive = self._drive
        if drive is None and not self._work.is_running and not self._was_lost and nav2.own_goals():
            await nav2.stop_own_goals()
        elif (
            drive is not None
            and drive.task.needs_nav2
            and not (self._held or drive.ending)
            and nav2.silent_s > GONE_S
        ):
            reason = f"Nav2 has sent no message for {GONE_S:g} s"
            self._work.replace(
                lambda: self._fail(drive, Outcome(BehaviorState.FAILED, "FAILED", reason))
            )
