"""Carries commands to arbiters: one FIFO a resource, every call bounded, every failure a report.

A behavior on several resources takes its turn in the FIFO of each. Nothing here waits for a
vehicle: what comes of a command arrives as a report.
"""

import asyncio
import logging
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Protocol

from m2pem.api.arbiter import Arbiter, BehaviorReport, BehaviorRequest, adjusts, fences
from m2pem.api.capabilities import arbiter_capabilities
from m2pem.api.clock import Clock
from m2pem.api.epoch_fence import run_of
from m2pem.conformance.monitor import ConformanceMonitor
from m2pem.engine.commands import AdjustBehavior, CancelBehavior, StartBehavior
from m2pem.errors import OperatorError, StaleCommandError
from m2pem.executive.behavior_lifecycle import DispatcherView
from m2pem.executive.fleet_connections import FleetArbiters
from m2pem.executive.own_fences import OwnFences
from m2pem.executive.separation import VehicleSeparation
from m2pem.fleet.allocation import Availability
from m2pem.fleet.parameters import ParameterError, resolve
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorSpec, BehaviorState, ResourceId
from m2pem.mission.geometry import Geometry

log = logging.getLogger("m2pem.dispatch")

CALL_TIMEOUT_S = 10.0
"""An arbiter's `start`, `cancel`, `hold` or `resume` only hands over; one that hangs is a fault."""

ANSWER_WITHIN_S = 60.0
"""A vehicle answers within this time whether it goes on with other parameters; one that has not
begun its behavior answers then."""

START_WAIT_S = 0.3
"""How long STOP and pause wait for an arbiter's `start` that has not returned: a cancel that comes
before its start would stop nothing."""

Geometries = Callable[[str, str], Geometry | None]
"""(run, name) -> the route, area or point that the run knows under the name."""


class Claims(Protocol):
    """What the dispatcher must know of the runs' claims: `m2pem.executive.ownership.Ownership`."""

    def open(self) -> None:
        """Let arbiters send at once, as a hold must go out."""
        ...

    async def confirmed(self) -> None:
        """Return when it is known that this executive still drives its runs; the dispatcher has
        disowned all others then."""
        ...


@dataclass(slots=True)
class _Active:
    """A behavior handed to an arbiter and not ended."""

    arbiter: Arbiter
    resources: tuple[ResourceId, ...]
    last_number: int = 0
    adopted: bool = False
    deadline: asyncio.Task[None] | None = None
    answer: asyncio.Task[None] | None = None
    """Waits for what the vehicle says to other parameters."""

    def forget(self) -> None:
        """It has ended, or is no longer commanded from here."""
        for task in (self.deadline, self.answer):
            if task is not None:
                task.cancel()


@dataclass(slots=True)
class Order:
    """A STOP or hold that was sent out of turn. `wrong`: "", or why it may not have arrived.

    `hosts`: the other hosts that it goes to.
    """

    resources: tuple[ResourceId, ...]
    task: asyncio.Task[None] | None = None
    wrong: str = ""
    hosts: tuple[str, ...] = ()


