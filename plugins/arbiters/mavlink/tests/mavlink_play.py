"""Plays behaviors on vehicles without a network, in virtual time."""

from collections.abc import Awaitable, Callable

from m2pem_plugin_mavlink.arbiter import MavlinkArbiter
from mavlink_double import Body, DoubleStation, connections

from m2pem.api import BehaviorReport, Fence, ResourceId
from m2pem.api.clock import run_virtual
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness, context

START_US = 1_767_225_600_000_000
V = ResourceId("v")


class Bench(ArbiterHarness):
    """A bench whose vehicle is called v."""

    bodies: dict[ResourceId, Body]

    async def do(self, behavior: str, within_s: float = 600.0, **parameters) -> BehaviorReport:
        """Start it, and wait for its end."""
        await self.start("r1.b1", behavior, V, **parameters)
        return await self.ended("r1.b1", within_s)

    @property
    def body(self) -> Body:
        return self.bodies[V]

    @property
    def told(self) -> list[str]:
        return [call[0] for call in self.body.calls]


def play(
    bodies: Body | dict[ResourceId, Body], main: Callable[[Bench], Awaitable[None]], **more
) -> None:
    """Run `main` with a connected arbiter; again with the same bodies: after a restart."""
    bodies = {V: bodies} if isinstance(bodies, Body) else bodies

    async def run(clock) -> None:
        lent = context(clock)
        arbiter = MavlinkArbiter(
            connections(bodies, **more), lent, lambda *_: DoubleStation(bodies, lent)
        )
        async with Bench(arbiter, clock) as bench:
            bench.bodies, bench.bus = bodies, lent.bus
            await main(bench)

    run_virtual(run, START_US)


def after_a_restart(
    body: Body,
    behavior: str,
    main: Callable[[Bench, str], Awaitable[None]],
    *,
    before: Callable[[Bench], None] = lambda _: None,
    meanwhile: Callable[[Body], None] = lambda _: None,
    runs_for_s: float = 4.0,
    fence: Fence | None = None,
    **parameters,
) -> None:
    """Begin a behavior, close the arbiter, and run `main` with another one and the reference."""
    bodies = {V: body}

    async def run(clock) -> None:
        def arbiter():
            lent = context(clock)
            fenced = connections(bodies, fence=fence)
            made = MavlinkArbiter(fenced, lent, lambda *_: DoubleStation(bodies, lent))
            bench = Bench(made, clock)
            bench.bodies, bench.bus = bodies, lent.bus
            return bench

        async with arbiter() as bench:
            before(bench)
            await bench.start("r1.b1", behavior, V, **parameters)
            await bench.running("r1.b1")
            await clock.sleep(runs_for_s)
            reference = bench.of("r1.b1")[0].native_ref
            assert reference
        meanwhile(body)
        body.calls.clear()
        async with arbiter() as bench:
            await main(bench, reference)

    run_virtual(run, START_US)
