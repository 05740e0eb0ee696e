"""Orders of ground stations: checked, carried out as behaviors of m2pem, and acknowledged.

`MissionControl.execute_behavior` decides: it refuses a vehicle that a run or another operator has.
A station that asks for control (MAV_CMD_REQUEST_OPERATOR_CONTROL) takes the vehicle as an operator
does, and what the run did there ends.
"""

import asyncio
from collections import OrderedDict
from collections.abc import Callable, Collection, Coroutine
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import BehaviorState, MissionControl, ResourceId, RunId, RunStatus, distance_m
from m2pem.errors import BusyError, M2pemError, MissionError, OperatorError
from m2pem_plugin_mavlink.face.commands import (
    REQUEST_OPERATOR_CONTROL,
    Command,
    Order,
    RefusedCommandError,
    asks_for_offboard,
    order_of,
)
from m2pem_plugin_mavlink.face.modes import GUIDE, RUN_PLAN
from m2pem_plugin_mavlink.face.plan_runs import PlanRuns
from m2pem_plugin_mavlink.face.requests import (
    ACCEPTED,
    DENIED,
    REJECTED,
    Request,
    Say,
    acknowledge_plan,
    acknowledgement,
    name_of,
)
from m2pem_plugin_mavlink.face.stations import Station
from m2pem_plugin_mavlink.face.uploads import Uploads
from m2pem_plugin_mavlink.face.vehicle import ShownVehicle
from m2pem_plugin_mavlink.link.route import Peer
from m2pem_plugin_mavlink.protocol.messages import Address

FAILED: int = dialect.MAV_RESULT_FAILED
IN_PROGRESS: int = dialect.MAV_RESULT_IN_PROGRESS
CONFIGURE_GIMBAL: int = dialect.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE
ARM: int = dialect.MAV_CMD_COMPONENT_ARM_DISARM
ARMED_S = 10.0
"""An armed vehicle waits so long for what follows, as autopilots do (PX4: COM_DISARM_PRFLT,
ArduCopter: DISARM_DELAY)."""

SETTING_OUT = frozenset({"goto", "takeoff", "single_vehicle_routing"})
IN_GUIDED = frozenset({"goto", "takeoff", "orbit", "set_speed", "change_altitude"})
"""Orders after which a vehicle is in GUIDED still, as those of ArduPilot are."""

DEPARTURE_EVERY_S = 0.5
PROGRESS_EVERY_S = 1.0
"""MAVROS, simple programs and missions of MAVSDK take the first acknowledgement for the last one;
MAVSDK waits 2 s for it, QGroundControl 3 s."""

REPEATED_S = 3.0
"""Seconds after its end for which a command that comes again is a repetition of the same one."""

ORDERS_PER_S = 2.0
MOST_ORDERS_AT_ONCE = 6.0
"""Orders of one station for one resource: each is a run in the journal. Those that stop it are
counted apart."""

TARGET_EVERY_S = 1.0
SAME_TARGET_M = 0.5
MOST_OUTCOMES = 256

OFF = "commands of ground stations are off: faces.mavlink.commands"


_Key = tuple[Peer, Address, Address, int]


@dataclass(slots=True)
class _Pending:
    """A command of a station. `result`: its last acknowledgement."""

    command: Command
    request: Request
    result: int = IN_PROGRESS
    ended_s: float = 0.0
    runs_plan: bool = False

    @property
    def key(self) -> _Key:
        """Names the sender, the receiver and the kind of command."""
        request = self.request
        return request.station.peer, request.source, request.component, self.command.id

    @property
    def by(self) -> str:
        """Who commands, for the journal."""
        return self.request.by

    def acknowledge(self, result: int) -> None:
        """Send the result."""
        self.request.answer(acknowledgement(self.command.id, result, self.request.source))


