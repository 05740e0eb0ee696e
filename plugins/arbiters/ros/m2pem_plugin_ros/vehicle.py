"""One vehicle of the arbiter, or a payload with its own node: its driver, its order, and its
link."""

import asyncio
import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from functools import partial
from uuid import UUID

from m2pem.api import (
    ArbiterContext,
    BehaviorId,
    BehaviorParameters,
    BehaviorRequest,
    BehaviorState,
    BehaviorTracker,
    Connection,
    LatestTask,
    Limits,
    LinkState,
    PayloadState,
    RemainingRoute,
    ResolvedValue,
    ResourceId,
    Value,
    VehiclePosition,
    VehicleState,
    find_breach,
    stance_on,
)
from m2pem.api.remember import remember
from m2pem.errors import PluginError
from m2pem_plugin_ros.checkpoint import goal_id, run_id
from m2pem_plugin_ros.connections import VehicleConnection, VehicleSensors
from m2pem_plugin_ros.drivers.driver import (
    Discovering,
    Driver,
    DriverSetup,
    Health,
    Order,
    Outcome,
)
from m2pem_plugin_ros.evidence import SETTLE_S, contradiction
from m2pem_plugin_ros.log_throttle import LogThrottle
from m2pem_plugin_ros.settings import DriverName, Settings

QUERY_WITHIN_S = 3.0
"""Timeout of a query to the vehicle, in real time."""

FOUND_WITHIN_S = 10.0
"""A behavior waits so long for what DDS has not discovered of its vehicle, in real time."""

ASKED_WITHIN_S = 6.0
"""The same for a query, in real time; with its own timeout, it is less than an executive waits."""

LOOK_EVERY_S = 0.1

CANCEL_SHARE = 0.8
"""A cancel that takes more than this part of the cancel timeout has failed."""

RECLAIM_WITHIN_S = 5.0
"""In real time. A vehicle that has not acknowledged a CANCEL by then is also sent HOLD."""

CLOSE_WITHIN_S = 5.0
LEFT_EVERY_S = 1.0
"""Of what its node reports that is left, the newest is journaled once in that time."""

LEAST_PROGRESS_M = 1.0
"""What is left of a route that fails or is lost is reported if so much was driven since."""

REMEMBERED = 1_000
OTHERS_EVERY_S = 1.0
"""Period of the check for other publishers, in real time."""

_GOES_ON = (BehaviorState.ACCEPTED, BehaviorState.RUNNING)


@dataclass(frozen=True, slots=True)
class VehicleSetup:
    """The arguments of a vehicle."""

    connection: Connection
    settings: Settings
    context: ArbiterContext
    tracker: BehaviorTracker
    limits: Limits


