"""An executive and a host in two processes, with a link that is slow, breaks, or loses an end."""

import asyncio
import math
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from m2pem_plugin_zenoh.plugin import ZenohHosts
from zenoh_world import UGV1, UGV2, HostProcess, Wire, free_port, hosted_simulation

from m2pem.api import BehaviorState, LinkState, Point, Route, SystemClock, VehicleState
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness, context

SPEED = 4.0
"""Of the clock of the host and of the executive; the link is judged in real time."""

LONG = Route(((38.108, -77.3192, None), (38.130, -77.3180, None)))
NEAR = Point((38.1077, -77.3192, None))
StartHost = Callable[..., HostProcess]


@pytest.fixture
def start_host(tmp_path: Path) -> Iterator[StartHost]:
    started: list[HostProcess] = []

    def start(
        policy: str = "continue:1", lost_after_s: float = 1.0, round_trip_s: float = 1.0
    ) -> HostProcess:
        words = (free_port(), tmp_path, SPEED, policy, lost_after_s, round_trip_s)
        started.append(HostProcess(*words))
        return started[-1]

    yield start
    for host in started:
        host.close()


@asynccontextmanager
async def connected(
    port: int, folder: Path, lost_after_s: float = 1.0, round_trip_s: float = 1.0
) -> AsyncIterator[ArbiterHarness]:
    clock = SystemClock(SPEED)
    hosted = hosted_simulation(port, folder, lost_after_s=lost_after_s, round_trip_s=round_trip_s)
    arbiter = ZenohHosts()(hosted.connections, context(clock), hosted)
    async with ArbiterHarness(arbiter, clock) as harness:
        yield harness


async def drive(harness: ArbiterHarness, id_: str = "r1.b1", vehicle: str = UGV1) -> None:
    await harness.start(id_, "single_vehicle_routing", vehicle, route=LONG)


def speed_m_s(harness: ArbiterHarness) -> float:
    state = harness.latest(UGV1)
    if state is None:
        return math.nan  # not received yet: no comparison holds
    assert isinstance(state, VehicleState)
    assert state.velocity_enu_m_s is not None
    return max(map(abs, state.velocity_enu_m_s))


def is_lost(harness: ArbiterHarness) -> bool:
    state = harness.latest(UGV1)
    return state is not None and state.link is LinkState.LOST


async def test_a_cut_shorter_than_the_bound_changes_nothing(
    start_host: StartHost, tmp_path: Path
) -> None:
    host = start_host(lost_after_s=20.0)
    async with (
        Wire(free_port(), host.port) as wire,
        connected(wire.port, tmp_path, 20.0) as harness,
    ):
        await harness.start("r1.b1", "goto", UGV1, target=NEAR)
        await harness.running("r1.b1")
        wire.cut = True
        await harness.clock.sleep(8)
        wire.cut = False
        end = await harness.ended("r1.b1", 200)
        assert end.state is BehaviorState.SUCCEEDED, end
        assert host.say(f"effects {UGV1}") == "1"


async def test_a_cut_link_loses_the_vehicle_which_is_held_when_it_returns(
    start_host: StartHost, tmp_path: Path
) -> None:
    host = start_host("continue:1")
    async with Wire(free_port(), host.port) as wire, connected(wire.port, tmp_path) as harness:
        await drive(harness)
        assert await harness.until(lambda: speed_m_s(harness) > 1, 60)
        wire.cut = True
        end = await harness.ended("r1.b1", 100)
        assert (end.state, end.code) == (BehaviorState.LOST, "LINK_LOST")
        assert "host pi" in end.reason
        assert is_lost(harness)
        await drive(harness, "r1.b2")
        refused = await harness.ended("r1.b2", 10)
        assert (refused.state, refused.code) == (BehaviorState.REJECTED, "LINK_LOST")
        wire.cut = False
        assert await harness.until(lambda: not is_lost(harness), 200)
        at_rest = await harness.until(lambda: speed_m_s(harness) < 0.1, 60)
        assert at_rest, "its behavior is not the run's any more: it is held before anything else"
        await harness.arbiter.cancel("r1.b1", 1)
        await drive(harness, "r1.b3")
        await harness.running("r1.b3")
        assert harness.of("r1.b1")[-1] == end, "what is LOST has one end"