class Orders:
    """`allowed`: the vehicles that stations may command; `say` tells a station why one is
    refused."""

    def __init__(
        self,
        control: MissionControl,
        allowed: Collection[ResourceId],
        plans: PlanRuns,
        say: Say,
        now_s: Callable[[], float],
    ) -> None:
        self._control = control
        self._allowed = allowed
        self._plans = plans
        self._say = say
        self._now_s = now_s
        self._pending: OrderedDict[_Key, _Pending] = OrderedDict()
        self._latest: dict[ResourceId, _Key] = {}
        self._last: dict[ResourceId, Order] = {}
        self._runs: dict[ResourceId, tuple[RunId, str]] = {}
        self._budgets: dict[tuple[Peer, ResourceId, bool], tuple[float, float]] = {}
        self._began: OrderedDict[RunId, asyncio.Future[tuple[int, str]]] = OrderedDict()
        self._targets: dict[tuple[Peer, Address, int], Order] = {}
        self._followed: dict[
            tuple[Peer, Address, int], asyncio.Future[RefusedCommandError | None]
        ] = {}
        self._tasks: set[asyncio.Task[None]] = set()
        self._uploads = Uploads(plans.store, self._begin, say)

    async def close(self) -> None:
        """Follow no order any more. What vehicles do goes on: the executive has it."""
        tasks = list(self._tasks)
        for task in tasks:
            task.cancel()
        if tasks:
            await asyncio.wait(tasks)

    # --- what the records say ---------------------------------------------------------------------

    def progressed(self, run: RunId, state: BehaviorState) -> None:
        """The behavior of a run is accepted or under way."""
        if state is BehaviorState.RUNNING:
            self._settle(run, ACCEPTED, "")

    def ended(self, run: RunId, state: BehaviorState, reason: str) -> None:
        """The behavior of a run has ended."""
        self._settle(run, ACCEPTED if state is BehaviorState.SUCCEEDED else FAILED, reason)

    def _settle(self, run: RunId, result: int, reason: str) -> None:
        began = self._outcome(run)
        if not began.done():
            began.set_result((result, reason))

    def _outcome(self, run: RunId) -> asyncio.Future[tuple[int, str]]:
        """Return what becomes of a run that carries out an order: MAV_RESULT and reason. Its
        records may come before `execute_behavior` returns."""
        began = self._began.get(run)
        if began is None:
            while len(self._began) >= MOST_OUTCOMES:
                self._began.popitem(last=False)
            began = self._began[run] = asyncio.get_running_loop().create_future()
        return began

    # --- commands ---------------------------------------------------------------------------------

    def command(self, command: Command, request: Request) -> None:
        """Carry out a command, or refuse it."""
        pending = _Pending(command, request)
        key = pending.key
        known = self._pending.get(key)
        if known is not None and self._repeats(known, pending):
            if known.result != IN_PROGRESS:
                pending.acknowledge(known.result)
            return
        self._pending[key] = pending
        self._pending.move_to_end(key)
        while len(self._pending) > MOST_OUTCOMES:
            self._pending.popitem(last=False)
        try:
            work = self._work(pending)
        except RefusedCommandError as error:
            self._refuse(pending, error)
            return
        if work is None:
            self._end(pending, ACCEPTED)
        else:
            self._begin(work)

    def _repeats(self, known: _Pending, again: _Pending) -> bool:
        """Return whether a command is the same one again, as its acknowledgement was lost."""
        command = again.command
        same = (known.command.params, known.command.place, known.command.z)
        if same != (command.params, command.place, command.z) and repr(same) != repr(
            (command.params, command.place, command.z)  # NaN differs from itself
        ):
            return False
        if known.result == IN_PROGRESS:
            return True
        if known.runs_plan and not again.request.vehicle.runs_plan:
            return False  # its run has ended since
        recent = self._now_s() - known.ended_s <= REPEATED_S
        latest = self._latest.get(again.request.vehicle.resource) in (again.key, None)
        return recent and latest and (command.confirmation > 0 or known.result == ACCEPTED)

    def _work(self, pending: _Pending) -> Coroutine[Any, Any, None] | None:
        """Return what carries a command out; None: nothing is to be done.

        Raises:
            RefusedCommandError: it is refused.
        """
        command, request = pending.command, pending.request
        vehicle = request.vehicle
        if vehicle.resource not in self._allowed:
            raise RefusedCommandError(OFF)
        if command.id == REQUEST_OPERATOR_CONTROL:
            return self._hand_over(pending)
        if command.id == CONFIGURE_GIMBAL:
            for each in vehicle.cameras:
                each.controller = request.source
            return None
        if command.id == ARM and request.camera is None:
            return self._arm(pending)
        target = self._followed.get((request.station.peer, request.source, vehicle.system))
        if target is not None and asks_for_offboard(command):
            return self._offboard(pending, target)
        order = order_of(command, vehicle, request.camera)
        if order is None:
            return None
        self._count(order, request.station)
        order = self._with_speed(order, vehicle)
        if order.behavior == "set_speed" and vehicle.runs_plan:
            raise RefusedCommandError("its plan goes on at the speeds of its items", REJECTED)
        self._latest[vehicle.resource] = pending.key
        pending.runs_plan = order.behavior == RUN_PLAN
        return self._carry_out(pending, order)

    def _with_speed(self, order: Order, vehicle: ShownVehicle) -> Order:
        """Another speed on the way to a target is a new order to go there: one behavior replaces
        the other, and `set_speed` alone would stop the vehicle."""
        last = self._last.get(vehicle.resource)
        if order.behavior != "set_speed" or last is None or last.behavior != "goto":
            return order
        if vehicle.behavior != "goto":
            return order
        return Order(last.resource, "goto", {**last.parameters, **order.parameters})

    def _count(self, order: Order, station: Station) -> None:
        """Count an order of a station.

        Raises:
            RefusedCommandError: there are too many.
        """
        now_s = self._now_s()
        key = station.peer, order.resource, order.behavior == "hold"
        left, counted_s = self._budgets.get(key, (MOST_ORDERS_AT_ONCE, now_s))
        left = min(MOST_ORDERS_AT_ONCE, left + ORDERS_PER_S * (now_s - counted_s))
        if left < 1.0:
            raise RefusedCommandError("commands come too fast", REJECTED)
        self._budgets[key] = left - 1.0, now_s
        if len(self._budgets) > MOST_OUTCOMES:
            refilled_s = now_s - MOST_ORDERS_AT_ONCE / ORDERS_PER_S
            self._budgets = {
                each: budget for each, budget in self._budgets.items() if budget[1] > refilled_s
            }

    async def _offboard(
        self, pending: _Pending, target: asyncio.Future[RefusedCommandError | None]
    ) -> None:
        """Answer the mode Offboard as its first target is answered, which is on the way already."""
        refusal = await asyncio.shield(target)
        if refusal is None:
            self._end(pending, ACCEPTED)
        else:
            self._refuse(pending, refusal)

    async def _hand_over(self, pending: _Pending) -> None:
        resource, by = pending.request.vehicle.resource, pending.by
        takes = pending.command.params[0] == 1
        try:
            if takes:
                await self._control.take(resource, by=by)
            else:
                # A station gives back only what it has itself, for whatever reason.
                holder = (await self._control.holders()).get(resource)
                if holder != by:
                    raise OperatorError(f"it is not with {by}, but with {holder or 'no operator'}")
                await self._control.give_back(resource, by=by)
        except M2pemError as error:
            self._refuse(pending, RefusedCommandError(str(error), REJECTED))
        else:
            self._end(pending, ACCEPTED)

    def _arm(self, pending: _Pending) -> Coroutine[Any, Any, None] | None:
        vehicle, arms = pending.request.vehicle, pending.command.params[0] == 1
        if arms:
            return None if vehicle.armed else self._await_departure(pending)
        if vehicle.arm_requested and not vehicle.behavior and not vehicle.airborne:
            vehicle.arm_requested = False
        elif vehicle.armed:
            raise RefusedCommandError("m2pem does not disarm: send a landing or a hold")
        return None

    async def _await_departure(self, pending: _Pending) -> None:
        """Accept ARM if the vehicle could set out now. m2pem arms it when it does."""
        vehicle = pending.request.vehicle
        try:
            reason = await self._why_it_stays(vehicle, pending.by)
        except M2pemError as error:
            reason = str(error)
        if reason:
            self._refuse(pending, RefusedCommandError(reason, REJECTED))
            return
        vehicle.arm_requested = True
        self._end(pending, ACCEPTED)
        tell = partial(self._say, pending.request.station, vehicle)
        if vehicle.arms_itself:
            tell("it arms when it sets out: send a takeoff, a target or a mission")
        departed = False
        end_s = self._now_s() + ARMED_S
        while vehicle.arm_requested and not departed and (left_s := end_s - self._now_s()) > 0:
            await asyncio.sleep(min(left_s, DEPARTURE_EVERY_S))
            departed = bool(vehicle.behavior)
        if vehicle.arm_requested and not departed:
            tell(f"disarmed: nothing followed within {ARMED_S:g} s")
        vehicle.arm_requested = False

    async def _why_it_stays(self, vehicle: ShownVehicle, by: str) -> str:
        """Return why a vehicle could not set out for a station now; "": it could."""
        if SETTING_OUT.isdisjoint(vehicle.behaviors):
            return f"{vehicle.resource} has no behavior that moves it"
        if vehicle.state is not None and vehicle.state.ready is False:
            return ", ".join(vehicle.state.not_ready_reasons) or "it is not ready"
        holder = (await self._control.holders()).get(vehicle.resource, "")
        if holder == by:
            return ""
        if holder:
            return f"{holder} has it"
        return (await self._control.unavailable()).get(vehicle.resource, "")

    async def _carry_out(self, pending: _Pending, order: Order) -> None:
        executing = asyncio.ensure_future(self._execute(order, pending.by, pending.request.vehicle))
        try:
            while not (await asyncio.wait([executing], timeout=PROGRESS_EVERY_S))[0]:
                pending.acknowledge(IN_PROGRESS)
            result, reason = executing.result()
        except asyncio.CancelledError:
            executing.cancel()
            raise
        if result == ACCEPTED:
            self._end(pending, ACCEPTED)
        else:
            self._refuse(pending, RefusedCommandError(reason, result))

    async def _execute(self, order: Order, by: str, vehicle: ShownVehicle) -> tuple[int, str]:
        """Carry an order out, and note it as the last one unless it is refused."""
        if order.behavior == GUIDE:
            return await self._guide(order.resource, by, vehicle)
        vehicle.guided &= order.behavior in IN_GUIDED or order.resource != vehicle.resource
        if order.resource == vehicle.resource:
            done = await self._about_plan(order, by, vehicle)
            if done is not None:
                return done
        before = self._last.get(order.resource)
        self._last[order.resource] = order
        result, reason = await self._outcome_of(order, by)
        if result != ACCEPTED and self._last.get(order.resource) is order:
            del self._last[order.resource]
            if before is not None:
                self._last[order.resource] = before
        return result, reason

    async def _guide(self, resource: ResourceId, by: str, vehicle: ShownVehicle) -> tuple[int, str]:
        """End what a vehicle does, unless a station has guided it there, and let it wait."""
        if vehicle.behavior and not vehicle.guided:
            result, reason = await self._execute(Order(resource, "hold"), by, vehicle)
            if result != ACCEPTED:
                return result, reason
        vehicle.guided = True
        return ACCEPTED, ""

    async def _about_plan(
        self, order: Order, by: str, vehicle: ShownVehicle
    ) -> tuple[int, str] | None:
        """Begin a plan, go on with it, pause it, or end it for another order of its station; None:
        the order is to be carried out."""
        run = vehicle.plan_run
        own = run is not None and vehicle.runs_plan and run.by == by
        try:
            if order.behavior == RUN_PLAN:
                if not vehicle.runs_plan:
                    await self._end_last(vehicle.resource, by)
                await self._plans.start(vehicle, by)
                return ACCEPTED, ""
            if run is None or not own:
                return None
            if order.behavior == "hold":
                if run.status is not RunStatus.PAUSED:
                    await self._control.pause(run.run, by=by)
                return ACCEPTED, ""
            await self._control.stop(run.run, by=by, reason=f"{order.behavior} takes its place")
            await self._control.wait(run.run)
        except RefusedCommandError as error:
            return error.result, error.reason
        except MissionError as error:
            return DENIED, _first(error)
        except M2pemError as error:
            return REJECTED, str(error)
        return None

    async def _end_last(self, resource: ResourceId, by: str) -> None:
        """End the behavior that a station has commanded before, as another one would."""
        run, own = self._runs.get(resource, ("", ""))
        if own == by:
            with suppress(OperatorError):  # it has ended
                await self._control.stop(run, by=by, reason="its plan takes its place")
            await self._control.wait(run)

    async def _outcome_of(self, order: Order, by: str) -> tuple[int, str]:
        """Begin a behavior; return when it is under way or has ended: MAV_RESULT and reason."""
        try:
            run = await self._control.execute_behavior(
                order.resource, order.behavior, order.parameters, by=by
            )
        except MissionError as error:
            return DENIED, _first(error)
        except (BusyError, OperatorError) as error:
            return REJECTED, str(error)
        except M2pemError as error:
            return FAILED, str(error)
        self._runs[order.resource] = run, by
        began = self._outcome(run)
        ending = asyncio.ensure_future(self._control.wait(run))
        try:
            both: list[asyncio.Future[Any]] = [began, ending]
            await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)
            if began.done():
                return began.result()
            return FAILED, ending.result().detail or "it did not begin"
        finally:
            ending.cancel()
            self._began.pop(run, None)

    # --- plans ------------------------------------------------------------------------------------

    def upload(self, request: Request) -> bool:
        """Take a message that uploads or clears a plan; return False if it is of another kind."""
        match request.message.TYPE.name:
            case "MISSION_ACK":
                self._uploads.cancelled(request)
            case "MISSION_ITEM" | "MISSION_ITEM_INT":
                self._uploads.item(request)
            case "MISSION_COUNT" if self._may_upload(request):
                self._uploads.count(request)
            case "MISSION_CLEAR_ALL" if self._may_upload(request):
                self._begin(self._plans.clear(request))
            case "MISSION_WRITE_PARTIAL_LIST":
                acknowledge_plan(request, dialect.MAV_MISSION_UNSUPPORTED)
            case "MISSION_SET_CURRENT" if request.message.seq:
                self._say(request.station, request.vehicle, "a plan is carried out as a whole")
            case "MISSION_COUNT" | "MISSION_CLEAR_ALL" | "MISSION_SET_CURRENT":
                pass
            case _:
                return False
        return True

    def _may_upload(self, request: Request) -> bool:
        if request.vehicle.resource in self._allowed:
            return True
        acknowledge_plan(request, dialect.MAV_MISSION_DENIED)
        self._say(request.station, request.vehicle, OFF)
        return False

    # --- targets that are sent again and again ----------------------------------------------------

    def target(self, order: Order, request: Request) -> None:
        """Go to a target that has no acknowledgement (SET_POSITION_TARGET_GLOBAL_INT). Stations
        repeat it many times in a second: only another target is a new order."""
        station, vehicle = request.station, request.vehicle
        key = station.peer, request.source, vehicle.system
        if vehicle.resource not in self._allowed:
            self._say(station, vehicle, OFF)
            return
        self._targets[key] = order
        if key not in self._followed:
            self._followed[key] = asyncio.get_running_loop().create_future()
            self._begin(self._follow(key, request))

    async def _follow(self, key: tuple[Peer, Address, int], request: Request) -> None:
        station, vehicle = request.station, request.vehicle
        done: Order | None = None
        try:
            while (order := self._targets.pop(key, None)) is not None:
                if done is None or not _same(order, done):
                    refusal = None
                    try:
                        self._count(order, station)
                    except RefusedCommandError as error:
                        refusal = error
                    else:
                        done = order
                        by = name_of(request.source, station)
                        result, reason = await self._execute(order, by, vehicle)
                        if result != ACCEPTED:
                            refusal = RefusedCommandError(reason, result)
                    if refusal is not None:
                        self._say(station, vehicle, refusal.reason)
                    if (answer := self._followed[key]).done():
                        answer = self._followed[key] = asyncio.get_running_loop().create_future()
                    answer.set_result(refusal)
                await asyncio.sleep(TARGET_EVERY_S)
        finally:
            self._followed.pop(key).cancel()

    # --- acknowledgements -------------------------------------------------------------------------

    def _begin(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _refuse(self, pending: _Pending, error: RefusedCommandError) -> None:
        self._end(pending, error.result)
        request, text = pending.request, f"{pending.command.name}: {error.reason}"
        self._say(request.station, request.vehicle, text)

    def _end(self, pending: _Pending, result: int) -> None:
        pending.result, pending.ended_s = result, self._now_s()
        pending.acknowledge(result)


def _same(order: Order, other: Order) -> bool:
    a, b = order.parameters["target"], other.parameters["target"]
    assert isinstance(a, list) and isinstance(b, list)
    near = distance_m((a[0], a[1]), (b[0], b[1])) <= SAME_TARGET_M  # type: ignore[arg-type]
    return near and a[2:] == b[2:]


def _first(error: MissionError) -> str:
    findings = list(error.findings)
    return findings[0].message if findings else str(error)