class Vehicle:
    """Implements `DriverEvents`. Errors of the driver stay here, and are reported as failures."""

    def __init__(
        self,
        setup: VehicleSetup,
        ros_connection: VehicleConnection,
        make_driver: Callable[[DriverSetup], Driver],
    ) -> None:
        self.resource: ResourceId = setup.connection.resource
        self.settings = setup.settings
        self.link = LinkState.CONNECTED
        self.first_contact = asyncio.Event()
        self._context = setup.context
        self._tracker = setup.tracker
        self._limits = setup.limits
        self._ros_connection = ros_connection
        self._domain = setup.connection.domain
        self._sensors, self.endpoints = ros_connection.sensors, ros_connection.endpoints
        self._fence = setup.connection.fence
        self._log_throttle = LogThrottle(setup.context.logger, self.resource)
        self._behaviors: dict[UUID, BehaviorId] = {}
        self._runs: dict[str, BehaviorId] = {}
        self._order: Order | None = None
        self._route: RemainingRoute | None = None
        self._left: Mapping[str, Value] | None = None
        self._left_us = 0
        self._adopted = False
        self._cancelled: BehaviorId = ""
        self._settling: UUID | None = None
        self._waiting: BehaviorId = ""
        self._found_by_s = 0.0
        self._is_held = False
        self._broken = ""
        self._checked_s = 0.0
        self._refusal = ""
        self._unresolved: dict[UUID, BehaviorId] = {}
        self._resolved = asyncio.Event()
        self._last_contact_us = setup.context.clock.now_us()
        self._contacts = 0
        self._fixes = 0
        self._reported: tuple[object, ...] = ()
        self._work = LatestTask()
        connection, settings, context = setup.connection, setup.settings, setup.context
        ros, localization = ros_connection.ros, self._sensors.localization
        self.driver = make_driver(
            DriverSetup(connection, settings, context, ros, localization, self)
        )

    @property
    def doing(self) -> BehaviorId | None:
        """The behavior that the vehicle was given and that goes on. A behavior of the vehicle that
        only uses a payload is not the payload's."""
        holder = self._tracker.holder(self.resource)
        is_own = self._order is not None and self._order.request.id == holder
        return holder if is_own else None

    # --- calls of the arbiter -------------------------------------------------------------------

    async def take(self, request: BehaviorRequest, *, query_first: bool = False) -> None:
        """Start a request in place of the current one. `query_first`: it may have been started
        before."""
        order = self._order_for(request)
        self._keep(order)
        self._publish_targets()
        self._waiting, self._is_held = "", False
        if self._is_to_be_found(request):
            self._waiting = request.id
            self._work.add(self._give_when_found(order.goal, query_first=query_first))
        else:
            await self._give(order, query_first=query_first)

    async def _give_when_found(self, goal: UUID, *, query_first: bool) -> None:
        """Begin an order when its vehicle is discovered; reject it if that takes too long."""

        def order() -> Order | None:
            own = self._order
            return own if own is not None and own.goal == goal and self._waiting else None

        awaited = order()
        if awaited is None:
            return
        name, missing = awaited.request.id, self._missing(awaited.request)
        self._context.logger.warning(
            "%s: %s waits: not discovered yet: %s", self.resource, name, missing
        )
        missing = await self._until_found(awaited.request, FOUND_WITHIN_S)
        while not missing and self._is_held and order():  # noqa: ASYNC110  # resumed, or replaced
            await asyncio.sleep(LOOK_EVERY_S)
        awaited = order()
        if self._waiting == name:
            self._waiting = ""
        if awaited is None or self._cancelled == name:
            return  # it was cancelled or replaced, or the vehicle is lost
        late = f"not discovered within {FOUND_WITHIN_S:g} s: {missing}" if missing else ""
        if reason := late or self.refusal(awaited.request):
            self._order = None
            if late and goal in self._unresolved:  # it may run, and is to be ended
                self._tracker.lose(self.resource, reason)
            else:
                self._tracker.end(name, BehaviorState.REJECTED, reason=reason)
            return
        await self._give(awaited, query_first=query_first)

    async def _give(self, order: Order, *, query_first: bool) -> None:
        request = order.request
        # A plain base does nothing without commands.
        if query_first and self.settings.driver is not DriverName.BASE:
            outcome = await self.query(order)
            if self._tracker.last(request.id).state.terminal:
                return  # the vehicle was lost meanwhile, or the behavior has ended
            if outcome.state in _GOES_ON:
                self.progress(order.goal)
                if self._cancelled == request.id:
                    self._call_driver("end", lambda: self.driver.end(order.goal))
                return
            if outcome.is_end:
                self.ended(order.goal, outcome)
                return
            if self._cancelled == request.id:
                self._tracker.end(request.id, BehaviorState.CANCELLED)
                return
        self._unresolved.clear()
        if wrong := self._call_driver("begin", lambda: self.driver.begin(order)):
            self._tracker.end(request.id, BehaviorState.FAILED, reason=wrong)
        elif self._is_held:  # meanwhile
            self.hold()

    def cancel(self, behavior: BehaviorId) -> None:
        """Cancel a behavior. It fails if the vehicle does not stop in time."""
        goal = goal_id(self._context.journal, behavior)
        if self._waiting == behavior and goal not in self._unresolved:
            self._waiting, self._order = "", None
            self._tracker.end(behavior, BehaviorState.CANCELLED, reason="it was not sent yet")
            return
        self._cancelled = behavior
        self._work.add(self._fail_cancel_after_limit(behavior))
        if wrong := self._call_driver("end", lambda: self.driver.end(goal)):
            self._mark_unresolved(behavior)
            self._tracker.end(behavior, BehaviorState.FAILED, reason=wrong)

    def adjust(self, behavior: BehaviorId, parameters: Mapping[str, ResolvedValue]) -> None:
        order, goal = self._order, goal_id(self._context.journal, behavior)
        if order is not None and order.goal == goal:
            request = order.request
            merged = {**request.parameters, **parameters}
            self._order = replace(order, request=replace(request, parameters=merged))
        self._call_driver("adjust", lambda: self.driver.adjust(goal, parameters))

    def hold(self) -> None:
        """Stop the vehicle, and keep the behavior."""
        self._is_held = True
        self._call_driver("hold", self.driver.hold)

    def resume(self) -> None:
        self._is_held = False
        self._call_driver("resume", self.driver.resume)

    async def reclaim(self) -> str:
        """End all orders that a lost vehicle may still execute, now that it is received again.
        Return "" when all are acknowledged; otherwise, after a timeout, what it may still do."""
        if (holder := self.doing) is not None:
            self._lose(holder, (self._context.clock.now_us() - self._last_contact_us) / 1e6)
        left = list(self._unresolved.values())
        if left:  # what is sent to a node that has just come back may be dropped
            await self._until_found(self.order_for(left[0]).request, RECLAIM_WITHIN_S)
        for goal in list(self._unresolved):
            self._call_driver("end", partial(self.driver.end, goal))
        try:
            async with asyncio.timeout(RECLAIM_WITHIN_S):
                while self._unresolved:
                    self._resolved.clear()
                    await self._resolved.wait()
        except TimeoutError:
            self.hold()
            behaviors = ", ".join(self._unresolved.values())
            return (
                f"its link is up again, but it has not acknowledged the cancel of"
                f" {behaviors} and HOLD: it may still do that"
            )
        return ""

    @property
    def problem(self) -> str:
        """Why it must not be commanded, of what its topics show; "" if it may. A vehicle that was
        never received, and that DDS does not list, is not there."""
        if wrong := self._ros_connection.refusal:
            return wrong
        is_there = self._contacts or self.endpoints.is_listed
        return "" if is_there else f"no message ever: {self.endpoints.absence}"

    def refusal(self, request: BehaviorRequest) -> str:
        """Return why a request cannot be done now; "" if it can."""
        if self._broken:
            return self._broken
        try:
            if wrong := self._ros_connection.refusal:
                return wrong
            if self._is_to_be_found(request):
                return ""  # it waits
            return self.driver.refusal(request) or self._breach(request)
        except Exception as error:
            self._context.logger.exception("%s: refusal", self.resource)
            return _bug(error)

    async def query(self, order: Order) -> Outcome:
        """Return the state of a goal on the vehicle; UNKNOWN also if it does not answer in time."""
        if missing := await self._until_found(order.request, ASKED_WITHIN_S):
            reason = f"{self.resource} cannot be asked: not discovered yet: {missing}"
            return Outcome(BehaviorState.UNKNOWN, reason=reason)
        try:
            async with asyncio.timeout(QUERY_WITHIN_S):
                return await self.driver.query(order)
        except TimeoutError:
            reason = f"{self.resource} did not answer the query within {QUERY_WITHIN_S:g} s"
        except Exception as error:
            self._context.logger.exception("%s: query", self.resource)
            reason = f"the query of {self.resource} failed: {error}"
        return Outcome(BehaviorState.UNKNOWN, reason=reason)

    def adopt(self, order: Order) -> None:
        """Take over an order that was found on the vehicle."""
        self._keep(order)
        self._adopted = True

    def order_for(
        self,
        behavior: BehaviorId,
        epoch: int = 0,
        name: str = "",
        parameters: Mapping[str, ResolvedValue] | None = None,
    ) -> Order:
        """Return an order that may have been sent before a restart. Its name may be "", if it is
        not known."""
        request = BehaviorRequest(behavior, epoch, name, parameters or {}, (self.resource,))
        return self._order_for(request)

    def claim(self, run: str, epoch: int) -> None:
        """Have the vehicle refuse lower epochs of a run."""
        id_ = run_id(self._context.journal, run)
        self._remember_run(id_, run)
        self._call_driver("claim", lambda: self.driver.claim(id_, epoch))

    def disown(self, behaviors: Collection[BehaviorId]) -> None:
        """Send nothing more for these behaviors; the vehicle goes on with them."""
        if self._order is not None and self._order.request.id in behaviors:
            self._order = None
            self._call_driver("forget", self.driver.abandon)
        self._unresolved = {
            goal: behavior
            for goal, behavior in self._unresolved.items()
            if behavior not in behaviors
        }

    def mark_unresolved(self, order: Order) -> None:
        """Remember that the vehicle may still execute an order. It is preempted by the next one."""
        self._unresolved[order.goal] = order.request.id

    async def open(self) -> None:
        """Open the driver. If that fails, every request is refused; other vehicles are not
        affected.

        Raises:
            PluginError: something that it needs is not installed.
        """
        try:
            await self.driver.open()
        except PluginError:
            raise
        except Exception as error:
            self._context.logger.exception("%s: its driver failed to open", self.resource)
            self._broken = f"its driver failed to open: {_bug(error)}"

    async def close(self) -> None:
        """Close the driver. The vehicle goes on with what it does."""
        await self._work.close()
        try:
            async with asyncio.timeout(CLOSE_WITHIN_S):
                await self.driver.close()
        except Exception:
            self._context.logger.exception("%s: its driver failed to close", self.resource)

    # --- reports of the driver ------------------------------------------------------------------

    def alive(self) -> None:
        self._last_contact_us = self._context.clock.now_us()
        self._contacts += 1
        self.first_contact.set()

    def progress(self, goal: UUID) -> None:
        if (behavior := self._behavior(goal)) is not None:
            self._tracker.progress(behavior)

    def remains(self, goal: UUID, remaining: Mapping[str, Value]) -> None:
        behavior = self._behavior(goal)
        if behavior is None or self._order is None or self._order.goal != goal:
            return
        self._left, self._route = dict(remaining), None
        self._report_left(behavior)

    def ended(self, goal: UUID, outcome: Outcome) -> None:
        is_settling = self._settling == goal and self._is_current(goal)
        if is_settling and outcome.state is not BehaviorState.FAILED:
            return  # a driver may report it again
        if self._contradiction(goal, outcome):
            self._settling = goal
            self._work.add(self._settle(goal, outcome))
        else:
            self._report_end(goal, outcome)

    def _report_end(self, goal: UUID, outcome: Outcome) -> None:
        if self._settling == goal:
            self._settling = None
        was_left = self._unresolved.pop(goal, None) is not None
        self._resolved.set()
        behavior = self._behaviors.get(goal) if was_left else self._behavior(goal)
        if behavior is None:
            return
        if not outcome.is_end:
            self._log_throttle.log(
                "an end with a state that is not terminal", f"{behavior} is {outcome.state}"
            )
            return
        if self._order is not None and self._order.goal == goal:
            self._order = None
        if outcome.state is BehaviorState.FAILED:
            self._report_left(behavior, LEAST_PROGRESS_M)
        if outcome.state is BehaviorState.SUCCEEDED:
            self._tracker.progress(behavior)  # a behavior that ends at once has run, too
        self._tracker.end(behavior, outcome.state, outcome.code, outcome.reason, outcome.outputs)

    def superseded(self, run: str, newest: int) -> None:
        behavior = self._runs.get(run)
        if behavior is not None and newest > self._context.epoch_of(behavior):
            self._tracker.superseded(behavior, newest)

    # --- time -----------------------------------------------------------------------------------

    def listen_from_now(self) -> None:
        """Count the silence of the vehicle from now on; the time for its discovery, too."""
        self._last_contact_us = self._context.clock.now_us()
        if isinstance(self.driver, Discovering):
            self._found_by_s = asyncio.get_running_loop().time() + FOUND_WITHIN_S

    def attend(self, *, may_lose: bool) -> VehicleState | PayloadState | None:
        """Check the vehicle, and return its new state; None if nothing has changed.

        `may_lose`: all messages until now were processed, so that silence means a lost link.
        """
        now_us = self._context.clock.now_us()
        self._note_fix()
        silent_s = (now_us - self._last_contact_us) / 1e6
        bound_s = self._limits.lost_after_s
        is_silent = silent_s >= bound_s
        holder = self.doing
        if holder is not None and not is_silent:
            self._report_left(holder)
        # To the executive, LOST is the end of a behavior, also of one that waits.
        is_young = asyncio.get_running_loop().time() < self._found_by_s
        is_awaited = not self._contacts and (is_young or self._waiting != "")
        if not self._contacts:
            self.link = LinkState.DEGRADED if is_awaited else LinkState.LOST
        elif may_lose or not is_silent:
            self.link = link_state(silent_s, bound_s)
        if is_silent and may_lose and holder is not None and not is_awaited:
            self._lose(holder, silent_s)
            holder = None
        self._publish_targets()
        self._check_for_other_publishers()
        news = (self._contacts, self._sensors.changes, self.link, holder, self._refusal)
        unchanged = (self.link, self._refusal)
        still_lost = self.link is LinkState.LOST and self._reported[2::2] == unchanged
        if still_lost or (news == self._reported and not is_awaited):
            return None
        self._reported = news
        behavior = self._order.request.behavior if self._order else ""
        if self._ros_connection.payload_status is not None:
            return self._ros_connection.payload_status.state(now_us, self.link, behavior)
        health = self._health()
        state = vehicle_state(self.resource, now_us, self._sensors, health, self.link, behavior)
        if not self._refusal:
            return state
        reasons = dict.fromkeys((self._refusal, *state.not_ready_reasons))
        return replace(state, ready=False, not_ready_reasons=tuple(reasons))

    # --- inside ---------------------------------------------------------------------------------

    def _is_current(self, goal: UUID) -> bool:
        return self._order is not None and self._order.goal == goal

    def _contradiction(self, goal: UUID, outcome: Outcome) -> str:
        """Return what odometry shows against the end of the current order; "" for any other."""
        if self._order is None or self._order.goal != goal or self._ros_connection.payload_status:
            return ""
        request, where = self._order.request, self._sensors.localization
        return contradiction(request, outcome.state, self._domain, where, self._context.origin)

    async def _settle(self, goal: UUID, outcome: Outcome) -> None:
        """Report an end as soon as odometry agrees with it; as failed if it does not in time."""
        clock, limit_s = self._context.clock, SETTLE_S[outcome.state]
        until_us = clock.now_us() + limit_s * 1e6
        while (wrong := self._contradiction(goal, outcome)) and clock.now_us() < until_us:
            await clock.sleep(LOOK_EVERY_S)
        if self._settling != goal or not self._is_current(goal):
            return  # it has failed meanwhile, or the vehicle is lost or has another order
        if wrong:
            code = "FAILED" if outcome.state is BehaviorState.SUCCEEDED else "TIMEOUT"
            reason = f"reported as {outcome.state}, but {limit_s:g} s later odometry shows: {wrong}"
            self._context.logger.error("%s: %s", self.resource, reason)
            if outcome.state is BehaviorState.CANCELLED:
                self._call_driver("hold", self.driver.hold)
            outcome = Outcome(BehaviorState.FAILED, code, reason)
        self._report_end(goal, outcome)

    def _note_fix(self) -> None:
        """Before odometry has come, a satellite fix shows that a vehicle without a node of m2pem is
        there, too."""
        where, changes = self._sensors.localization, self._sensors.changes
        if self.settings.driver is not DriverName.NODE and changes != self._fixes:
            self._fixes = changes
            if where.pose is None and where.position is not None:
                self.alive()

    def _missing(self, request: BehaviorRequest) -> str:
        """Return what of the vehicle is not discovered yet, and needed; "" if nothing is."""
        if not (self._contacts or self.endpoints.is_listed):
            return self.endpoints.absence
        if not isinstance(self.driver, Discovering):
            return ""
        for value in request.parameters.values():
            if isinstance(value, VehiclePosition):
                target = self._context.bus.latest(ResourceId(value.vehicle))
                if not isinstance(target, VehicleState) or target.position is None:
                    return f"a position of {value.vehicle}"
        return self.driver.missing(request)

    def _is_to_be_found(self, request: BehaviorRequest) -> bool:
        """Whether a request has to wait. One for a vehicle that was received, and is silent now,
        does not: it will be lost."""
        silent_s = (self._context.clock.now_us() - self._last_contact_us) / 1e6
        is_gone = self._contacts and silent_s >= self._limits.lost_after_s
        return not is_gone and self._missing(request) != ""

    async def _until_found(self, request: BehaviorRequest, within_s: float) -> str:
        """Wait, in real time. Return what is still missing then, or ""."""
        loop = asyncio.get_running_loop()
        end_s = loop.time() + within_s
        while (missing := self._missing(request)) and loop.time() < end_s:  # noqa: ASYNC110  # of the graph
            await asyncio.sleep(LOOK_EVERY_S)
        return missing

    def _check_for_other_publishers(self) -> None:
        """Check the endpoints periodically, so that operators know of a conflict early."""
        now_s = asyncio.get_running_loop().time()
        if now_s - self._checked_s < OTHERS_EVERY_S:
            return
        self._checked_s = now_s
        wrong = self.problem
        if wrong and wrong != self._refusal and self._contacts:
            self._context.logger.error("%s: it is not commanded: %s", self.resource, wrong)
        elif self._refusal and not wrong:
            self._context.logger.warning("%s: it can be commanded now", self.resource)
        self._refusal = wrong

    def _report_left(self, behavior: BehaviorId, least_m: float | None = None) -> None:
        """Report what is left: as its node says it, else of a route, by the position. `least_m`:
        what was driven since the last report; None: it is not the last one."""
        if self._left is not None:
            now_us = self._context.clock.now_us()
            if least_m is not None or now_us - self._left_us >= LEFT_EVERY_S * 1e6:
                self._left_us = now_us
                self._tracker.remains(behavior, self._left)
                self._left = None
            return
        position, route = self._sensors.localization.position, self._route
        if route is None or position is None:
            return
        place = route.frame.to_local((position.latitude_deg, position.longitude_deg))
        route.follow(place, anywhere=self._adopted)
        if (left := route.to_report(least_m)) is not None:
            self._tracker.remains(behavior, left)

    def _lose(self, holder: BehaviorId, silent_s: float) -> None:
        self._report_left(holder, LEAST_PROGRESS_M)
        self._mark_unresolved(holder)
        self._call_driver("forget", self.driver.abandon)
        reason = f"no message for {silent_s:.1f} s"
        if not self._contacts:
            reason = f"no message ever: {self.endpoints.absence}"
        self._tracker.lose(self.resource, reason)

    def _mark_unresolved(self, behavior: BehaviorId) -> None:
        self._unresolved[goal_id(self._context.journal, behavior)] = behavior
        self._order = None

    async def _fail_cancel_after_limit(self, behavior: BehaviorId) -> None:
        limit_s = CANCEL_SHARE * self._limits.cancel_timeout_s
        await self._context.clock.sleep(limit_s)
        if self.doing == behavior:
            self._mark_unresolved(behavior)
            reason = f"the vehicle did not stop within {limit_s:g} s of the cancel"
            self._tracker.end(behavior, BehaviorState.FAILED, "TIMEOUT", reason)

    def _order_for(self, request: BehaviorRequest) -> Order:
        journal = self._context.journal
        goal, run = goal_id(journal, request.id), run_id(journal, request.id)
        self._remember_run(run, request.id)
        others = [goal_id(journal, preempted) for preempted in request.preempts]
        preempts = tuple(
            each for each in dict.fromkeys([*others, *self._unresolved]) if each != goal
        )
        return Order(request, goal, run, preempts)

    def _remember_run(self, run: UUID, behavior: BehaviorId) -> None:
        """Remember of which run a refusal may be; the newest behavior of it is named."""
        remember(self._runs, str(run), behavior, REMEMBERED)

    def _keep(self, order: Order) -> None:
        self._order = order
        request, self._adopted = order.request, False
        is_routing = request.behavior == "single_vehicle_routing"
        self._route = RemainingRoute.of(request.parameters) if is_routing else None
        self._left, self._left_us = None, 0
        remember(self._behaviors, order.goal, order.request.id, REMEMBERED)

    def _behavior(self, goal: UUID) -> BehaviorId | None:
        behavior = self._behaviors.get(goal)
        if behavior is None:
            self._log_throttle.log("a report of a goal that was not sent", str(goal))
        return behavior

    def _call_driver(self, what: str, call: Callable[[], None]) -> str:
        """Call the driver. Return "", or what went wrong."""
        try:
            call()
        except Exception as error:
            self._context.logger.exception("%s: %s", self.resource, what)
            return _bug(error)
        return ""

    def _breach(self, request: BehaviorRequest) -> str:
        """Return where the request would leave the fence of the fleet; "" if it does not."""
        where = self._sensors.localization
        start = None if where.position is None else where.position.latlon
        yaw_rad = None if where.pose is None else where.pose.yaw_rad
        given, stance_of = BehaviorParameters(request.parameters), stance_on(self._context.bus)
        found = find_breach(self._fence, request.behavior, given, start, yaw_rad, stance_of)
        return str(found or "")

    def _health(self) -> Health:
        try:
            return self.driver.health
        except Exception as error:
            self._log_throttle.log("invalid health from its driver", repr(error))
            return Health()

    def _publish_targets(self) -> None:
        """Publish the states of target vehicles. A payload always gets the state of its own
        vehicle."""
        carrier, of_a_vehicle, _ = self.resource.partition("/")
        names = {carrier: None} if of_a_vehicle else {}
        if self._order is not None and self.doing is not None:
            values = self._order.request.parameters.values()
            names |= {value.vehicle: None for value in values if isinstance(value, VehiclePosition)}
        for name in names:
            state = self._context.bus.latest(ResourceId(name))
            if isinstance(state, VehicleState):
                self._ros_connection.publish_target(state)


