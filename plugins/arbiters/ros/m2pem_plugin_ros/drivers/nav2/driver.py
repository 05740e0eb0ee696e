"""A vehicle that Nav2 steers, as the arbiter drives it: one order at a time.

Whatever is asked takes effect at once: what was being done for an order, a call in flight too, is
given up, and only then something else is sent. A call that Nav2 may have heard is reckoned with.
"""

import asyncio
from collections import OrderedDict
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from uuid import UUID

from m2pem.api import BehaviorRequest, BehaviorState, ResolvedValue
from m2pem_plugin_ros.drivers.driver import Health, Order, Outcome, Seat
from m2pem_plugin_ros.drivers.nav2.client import Nav2
from m2pem_plugin_ros.drivers.nav2.errors import NavigationError, taken_over
from m2pem_plugin_ros.drivers.nav2.goal_client import number_of
from m2pem_plugin_ros.drivers.nav2.tasks import ERRANDS, Errand, Job
from m2pem_plugin_ros.runtime import RosError
from m2pem_plugin_ros.sensors.localization import stands

LOOK_EVERY_S = 1.0
LOOK_AT_MOST_EVERY_S = 0.1
"""In real seconds, however fast the clock is."""

FRESH_S = 1.0
GONE_S = 5.0
"""Real seconds. Nav2 that says nothing for so long, on a vehicle that is heard, has ended."""

STOP_WITHIN_S = 7.0
"""A vehicle that is told to stop stands by then; the arbiter waits but little longer."""

AGAIN_S = 0.2
REMEMBERED = 100


@dataclass(slots=True)
class _Drive:
    """An order that goes on."""

    order: Order
    errand: Errand
    begun: bool = False
    ending: bool = False


