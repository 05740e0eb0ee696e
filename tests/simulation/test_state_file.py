import sqlite3
import subprocess
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path
from uuid import UUID

import pytest

from m2pem.api.clock import Clock, run_virtual
from m2pem.api.telemetry import VehicleState
from m2pem.errors import StaleCommandError
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.mission.geometry import Point, VehiclePosition
from m2pem.simulation.arbiters import SimArbiter
from m2pem.simulation.state_file import StateFileError, recorded_effects
from m2pem.testing.contracts.arbiter_harness import JOURNAL, ArbiterHarness
from tests.simulation.conftest import START_US, Fleet, local, make, place, route

S = 1_000_000
EAST_100 = route((50, 0), (100, 0))
DRIVE_S = 100 / 5 + 5 / 1.5 / 2 + 5 / 3 / 2
Life = Callable[[ArbiterHarness, SimArbiter], Awaitable[None]]


@pytest.fixture
def state(tmp_path: Path) -> str:
    return str(tmp_path / "state.sqlite")


def lives(state: str, *mains: Life, gap_s: float = 0.0, **settings: object) -> None:
    """One arbiter after another on the same state, with a gap between them."""
    settings = {"state": state, "heading": "90 deg", **settings}
    detector = {**settings, "detector": True, "detections": [{"at": "5 s", "type": "gpr"}]}
    fleet = {
        "ugv": ("ground", settings),
        "lead": ("ground", settings),
        "ugv/gpr": ("ground", detector),
    }

    async def run(clock: Clock) -> None:
        for main in mains:
            arbiter = make(clock, fleet, telemetry_hz=0.0)
            async with ArbiterHarness(arbiter, clock) as bench:
                await main(bench, arbiter)
            await clock.sleep(gap_s)

    run_virtual(run, START_US)


async def drive(bench: ArbiterHarness, _: SimArbiter) -> None:
    await bench.start("r1.b1", "single_vehicle_routing", "ugv", route=EAST_100)
    await bench.clock.sleep(4)