def _bug(error: Exception) -> str:
    return f"internal error of m2pem: {type(error).__name__}: {error}"


DEGRADED_SHARE = 0.5
"""A vehicle that is silent for this part of `lost_after_s` has a bad link."""


def link_state(silent_s: float, lost_after_s: float) -> LinkState:
    """Return the state of a link whose last message is `silent_s` seconds old."""
    if silent_s >= lost_after_s:
        return LinkState.LOST
    if silent_s >= DEGRADED_SHARE * lost_after_s:
        return LinkState.DEGRADED
    return LinkState.CONNECTED


def vehicle_state(
    resource: ResourceId,
    time_us: int,
    sensors: VehicleSensors,
    health: Health,
    link: LinkState,
    behavior: str,
) -> VehicleState:
    """Return the state for the fleet. An error of a component makes the vehicle not ready."""
    pose, errors = sensors.localization.pose, sensors.errors
    battery = health.battery_fraction
    return VehicleState(
        resource,
        time_us,
        sensors.localization.position,
        velocity_enu_m_s=_velocity(sensors),
        yaw_rad=pose.yaw_rad if pose is not None else None,
        battery_fraction=sensors.battery_fraction if battery is None else battery,
        mode=health.mode,
        ready=False if errors else health.ready,
        not_ready_reasons=(*health.not_ready_reasons, *errors, *sensors.problems),
        link=link,
        behavior=behavior,
    )


def _velocity(sensors: VehicleSensors) -> tuple[float, float, float] | None:
    pose, twist = sensors.localization.pose, sensors.localization.twist
    if pose is None or twist is None:
        return None
    cos, sin = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    return (
        twist.forward_m_s * cos - twist.left_m_s * sin,
        twist.forward_m_s * sin + twist.left_m_s * cos,
        0.0,
    )