async def test_a_start_that_was_on_its_way_when_the_link_was_cut_moves_nothing(
    start_host: StartHost, tmp_path: Path
) -> None:
    host = start_host()
    async with Wire(free_port(), host.port) as wire, connected(wire.port, tmp_path) as harness:
        assert await harness.until(lambda: harness.latest(UGV1) is not None, 100)
        wire.cut = True
        await drive(harness)
        end = await harness.ended("r1.b1", 100)
        assert end.state is BehaviorState.LOST, end
        await harness.clock.sleep(10)
        wire.cut = False
        assert await harness.until(lambda: not is_lost(harness), 200)
        await drive(harness, "r1.b2", UGV2)
        await harness.running("r1.b2", 100)
        assert host.say(f"effects {UGV1}") == "0"


async def test_a_hold_overtakes_what_a_slow_link_carries(
    start_host: StartHost, tmp_path: Path
) -> None:
    host = start_host()
    async with Wire(free_port(), host.port) as wire:
        wire.delay_s = 0.4
        async with connected(wire.port, tmp_path) as harness:
            assert await harness.until(lambda: harness.latest(UGV1) is not None, 100)
            await drive(harness)
            assert await harness.until(lambda: speed_m_s(harness) > 1, 100)
            await harness.arbiter.hold(UGV1)
            assert await harness.until(lambda: speed_m_s(harness) < 0.1, 60)
            await harness.arbiter.cancel("r1.b1", 1)
            end = await harness.ended("r1.b1", 60)
            assert end.state is BehaviorState.CANCELLED, end


@pytest.mark.long
async def test_operators_are_told_of_a_link_that_is_slower_than_the_fleet_says(
    start_host: StartHost, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    host = start_host(lost_after_s=4.0)
    async with Wire(free_port(), host.port) as wire:
        wire.delay_s = 0.4
        async with connected(wire.port, tmp_path, 4.0, round_trip_s=0.5) as harness:
            told = "host pi answers after"
            assert await harness.until(lambda: told in caplog.text, 100)
            assert "write a longer one" in caplog.text


async def test_a_killed_host_takes_its_vehicles_up_again(
    start_host: StartHost, tmp_path: Path
) -> None:
    host = start_host(lost_after_s=8.0)
    async with connected(host.port, tmp_path, 8.0) as harness:
        await harness.start("r1.b1", "goto", UGV1, target=NEAR)
        await harness.running("r1.b1")
        host.kill()
        await asyncio.to_thread(host.restart)
        end = await harness.ended("r1.b1", 600)
        assert end.state is BehaviorState.SUCCEEDED, end
        states = [BehaviorState.ACCEPTED, BehaviorState.RUNNING, BehaviorState.SUCCEEDED]
        assert harness.states_of("r1.b1") == states
        # Its simulated vehicle remembers what it has begun: nothing after the restart.
        assert host.say(f"effects {UGV1}") == "0"


async def test_an_executive_that_was_replaced_does_not_get_the_host_back(
    start_host: StartHost, tmp_path: Path
) -> None:
    host = start_host(lost_after_s=3.0)
    async with connected(host.port, tmp_path, 3.0) as first:
        await drive(first)
        await first.running("r1.b1")
        async with connected(host.port, tmp_path, 3.0) as second:
            found = await second.arbiter.query("r1.b1", None)
            assert found.state is BehaviorState.RUNNING
            end = await first.ended("r1.b1", 200)
            assert end.state is BehaviorState.LOST, end
            assert await second.until(lambda: speed_m_s(second) > 1, 60), "it goes on"
        await first.start("r1.b2", "goto", UGV2, target=NEAR)
        refused = await first.ended("r1.b2", 10)
        assert "taken the host over" in refused.reason


@pytest.mark.long
@pytest.mark.parametrize(("delay_s", "cut_s"), [(2.0, 5.0), (0.0, 60.0)])
async def test_a_very_slow_link_that_is_cut_for_long(
    start_host: StartHost, tmp_path: Path, delay_s: float, cut_s: float
) -> None:
    round_trip_s = 2 * delay_s + 4  # a busy computer adds to it
    host = start_host("hold:8", 4.0, round_trip_s)
    async with Wire(free_port(), host.port) as wire:
        wire.delay_s = delay_s
        async with connected(wire.port, tmp_path, 4.0, round_trip_s) as harness:
            assert await harness.until(lambda: harness.latest(UGV1) is not None, 400)
            await drive(harness)
            assert await harness.until(lambda: speed_m_s(harness) > 1, 400)
            assert harness.of("r1.b1")[-1].state is BehaviorState.RUNNING
            wire.cut = True
            await asyncio.sleep(cut_s)
            wire.cut = False
            assert await harness.until(lambda: not is_lost(harness), 600)
            await drive(harness, "r1.b2", UGV2)
            await harness.running("r1.b2", 400)
            is_lost_for_good = BehaviorState.LOST in harness.states_of("r1.b1")
            assert is_lost_for_good is (cut_s > 4 + round_trip_s)
