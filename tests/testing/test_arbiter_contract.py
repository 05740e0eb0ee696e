"""The contract must find what is wrong with an arbiter, or it proves nothing of a good one."""

import asyncio
import dataclasses
import inspect
import os
import threading
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from pathlib import Path

import pytest

from m2pem.api.arbiter import (
    ArbiterContext,
    BehaviorReport,
    BehaviorRequest,
    Connection,
    Limits,
)
from m2pem.api.capabilities import ArbiterCapabilities
from m2pem.api.clock import Clock, run_virtual
from m2pem.api.telemetry import PayloadState, VehicleState
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.mission.geometry import Point, Route
from m2pem.mission.values import Value
from m2pem.simulation.arbiters import SimArbiter
from m2pem.simulation.faults import Fault
from m2pem.testing.contracts.arbiter import ArbiterCase, ArbiterContract

UGV1, UGV2 = ResourceId("ugv1"), ResourceId("ugv2")
CASE = ArbiterCase(
    vehicle=UGV1,
    other=UGV2,
    long=(
        "single_vehicle_routing",
        {"route": Route(((38.108, -77.3192, None), (38.110, -77.3180, None)))},
    ),
    short=("goto", {"target": Point((38.1077, -77.3192, None))}),
    bad=("speed", -1.0),
    route=(
        "single_vehicle_routing",
        {"route": Route(((38.108, -77.3192, None), (38.110, -77.3180, None)))},
    ),
)


class TwiceReported(SimArbiter):
    async def reports(self) -> AsyncIterator[BehaviorReport]:
        async for report in super().reports():
            yield report
            if report.state.terminal:
                yield dataclasses.replace(report, number=report.number + 1)


class EndsEarly(SimArbiter):
    async def connect(self) -> None:
        await super().connect()
        self.inject(UGV1, Fault("end_early", after_s=1.0))


class GoesOn(SimArbiter):
    async def connect(self) -> None:
        await super().connect()
        self.inject(UGV1, Fault("go_on"))


class NeverLess(SimArbiter):
    async def reports(self) -> AsyncIterator[BehaviorReport]:
        first: Mapping[str, Value] | None = None
        async for report in super().reports():
            first = first or report.remaining
            yield dataclasses.replace(report, remaining=report.remaining and first)


class NeverAccepted(SimArbiter):
    async def reports(self) -> AsyncIterator[BehaviorReport]:
        async for report in super().reports():
            if report.state is not BehaviorState.ACCEPTED:
                yield report


class Unnumbered(SimArbiter):
    async def reports(self) -> AsyncIterator[BehaviorReport]:
        async for report in super().reports():
            yield dataclasses.replace(report, number=1)


class Reasonless(SimArbiter):
    async def reports(self) -> AsyncIterator[BehaviorReport]:
        async for report in super().reports():
            yield dataclasses.replace(report, reason="")


class Codeless(SimArbiter):
    async def reports(self) -> AsyncIterator[BehaviorReport]:
        async for report in super().reports():
            yield dataclasses.replace(report, code="")


class StartsAnew(SimArbiter):
    async def start(self, request: BehaviorRequest) -> None:
        await super().start(dataclasses.replace(request, epoch=request.epoch + len(self.effects)))


class Careless(SimArbiter):
    async def start(self, request: BehaviorRequest) -> None:
        parameters = {k: v for k, v in request.parameters.items() if k in ("route", "target")}
        await super().start(dataclasses.replace(request, parameters=parameters))


class Greedy(SimArbiter):
    async def start(self, request: BehaviorRequest) -> None:
        busy = tuple(effect.behavior for effect in self.effects)
        await super().start(dataclasses.replace(request, preempts=busy))


class NeverPreempts(SimArbiter):
    async def start(self, request: BehaviorRequest) -> None:
        await super().start(dataclasses.replace(request, preempts=()))


class Timeless(SimArbiter):
    async def start(self, request: BehaviorRequest) -> None:
        await super().start(dataclasses.replace(request, epoch=9))

    async def cancel(self, behavior: str, epoch: int) -> None:
        await super().cancel(behavior, 9)


class StartsOne(SimArbiter):
    async def start(self, request: BehaviorRequest) -> None:
        if not self.effects:
            await super().start(request)


class Unfenced(SimArbiter):
    async def query(self, behavior: str, native_ref: str | None) -> BehaviorReport:
        return dataclasses.replace(await super().query(behavior, native_ref), epoch=0)

    async def fence(self, run: str, epoch: int) -> None:
        pass


class CancelsDisowned(SimArbiter):
    async def disown(self, run: str) -> None:
        for effect in self.effects:
            await super().cancel(effect.behavior, 9)


class NeverCancels(SimArbiter):
    async def cancel(self, behavior: str, epoch: int) -> None:
        pass


class CancelsAll(SimArbiter):
    async def cancel(self, behavior: str, epoch: int) -> None:
        for effect in self.effects:
            await super().cancel(effect.behavior, epoch)


