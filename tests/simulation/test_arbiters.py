import asyncio
import math
from itertools import chain
from typing import Any

import pytest

from m2pem.api.arbiter import BehaviorReport, Connection
from m2pem.api.clock import Clock, SystemClock, run_virtual
from m2pem.api.telemetry import VehicleState
from m2pem.errors import FleetError
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.mission.geometry import Point, VehiclePosition
from m2pem.simulation.arbiters import SimArbiter
from m2pem.simulation.executions import EffectKind
from m2pem.simulation.faults import Fault
from m2pem.simulation.kinematics import DEFAULTS
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness, context
from tests.simulation.conftest import START_US, Fleet, Simulate, area, local, make, place, route

S = 1_000_000
UGV: Fleet = {"ugv": ("ground", {"heading": "90 deg"})}
UAV: Fleet = {"uav": ("air", {})}
EAST_100 = route((50, 0), (100, 0))
GROUND = DEFAULTS["ground"]
DRIVE_S = 100 / 5 + 5 / 1.5 / 2 + 5 / 3 / 2


def state(bench: ArbiterHarness, vehicle: str) -> VehicleState:
    found = bench.latest(vehicle)
    assert isinstance(found, VehicleState)
    return found


def kinds(arbiter: SimArbiter, behavior: str) -> list[EffectKind]:
    return [effect.kind for effect in arbiter.effects if effect.behavior == behavior]


