"""Vehicles that m2pem's authors did not write, of two libraries, in processes of their own:
vda-5050-lib (npm) at 1.1 and 2.0, and vda5050-sdk (PyPI) at 2.0 and 2.1. Those of vda-5050-lib are
also made faulty: they contradict what they report, or do not obey."""

import asyncio
import math
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from m2pem_plugin_vda5050.arbiter import Vda5050Arbiter
from vda_world import ORIGIN, REPOSITORY, Mosquitto, connection, until

from m2pem.api import BehaviorState, Connection, Point, ResourceId, Route, SystemClock, VehicleState
from m2pem.errors import OperatorError
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness, context

SPEED = 3.0
AGV1 = ResourceId("agv1")
LOAD = {"stationType": "floor", "loadType": "EPAL"}
JS = REPOSITORY / "tests" / "js"
SDK = Path(__file__).with_name("sdk_vehicle.py")
PROGRAMS = {"vda-5050-lib": ("drive_agv.mjs", JS), "vda5050-sdk": (str(SDK), SDK.parent)}


def place(x: float, y: float) -> tuple[float, float, None]:
    """Return a place of the hall, in metres from its origin."""
    east_m = math.radians(1) * 6_378_137 * math.cos(math.radians(ORIGIN["lat"]))
    return ORIGIN["lat"] + y / 110_996, ORIGIN["lon"] + x / east_m, None