class RaisesOnUnknown(SimArbiter):
    async def cancel(self, behavior: str, epoch: int) -> None:
        if not self.effects:
            raise KeyError(behavior)
        await super().cancel(behavior, epoch)


class AlwaysRunning(SimArbiter):
    async def query(self, behavior: str, native_ref: str | None) -> BehaviorReport:
        return BehaviorReport(behavior, 1, BehaviorState.RUNNING)


class Forgetful(SimArbiter):
    async def query(self, behavior: str, native_ref: str | None) -> BehaviorReport:
        return BehaviorReport(behavior, 0, BehaviorState.UNKNOWN)


class HidesHolds(SimArbiter):
    async def query(self, behavior: str, native_ref: str | None) -> BehaviorReport:
        return dataclasses.replace(await super().query(behavior, native_ref), held=False)


class NeverHolds(SimArbiter):
    async def hold(self, resource: ResourceId) -> None:
        pass


class NeverResumes(SimArbiter):
    async def resume(self, resource: ResourceId) -> None:
        pass


class Hasty(SimArbiter):
    def limits(self, resource: ResourceId) -> Limits:
        return Limits(hold_within_s=0.1, cancel_timeout_s=0.1)


class HearsNoLoss(SimArbiter):
    def lose_link(self, resource: ResourceId) -> None:
        pass


class LosesAll(SimArbiter):
    def lose_link(self, resource: ResourceId) -> None:
        for vehicle in (UGV1, UGV2):
            super().lose_link(vehicle)


class Anonymous(SimArbiter):
    async def telemetry(self) -> AsyncIterator[VehicleState | PayloadState]:
        async for state in super().telemetry():
            yield dataclasses.replace(state, resource=ResourceId("x"))


class OwnTime(SimArbiter):
    async def telemetry(self) -> AsyncIterator[VehicleState | PayloadState]:
        async for state in super().telemetry():
            yield dataclasses.replace(state, time_us=state.time_us + 10**12)


class Leaky(SimArbiter):
    async def connect(self) -> None:
        await super().connect()
        self.task = asyncio.create_task(asyncio.sleep(3600))


class LeavesThread(SimArbiter):
    async def connect(self) -> None:
        await super().connect()
        threading.Thread(target=time.sleep, args=(1,), daemon=True).start()


class LeavesFile(SimArbiter):
    async def connect(self) -> None:
        await super().connect()
        self.pipe = os.pipe()

    def __del__(self) -> None:
        for end in self.pipe:
            os.close(end)


class HoldsAll(SimArbiter):
    async def hold(self, resource: ResourceId) -> None:
        for vehicle in (UGV1, UGV2):
            await super().hold(vehicle)


class Instant(SimArbiter):
    async def start(self, request: BehaviorRequest) -> None:
        self.script(request.id, 0.0, "succeeded")
        await super().start(request)


class BeginsAnew(SimArbiter):
    """Takes a start that comes again as a new one, under another name."""

    async def start(self, request: BehaviorRequest) -> None:
        again = sum(effect.behavior.startswith(request.id) for effect in self.effects)
        await super().start(dataclasses.replace(request, id=request.id + "x" * again))


class ClosesOnce(SimArbiter):
    closed = False

    async def close(self) -> None:
        if self.closed:
            raise RuntimeError("closed already")
        self.closed = True
        await super().close()


class DrivesOn(SimArbiter):
    """Its vehicles still move when their links return, and are not stopped."""

    task: asyncio.Task[None]

    def restore_link(self, resource: ResourceId) -> None:
        super().restore_link(resource)
        request = BehaviorRequest("r9.b1", 1, *CASE.long, (resource,))
        self.task = asyncio.create_task(self.start(request))

    async def hold(self, resource: ResourceId) -> None:
        pass


class StaysHeld(SimArbiter):
    """What was held when it returned is never let go."""

    async def start(self, request: BehaviorRequest) -> None:
        if not self.effects:
            await super().start(request)


class Undeclared(SimArbiter):
    """Has methods of which the executive knows nothing."""

    capabilities = ArbiterCapabilities()


class Boastful(SimArbiter):
    """Declares what it does not have."""

    capabilities = ArbiterCapabilities(adjusts=True, sights=True, addresses=True, reclaims=True)


