"""One vehicle of the arbiter, or a payload with a node of its own: its driver, what it was given,
and when it was heard."""

import asyncio
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from uuid import UUID

from m2pem.api import (
    ArbiterContext,
    BehaviorId,
    BehaviorRequest,
    BehaviorState,
    BehaviorTracker,
    Connection,
    Limits,
    LinkState,
    PayloadState,
    ResolvedValue,
    ResourceId,
    VehiclePosition,
    VehicleState,
)
from m2pem.errors import PluginError
from m2pem_plugin_ros.checkpoint import goal_id, run_id
from m2pem_plugin_ros.connections import Instruments, Senses
from m2pem_plugin_ros.drivers.driver import Driver, Health, Order, Outcome, Seat
from m2pem_plugin_ros.fence_check import Confines
from m2pem_plugin_ros.log_throttle import Complaints
from m2pem_plugin_ros.settings import DriverName, Settings

LOOK_WITHIN_S = 3.0
"""In real time: so long may a vehicle take to say how it stands to a goal."""

CANCEL_SHARE = 0.8
"""Of the time in which a cancelled vehicle must be free: one that takes longer has failed to."""

RECLAIM_WITHIN_S = 5.0
"""In real time: a vehicle that has not acknowledged a CANCEL by then is also told to HOLD."""

CLOSE_WITHIN_S = 5.0
REMEMBERED = 1_000
OTHERS_EVERY_S = 1.0
"""In real time, however fast the clock is: so often it is looked who else is there."""

_GOES_ON = (BehaviorState.ACCEPTED, BehaviorState.RUNNING)


@dataclass(frozen=True, slots=True)
class Post:
    """What a vehicle is made with."""

    connection: Connection
    settings: Settings
    context: ArbiterContext
    ledger: BehaviorTracker
    limits: Limits