def test_a_behavior_ends_exactly_when_its_motion_does(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await bench.start("r1.b1", "single_vehicle_routing", "ugv", route=EAST_100)
        end = await bench.ended("r1.b1", 3600)
        assert (bench.clock.now_us() - START_US) / S == pytest.approx(DRIVE_S, abs=1e-3)
        assert (end.state, end.native_ref) == (BehaviorState.SUCCEEDED, "r1.b1")
        assert local(state(bench, "ugv").position) == pytest.approx((100, 0), abs=0.01)

    simulate(UGV, main)


def test_a_pause_moves_the_end_by_the_pause(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", "single_vehicle_routing", "ugv", route=EAST_100)
        await bench.clock.sleep(10)
        await arbiter.hold(ResourceId("ugv"))
        await arbiter.hold(ResourceId("ugv"))
        await bench.clock.sleep(100)
        assert state(bench, "ugv").mode == "hold"
        await arbiter.resume(ResourceId("ugv"))
        await arbiter.resume(ResourceId("ugv"))
        await bench.ended("r1.b1", 3600)
        assert (bench.clock.now_us() - START_US) / S == pytest.approx(DRIVE_S + 100, abs=1e-3)
        assert kinds(arbiter, "r1.b1") == ["start", "hold", "resume", "end"]

    simulate(UGV, main)


def test_cancel_brakes_first_and_the_vehicle_stays_where_it_stopped(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", "single_vehicle_routing", "ugv", route=EAST_100)
        await bench.clock.sleep(10)
        await arbiter.cancel("r1.b1", 1)
        await arbiter.cancel("r1.b1", 1)
        end = await bench.ended("r1.b1", 60)
        braking_s = 5 / GROUND.deceleration_m_s2
        assert (bench.clock.now_us() - START_US) / S == pytest.approx(10 + braking_s, abs=1e-3)
        assert end.state is BehaviorState.CANCELLED
        stopped = state(bench, "ugv").position
        await arbiter.resume(ResourceId("ugv"))
        await bench.start("r1.b2", "hold", "ugv", duration=100.0)
        await bench.ended("r1.b2", 101)
        assert local(state(bench, "ugv").position) == pytest.approx(local(stopped))
        assert kinds(arbiter, "r1.b1") == ["start", "cancel", "end"]

    simulate(UGV, main)


def test_a_held_behavior_can_be_cancelled(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", "single_vehicle_routing", "ugv", route=EAST_100)
        await bench.clock.sleep(10)
        await arbiter.hold(ResourceId("ugv"))
        await bench.clock.sleep(100)
        await arbiter.cancel("r1.b1", 1)
        assert (await bench.ended("r1.b1", 0.001)).state is BehaviorState.CANCELLED

    simulate(UGV, main)


def test_preempting_ends_the_old_at_once_and_brakes_from_its_speed(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", "single_vehicle_routing", "ugv", route=EAST_100)
        await bench.clock.sleep(10)
        await arbiter.cancel("r1.b1", 1)
        await bench.start("r1.b2", "drive_stop", "ugv", preempts=("r1.b1",))
        assert (await bench.ended("r1.b1", 0.001)).state is BehaviorState.CANCELLED
        await bench.ended("r1.b2", 60)
        braking_s = 5 / GROUND.deceleration_m_s2
        assert (bench.clock.now_us() - START_US) / S == pytest.approx(10 + braking_s, abs=1e-3)
        gone_m = 5 * 10 - 5 * 5 / 1.5 / 2 + 25 / (2 * GROUND.deceleration_m_s2)
        assert local(state(bench, "ugv").position)[0] == pytest.approx(gone_m, abs=0.01)

    simulate(UGV, main)


def test_a_busy_resource_is_refused_and_a_vehicle_and_its_payload_are_held_apart(
    simulate: Simulate,
) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await bench.start("r1.b1", "teleop", "ugv")
        await bench.start("r1.b2", "hold", "ugv")
        await bench.start("r1.b3", "record_video", "ugv/ptz")
        refused = await bench.ended("r1.b2", 1)
        assert refused.code == "RESOURCE_UNAVAILABLE"
        assert "r1.b1" in refused.reason
        assert bench.states_of("r1.b3") == ["ACCEPTED", "RUNNING"]

    simulate({**UGV, "ugv/ptz": ("ground", {})}, main)


@pytest.mark.parametrize(
    ("behavior", "parameters", "said"),
    [
        ("single_vehicle_routin", {}, "single_vehicle_routing"),
        ("takeoff", {"altitude": 3.0}, "takeoff"),
        ("single_vehicle_routing", {}, "'route'"),
        ("single_vehicle_routing", {"route": 3.0}, "'route'"),
        ("single_vehicle_routing", {"route": EAST_100, "sped": 1.0}, "'sped'"),
        ("single_vehicle_routing", {"route": EAST_100, "speed": math.nan}, "'speed'"),
        ("follow", {"target": VehiclePosition("nobody")}, "nobody"),
        ("goto", {"target": Point((0.0, 0.0, None))}, "`origin`"),
        ("area_survey", {"area": area((0, 0), (9000, 0), (0, 9000)), "spacing": 0.1}, "spacing"),
    ],
)
def test_what_cannot_be_done_is_rejected_by_name(
    simulate: Simulate, behavior: str, parameters: dict[str, object], said: str
) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", behavior, "ugv", **parameters)  # type: ignore[arg-type]
        end = await bench.ended("r1.b1", 1)
        assert (end.state, end.code) == (BehaviorState.REJECTED, "REJECTED")
        assert said in end.reason
        assert arbiter.effects == []

    simulate(UGV, main)


def test_a_behavior_that_the_fleet_does_not_allow_is_rejected(simulate: Simulate) -> None:
    async def main(clock: Clock) -> None:
        ugv = ResourceId("ugv")
        allowed = Connection(ugv, "ground", behaviors=("hold",))
        arbiter = SimArbiter({ugv: allowed}, context(clock))
        async with ArbiterHarness(arbiter, clock) as bench:
            await bench.start("r1.b1", "drive_stop", "ugv")
            assert "does not allow" in (await bench.ended("r1.b1", 1)).reason

    run_virtual(main, START_US)


def test_a_restart_with_a_higher_epoch_starts_what_has_ended_and_goes_on_counting(
    simulate: Simulate,
) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", "hold", "ugv", duration=5.0)
        await bench.ended("r1.b1", 6)
        await bench.start("r1.b1", "hold", "ugv", duration=5.0)
        await bench.start("r1.b1", "hold", "ugv", duration=5.0, epoch=2)
        await bench.until(lambda: len(bench.of("r1.b1")) == 6, 6)
        assert [report.number for report in bench.of("r1.b1")] == [1, 2, 3, 4, 5, 6]
        assert kinds(arbiter, "r1.b1") == ["start", "end", "start", "end"]

    simulate(UGV, main)


# --- faults and scripts -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("end", "expected"),
    [
        ("failed", ("FAILED", "ROUTE_BLOCKED")),
        ("succeeded", ("SUCCEEDED", "")),
        ("lost", ("LOST", "ROUTE_BLOCKED")),
    ],
)
@pytest.mark.parametrize("after_s", [10.0, 100.0])
def test_a_script_ends_a_behavior_before_or_after_its_motion(
    simulate: Simulate, end: str, expected: tuple[str, str], after_s: float
) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        arbiter.script("r1.b1", after_s, end, "ROUTE_BLOCKED")
        await bench.start("r1.b1", "single_vehicle_routing", "ugv", route=EAST_100)
        report = await bench.ended("r1.b1", 3600)
        assert (report.state, report.code) == expected
        assert bench.clock.now_us() == START_US + after_s * S
        await bench.start("r1.b2", "hold", "ugv")
        assert (await bench.ended("r1.b2", 10)).state is BehaviorState.SUCCEEDED

    simulate(UGV, main)


def test_a_pause_does_not_count_for_a_script(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        arbiter.script("r1.b1", 10.0, "failed")
        await bench.start("r1.b1", "single_vehicle_routing", "ugv", route=EAST_100)
        await bench.clock.sleep(4)
        await arbiter.hold(ResourceId("ugv"))
        await bench.clock.sleep(50)
        await arbiter.resume(ResourceId("ugv"))
        assert (await bench.ended("r1.b1", 100)).code == "FAILED"
        assert bench.clock.now_us() == START_US + 60 * S

    simulate(UGV, main)


@pytest.mark.parametrize(
    ("behavior", "resource", "parameters"),
    [
        ("single_vehicle_routing", "ugv", {"route": EAST_100}),
        ("hold", "ugv", {"duration": 5.0}),
        ("takeoff", "uav", {"altitude": 20.0}),
        ("area_survey", "uav", {"area": area((0, 0), (60, 0), (60, 40), (0, 40))}),
        ("take_picture", "uav/cam", {"count": 5, "interval": 2.0}),
        ("record_video", "uav/cam", {"duration": 7.0}),
    ],
)
def test_a_behavior_scaled_in_time_takes_as_many_times_as_long_for_the_same_motion(
    simulate: Simulate, behavior: str, resource: str, parameters: dict[str, Any]
) -> None:
    took_s: list[float] = []
    ends: list[tuple[list[float], object]] = []

    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        if took_s:
            arbiter.scale_time("r1.b1", 2.5)
        await bench.start("r1.b1", behavior, resource, **parameters)
        report = await bench.ended("r1.b1", 36_000)
        assert report.state is BehaviorState.SUCCEEDED
        now_us = bench.clock.now_us()
        took_s.append((now_us - START_US) / S)
        ways = [(each.driven_m(now_us), *each.pose(now_us).place) for each in arbiter.vehicles]
        ends.append(([*chain(*ways)], report.outputs.get("picture.files")))

    aloft = {"altitude": "30 m"} if behavior == "area_survey" else {}
    fleet: Fleet = {**UGV, "uav": ("air", aloft), "uav/cam": ("air", {"kind": "camera"})}
    for _ in range(2):
        simulate(fleet, main)
    assert took_s[1] == pytest.approx(2.5 * took_s[0], abs=1e-3)
    assert took_s[0] > 1
    (way, files), (scaled_way, scaled_files) = ends
    assert scaled_way == pytest.approx(way, abs=0.01)
    assert scaled_files == files


def test_a_behavior_scaled_in_time_is_slower_at_an_adjusted_speed_too(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        arbiter.scale_time("r1.b1", 2.0)
        await bench.start("r1.b1", "single_vehicle_routing", "ugv", route=EAST_100)
        await bench.clock.sleep(10)
        [vehicle] = arbiter.vehicles
        assert vehicle.pose(bench.clock.now_us()).speed == pytest.approx(2.5)
        await arbiter.adjust("r1.b1", 1, {"speed": 2.0})
        await bench.clock.sleep(5)
        assert vehicle.pose(bench.clock.now_us()).speed == pytest.approx(1.0)
        await bench.ended("r1.b1", 3600)
        assert local(state(bench, "ugv").position) == pytest.approx((100, 0), abs=0.01)

    simulate(UGV, main)


def test_a_script_that_says_no_possible_end_is_an_error(simulate: Simulate) -> None:
    async def main(_: ArbiterHarness, arbiter: SimArbiter) -> None:
        with pytest.raises(ValueError, match="stalled or lost, not 'exploded'"):
            arbiter.script("r1.b1", 1.0, "exploded")

    simulate(UGV, main)


def test_faults_of_the_fleet_strike_as_often_as_they_say(simulate: Simulate) -> None:
    faults = [
        {"kind": "reject", "behavior": "hold", "error": "BUSY"},
        {"kind": "fail", "after": "5 s", "error": "ROUTE_BLOCKED"},
    ]

    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        ends: list[BehaviorReport] = []
        for number in range(3):
            await bench.start(f"r1.b{number}", "hold", "ugv", duration=20.0)
            ends.append(await bench.ended(f"r1.b{number}", 60))
        assert [(end.state, end.code) for end in ends] == [
            ("REJECTED", "BUSY"),
            ("FAILED", "ROUTE_BLOCKED"),
            ("SUCCEEDED", ""),
        ]
        assert bench.clock.now_us() == START_US + 25 * S

    simulate({"ugv": ("ground", {"faults": faults})}, main)


def test_a_payload_does_not_inherit_the_faults_of_its_vehicle(simulate: Simulate) -> None:
    settings = {"faults": [{"kind": "reject"}]}

    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await bench.start("r1.b1", "zoom", "ugv/ptz", level=2.0)
        assert (await bench.ended("r1.b1", 10)).state is BehaviorState.SUCCEEDED

    simulate({"ugv": ("ground", settings), "ugv/ptz": ("ground", settings)}, main)


def test_a_stalled_behavior_never_reports_again_but_cancel_frees_its_vehicle(
    simulate: Simulate,
) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        arbiter.inject(ResourceId("ugv"), Fault("stall", after_s=5.0))
        await bench.start("r1.b1", "single_vehicle_routing", "ugv", route=EAST_100)
        await bench.clock.sleep(1000)
        assert state(bench, "ugv").velocity_enu_m_s == (0.0, 0.0, 0.0)
        await arbiter.cancel("r1.b1", 1)
        await bench.clock.sleep(1000)
        assert bench.states_of("r1.b1") == ["ACCEPTED", "RUNNING"]
        assert (await arbiter.query("r1.b1", None)).state is BehaviorState.CANCELLED
        await bench.start("r1.b2", "hold", "ugv")
        assert (await bench.ended("r1.b2", 1)).state is BehaviorState.SUCCEEDED

    simulate(UGV, main)


# --- links --------------------------------------------------------------------------------------


def test_a_lost_link_silences_the_vehicle_and_loses_its_behaviors(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", "single_vehicle_routing", "ugv", route=EAST_100)
        await bench.start("r1.b2", "record_video", "ugv/ptz")
        await bench.clock.sleep(5)
        arbiter.lose_link(ResourceId("ugv"))
        await bench.clock.sleep(0)
        heard = len(bench.states)
        assert (await arbiter.query("r1.b1", None)).state is BehaviorState.RUNNING
        for behavior in ("r1.b1", "r1.b2"):
            end = await bench.ended(behavior, 3.001)
            assert (end.state, end.code) == (BehaviorState.LOST, "LINK_LOST")
        assert bench.clock.now_us() == START_US + 8 * S
        await bench.clock.sleep(100)
        assert len(bench.states) == heard
        arbiter.restore_link(ResourceId("ugv"))
        await bench.until(lambda: len(bench.states) > heard, 1)
        await bench.start("r1.b3", "hold", "ugv")
        assert (await bench.ended("r1.b3", 1)).state is BehaviorState.SUCCEEDED
        assert len(bench.of("r1.b1")) == 3

    simulate({**UGV, "ugv/ptz": ("ground", {})}, main, telemetry_hz=5.0)


def test_what_was_said_and_commanded_without_a_link_arrives_when_it_is_mended(
    simulate: Simulate,
) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", "hold", "ugv", duration=1.0)
        arbiter.lose_link(ResourceId("ugv"))
        await bench.clock.sleep(2)
        assert bench.states_of("r1.b1") == ["ACCEPTED", "RUNNING"]
        await bench.start("r1.b2", "hold", "ugv", duration=10.0)
        assert (await arbiter.query("r1.b2", None)).state is BehaviorState.UNKNOWN
        arbiter.restore_link(ResourceId("ugv"))
        assert (await bench.ended("r1.b1", 0.1)).state is BehaviorState.SUCCEEDED
        await bench.ended("r1.b2", 10.1)
        assert bench.clock.now_us() == START_US + 12 * S

    simulate(UGV, main)


def test_a_start_that_never_reached_its_vehicle_is_lost_and_never_done(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        arbiter.lose_link(ResourceId("ugv"))
        await bench.clock.sleep(1)
        await bench.start("r1.b1", "hold", "ugv", duration=1.0)
        assert (await bench.ended("r1.b1", 3)).state is BehaviorState.LOST
        await bench.start("r1.b2", "hold", "ugv", duration=1.0)
        assert (await bench.ended("r1.b2", 0.1)).state is BehaviorState.LOST
        arbiter.restore_link(ResourceId("ugv"))
        await bench.clock.sleep(100)
        assert arbiter.effects == []

    simulate(UGV, main)


def test_a_link_that_is_mended_in_time_loses_nothing(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", "single_vehicle_routing", "ugv", route=EAST_100)
        for _ in range(4):
            arbiter.lose_link(ResourceId("ugv"))
            await bench.clock.sleep(2)
            arbiter.restore_link(ResourceId("ugv"))
        assert (await bench.ended("r1.b1", 100)).state is BehaviorState.SUCCEEDED

    simulate(UGV, main)


def test_the_fault_of_a_link_cuts_it(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        arbiter.inject(ResourceId("ugv"), Fault("lose_link", after_s=4.0))
        await bench.start("r1.b1", "single_vehicle_routing", "ugv", route=EAST_100)
        assert (await bench.ended("r1.b1", 100)).state is BehaviorState.LOST
        assert bench.clock.now_us() == START_US + 7 * S

    simulate(UGV, main)


# --- batteries ----------------------------------------------------------------------------------


def test_an_empty_battery_fails_the_behavior_and_brings_the_vehicle_down(
    simulate: Simulate,
) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await bench.start("r1.b1", "takeoff", "uav", altitude=30.0)
        await bench.ended("r1.b1", 60)
        await bench.start("r1.b2", "teleop", "uav")
        end = await bench.ended("r1.b2", 1000)
        assert (end.state, end.code) == (BehaviorState.FAILED, "BATTERY_LOW")
        assert bench.clock.now_us() == pytest.approx(START_US + 600 * S, abs=S)
        await bench.clock.sleep(60)
        assert state(bench, "uav").altitude_above_home_m == pytest.approx(0)
        assert state(bench, "uav").ready is False
        await bench.start("r1.b3", "takeoff", "uav", altitude=30.0)
        assert (await bench.ended("r1.b3", 1)).code == "BATTERY_LOW"

    simulate({"uav": ("air", {"battery": "50 %", "endurance": "20 min"})}, main)


def test_an_idle_aircraft_sinks_to_the_ground_when_its_battery_is_empty(
    simulate: Simulate,
) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await bench.start("r1.b1", "takeoff", "uav", altitude=30.0)
        await bench.ended("r1.b1", 60)
        await bench.clock.sleep(700)
        assert state(bench, "uav").altitude_above_home_m == pytest.approx(0)
        assert state(bench, "uav").battery_fraction == 0

    simulate({"uav": ("air", {"endurance": "10 min"})}, main)


def test_every_twentieth_of_the_battery_is_told_without_a_telemetry_rate(
    simulate: Simulate,
) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        loop = route((0, 100), (100, 100), (100, 0))
        await bench.start("r1.b1", "single_vehicle_routing", "ugv", route=loop, loop=True)
        await bench.ended("r1.b1", 3601)
        told = [s.battery_fraction for s in bench.states if isinstance(s, VehicleState)]
        for step in range(20):
            assert any(level == pytest.approx(step / 20, abs=1e-6) for level in told)
        assert len(told) < 40

    simulate({"ugv": ("ground", {"endurance": "1 h"})}, main)


# --- the whole ----------------------------------------------------------------------------------


def test_an_idle_arbiter_without_telemetry_sets_no_timer(simulate: Simulate) -> None:
    async def main(_: ArbiterHarness, __: SimArbiter) -> None:
        others = asyncio.all_tasks() - {asyncio.current_task()}
        owners = [str(t.get_coro().__qualname__).partition(".")[0] for t in others]  # type: ignore[union-attr]
        assert owners == ["ArbiterHarness"] * 2, "it reads reports and states"

    simulate({**UGV, **UAV, "ugv/ptz": ("ground", {})}, main)


def test_telemetry_comes_at_its_rate_while_moving_and_once_a_second_while_standing(
    simulate: Simulate,
) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await bench.clock.sleep(10.5)
        assert len(bench.states) == 11
        await bench.start("r1.b1", "single_vehicle_routing", "ugv", route=EAST_100)
        await bench.clock.sleep(10)
        assert len(bench.states) == pytest.approx(11 + 50, abs=2)

    simulate(UGV, main, telemetry_hz=5.0)


def test_the_first_state_of_each_of_many_vehicles_is_published(simulate: Simulate) -> None:
    many: Fleet = {f"ugv{number}": ("ground", {}) for number in range(1200)}

    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await bench.clock.sleep(0.1)
        assert {each.resource for each in bench.states} == set(many)

    simulate(many, main, telemetry_hz=5.0)


async def test_states_that_were_missed_while_the_computer_was_suspended_are_skipped() -> None:
    now_ns = [0]
    clock = SystemClock(start_us=START_US, steady_ns=lambda: now_ns[0])
    arbiter = make(clock, UGV, telemetry_hz=5.0)
    async with ArbiterHarness(arbiter, clock) as bench:
        now_ns[0] += 8 * 3_600_000_000_000
        await arbiter.hold(ResourceId("ugv"))
        await asyncio.sleep(0)
        assert len(bench.states) < 5
        assert bench.states[-1].time_us == clock.now_us()


def test_the_same_commands_have_the_same_reports_at_the_same_times() -> None:
    def once() -> list[tuple[int, BehaviorReport]]:
        heard: list[tuple[int, BehaviorReport]] = []

        async def main(clock: Clock) -> None:
            fleet: Fleet = {f"v{i}": ("air" if i % 2 else "ground", {}) for i in range(6)}
            arbiter = make(clock, fleet)
            async with ArbiterHarness(arbiter, clock) as bench:
                for i in range(6):
                    await bench.start(
                        f"r1.b{i}", "goto", f"v{i}", target=Point(place(100, 50 + i % 3))
                    )
                await arbiter.hold(ResourceId("v3"))
                await clock.sleep(7)
                await arbiter.resume(ResourceId("v3"))
                while sum(r.state.terminal for r in bench.reports) < 6:
                    count = len(bench.reports)
                    await bench.until(lambda count=count: len(bench.reports) > count, 600)  # type: ignore[misc]
                    now = clock.now_us()
                    heard.extend((now, report) for report in bench.reports[count:])

        run_virtual(main, START_US)
        return heard

    assert once() == once()


def test_ended_behaviors_are_forgotten_only_beyond_a_bound(
    simulate: Simulate, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("m2pem.simulation.state_file.REMEMBERED", 5)

    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.running", "teleop", "uav")
        for number in range(10):
            await bench.start(f"r1.b{number}", "hold", "ugv")
            await bench.ended(f"r1.b{number}", 1)
        known = [
            (await arbiter.query(f"r1.{name}", None)).state.value
            for name in ("running", "b0", "b9")
        ]
        assert known == ["RUNNING", "UNKNOWN", "SUCCEEDED"]

    simulate({**UGV, **UAV}, main)


def test_limits_are_the_time_to_stop_from_full_speed(simulate: Simulate) -> None:
    async def main(_: ArbiterHarness, arbiter: SimArbiter) -> None:
        limits = arbiter.limits(ResourceId("ugv"))
        assert limits.hold_within_s > GROUND.stopping_s
        assert limits.lost_after_s == 3.0

    simulate(UGV, main, telemetry_hz=5.0)


def test_a_silent_arbiter_promises_no_bound_for_a_link(simulate: Simulate) -> None:
    async def main(_: ArbiterHarness, arbiter: SimArbiter) -> None:
        assert arbiter.limits(ResourceId("ugv")).lost_after_s == math.inf

    simulate(UGV, main)


def test_wrong_settings_are_refused_with_every_finding() -> None:
    async def main(clock: Clock) -> None:
        with pytest.raises(FleetError) as caught:
            make(clock, {"ugv": ("ground", {"battery": "200 %", "max_speed": "5 kg"})})
        assert [finding.element for finding in caught.value.findings] == [
            "ugv.connection.max_speed",
            "ugv.connection.battery",
        ]

    run_virtual(main, START_US)