class Vehicle:
    """A vehicle of a library; what it prints is in `lines`."""

    def __init__(self, library: str, version: str, broker: Mosquitto) -> None:
        program, folder = PROGRAMS[library]
        run = sys.executable if program.endswith(".py") else shutil.which("node")
        if run is None or not (JS / "node_modules" / "vda-5050-lib").exists():
            pytest.fail("needs Node.js 18 or newer and the packages of tests/js: run `make setup`")
        self.settings = {
            **connection(broker.url, AGV1, own_behaviors={"pick": None}, version=version),
            "map": {"id": "hall"},
        }
        self._process = subprocess.Popen(
            [run, program, broker.url, AGV1, version, f"{SPEED:g}"],
            cwd=folder,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.lines: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        until(lambda: "ready" in self.lines)

    def fault(self, text: str) -> None:
        """Have something go wrong from now on."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{text}\n")
        self._process.stdin.flush()
        until(lambda: f"fault: {text}" in self.lines, lambda: self.lines[-5:])

    def count(self, text: str) -> int:
        return sum(line.startswith(text) for line in self.lines)

    def close(self) -> None:
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.close()
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._reader.join()
        self._process.stdout.close()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self.lines.append(line.rstrip("\n"))


ALL = (
    ("vda-5050-lib", "1.1.0"),
    ("vda-5050-lib", "2.0.0"),
    ("vda5050-sdk", "2.0.0"),
    ("vda5050-sdk", "2.1.0"),
)


@pytest.fixture(params=ALL, ids="-".join)
def agv(request: pytest.FixtureRequest, broker: Mosquitto) -> Iterator[Vehicle]:
    """Each vehicle of each library."""
    made = Vehicle(*request.param, broker)
    yield made
    made.close()


@pytest.fixture
def faulty(broker: Mosquitto) -> Iterator[Vehicle]:
    """A vehicle of vda-5050-lib that can be made faulty."""
    made = Vehicle("vda-5050-lib", "2.0.0", broker)
    yield made
    made.close()


@asynccontextmanager
async def commanding(agv: Vehicle, **more: Any) -> AsyncIterator[ArbiterHarness]:
    """An arbiter of the vehicle; `more`: of its settings."""
    clock = SystemClock(SPEED)
    made = {AGV1: Connection(AGV1, "ground", {**agv.settings, **more}, sitl=True)}
    async with ArbiterHarness(Vda5050Arbiter(made, context(clock)), clock) as harness:
        assert await harness.until(lambda: harness.latest(AGV1) is not None, 60)
        yield harness


def state(harness: ArbiterHarness) -> VehicleState:
    found = harness.latest(AGV1)
    assert isinstance(found, VehicleState)
    return found


def distance_m(harness: ArbiterHarness, x: float, y: float) -> float:
    """Return how far the vehicle is from a place of the hall."""
    position, (latitude, longitude, _) = state(harness).position, place(x, y)
    assert position is not None
    east_m = (position.longitude_deg - longitude) * 111_320 * math.cos(math.radians(latitude))
    return math.hypot(east_m, (position.latitude_deg - latitude) * 110_996)


async def moving(harness: ArbiterHarness) -> None:
    assert await harness.until(lambda: distance_m(harness, 0, 0) > 0.5, 60), state(harness)


async def at_rest(harness: ArbiterHarness) -> None:
    """Look at the next states, more than vda-5050-lib reports an action in that has ended."""
    count = len(harness.states)
    assert await harness.until(lambda: len(harness.states) > count + 5, 60)
    before = state(harness).position
    assert await harness.until(lambda: len(harness.states) > count + 35, 60)
    assert state(harness).position == before


@pytest.mark.tried_with(
    "vda-5050-lib",
    "a vehicle of it gets orders, updates, actions, pauses and cancels, at 1.1 and 2.0",
    kind="Automated guided vehicles",
    result="done",
)
@pytest.mark.tried_with(
    "vda5050-sdk",
    "a vehicle of it gets orders, updates, actions, pauses and cancels, at 2.0 and 2.1",
    kind="Automated guided vehicles",
    result="done",
)
async def test_it_goes_to_a_place_picks_a_load_and_drives_a_route(agv: Vehicle) -> None:
    async with commanding(agv, released_nodes=1) as harness:
        assert await harness.until(lambda: state(harness).ready is True, 30), state(harness)
        await harness.start("r1.b1", "goto", AGV1, target=Point(place(3, 0)))
        assert (await harness.ended("r1.b1", 60)).state is BehaviorState.SUCCEEDED
        assert distance_m(harness, 3, 0) < 0.5
        await harness.start("r1.b2", "pick", AGV1, target=Point(place(3, 2)), **LOAD)
        end = await harness.ended("r1.b2", 60)
        assert end.state is BehaviorState.SUCCEEDED, end
        assert distance_m(harness, 3, 2) < 0.5
        before = agv.count("order")
        route = Route((place(3, 4), place(0, 4), place(0, 2)))
        await harness.start("r1.b3", "single_vehicle_routing", AGV1, route=route)
        end = await harness.ended("r1.b3", 120)
        assert end.state is BehaviorState.SUCCEEDED, end
        assert distance_m(harness, 0, 2) < 0.5
        assert agv.count("order") - before == 3, "one order, and two updates of it"


async def test_it_drives_laps_pauses_and_stops(agv: Vehicle) -> None:
    """At the end of each base, a vehicle that stops at nodes has done its order: the next update
    goes on with it."""
    async with commanding(agv, released_nodes=1) as harness:
        corners = (place(2, 0), place(2, 2), place(0, 0))
        await harness.start(
            "r1.b1", "single_vehicle_routing", AGV1, route=Route(corners), loop=True
        )
        assert await harness.until(lambda: agv.count("order") > 2 * len(corners), 120), agv.lines
        await harness.arbiter.hold(AGV1)
        await at_rest(harness)
        assert state(harness).ready is True, "it is paused by m2pem, also if it reports no action"
        await harness.arbiter.resume(AGV1)
        orders = agv.count("order")
        assert await harness.until(lambda: agv.count("order") > orders + 1, 60), agv.lines
        await harness.arbiter.cancel("r1.b1", 1)
        end = await harness.ended("r1.b1", 30)
        assert end.state is BehaviorState.CANCELLED, end
        await at_rest(harness)
        assert state(harness).ready is True, state(harness)
        await harness.start("r1.b2", "goto", AGV1, target=Point(place(1, 1)))
        assert (await harness.ended("r1.b2", 60)).state is BehaviorState.SUCCEEDED


@pytest.mark.parametrize("fault", ["ignore instant actions", ""])
async def test_a_vehicle_that_takes_no_instant_actions_is_not_ready_and_gets_no_order(
    faulty: Vehicle, fault: str
) -> None:
    """It ignores them, or refuses them, as their version is another one."""
    if fault:
        faulty.fault(fault)
    version = "2.0.0" if fault else "2.1.0"
    async with commanding(faulty, version=version) as harness:
        await harness.start("r1.b1", "goto", AGV1, target=Point(place(3, 0)))
        end = await harness.ended("r1.b1", 60)
        assert (end.state.terminal, end.code) == (True, "REJECTED")
        assert "it takes no instant actions, so that it could not be stopped" in end.reason
        assert fault or "version: 2.1.0 is not compatible" in end.reason
        assert await harness.until(lambda: end.reason in state(harness).not_ready_reasons, 10)
        await harness.start("r1.b2", "goto", AGV1, target=Point(place(3, 0)))
        assert (await harness.ended("r1.b2", 10)).state is BehaviorState.REJECTED
    assert faulty.count("order") == 0


@pytest.mark.parametrize("what", ["hold", "cancel"])
async def test_a_stop_that_is_not_obeyed_is_said_within_a_second(
    faulty: Vehicle, what: str
) -> None:
    async with commanding(faulty) as harness:
        await harness.start("r1.b1", "goto", AGV1, target=Point(place(200, 0)))
        await moving(harness)
        faulty.fault("ignore instant actions")
        stop = harness.arbiter.hold(AGV1) if what == "hold" else harness.arbiter.cancel("r1.b1", 1)
        before_s = time.monotonic()
        with pytest.raises(OperatorError, match=r"^agv1 does NOT obey: no state shows "):
            await stop
        assert time.monotonic() - before_s < 60
        said = "it does NOT obey: it drives, and no state shows "
        assert await harness.until(
            lambda: any(each.startswith(said) for each in state(harness).not_ready_reasons), 10
        ), state(harness)
        assert not any(report.state.terminal for report in harness.of("r1.b1"))


@pytest.mark.parametrize(
    ("fault", "what", "action"),
    [
        ("drive on after a pause", "hold", "startPause"),
        ("drive on after a cancel", "cancel", "cancelOrder"),
    ],
)
async def test_a_vehicle_that_reports_a_stop_and_drives_on_is_said_not_to_obey(
    faulty: Vehicle, fault: str, what: str, action: str
) -> None:
    async with commanding(faulty) as harness:
        await harness.start("r1.b1", "goto", AGV1, target=Point(place(200, 0)))
        await moving(harness)
        faulty.fault(fault)
        await (harness.arbiter.hold(AGV1) if what == "hold" else harness.arbiter.cancel("r1.b1", 1))
        said = f"it does NOT obey: it drives although it reports {action} as FINISHED"
        assert await harness.until(
            lambda: any(each.startswith(said) for each in state(harness).not_ready_reasons), 10
        ), state(harness)
        if what == "cancel":  # it is paused then, and at rest
            end = await harness.ended("r1.b1", 30)
            assert end.state is BehaviorState.CANCELLED
            await at_rest(harness)
            assert faulty.count("instant startPause") == 1


@pytest.mark.parametrize(
    ("fault", "code", "reason"),
    [
        ("mode MANUAL", "TAKEN_OVER", "its operating mode is MANUAL now"),
        ("another order", "TAKEN_OVER", "it has another order now, 'another'"),
        ("forget the rest", "TAKEN_OVER", ", 0 of 2, not by m2pem"),
        ("fatal", "FAILED", "the vehicle has a fatal error: laser: blind"),
    ],
)
async def test_a_vehicle_that_shows_something_else_than_commanded_has_not_succeeded(
    faulty: Vehicle, fault: str, code: str, reason: str
) -> None:
    async with commanding(faulty) as harness:
        route = Route((place(60, 0), place(80, 0)))
        await harness.start("r1.b1", "single_vehicle_routing", AGV1, route=route)
        await moving(harness)
        faulty.fault(fault)
        end = await harness.ended("r1.b1", 60)
        assert (end.state, end.code) == (BehaviorState.FAILED, code)
        assert reason in end.reason
        if code == "FAILED":
            await asyncio.to_thread(until, lambda: faulty.count("instant cancelOrder"))


async def test_in_semiautomatic_mode_an_order_goes_on(faulty: Vehicle) -> None:
    """The standard has the vehicle follow orders there; a person drives its speed."""
    async with commanding(faulty) as harness:
        await harness.start("r1.b1", "goto", AGV1, target=Point(place(9, 0)))
        await moving(harness)
        faulty.fault("mode SEMIAUTOMATIC")
        assert await harness.until(lambda: state(harness).ready is False, 10)
        assert (await harness.ended("r1.b1", 60)).state is BehaviorState.SUCCEEDED