class Vehicle:
    """Implements `Told`. Whatever its driver raises stays here, and is told as a failure."""

    def __init__(
        self, post: Post, instruments: Instruments, make_driver: Callable[[Seat], Driver]
    ) -> None:
        self.resource: ResourceId = post.connection.resource
        self.settings = post.settings
        self.link = LinkState.CONNECTED
        self.heard_once = asyncio.Event()
        self._context = post.context
        self._ledger = post.ledger
        self._limits = post.limits
        self._instruments = instruments
        fence = post.connection.fence
        self._confines = None if fence is None else Confines(fence, post.context.bus)
        self._complaints = Complaints(post.context.logger, self.resource)
        self._behaviors: dict[UUID, BehaviorId] = {}
        self._order: Order | None = None
        self._cancelled: BehaviorId = ""
        self._broken = ""
        self._looked_s = 0.0
        self._wrong = ""
        self._left: dict[UUID, BehaviorId] = {}
        self._left_less = asyncio.Event()
        self._heard_us = post.context.clock.now_us()
        self._heard = 0
        self._told: tuple[object, ...] = ()
        self._tasks: set[asyncio.Task[None]] = set()
        localization = instruments.senses.localization
        self.driver = make_driver(
            Seat(post.connection, post.settings, post.context, instruments.ros, localization, self)
        )

    @property
    def doing(self) -> BehaviorId | None:
        """The behavior that it was given and that goes on. What only holds a payload, while its
        vehicle does it, is none of the payload's."""
        holder = self._ledger.holder(self.resource)
        is_ours = self._order is not None and self._order.request.id == holder
        return holder if is_ours else None

    # --- what the arbiter asks ------------------------------------------------------------------

    async def take(self, request: BehaviorRequest, *, look_first: bool = False) -> None:
        """Do this, in place of what it does. `look_first`: it may have been begun already."""
        order = self._order_for(request)
        self._keep(order)
        self._show_targets()
        # A plain base does nothing while nobody drives it.
        if look_first and self.settings.driver is not DriverName.BASE:
            outcome = await self.look(order)
            if self._ledger.last(request.id).state.terminal:
                return  # the vehicle was lost meanwhile, or it has ended
            if outcome.state in _GOES_ON:
                self.progress(order.goal)
                if self._cancelled == request.id:
                    self._ask("end", lambda: self.driver.end(order.goal))
                return
            if outcome.is_end:
                self.ended(order.goal, outcome)
                return
            if self._cancelled == request.id:
                self._ledger.end(request.id, BehaviorState.CANCELLED)
                return
        self._left.clear()
        if wrong := self._ask("begin", lambda: self.driver.begin(order)):
            self._ledger.end(request.id, BehaviorState.FAILED, reason=wrong)

    def cancel(self, behavior: BehaviorId) -> None:
        """Stop doing it, within the limit that was promised."""
        goal = goal_id(self._context.journal, behavior)
        self._cancelled = behavior
        task = asyncio.get_running_loop().create_task(self._give_up(behavior))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        if wrong := self._ask("end", lambda: self.driver.end(goal)):
            self._leave(behavior)
            self._ledger.end(behavior, BehaviorState.FAILED, reason=wrong)

    def adjust(self, behavior: BehaviorId, parameters: Mapping[str, ResolvedValue]) -> None:
        """Go on with these parameters."""
        order, goal = self._order, goal_id(self._context.journal, behavior)
        if order is not None and order.goal == goal:
            request = order.request
            merged = {**request.parameters, **parameters}
            self._order = replace(order, request=replace(request, parameters=merged))
        self._ask("adjust", lambda: self.driver.adjust(goal, parameters))

    def hold(self) -> None:
        """Stand still, and keep the behavior."""
        self._ask("hold", self.driver.hold)

    def resume(self) -> None:
        """Go on."""
        self._ask("resume", self.driver.resume)

    async def reclaim(self) -> str:
        """It is heard again: have it end what it was left with. Returns when it has acknowledged
        all of that, and ""; else, after a while, what it may still do."""
        if (holder := self.doing) is not None:
            self._lose(holder, (self._context.clock.now_us() - self._heard_us) / 1e6)
        for goal in list(self._left):
            self._ask("end", partial(self.driver.end, goal))
        try:
            async with asyncio.timeout(RECLAIM_WITHIN_S):
                while self._left:
                    self._left_less.clear()
                    await self._left_less.wait()
        except TimeoutError:
            self.hold()
            left = ", ".join(self._left.values())
            return (
                f"it is heard again, was told to end {left} and then to hold, and has not"
                " acknowledged: it may still do that"
            )
        return ""

    @property
    def absence(self) -> str:
        """Where it is awaited, and who is there, for people."""
        return self._instruments.senses.absence

    def refusal(self, request: BehaviorRequest) -> str:
        """Why it cannot be done now; "" if it can."""
        if self._broken:
            return self._broken
        try:
            if wrong := self._instruments.senses.refusal:
                return wrong
            return self.driver.refusal(request) or self._breach(request)
        except Exception as error:
            self._context.logger.exception("%s: refusal", self.resource)
            return _bug(error)

    async def look(self, order: Order) -> Outcome:
        """How the vehicle stands to a goal; UNKNOWN also if it does not say soon."""
        try:
            async with asyncio.timeout(LOOK_WITHIN_S):
                return await self.driver.look(order)
        except TimeoutError:
            reason = f"{self.resource} did not say within {LOOK_WITHIN_S:g} s whether it does it"
        except Exception as error:
            self._context.logger.exception("%s: look", self.resource)
            reason = f"{self.resource} could not be asked: {error}"
        return Outcome(BehaviorState.UNKNOWN, reason=reason)

    def adopt(self, order: Order) -> None:
        """It was found doing this, and its driver has it."""
        self._keep(order)

    def order_for(
        self,
        behavior: BehaviorId,
        epoch: int = 0,
        name: str = "",
        parameters: Mapping[str, ResolvedValue] | None = None,
    ) -> Order:
        """An order that may have been given before a restart; of an unknown name it is ""."""
        request = BehaviorRequest(behavior, epoch, name, parameters or {}, (self.resource,))
        return self._order_for(request)

    def leave(self, order: Order) -> None:
        """It may still do this, and is to stop doing it when it is given something else."""
        self._left[order.goal] = order.request.id

    async def open(self) -> None:
        """Have the driver listen. One that breaks refuses every request, and stops nobody else.

        Raises:
            PluginError: something that it needs is not installed.
        """
        try:
            await self.driver.open()
        except PluginError:
            raise
        except Exception as error:
            self._context.logger.exception("%s: its driver does not open", self.resource)
            self._broken = f"its driver did not open: {_bug(error)}"

    async def close(self) -> None:
        """Let go; the vehicle keeps doing what it does."""
        tasks = list(self._tasks)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        try:
            async with asyncio.timeout(CLOSE_WITHIN_S):
                await self.driver.close()
        except Exception:
            self._context.logger.exception("%s: its driver does not close", self.resource)

    # --- what the driver tells ------------------------------------------------------------------

    def heard(self) -> None:
        """The vehicle, or what steers it there, is alive."""
        self._heard_us = self._context.clock.now_us()
        self._heard += 1
        self.heard_once.set()

    def progress(self, goal: UUID) -> None:
        """The vehicle does it."""
        if (behavior := self._behavior(goal)) is not None:
            self._ledger.progress(behavior)

    def ended(self, goal: UUID, outcome: Outcome) -> None:
        """It has ended, for good."""
        was_left = self._left.pop(goal, None) is not None
        self._left_less.set()
        behavior = self._behaviors.get(goal) if was_left else self._behavior(goal)
        if behavior is None:
            return
        if not outcome.is_end:
            self._complaints.add("an end that is none", f"{behavior} is {outcome.state}")
            return
        if self._order is not None and self._order.goal == goal:
            self._order = None
        if outcome.state is BehaviorState.SUCCEEDED:
            self._ledger.progress(behavior)  # one that was done so soon ran all the same
        self._ledger.end(behavior, outcome.state, outcome.code, outcome.reason, outcome.outputs)

    # --- time -----------------------------------------------------------------------------------

    def listen_from_now(self) -> None:
        """Silence counts from now on."""
        self._heard_us = self._context.clock.now_us()

    def attend(self, *, may_lose: bool) -> VehicleState | PayloadState | None:
        """Look after the vehicle; what the fleet is to be told, if there is news.

        `may_lose`: what it said until now has been heard, so that silence means something.
        """
        now_us = self._context.clock.now_us()
        silent_s = (now_us - self._heard_us) / 1e6
        bound_s = self._limits.lost_after_s
        is_silent = silent_s >= bound_s
        holder = self.doing
        if not self._heard:
            self.link = LinkState.LOST
        elif may_lose or not is_silent:
            self.link = link_state(silent_s, bound_s)
        if is_silent and may_lose and holder is not None:
            self._lose(holder, silent_s)
            holder = None
        self._show_targets()
        self._look_for_others()
        news = (self._heard, self._instruments.senses.changes, self.link, holder, self._wrong)
        still_lost = self.link is LinkState.LOST and self._told[2:3] == (self.link,)
        if still_lost or news == self._told:
            return None
        self._told = news
        behavior = self._order.request.behavior if self._order else ""
        if self._instruments.sight is not None:
            return self._instruments.sight.state(now_us, self.link, behavior)
        health, senses = self._health(), self._instruments.senses
        state = vehicle_state(self.resource, now_us, senses, health, self.link, behavior)
        if not self._wrong:
            return state
        reasons = (self._wrong, *state.not_ready_reasons)
        return replace(state, ready=False, not_ready_reasons=reasons)

    # --- inside ---------------------------------------------------------------------------------

    def _look_for_others(self) -> None:
        """Once in a while, so that operators know before something is commanded."""
        now_s = asyncio.get_running_loop().time()
        if now_s - self._looked_s < OTHERS_EVERY_S:
            return
        self._looked_s = now_s
        wrong = self._instruments.senses.refusal
        if wrong and wrong != self._wrong:
            self._context.logger.error("%s: nothing more is commanded: %s", self.resource, wrong)
        elif self._wrong and not wrong:
            self._context.logger.warning("%s: can be commanded again", self.resource)
        self._wrong = wrong

    def _lose(self, holder: BehaviorId, silent_s: float) -> None:
        self._leave(holder)
        self._ask("forget", self.driver.forget)
        reason = f"not heard for {silent_s:.1f} s"
        if not self._heard:
            reason = f"never heard: {self.absence}"
        self._ledger.lose(self.resource, reason)

    def _leave(self, behavior: BehaviorId) -> None:
        self._left[goal_id(self._context.journal, behavior)] = behavior
        self._order = None

    async def _give_up(self, behavior: BehaviorId) -> None:
        limit_s = CANCEL_SHARE * self._limits.cancel_timeout_s
        await self._context.clock.sleep(limit_s)
        if self.doing == behavior:
            self._leave(behavior)
            reason = f"it did not stop within {limit_s:g} s of the cancel"
            self._ledger.end(behavior, BehaviorState.FAILED, "TIMEOUT", reason)

    def _order_for(self, request: BehaviorRequest) -> Order:
        journal = self._context.journal
        goal = goal_id(journal, request.id)
        others = [goal_id(journal, preempted) for preempted in request.preempts]
        preempts = tuple(each for each in dict.fromkeys([*others, *self._left]) if each != goal)
        return Order(request, goal, run_id(journal, request.id), preempts)

    def _keep(self, order: Order) -> None:
        self._order = order
        self._behaviors.pop(order.goal, None)
        self._behaviors[order.goal] = order.request.id
        if len(self._behaviors) > REMEMBERED:
            del self._behaviors[next(iter(self._behaviors))]

    def _behavior(self, goal: UUID) -> BehaviorId | None:
        behavior = self._behaviors.get(goal)
        if behavior is None:
            self._complaints.add("what it says of a goal that it was not given", str(goal))
        return behavior

    def _ask(self, what: str, call: Callable[[], None]) -> str:
        """Returns "", or what went wrong."""
        try:
            call()
        except Exception as error:
            self._context.logger.exception("%s: %s", self.resource, what)
            return _bug(error)
        return ""

    def _breach(self, request: BehaviorRequest) -> str:
        """Where it would leave the fleet's fence."""
        if self._confines is None:
            return ""
        where = self._instruments.senses.localization
        yaw_rad = None if where.pose is None else where.pose.yaw_rad
        return self._confines.refusal(request, where.position, yaw_rad)

    def _health(self) -> Health:
        try:
            return self.driver.health
        except Exception as error:
            self._complaints.add("what its driver says of its health", repr(error))
            return Health()

    def _show_targets(self) -> None:
        """A payload is told all the time where it is carried, for what it is asked next."""
        carrier, of_a_vehicle, _ = self.resource.partition("/")
        names = {carrier: None} if of_a_vehicle else {}
        if self._order is not None and self.doing is not None:
            values = self._order.request.parameters.values()
            names |= {value.vehicle: None for value in values if isinstance(value, VehiclePosition)}
        for name in names:
            state = self._context.bus.latest(ResourceId(name))
            if isinstance(state, VehicleState):
                self._instruments.show_target(state)


