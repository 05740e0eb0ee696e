"""What the contract of arbiters, kept by the template, cannot see of `GoalArbiter`."""

import pytest

from m2pem.api import (
    BehaviorRequest,
    BehaviorSpec,
    BehaviorState,
    BehaviorType,
    Connection,
    GoalArbiter,
    ResourceId,
    VehicleState,
)
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness, context

FIRST, SECOND = ResourceId("first"), ResourceId("second")


class Boats(GoalArbiter):
    """Boats that do what the test says; `first` may break what it says."""

    behaviors = (BehaviorSpec("sail", BehaviorType.VEHICLE),)

    def __init__(self, clock, breaks=None, silent=()):
        connections = {name: Connection(name, "surface") for name in (FIRST, SECOND)}
        super().__init__(connections, context(clock))
        self.breaks, self.silent = breaks, silent
        self.goals = {}

    async def listen(self, resource):
        while True:
            if resource == FIRST and self.breaks is not None:
                raise self.breaks
            if resource not in self.silent:
                now_us = self.context.clock.now_us()
                self.receive(VehicleState(resource, now_us), self.goals.get(resource, ""))
            await self.context.clock.sleep(0.5)

    def refusal(self, request: BehaviorRequest) -> str:
        return "it is ashore" if request.id == "r1.b9" else ""

    async def begin(self, request, goal):
        self.goals[request.resources[0]] = goal


@pytest.mark.parametrize("breaks", [ConnectionError("no link"), ValueError("no such word")])
def test_a_vehicle_that_cannot_be_heard_does_not_deafen_the_arbiter_to_others(
    breaks, virtual
) -> None:
    async def main(clock):
        async with ArbiterHarness(Boats(clock, breaks), clock) as bench:
            await bench.start("r1.b1", "sail", SECOND)
            await bench.running("r1.b1")
            await bench.start("r1.b2", "sail", FIRST)
            return await bench.ended("r1.b2", 10)

    assert virtual(main).state is BehaviorState.LOST


def test_to_connect_takes_no_longer_than_its_bound_when_nobody_speaks(virtual) -> None:
    async def main(clock):
        arbiter, began_us = Boats(clock, silent=(FIRST, SECOND)), clock.now_us()
        await arbiter.connect()
        took_us = clock.now_us() - began_us
        await arbiter.close()
        return took_us

    assert virtual(main) == 2_000_000


def test_a_refusal_of_a_subclass_reaches_the_executive(virtual) -> None:
    async def main(clock):
        async with ArbiterHarness(Boats(clock), clock) as bench:
            await bench.start("r1.b9", "sail", FIRST)
            return await bench.ended("r1.b9", 1)

    end = virtual(main)
    assert (end.state, end.code, end.reason) == (BehaviorState.REJECTED, "REJECTED", "it is ashore")


def test_an_old_goal_of_a_vehicle_says_nothing_of_a_new_behavior_of_the_same_id(virtual) -> None:
    async def main(clock):
        boats = Boats(clock)
        async with ArbiterHarness(boats, clock) as bench:
            boats.receive(VehicleState(FIRST, 0), "goal-of-last-year", BehaviorState.SUCCEEDED)
            return await boats.query("r1.b1", "goal-of-another-run"), bench.reports

    found, reports = virtual(main)
    assert (found.state, reports) == (BehaviorState.UNKNOWN, [])
