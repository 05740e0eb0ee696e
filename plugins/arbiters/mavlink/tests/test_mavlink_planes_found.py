"""Planes that are found again after a restart of the arbiter, over real UDP."""

import pytest
from m2pem_plugin_mavlink.arbiter import MavlinkArbiter
from m2pem_plugin_mavlink.behaviors import arrival as looking
from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_simulated import Bench, at, connections, fly

from m2pem.api import BehaviorState, Point
from m2pem.testing.contracts.arbiter_harness import context


async def found(bench, id_: str) -> None:
    """Another arbiter sees that it goes on, and how it ends."""
    reference = bench.of(id_)[-1].native_ref
    arbiter = MavlinkArbiter(connections(bench.simulator), context(bench.clock))
    async with Bench(arbiter, bench.clock) as other:
        report = await other.arbiter.query(id_, reference)
        assert report.state is BehaviorState.RUNNING, report
        assert (await other.ended(id_, 300)).state is BehaviorState.SUCCEEDED


def test_a_takeoff_is_found_again() -> None:
    async def main(bench) -> None:
        await bench.start("r1.b1", "takeoff", "v1", altitude=150.0)
        await bench.running("r1.b1")
        assert await bench.until(lambda: bench.truth().up_m > 20, 60)
        await bench.arbiter.close()
        await found(bench, "r1.b1")

    fly(main, Kind.PLANE)


def test_an_orbit_is_found_again() -> None:
    async def main(bench) -> None:
        await bench.do("r1.up", "takeoff", altitude=60.0)
        center = Point((*at(200, 0), 60.0))
        await bench.start("r1.b1", "orbit", "v1", target=center, radius=80.0, turns=4.0)
        await bench.running("r1.b1")
        await bench.clock.sleep(30)
        await bench.arbiter.close()
        await found(bench, "r1.b1")

    fly(main, Kind.PLANE)


def test_a_goto_is_found_again_while_the_plane_still_flies_away_from_its_target(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # It turns more quickly than real ones do: only what it names as its target counts here.
    monkeypatch.setattr(looking, "LOOKS_FOR_S", 0.0)

    async def main(bench) -> None:
        await bench.do("r1.up", "takeoff", altitude=60.0)
        ahead = Point((*at(3000, 0), 60.0))
        await bench.start("r1.b1", "goto", "v1", target=ahead)
        assert await bench.until(lambda: bench.level()[0] > 400, 120)
        await bench.arbiter.cancel("r1.b1", 1)
        await bench.ended("r1.b1", 60)
        behind = Point((*at(-3000, 0), 60.0))
        await bench.start("r1.b2", "goto", "v1", target=behind)
        await bench.running("r1.b2")
        await bench.arbiter.close()
        await found(bench, "r1.b2")

    fly(main, Kind.PLANE)