class Nav2Driver:
    """Implements `Driver`. Nav2's own goals are known by their ids: those of others are never
    taken for ours."""

    def __init__(self, seat: Seat) -> None:
        self._seat = seat
        self._told = seat.told
        self._logger = seat.context.logger
        self._name = seat.connection.resource
        self._nav2: Nav2 | None = None
        self._drive: _Drive | None = None
        self._held = False
        self._ended: OrderedDict[UUID, Outcome] = OrderedDict()
        self._work: set[asyncio.Task[None]] = set()
        self._looking: list[asyncio.Task[None]] = []
        self._given_up: dict[UUID, asyncio.Task[None]] = {}
        self._was_lost = False

    async def open(self) -> None:
        """Listen to Nav2, and to whether it is active.

        Raises:
            RosError: nav2_msgs is not installed.
        """
        settings = self._seat.settings
        self._nav2 = Nav2(self._seat.ros, settings.namespace, self._told.heard, self._logger)
        loop = asyncio.get_running_loop()
        self._looking = [
            loop.create_task(self._look_on(self._nav2)),
            loop.create_task(self._listen_on(self._nav2)),
        ]

    @property
    def health(self) -> Health:
        """Whether Nav2 takes goals, and what it does."""
        if self._nav2 is None:
            return Health()
        trouble = self._nav2.trouble
        return Health(self._nav2.doing, not trouble, (trouble,) if trouble else ())

    def refusal(self, request: BehaviorRequest) -> str:
        """What drives needs an active Nav2; what stands does not."""
        if request.behavior not in ERRANDS:
            return f"Nav2 cannot do '{request.behavior}'"
        if self._nav2 is None:
            return "the driver is not open"
        try:
            errand = self._errand(self._nav2, Order(request, UUID(int=0), UUID(int=0)))
        except NavigationError as error:
            return error.reason
        return (self._nav2.trouble if errand.needs_nav2 else "") or errand.refusal()

    # --- what is asked --------------------------------------------------------------------------

    def begin(self, order: Order) -> None:
        """Do this, in place of what is done."""
        if self._nav2 is None:
            return
        try:
            errand = self._errand(self._nav2, order)
        except NavigationError as error:
            self._told.ended(order.goal, Outcome(BehaviorState.REJECTED, "REJECTED", str(error)))
            return
        self._drive = drive = _Drive(order, errand)
        self._held = self._was_lost = False
        self._replace(lambda: self._run(drive))

    def end(self, goal: UUID) -> None:
        """Stop, if it does this."""
        drive, nav2 = self._drive, self._nav2
        if drive is not None and drive.order.goal == goal:
            if not drive.ending:
                drive.ending = True
                self._replace(lambda: self._stop_for(drive))
            return
        outcome = self._ended.get(goal, Outcome(BehaviorState.CANCELLED))
        active = nav2 is not None and any(number_of(goal, each) is not None for each in nav2.ours())
        if nav2 is None or not (active or (self._was_lost and goal not in self._ended)):
            self._told.ended(goal, outcome)
            return
        if goal in self._given_up:
            return
        task = asyncio.get_running_loop().create_task(self._cancel_old(nav2, goal, outcome))
        self._given_up[goal] = task
        self._work.add(task)
        task.add_done_callback(self._work.discard)
        task.add_done_callback(lambda _: self._given_up.pop(goal, None))

    def adjust(self, goal: UUID, parameters: Mapping[str, ResolvedValue]) -> None:
        """Go on with these."""
        if self._drive is not None and self._drive.order.goal == goal:
            self._drive.errand.adjust(parameters)

    def hold(self) -> None:
        """Have Nav2 do nothing, and keep the order."""
        drive = self._drive
        if drive is not None and drive.ending:
            return  # it is being stopped already
        if drive is not None:
            drive.errand.held()
        self._held = True
        self._replace(lambda: self._stand(drive))

    def resume(self) -> None:
        """Give Nav2 what is left of the order."""
        drive, held = self._drive, self._held
        self._held = False
        if drive is not None and held:
            self._replace(lambda: self._run(drive))

    async def look(self, order: Order) -> Outcome:
        """By the goal's id among those that Nav2 tells of, whoever has sent it."""
        if self._nav2 is None:
            return Outcome(BehaviorState.UNKNOWN, reason="the driver is not open")
        if order.request.behavior not in ERRANDS:
            # A goal that goes on is found when the order is given once more, and then in full.
            return Outcome(BehaviorState.UNKNOWN, reason="what it was to do is not known")
        try:
            errand = self._errand(self._nav2, order)
            outcome = await errand.look()
        except (NavigationError, RosError) as error:
            return Outcome(BehaviorState.UNKNOWN, reason=str(error))
        if outcome.state is BehaviorState.RUNNING:
            self._drive = drive = _Drive(order, errand)
            self._held = False
            self._replace(lambda: self._run(drive))
        return outcome

    def forget(self) -> None:
        """It cannot be reached. What it was given stays ours, to be ended when it is again."""
        self._drive = None
        self._held = False
        self._was_lost = True
        for task in self._work:
            task.cancel()

    async def close(self) -> None:
        """Leave the vehicle as it is."""
        tasks = [*self._work, *self._looking]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    # --- one thing at a time --------------------------------------------------------------------

    def _replace(self, work: Callable[[], Awaitable[None]]) -> None:
        before = set(self._work)
        for task in before:
            task.cancel()
        task = asyncio.get_running_loop().create_task(self._after(before, work))
        self._work.add(task)
        task.add_done_callback(self._work.discard)

    async def _after(
        self, before: set[asyncio.Task[None]], work: Callable[[], Awaitable[None]]
    ) -> None:
        if before:
            await asyncio.wait(before)
        await work()

    # --- what is done ---------------------------------------------------------------------------

    async def _run(self, drive: _Drive) -> None:
        try:
            await drive.errand.run()
        except NavigationError as error:
            rejected = error.state is BehaviorState.REJECTED and drive.begun
            state = BehaviorState.FAILED if rejected else error.state
            await self._fail(drive, Outcome(state, error.code, error.reason))
        except RosError as error:
            await self._fail(drive, Outcome(BehaviorState.FAILED, "FAILED", str(error)))
        except asyncio.CancelledError:
            raise
        except Exception as error:  # one vehicle's bug must not hang its mission
            self._logger.exception("%s: %s", self._name, drive.order.request.behavior)
            reason = f"m2pem is wrong: {type(error).__name__}: {error}"
            await self._fail(drive, Outcome(BehaviorState.FAILED, "FAILED", reason))
        else:
            self._over(drive, Outcome(BehaviorState.SUCCEEDED))

    async def _stop_for(self, drive: _Drive) -> None:
        """For the end of an order."""
        problem = ""
        try:
            await self._stop()
        except RosError as error:
            problem = str(error)
        localization, clock = self._seat.localization, self._seat.context.clock
        problem = problem or await stands(localization, clock, STOP_WITHIN_S)
        if problem:
            reason = f"it did not stop: {problem}"
            self._over(drive, Outcome(BehaviorState.FAILED, "TIMEOUT", reason))
        else:
            self._over(drive, Outcome(BehaviorState.CANCELLED))

    async def _stand(self, drive: _Drive | None) -> None:
        """Until something else is asked for. Goals that somebody else gives then are theirs."""
        stopped = False
        while not stopped:
            try:
                await self._stop()
                stopped = True
            except RosError as error:
                self._logger.error("%s: cannot be held: %s", self._name, error)
                await self._seat.context.clock.sleep(AGAIN_S)
        while drive is not None and self._nav2 is not None:
            if rival := self._nav2.rival():
                taken = taken_over(f"somebody else has given Nav2 a goal: {rival}")
                self._over(drive, Outcome(taken.state, taken.code, taken.reason))
                return
            await self._seat.context.clock.sleep(AGAIN_S)

    async def _stop(self) -> None:
        if self._nav2 is not None:
            await self._nav2.stop()

    async def _fail(self, drive: _Drive, outcome: Outcome) -> None:
        """What has failed half-way must not go on; what somebody else does is theirs."""
        if outcome.code != "TAKEN_OVER" and self._nav2 is not None:
            try:
                await self._nav2.stop_ours()
            except RosError as error:
                self._logger.error("%s: does not stop: %s", self._name, error)
        self._over(drive, outcome)

    async def _cancel_old(self, nav2: Nav2, goal: UUID, outcome: Outcome) -> None:
        """Until Nav2 has said that it does it no more."""
        while True:
            try:
                if self._was_lost and not nav2.rival():
                    # What it does may have been told while it was not heard: all is cancelled.
                    await nav2.stop()
                else:
                    await nav2.stop_ours(lambda active: number_of(goal, active) is not None)
            except RosError as error:
                self._logger.error("%s: %s does not end: %s", self._name, goal, error)
                await self._seat.context.clock.sleep(AGAIN_S)
            else:
                break
        self._was_lost = False
        self._told.ended(goal, outcome)

    def _over(self, drive: _Drive, outcome: Outcome) -> None:
        if self._drive is not drive:
            return
        self._drive = None
        self._ended[drive.order.goal] = outcome
        if len(self._ended) > REMEMBERED:
            self._ended.popitem(last=False)
        if self._nav2 is not None:
            self._nav2.limit_speed(None)
        self._told.ended(drive.order.goal, outcome)

    def _errand(self, nav2: Nav2, order: Order) -> Errand:
        def begun() -> None:
            if self._drive is not None and self._drive.order is order:
                self._drive.begun = True
                self._told.progress(order.goal)

        return ERRANDS[order.request.behavior](Job(self._seat, nav2, order, begun))

    # --- how Nav2 is ----------------------------------------------------------------------------

    async def _look_on(self, nav2: Nav2) -> None:
        while True:
            try:
                await nav2.look()
                await self._look_after(nav2)
            except RosError as error:
                self._logger.warning("%s: %s", self._name, error)
            except Exception:  # a vehicle must not go deaf because of one bad answer
                self._logger.exception("%s: Nav2 cannot be looked at", self._name)
            await self._pause()

    async def _listen_on(self, nav2: Nav2) -> None:
        """A vehicle that says where it is is heard, however long Nav2 takes to answer."""
        while True:
            if nav2.looked_at and self._seat.localization.age_s <= FRESH_S:
                self._told.heard()
            await self._pause()

    async def _pause(self) -> None:
        clock = self._seat.context.clock
        await asyncio.gather(clock.sleep(LOOK_EVERY_S), asyncio.sleep(LOOK_AT_MOST_EVERY_S))

    async def _look_after(self, nav2: Nav2) -> None:
        """What it does for nobody any more is ended; what it can do no more has failed."""
        drive = self._drive
        if drive is None and not self._work and not self._was_lost and nav2.ours():
            await nav2.stop_ours()
        elif (
            drive is not None
            and drive.errand.needs_nav2
            and not (self._held or drive.ending)
            and nav2.silent_s > GONE_S
        ):
            reason = f"Nav2 has not been heard for {GONE_S:g} s"
            self._replace(
                lambda: self._fail(drive, Outcome(BehaviorState.FAILED, "FAILED", reason))
            )