def test_a_behavior_goes_on_while_nobody_is_there(state: str) -> None:
    async def again(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        assert (await arbiter.query("r1.b1", "r1.b1")).state is BehaviorState.RUNNING
        await bench.start("r1.b1", "single_vehicle_routing", "ugv", route=EAST_100, epoch=2)
        end = await bench.ended("r1.b1", 100)
        assert end.state is BehaviorState.SUCCEEDED
        assert end.number > 3, "what was left was counted meanwhile"
        assert (bench.clock.now_us() - START_US) / S == pytest.approx(DRIVE_S, abs=1e-3)
        assert [(e.kind, e.behavior) for e in recorded_effects(state)] == [
            ("start", "r1.b1"),
            ("end", "r1.b1"),
        ]

    lives(state, drive, again, gap_s=6.0)


def test_an_epoch_that_was_only_announced_is_kept_across_a_restart(state: str) -> None:
    async def taken_over(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await drive(bench, arbiter)
        await arbiter.fence("r1", 4)

    async def again(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        with pytest.raises(StaleCommandError, match="epoch 4 was seen"):
            await arbiter.cancel("r1.b1", 3)
        assert (await arbiter.query("r1.b1", "r1.b1")).epoch == 4
        await arbiter.cancel("r1.b1", 4)
        assert (await bench.ended("r1.b1", 100)).state is BehaviorState.CANCELLED

    lives(state, taken_over, again)


def test_a_fault_that_has_struck_does_not_strike_again_after_a_restart(state: str) -> None:
    async def fails(bench: ArbiterHarness, _: SimArbiter) -> None:
        await drive(bench, _)
        assert (await bench.ended("r1.b1", 100)).code == "ROUTE_BLOCKED"

    async def succeeds(bench: ArbiterHarness, _: SimArbiter) -> None:
        await bench.start("r1.b2", "single_vehicle_routing", "ugv", route=EAST_100, epoch=2)
        assert (await bench.ended("r1.b2", 100)).state is BehaviorState.SUCCEEDED

    lives(state, fails, succeeds, faults=["single_vehicle_routing: fail ROUTE_BLOCKED at 5 s"])


def test_a_behavior_of_another_journal_is_neither_taken_over_nor_repeated(state: str) -> None:
    fleet: Fleet = {"ugv": ("ground", {"state": state, "heading": "90 deg"})}
    other = UUID("9b1c2f04-0d0e-4c35-8a54-5a7b6f3c2e10")

    async def run(clock: Clock) -> None:
        first = make(clock, fleet, telemetry_hz=0.0)
        async with ArbiterHarness(first, clock) as bench:
            await drive(bench, first)
        async with ArbiterHarness(make(clock, fleet, other, telemetry_hz=0.0), clock) as bench:
            await bench.start("r1.b1", "single_vehicle_routing", "ugv", route=EAST_100)
            end = await bench.ended("r1.b1", 10)
            assert (end.state, end.code) == (BehaviorState.REJECTED, "RESOURCE_UNAVAILABLE")
            assert f"ugv is busy with r1.b1 of journal {JOURNAL}: resume or stop it" in end.reason
        async with ArbiterHarness(make(clock, fleet, telemetry_hz=0.0), clock) as bench:
            assert (await bench.arbiter.query("r1.b1", None)).state is BehaviorState.RUNNING
        async with ArbiterHarness(make(clock, fleet, other, telemetry_hz=0.0), clock) as bench:
            await bench.ended(f"{JOURNAL}/r1.b1", 100)  # while the other executive looks on
        async with ArbiterHarness(make(clock, fleet, telemetry_hz=0.0), clock) as bench:
            found = await bench.arbiter.query("r1.b1", None)
            assert (found.id, found.state) == ("r1.b1", BehaviorState.SUCCEEDED)
        async with ArbiterHarness(make(clock, fleet, other, telemetry_hz=0.0), clock) as bench:
            await bench.start("r1.b2", "single_vehicle_routing", "ugv", route=EAST_100)
            assert (await bench.ended("r1.b2", 100)).state is BehaviorState.SUCCEEDED

    run_virtual(run, START_US)
    starts = [e.behavior for e in recorded_effects(state) if e.kind == "start"]
    assert starts == ["r1.b1", "r1.b2"]


def test_what_ended_while_nobody_was_there_is_told_by_query_alone(state: str) -> None:
    async def again(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        found = await arbiter.query("r1.b1", "r1.b1")
        assert found.state is BehaviorState.SUCCEEDED
        await bench.clock.sleep(10)
        assert bench.reports == []
        vehicle = bench.latest("ugv")
        assert isinstance(vehicle, VehicleState)
        assert local(vehicle.position) == pytest.approx((100, 0), abs=0.01)
        ends = [effect for effect in recorded_effects(state) if effect.kind == "end"]
        assert [round((effect.time_us - START_US) / S, 2) for effect in ends] == [round(DRIVE_S, 2)]

    lives(state, drive, again, gap_s=600.0)


def test_without_a_state_file_nothing_is_known_afterwards(tmp_path: Path) -> None:
    async def again(_: ArbiterHarness, arbiter: SimArbiter) -> None:
        assert (await arbiter.query("r1.b1", "r1.b1")).state is BehaviorState.UNKNOWN

    lives("", drive, again)


def test_a_held_vehicle_is_found_held(state: str) -> None:
    async def hold(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await drive(bench, arbiter)
        await arbiter.hold(ResourceId("ugv"))

    async def again(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        assert (await arbiter.query("r1.b1", None)).state is BehaviorState.RUNNING
        await arbiter.hold(ResourceId("ugv"))
        await arbiter.resume(ResourceId("ugv"))
        await bench.ended("r1.b1", 100)
        assert (bench.clock.now_us() - START_US) / S == pytest.approx(DRIVE_S + 500, abs=1e-3)
        kinds = [effect.kind for effect in recorded_effects(state)]
        assert kinds == ["start", "hold", "resume", "end"]

    lives(state, hold, again, gap_s=500.0)


def test_a_cancel_that_was_on_its_way_is_carried_out(state: str) -> None:
    async def cancel(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await drive(bench, arbiter)
        await arbiter.cancel("r1.b1", 1)

    async def again(_: ArbiterHarness, arbiter: SimArbiter) -> None:
        assert (await arbiter.query("r1.b1", None)).state is BehaviorState.CANCELLED

    lives(state, cancel, again, gap_s=10.0)


def test_a_scripted_end_outlives_the_arbiter(state: str) -> None:
    async def scripted(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        arbiter.script("r1.b1", 15.0, "failed", "ROUTE_BLOCKED")
        await drive(bench, arbiter)

    async def again(bench: ArbiterHarness, _: SimArbiter) -> None:
        assert (await bench.ended("r1.b1", 100)).code == "ROUTE_BLOCKED"
        assert bench.clock.now_us() == START_US + 15 * S

    lives(state, scripted, again)


def test_a_pursuit_is_caught_up_with(state: str) -> None:
    async def follow(bench: ArbiterHarness, _: SimArbiter) -> None:
        await bench.start("r1.b1", "follow", "ugv", target=VehiclePosition("lead"), offset=10.0)
        await bench.start("r1.b2", "goto", "lead", target=Point(place(300, 0)))
        await bench.clock.sleep(5)

    async def again(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        vehicle = bench.latest("ugv")
        assert vehicle is None
        await bench.until(lambda: bench.latest("ugv") is not None, 2)
        vehicle = bench.latest("ugv")
        assert isinstance(vehicle, VehicleState)
        assert local(vehicle.position) == pytest.approx((290, 0), abs=1.0)
        assert (await arbiter.query("r1.b1", None)).state is BehaviorState.RUNNING

    lives(state, follow, again, gap_s=300.0)


@pytest.mark.parametrize(("gap_s", "expected"), [(0.0, 5.0), (60.0, 5.0)])
def test_a_planned_detection_counts_from_the_first_beginning_and_comes_once(
    state: str, gap_s: float, expected: float
) -> None:
    found: list[float] = []

    async def listen(bench: ArbiterHarness, _: SimArbiter) -> None:
        await bench.clock.sleep(20 if found else 4)
        for heard in bench.states:
            found.extend(
                (detection.time_us - START_US) / S for detection in getattr(heard, "detections", ())
            )

    async def second(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.clock.sleep(2)
        await listen(bench, arbiter)

    lives(state, listen, second, second, gap_s=gap_s)
    assert found == [expected]


def test_the_battery_goes_on_draining(state: str) -> None:
    levels: list[float] = []

    async def look(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await drive(bench, arbiter)
        await arbiter.cancel("r1.b1", 1)
        await bench.ended("r1.b1", 10)
        vehicle = bench.latest("ugv")
        assert isinstance(vehicle, VehicleState)
        assert vehicle.battery_fraction is not None
        levels.append(vehicle.battery_fraction)

    async def again(bench: ArbiterHarness, _: SimArbiter) -> None:
        await bench.until(lambda: bench.latest("ugv") is not None, 1)
        vehicle = bench.latest("ugv")
        assert isinstance(vehicle, VehicleState)
        assert vehicle.battery_fraction is not None
        levels.append(vehicle.battery_fraction)

    lives(state, look, again, gap_s=3600.0, endurance="1 h")
    assert levels[1] == pytest.approx(levels[0] - 0.02, abs=1e-3)


def test_ended_behaviors_leave_the_file_beyond_a_bound(
    state: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("m2pem.simulation.state_file.REMEMBERED", 5)

    async def many(bench: ArbiterHarness, _: SimArbiter) -> None:
        for number in range(10):
            await bench.start(f"r1.b{number}", "hold", "ugv")
            await bench.ended(f"r1.b{number}", 1)

    async def again(_: ArbiterHarness, arbiter: SimArbiter) -> None:
        states = [(await arbiter.query(f"r1.b{n}", None)).state for n in (0, 9)]
        assert states == [BehaviorState.UNKNOWN, BehaviorState.SUCCEEDED]

    lives(state, many, again)


def test_a_file_that_is_no_state_is_refused_by_name(state: str) -> None:
    Path(state).write_text("a letter to a friend, longer than the header of a database " * 9)

    async def never(_: ArbiterHarness, __: SimArbiter) -> None:
        raise AssertionError("it connected")

    with pytest.raises(StateFileError, match=r"state\.sqlite"):
        lives(state, never)


@pytest.mark.parametrize(
    ("statement", "said"),
    [
        ("UPDATE meta SET value = '0' WHERE key = 'format'", "format 0"),
        ("UPDATE bodies SET state = x'00'", "another version"),
    ],
)
def test_a_file_of_another_version_is_refused(state: str, statement: str, said: str) -> None:
    lives(state, drive)
    with sqlite3.connect(state) as connection:
        connection.execute(statement)
    with pytest.raises(StateFileError, match=said):
        lives(state, drive)


def test_what_could_not_be_said_before_the_end_is_known_afterwards(state: str) -> None:
    async def unheard(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", "hold", "ugv", duration=1.0)
        arbiter.lose_link(ResourceId("ugv"))
        await bench.clock.sleep(2)
        assert (await arbiter.query("r1.b1", None)).state is BehaviorState.RUNNING

    async def again(_: ArbiterHarness, arbiter: SimArbiter) -> None:
        assert (await arbiter.query("r1.b1", None)).state is BehaviorState.SUCCEEDED

    lives(state, unheard, again)


KILLED = """
import asyncio, os, signal, sys
sys.path.insert(0, sys.argv[2])
from tests.simulation.conftest import make, route
from m2pem.api.clock import SystemClock
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness

async def main():
    clock = SystemClock()
    arbiter = make(clock, {"ugv": ("ground", {"state": sys.argv[1]})})
    await arbiter.connect()
    bench = ArbiterHarness(arbiter, clock)
    await bench.start("r1.b1", "single_vehicle_routing", "ugv", route=route((0, 9000)))
    os.kill(os.getpid(), signal.SIGKILL)

asyncio.run(main())
"""


def test_a_start_survives_being_killed_right_after_it(state: str) -> None:
    folder = str(Path(__file__).parents[2])
    killed = subprocess.run([sys.executable, "-c", KILLED, state, folder], check=False)
    assert killed.returncode == -9
    [effect] = recorded_effects(state)
    assert (effect.kind, effect.behavior) == ("start", "r1.b1")

    async def again(clock: Clock) -> None:
        arbiter = make(clock, {"ugv": ("ground", {"state": state})})
        async with ArbiterHarness(arbiter, clock) as bench:
            assert (await arbiter.query("r1.b1", "r1.b1")).state is BehaviorState.RUNNING
            await bench.ended("r1.b1", 3600)

    run_virtual(again, effect.time_us + 30 * S)


def test_what_was_taken_while_nobody_was_there_has_its_names(state: str) -> None:
    fleet = {"ugv": ("ground", {"state": state}), "ugv/cam": ("ground", {"state": state})}

    async def run(clock: Clock) -> None:
        async with ArbiterHarness(make(clock, fleet, telemetry_hz=0.0), clock) as bench:
            await bench.start("r1.b1", "take_picture", "ugv/cam", count=2, interval=3.0)
            await bench.clock.sleep(1)
        await clock.sleep(60)
        async with ArbiterHarness(make(clock, fleet, telemetry_hz=0.0), clock) as bench:
            found = await bench.arbiter.query("r1.b1", "r1.b1")
            assert found.outputs["picture.files"] == ["sim:r1/b1_1.jpg", "sim:r1/b1_2.jpg"]
            assert found.outputs["picture.time"] == "2026-01-01T00:00:03.500000Z"

    run_virtual(run, START_US)
