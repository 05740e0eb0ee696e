"""Hosts behind a router and a link that loses packets, is slow, or is cut: real TCP in namespaces.

The executive of a test is this process; it reaches the router, which is at the near end of the
link, by a Unix socket.
"""

import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import pytest
from m2pem_plugin_zenoh.plugin import ZenohHosts
from zenoh_world import UGV1, UGV2, HostProcess, hosted_simulation, warm_up

from bench.network import Link, Network
from m2pem.api import (
    Arbiter,
    ArbiterContext,
    BehaviorState,
    HostedArbiter,
    Point,
    ResourceId,
    Route,
    SystemClock,
)
from m2pem.testing import ArbiterCase, ArbiterContract
from m2pem.testing.contracts.arbiter_harness import (
    ArbiterHarness,
    CutLink,
    Effects,
    MakeArbiter,
    context,
    link_is_up,
    speed,
)

pytestmark = [pytest.mark.long, pytest.mark.timeout(900)]
LONG = Route(((38.108, -77.3192, None), (38.130, -77.3180, None)))
ROUTER = str(Path(__file__).with_name("zenoh_router_process.py"))


@dataclass
class World:
    """A host at the far end of a link. `link`: may be changed."""

    link: Link
    host: HostProcess
    hosted: HostedArbiter


