"""Planes that are found again after a restart of the arbiter, over real UDP."""

from m2pem_plugin_mavlink.arbiter import MavlinkArbiter
from m2pem_plugin_mavlink.sim.specification import Kind
from mavlink_simulated import Bench, at, connections, fly

from m2pem.api import BehaviorState, Point
from m2pem.testing.contracts.bench import context


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