def _bug(error: Exception) -> str:
    return f"m2pem is wrong: {type(error).__name__}: {error}"


DEGRADED_SHARE = 0.5
"""Of `lost_after_s`: a vehicle that is silent for longer has a bad link."""


def link_state(silent_s: float, lost_after_s: float) -> LinkState:
    """How well a vehicle is heard that was heard so many seconds ago."""
    if silent_s >= lost_after_s:
        return LinkState.LOST
    if silent_s >= DEGRADED_SHARE * lost_after_s:
        return LinkState.DEGRADED
    return LinkState.CONNECTED


def vehicle_state(
    resource: ResourceId,
    time_us: int,
    senses: Senses,
    health: Health,
    link: LinkState,
    behavior: str,
) -> VehicleState:
    """What the fleet is told. A part that reports an error makes the vehicle not ready."""
    pose, errors = senses.localization.pose, senses.errors
    battery = health.battery_fraction
    return VehicleState(
        resource,
        time_us,
        senses.localization.position,
        velocity_enu_m_s=_velocity(senses),
        yaw_rad=pose.yaw_rad if pose is not None else None,
        battery_fraction=senses.battery_fraction if battery is None else battery,
        mode=health.mode,
        ready=False if errors else health.ready,
        not_ready_reasons=(*health.not_ready_reasons, *errors, *senses.troubles),
        link=link,
        behavior=behavior,
    )


def _velocity(senses: Senses) -> tuple[float, float, float] | None:
    pose, twist = senses.localization.pose, senses.localization.twist
    if pose is None or twist is None:
        return None
    cos, sin = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    return (
        twist.forward_m_s * cos - twist.left_m_s * sin,
        twist.forward_m_s * sin + twist.left_m_s * cos,
        0.0,
    )