@dataclass(eq=False)
class Dispatcher:
    """`post` takes every report, those of arbiters and those made here. `replaced` takes the
    refusal of a command whose run another executive drives. `claims` is asked before a vehicle is
    moved. `clearance`: reserves space for vehicles; None: the fleet does not say that they share
    it. `conformance`: watches what is under way.
    """

    _arbiters: FleetArbiters
    _availability: Availability
    _clock: Clock
    _geometries: Geometries
    _post: Callable[[BehaviorReport], None]
    _replaced: Callable[[StaleCommandError], None]
    _claims: Claims
    _fences: OwnFences
    _conformance: ConformanceMonitor
    _clearance: VehicleSeparation | None = None
    _active: dict[str, _Active] = field(default_factory=dict)
    _tails: dict[str, asyncio.Task[None]] = field(default_factory=dict)
    _starts: dict[str, asyncio.Task[None]] = field(default_factory=dict)
    _tasks: set[asyncio.Task[None]] = field(default_factory=set)
    _barred: set[str] = field(default_factory=set)
    _stopped: set[str] = field(default_factory=set)
    _disowned: dict[str, tuple[ResourceId, ...]] = field(default_factory=dict)

    # --- commands -------------------------------------------------------------------------------

    def start(self, command: StartBehavior) -> None:
        """Start a behavior, when its resources are free and its parameters make sense."""
        task = self._enqueue(command.resources, lambda: self._start(command))
        self._starts[command.behavior] = task
        task.add_done_callback(lambda _: self._starts.pop(command.behavior, None))

    def adjust(self, command: AdjustBehavior, failed: Callable[[str], None]) -> None:
        """Let a behavior go on with other parameters, unless it has ended or is being cancelled.

        `failed` is called with the reason when its arbiter could not be given them, or when the
        vehicle does not take them. The next command for the vehicle does not wait for its answer.
        """

        async def adjust() -> None:
            if wrong := await self._adjust(command, failed):
                failed(wrong)

        self._enqueue(command.goes_on.resources, adjust)

    def may_adjust(self, behavior: str) -> bool:
        """Whether the speed of a behavior that is commanded can be changed while it goes on. Where
        vehicles share space, it cannot: the space is reserved for the time at its first speed."""
        active = self._active.get(behavior)
        return active is not None and self._clearance is None and adjusts(active.arbiter)

    def cancel(self, command: CancelBehavior) -> None:
        """End a behavior; if it has not within its arbiter's limit, it is given up as LOST.

        One of several resources waits for its own start alone: a resource whose
        arbiter hangs in its call must not keep the others from stopping.
        """
        after = None
        if len(command.resources) > 1:
            start = self._starts.get(command.behavior)
            after = set() if start is None else {start}
        self._enqueue(command.resources, lambda: self._cancel(command), after)

    def end(self, behavior: str, epoch: int) -> None:
        """End a behavior whose vehicle deviates from it, as `cancel` does."""
        active = self._active.get(behavior)
        if active is None:
            return

        async def end() -> None:
            await self._claims.confirmed()
            if self._active.get(behavior) is active and run_of(behavior) not in self._disowned:
                await self._cancel_active(behavior, active, active.resources, epoch)

        self._enqueue(active.resources, end, set())

    def hold(self, resource: str) -> None:
        """Bring a resource to its safe state."""
        self._claims.open()
        self._enqueue((resource,), lambda: self._turn("hold", ResourceId(resource)))

    def resume(self, resource: str, run: str) -> None:
        """Let a resource go on after `hold`, for a run."""
        self._enqueue((resource,), lambda: self._resume(ResourceId(resource), run))

    def hold_all(self, run: str) -> list[ResourceId]:
        """Bring everything that a run commands to its safe state, whatever its state says.

        Returns what is commanded to hold.
        """
        resources = [each for _, active in self._active_of(run) for each in active.resources]
        for resource in resources:
            self.hold(resource)
        return resources

    # --- runs that pass from one executive to another --------------------------------------------

    async def confirm_claims(self) -> None:
        """Return when it is known which runs are driven here: see `Claims.confirmed`."""
        await self._claims.confirmed()

    async def fence(self, run: str, epoch: int) -> None:
        """Have all vehicles refuse what an earlier executive commands for a run, from now on driven
        here."""
        self._barred.discard(run)
        self._stopped.discard(run)
        for resource in self._disowned.pop(run, ()):
            if self._availability.reason(resource) == _driven_elsewhere(run):
                self._availability.restore(resource)
        await asyncio.gather(
            *(
                self._call(f"fence {run}", arbiter.fence(run, epoch))
                for arbiter in self._arbiters.all.values()
                if fences(arbiter)
            )
        )

    def bar(self, run: str) -> None:
        """Move no vehicle for a run any more, until it is driven here again."""
        self._barred.add(run)

    def disown(self, run: str) -> None:
        """Another executive drives a run: command nothing more for it, and have arbiters send
        nothing more.

        Its resources are not given to others here. They are held if an operator had stopped the
        run: the other executive did not get that stop.
        """
        if run in self._disowned:
            return
        active = self._active_of(run)
        resources = tuple(dict.fromkeys(each for _, one in active for each in one.resources))
        self._disowned[run] = resources
        self._barred.add(run)
        for behavior, _ in active:
            self.ended(behavior)
        for resource in resources:
            self._availability.withdraw(resource, _driven_elsewhere(run))
        self._enqueue((), lambda: self._let_go(run))
        if run in self._stopped:
            for resource in resources:
                self.hold(resource)

    async def _let_go(self, run: str) -> None:
        # All at once: one that hangs must not have the vehicles of the others commanded from here.
        await asyncio.gather(
            *(
                self._call(f"disown {run}", arbiter.disown(run))
                for arbiter in self._arbiters.all.values()
                if fences(arbiter)
            )
        )

    # --- STOP and pause, out of turn -------------------------------------------------------------

    def stop_at_once(self, run: str, epoch: int) -> dict[str, Order]:
        """Cancel all that a run commands, by behavior; it starts nothing any more.

        These cancels wait for nothing that their resources were asked before, but for
        `START_WAIT_S` for a start under way. A start that takes longer is abandoned, and the
        resource is held as well, as the arbiter may have begun the behavior. What is disowned
        is held: its vehicles refuse to cancel what another executive drives.
        """
        self._barred.add(run)
        self._stopped.add(run)
        if run in self._disowned:
            return {
                each: self._order((each,), partial(self._turn, "hold", each))
                for each in self._disowned[run]
            }
        return {
            behavior: self._order(active.resources, partial(self._stop, behavior, active, epoch))
            for behavior, active in self._active_of(run)
        }

    def hold_at_once(self, run: str) -> dict[str, Order]:
        """Hold all that a run commands, by resource; out of turn as `stop_at_once` is."""
        return {
            resource: self._order((resource,), partial(self._hold_now, behavior, resource))
            for behavior, active in self._active_of(run)
            for resource in active.resources
        }

    def hold_resources_at_once(self, resources: Iterable[str]) -> dict[str, Order]:
        """Hold resources whose work has failed, by resource; out of turn as `stop_at_once` is."""
        ids = _ids(resources)
        return {each: self._order((each,), partial(self._hold_failed, each)) for each in ids}

    async def _hold_failed(self, resource: ResourceId) -> str:
        wrong = await self._turn("hold", resource)
        return wrong or self._availability.reason(resource)

    def keep(self, incident: str, resources: Iterable[str]) -> None:
        """Keep resources for an incident: no behavior gets them."""
        self._availability.adopt(_ids(resources), incident)

    def keep_between_tasks(self, keeping: str, resource: str) -> None:
        """Keep a resource for the tasks of a run that may have it."""
        self._availability.keep(ResourceId(resource), keeping)

    def release(self, holder: str) -> None:
        """An incident, or what a run keeps between tasks, is over: what it held is free."""
        self._availability.release(holder)

    def _active_of(self, run: str) -> list[tuple[str, _Active]]:
        return [each for each in self._active.items() if run_of(each[0]) == run]

    def _order(
        self, resources: tuple[ResourceId, ...], send: Callable[[], Awaitable[str]]
    ) -> Order:
        hosts = filter(None, map(self._arbiters.host_of, resources))
        order = Order(resources, hosts=tuple(dict.fromkeys(hosts)))
        self._claims.open()

        async def carry_out() -> None:
            order.wrong = await send()

        order.task = self._enqueue(resources, carry_out, set())
        return order

    async def _stop(self, behavior: str, active: _Active, epoch: int) -> str:
        start = self._starts.get(behavior)
        abandoned = not await _returns(start)
        if abandoned and start is not None:
            start.cancel()
            await _returns(start)
        if self._active.get(behavior) is not active:
            return ""  # it was not sent: `_start` saw that its run is barred; or it is disowned
        wrong = await self._cancel_active(behavior, active, active.resources, epoch)
        if abandoned:
            wrong = wrong or "its start had not returned and was abandoned; it is held as well"
            held = await asyncio.gather(*(self._turn("hold", each) for each in active.resources))
            wrong = "; ".join([wrong, *filter(None, held)])
        return wrong

    async def _hold_now(self, behavior: str, resource: ResourceId) -> str:
        if not await _returns(self._starts.get(behavior)):
            # The vehicle may set off when its start returns at last: it is held then, too.
            self.hold(resource)
        return await self._turn("hold", resource)

    # --- what is known of behaviors -------------------------------------------------------------

    @property
    def under_way(self) -> int:
        """How many behaviors are commanded and have not ended."""
        return len(self._active)

    @property
    def calls_waiting(self) -> int:
        """How many calls of arbiters are under way or wait for their turn."""
        return len(self._tasks)

    def reported(self, report: BehaviorReport) -> None:
        """An arbiter's report passes through here, so that numbers go on rising; that of a team's
        part goes to its team."""
        if self._arbiters.teams.report_received(report):
            return
        active = self._active.get(report.id)
        if active is not None:
            if active.adopted and report.remaining is not None:
                # Its arbiter counts from the start again; the journal has higher numbers.
                report = replace(report, number=max(report.number, active.last_number + 1))
            active.last_number = max(active.last_number, report.number)
        self._post(report)

    def ended(self, behavior: str) -> None:
        """The journal has its end: its resources are free."""
        active = self._active.pop(behavior, None)
        if active is not None:
            active.forget()
        self._conformance.ended(behavior)
        self._availability.release(behavior)
        if self._clearance is not None:
            self._clearance.reservations.release(behavior)

    def adopt(self, behavior: str, resources: Iterable[str], number: int, arbiter: Arbiter) -> None:
        """After a restart: the arbiter has it already."""
        ids = [ResourceId(resource) for resource in resources]
        self._active[behavior] = _Active(arbiter, tuple(ids), number, adopted=True)
        self._availability.adopt(ids, behavior)

    def occupy(self, command: StartBehavior) -> None:
        """After a restart: the room that a behavior takes up which an arbiter has already; it is
        watched from now on."""
        ids, kind = _ids(command.resources), BehaviorType(command.type)
        spec = self.spec(ids, command.name, kind)
        if spec is None:
            return
        request = self.request(command, spec)
        if self._clearance is not None:
            self._clearance.reservations.adopt(request, kind)
        self._watch(request, adopted=True)

    def resources_of(self, behavior: str) -> Sequence[ResourceId]:
        """Return the resources of a behavior that has not ended."""
        active = self._active.get(behavior)
        return () if active is None else active.resources

    def view(self, behavior: str) -> DispatcherView:
        """Return what is commanded of a behavior that has not ended."""
        active = self._active.get(behavior)
        if active is None:
            return DispatcherView.NONE
        ending = active.deadline is not None
        return DispatcherView.CANCELLED if ending else DispatcherView.COMMANDED

    async def close(self) -> None:
        """Let calls under way end, drop what waits for a limit."""
        for active in self._active.values():
            active.forget()
        if self._tasks:
            await asyncio.wait(self._tasks)

    # --- inside ---------------------------------------------------------------------------------

    def _enqueue(
        self,
        resources: Iterable[str],
        job: Callable[[], Awaitable[object]],
        after: set[asyncio.Task[None]] | None = None,
    ) -> asyncio.Task[None]:
        """`after`: what the job waits for; None: all earlier jobs of its resources. The next job
        waits for both."""
        names = tuple(resources)
        before = {self._tails[name] for name in names if name in self._tails}
        task = tail = asyncio.create_task(self._in_turn(before if after is None else after, job))
        if after is not None and before - after:
            tail = asyncio.create_task(self._in_turn({task, *before}, _nothing))
        self._tasks |= {task, tail}
        for name in names:
            self._tails[name] = tail

        def done(_: asyncio.Task[None]) -> None:
            self._tasks.discard(tail)
            for name in names:
                if self._tails.get(name) is tail:
                    del self._tails[name]

        task.add_done_callback(self._tasks.discard)
        tail.add_done_callback(done)
        return task

    async def _in_turn(
        self, before: set[asyncio.Task[None]], job: Callable[[], Awaitable[object]]
    ) -> None:
        if before:
            await asyncio.wait(before)
        await job()

    async def _call(self, what: str, call: Awaitable[None]) -> str:
        """Await an arbiter's call within its bound. Returns "", or what went wrong."""
        try:
            async with asyncio.timeout(CALL_TIMEOUT_S):
                await call
        except StaleCommandError as error:
            log.error("%s: %s", what, error)
            self._replaced(error)
            return str(error)
        except TimeoutError:
            log.error("%s: the arbiter did not return within %s s", what, CALL_TIMEOUT_S)
            return f"the arbiter did not return within {CALL_TIMEOUT_S:g} s"
        except OperatorError as error:  # the vehicle's fault, not the arbiter's
            log.error("%s: %s", what, error)
            return str(error)
        except Exception as error:  # an arbiter's fault must not end the executive
            log.exception("%s: the arbiter raised", what)
            return f"the arbiter raised {type(error).__name__}: {error}"
        return ""

    async def _start(self, command: StartBehavior) -> None:
        ids = _ids(command.resources)
        kind = BehaviorType(command.type)
        serving = self._arbiters.serving(ids, command.name, kind)
        arbiter = serving or self._arbiters.of(ids[0])
        if self._is_barred(command):
            return  # the run's stop, which comes next, ends it
        self._active[command.behavior] = active = _Active(arbiter, ids)
        if serving is None:
            reason = f"{', '.join(ids)} are served by different arbiters"
            self._refuse(command.behavior, "REJECTED", reason)
            return
        spec = self.spec(ids, command.name, kind)
        if spec is None:
            reason = f"{', '.join(ids)}: no {kind.value} behavior {command.name} is offered"
            self._refuse(command.behavior, "REJECTED", reason)
            return
        had_by = (*command.preempts, *command.keepings)
        refusal = self._availability.acquire(ids, command.behavior, had_by)
        if refusal is not None:
            self._refuse(command.behavior, "RESOURCE_UNAVAILABLE", refusal)
            return
        try:
            request = self.request(command, spec)
        except ParameterError as error:
            self._refuse(command.behavior, "REJECTED", str(error))
            return
        if left := self._fences.refusal(request):
            self._refuse(command.behavior, "REJECTED", left)
            return
        if self._clearance is not None:
            near = await self._clearance.refusal(request, spec)
            if near:
                self._refuse(command.behavior, "REJECTED", near)
                return
        await self._claims.confirmed()
        if self._is_barred(command):
            self._active.pop(command.behavior, None)
            return
        self._watch(request)
        wrong = await self._call(f"start {command.behavior}", arbiter.start(request))
        if wrong and self._active.get(command.behavior) is active:
            self._refuse(command.behavior, "REJECTED", wrong)

    def _watch(self, request: BehaviorRequest, *, adopted: bool = False) -> None:
        active = self._active.get(request.id)
        straight = active is not None and arbiter_capabilities(active.arbiter).straight
        self._conformance.begins(request, straight=straight, adopted=adopted)

    async def _adjust(self, command: AdjustBehavior, failed: Callable[[str], None]) -> str:
        goes_on = command.goes_on
        await self._claims.confirmed()
        active = self._active.get(goes_on.behavior)
        if active is None or active.deadline is not None or self._is_barred(goes_on):
            return ""
        spec = self.spec(active.resources, goes_on.name, BehaviorType(goes_on.type))
        if spec is None or not adjusts(active.arbiter):
            return "its arbiter cannot change it"  # any more: the fleet was changed meanwhile
        try:
            parameters = self.request(goes_on, spec).parameters
        except ParameterError as error:
            return str(error)
        changed = {name: parameters[name] for name in command.names}
        what, arbiter, answer = f"adjust {goes_on.behavior}", active.arbiter, None

        async def hand_over() -> None:
            nonlocal answer
            answer = await arbiter.adjust(goes_on.behavior, command.epoch, changed)

        wrong = await self._call(what, hand_over())
        if answer is not None:
            if active.answer is not None:
                active.answer.cancel()  # of what was to be changed before
            active.answer = asyncio.create_task(self._answered(what, active, answer, failed))
        return wrong

    async def _answered(
        self,
        what: str,
        active: _Active,
        answer: Awaitable[str],
        failed: Callable[[str], None],
    ) -> None:
        """Say that a vehicle does not go on as its behavior was changed, unless that is over."""
        try:
            async with asyncio.timeout(ANSWER_WITHIN_S):
                wrong = await answer
        except TimeoutError:
            wrong = f"there is no answer after {ANSWER_WITHIN_S:g} s"
        except Exception as error:  # an arbiter's fault must not end the executive
            log.exception("%s: the arbiter raised", what)
            wrong = f"the arbiter raised {type(error).__name__}: {error}"
        if wrong and active.deadline is None:
            failed(wrong)

    def request(self, command: StartBehavior, spec: BehaviorSpec) -> BehaviorRequest:
        """What an arbiter is asked for.

        Raises:
            ParameterError: a parameter makes no sense.
        """
        run = run_of(command.behavior)
        ids = _ids(command.resources)
        parameters = resolve(
            spec,
            command.parameters,
            lambda name: self._geometries(run, name),
            self._arbiters.fleet.vehicles,
            self._arbiters.fleet.origin,
        )
        return BehaviorRequest(
            command.behavior,
            command.epoch,
            command.name,
            parameters,
            ids,
            _resource_ids(command.roles),
            self._arbiters.teams.parts_of(command.preempts, ids),
        )

    def _is_barred(self, command: StartBehavior) -> bool:
        return run_of(command.behavior) in self._barred

    async def _turn(self, what: str, resource: ResourceId) -> str:
        """Hold or resume; asked in its turn, as a team may have taken the resource meanwhile."""
        arbiter = self._arbiters.holding(resource)
        if self._clearance is not None and what == "hold":
            self._clearance.reservations.delay(resource)
        call = arbiter.hold(resource) if what == "hold" else arbiter.resume(resource)
        return await self._call(f"{what} {resource}", call)

    async def _resume(self, resource: ResourceId, run: str) -> None:
        await self._claims.confirmed()
        if run not in self._barred:
            await self._turn("resume", resource)

    def spec(
        self, resources: tuple[ResourceId, ...], name: str, kind: BehaviorType
    ) -> BehaviorSpec | None:
        """How it is taken: by every member of a team, else by the first that offers it."""
        specs = [self._arbiters.graph.spec(resource, name, kind) for resource in resources]
        if kind is BehaviorType.TEAM and not all(specs):
            return None
        return next((spec for spec in specs if spec is not None), None)

    async def _cancel(self, command: CancelBehavior) -> None:
        await self._claims.confirmed()
        if run_of(command.behavior) in self._disowned:
            return
        active = self._active.get(command.behavior)
        if active is None:
            self._post(BehaviorReport(command.behavior, 1, BehaviorState.CANCELLED))
            return
        ids = _ids(command.resources)
        await self._cancel_active(command.behavior, active, ids, command.epoch)

    async def _cancel_active(
        self, behavior: str, active: _Active, resources: tuple[ResourceId, ...], epoch: int
    ) -> str:
        """Ask its arbiter to end it, within the arbiter's limit. Returns "", or what went wrong."""
        self._conformance.cancelled(behavior)
        wrong = await self._call(f"cancel {behavior}", active.arbiter.cancel(behavior, epoch))
        if self._active.get(behavior) is active and active.deadline is None:
            limits = [active.arbiter.limits(resource) for resource in resources]
            timeout_s = max(limit.cancel_timeout_s for limit in limits)
            active.deadline = asyncio.create_task(self._give_up(behavior, timeout_s))
        return wrong

    async def _give_up(self, behavior: str, timeout_s: float) -> None:
        await self._clock.sleep(timeout_s)
        active = self._active.get(behavior)
        if active is not None:
            reason = f"did not end within {timeout_s:g} s of its cancel"
            self._post(
                BehaviorReport(
                    behavior, active.last_number + 1, BehaviorState.LOST, "TIMEOUT", reason
                )
            )

    def _refuse(self, behavior: str, code: str, reason: str) -> None:
        number = self._active[behavior].last_number + 1
        self._post(BehaviorReport(behavior, number, BehaviorState.REJECTED, code, reason))


async def _returns(start: asyncio.Task[None] | None) -> bool:
    """Wait a little for a start under way; whether none is under way any more."""
    if start is None or start.done():
        return True
    await asyncio.wait({start}, timeout=START_WAIT_S)
    return start.done()


def _driven_elsewhere(run: str) -> str:
    return f"another executive drives {run}, which has it"


async def _nothing() -> None:
    """What is queued only to be waited for."""


def _ids(names: Iterable[str]) -> tuple[ResourceId, ...]:
    return tuple(ResourceId(name) for name in names)


def _resource_ids(roles: Mapping[str, tuple[str, ...]]) -> dict[str, tuple[ResourceId, ...]]:
    return {role: _ids(names) for role, names in roles.items()}