FINDS = [
    (Undeclared, "the_arbiter_declares_what_it_can_do_beyond_its_protocol"),
    (Boastful, "the_arbiter_declares_what_it_can_do_beyond_its_protocol"),
    (TwiceReported, "accepted_comes_before_running_and_one_terminal_report_last"),
    (NeverAccepted, "accepted_comes_before_running_and_one_terminal_report_last"),
    (EndsEarly, "accepted_comes_before_running_and_one_terminal_report_last"),
    (GoesOn, "cancel_ends_a_behavior_within_the_declared_bound"),
    (NeverLess, "less_and_less_is_left_of_a_route"),
    (Unnumbered, "report_numbers_rise_from_one"),
    (StartsAnew, "a_second_start_of_the_same_behavior_has_no_effect"),
    (BeginsAnew, "a_second_start_has_one_physical_effect"),
    (Reasonless, "an_unknown_behavior_is_rejected_by_name"),
    (Codeless, "an_unknown_behavior_is_rejected_by_name"),
    (Careless, "a_bad_parameter_is_rejected_by_name"),
    (Careless, "an_unknown_parameter_is_rejected_by_name"),
    (Greedy, "a_busy_vehicle_refuses_another_behavior"),
    (NeverPreempts, "a_behavior_that_preempts_takes_the_vehicle_over"),
    (NeverCancels, "cancel_ends_a_behavior_within_the_declared_bound"),
    (Hasty, "cancel_ends_a_behavior_within_the_declared_bound"),
    (TwiceReported, "a_second_cancel_changes_nothing"),
    (RaisesOnUnknown, "cancel_of_an_unknown_behavior_is_quiet"),
    (NeverCancels, "a_cancelled_vehicle_can_be_commanded_again"),
    (AlwaysRunning, "query_tells_what_runs_and_what_has_ended"),
    (AlwaysRunning, "query_of_an_unknown_behavior_is_unknown"),
    (Forgetful, "another_arbiter_finds_the_behavior_again"),
    (HidesHolds, "a_vehicle_that_another_arbiter_has_held_is_reported_as_held"),
    (Timeless, "a_start_of_a_past_epoch_is_refused"),
    (Timeless, "a_cancel_of_a_past_epoch_is_refused"),
    (StartsOne, "a_start_of_the_same_or_a_newer_epoch_is_accepted"),
    (Unfenced, "a_query_names_the_epoch_that_was_seen"),
    (Unfenced, "a_takeover_refuses_the_past_executive_for_every_vehicle"),
    (CancelsDisowned, "a_vehicle_goes_on_with_what_is_disowned"),
    (NeverHolds, "hold_stops_the_vehicle_within_the_declared_bound"),
    (Hasty, "hold_stops_the_vehicle_within_the_declared_bound"),
    (NeverHolds, "resume_goes_on_with_the_behavior"),
    (NeverResumes, "resume_goes_on_with_the_behavior"),
    (HearsNoLoss, "a_cut_link_is_lost_within_the_declared_bound"),
    (LosesAll, "a_cut_link_is_lost_within_the_declared_bound"),
    (DrivesOn, "a_lost_vehicle_whose_link_returns_stops_before_it_is_free"),
    (StaysHeld, "a_lost_vehicle_whose_link_returns_stops_before_it_is_free"),
    (CancelsAll, "two_vehicles_do_not_mix"),
    (Anonymous, "telemetry_names_the_resource_and_rises_in_time"),
    (OwnTime, "states_are_stamped_by_the_clock_of_the_context"),
    (Leaky, "nothing_leaks_after_close"),
    (LeavesThread, "nothing_leaks_after_close"),
    (LeavesFile, "nothing_leaks_after_close"),
    (HoldsAll, "a_held_vehicle_does_not_hold_up_the_other"),
    (Instant, "a_behavior_takes_its_time_of_the_clock_that_was_lent"),
    (ClosesOnce, "close_is_quiet_when_it_was_never_connected_or_is_closed_already"),
]


@pytest.mark.parametrize(
    ("broken", "test"), FINDS, ids=[f"{broken.__name__}-{test}" for broken, test in FINDS]
)
def test_the_contract_finds_what_is_wrong(
    broken: type[SimArbiter], test: str, tmp_path: Path
) -> None:
    def make(context: ArbiterContext) -> SimArbiter:
        settings = {"state": str(tmp_path / "state.sqlite")}
        connections = {name: Connection(name, "ground", settings) for name in (UGV1, UGV2)}
        return broken(connections, context)

    def cut(arbiter: SimArbiter, vehicle: ResourceId) -> None:
        arbiter.lose_link(vehicle)

    def mend(arbiter: SimArbiter, vehicle: ResourceId) -> None:
        arbiter.restore_link(vehicle)

    def count_starts(arbiter: SimArbiter, vehicle: ResourceId) -> int:
        return sum(e.kind == "start" and e.resource == vehicle for e in arbiter.effects)

    def run(main: Callable[[Clock], Awaitable[None]]) -> None:
        run_virtual(main, 0)

    offered = {
        "make_arbiter": make,
        "case": CASE,
        "run": run,
        "cut_link": cut,
        "mend_link": mend,
        "effects": count_starts,
    }
    check = getattr(ArbiterContract, f"test_{test}")
    _, *wanted = inspect.signature(check).parameters
    with pytest.raises((AssertionError, KeyError, RuntimeError)):
        check(ArbiterContract(), **{name: offered[name] for name in wanted})


def test_every_test_of_the_contract_but_that_of_the_catalogue_is_shown_to_find_something() -> None:
    tests = {name.removeprefix("test_") for name in dir(ArbiterContract) if "test_" in name}
    unproven = tests - {test for _, test in FINDS}
    assert unproven == {
        "the_catalogue_needs_no_connection",
        "hold_and_resume_of_an_idle_vehicle_are_quiet",
    }