@contextmanager
def world(
    folder: Path, speed: float, policy: str, lost_after_s: float, round_trip_s: float
) -> Iterator[World]:
    near, far = "station", "vehicle"
    with Network(near, far) as network:
        behind = f"unixsock-stream/{folder / 'router'}"
        router = f"tcp/{network.address(near)}:7447"
        process = subprocess.Popen(
            [*network.inside(near), sys.executable, ROUTER, behind, router],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        assert process.stdout is not None
        assert process.stdout.readline() == b"ready\n"
        host = HostProcess(
            *(0, folder, speed, policy, lost_after_s, round_trip_s),
            connect=router,
            inside=network.inside(far),
        )
        hosted = hosted_simulation(
            0, folder, lost_after_s=lost_after_s, round_trip_s=round_trip_s, connect=behind
        )
        try:
            yield World(network.link(near, far), host, hosted)
        finally:
            host.close()
            process.communicate()


@pytest.fixture(scope="module", autouse=True)
def warm() -> None:
    warm_up()


class OverBadLink(ArbiterContract):
    """The contract, where commands and reports have a bad way."""

    unsupported: ClassVar[Mapping[str, str]] = {"virtual clock": "the host has a clock of its own"}
    lost_after_s: ClassVar[float]
    round_trip_s: ClassVar[float]
    short_s: ClassVar[float]

    def worsen(self, link: Link) -> None:
        raise NotImplementedError

    @pytest.fixture
    def world(self, tmp_path: Path) -> Iterator[World]:
        words = (self.speed, "hold:10", self.lost_after_s, self.round_trip_s)
        with world(tmp_path, *words) as made:
            self.worsen(made.link)
            yield made

    @pytest.fixture
    def make_arbiter(self, world: World) -> MakeArbiter:
        def make(context: ArbiterContext) -> Arbiter:
            return ZenohHosts()(world.hosted.connections, context, world.hosted)

        return make

    @pytest.fixture
    def case(self) -> ArbiterCase:
        route = Route(((38.108, -77.3192, None), (38.110, -77.3180, None)))
        return ArbiterCase(
            vehicle=UGV1,
            other=UGV2,
            long=("single_vehicle_routing", {"route": route}),
            short=("goto", {"target": Point((38.1077, -77.3192, None))}),
            bad=("speed", -1.0),
            short_s=self.short_s,
            route=("single_vehicle_routing", {"route": route, "speed": 4.0}),
        )

    @pytest.fixture
    def cut_link(self, world: World) -> CutLink:
        def cut(arbiter: Arbiter, vehicle: ResourceId) -> None:
            world.host.say(f"cut {vehicle}")

        return cut

    @pytest.fixture
    def mend_link(self, world: World) -> CutLink:
        def mend(arbiter: Arbiter, vehicle: ResourceId) -> None:
            world.host.say(f"mend {vehicle}")

        return mend

    @pytest.fixture
    def effects(self, world: World) -> Effects:
        return lambda arbiter, vehicle: int(world.host.say(f"effects {vehicle}"))


class TestLossyLink(OverBadLink):
    """Of the packets of each way, 30 % are lost: TCP sends them again, ever more slowly."""

    speed: ClassVar[float] = 2.0
    lost_after_s, round_trip_s, short_s = 20.0, 10.0, 80.0

    def worsen(self, link: Link) -> None:
        link.loss = 0.3


class TestSlowLink(OverBadLink):
    """What is sent arrives 2 s later, on each way."""

    lost_after_s, round_trip_s, short_s = 6.0, 8.0, 60.0

    def worsen(self, link: Link) -> None:
        link.delay_s = 2.0


# --- what is not of the contract ------------------------------------------------------------------


async def test_telemetry_is_thinned_to_a_link_of_10_kbit_s(tmp_path: Path) -> None:
    """It takes what is left: the contact is kept, and states and holds are not late."""
    clock = SystemClock()
    with world(tmp_path, 1.0, "continue:60", 3.0, 2.0) as made:
        made.link.bits_per_s = 10_000
        arbiter = ZenohHosts()(made.hosted.connections, context(clock), made.hosted)
        async with ArbiterHarness(arbiter, clock) as harness:
            assert await harness.until(lambda: harness.latest(UGV1) is not None, 60)
            for id_, vehicle in (("r1.b1", UGV1), ("r1.b2", UGV2)):
                await harness.start(id_, "single_vehicle_routing", vehicle, route=LONG)
                await harness.running(id_, 20)
            ages_s: list[float] = []
            for _ in range(30):
                count = len(harness.states)
                assert await harness.until(lambda count=count: len(harness.states) > count, 10)  # type: ignore[misc]
                ages_s.append((clock.now_us() - harness.states[-1].time_us) / 1e6)
            assert max(ages_s) < 3.0, ages_s
            await harness.arbiter.hold(UGV1)
            assert await harness.until(lambda: speed(harness, UGV1) < 0.1, 6)
            assert {each.state for each in harness.reports} == {
                BehaviorState.ACCEPTED,
                BehaviorState.RUNNING,
            }


async def test_what_was_cut_off_for_a_minute_is_back_soon_and_nothing_is_begun_twice(
    tmp_path: Path,
) -> None:
    clock = SystemClock()
    with world(tmp_path, 1.0, "hold:10", 3.0, 2.0) as made:
        arbiter = ZenohHosts()(made.hosted.connections, context(clock), made.hosted)
        async with ArbiterHarness(arbiter, clock) as harness:
            assert await harness.until(lambda: harness.latest(UGV1) is not None, 60)
            await harness.start("r1.b1", "single_vehicle_routing", UGV1, route=LONG)
            await harness.running("r1.b1", 20)
            made.link.cut = True
            end = await harness.ended("r1.b1", 20)
            assert (end.state, end.code) == (BehaviorState.LOST, "LINK_LOST")
            await harness.start("r1.b2", "single_vehicle_routing", UGV2, route=LONG)
            assert (await harness.ended("r1.b2", 5)).code == "LINK_LOST"
            await clock.sleep(60)
            made.link.cut = False
            assert await harness.until(lambda: link_is_up(harness, UGV1), 20)
            assert await harness.until(lambda: speed(harness, UGV1) < 0.1, 10)
            await harness.start("r1.b3", "single_vehicle_routing", UGV2, route=LONG)
            await harness.running("r1.b3", 20)
            assert harness.of("r1.b1")[-1] == end
            assert [made.host.say(f"effects {each}") for each in (UGV1, UGV2)] == ["1", "1"]
