"""Plays behaviors on vehicles without ROS, in virtual time."""

from collections.abc import Awaitable, Callable, Mapping
from contextlib import asynccontextmanager
from dataclasses import replace
from uuid import UUID

from ros_double import Dynamics, arbiter, at

from m2pem.api import ResourceId
from m2pem.api.clock import run_virtual
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness, context

A, B = ResourceId("a"), ResourceId("b")
JOURNAL = UUID("5a0cf3a8-1f5c-4b53-8f67-7c26a7f3b1d4")
START_US = 1_767_225_600_000_000
FAR = at(600.0, 0.0)
NEAR = at(10.0, 0.0)


class Play:
    """`bodies` outlive the arbiters that `connected` makes, one after the other."""

    def __init__(self, bodies: Mapping[ResourceId, Dynamics], clock, settings) -> None:
        self.bodies = bodies
        self.clock = clock
        self.context = replace(context(clock), journal=JOURNAL)
        self.settings = settings

    @asynccontextmanager
    async def connected(self):
        made = arbiter(self.bodies, self.context, **self.settings)
        async with ArbiterHarness(made, self.clock) as bench:
            yield bench


def play(
    main: Callable[[Play], Awaitable[None]],
    bodies: Mapping[ResourceId, Dynamics] | None = None,
    **settings: object,
) -> None:
    async def run(clock) -> None:
        await main(Play(bodies or {A: Dynamics(), B: Dynamics(east=10.0)}, clock, settings))

    run_virtual(run, START_US)
