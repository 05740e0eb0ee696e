"""One behavior alone, in virtual time: when it ends, and how its resources are then."""

import asyncio
import logging
from collections.abc import Mapping
from dataclasses import dataclass

from m2pem.api.arbiter import Arbiter, ArbiterContext, BehaviorRequest, Connection
from m2pem.api.clock import VirtualClock, run_virtual
from m2pem.fleet.fleet import Fleet
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.simulation.arbiters import SimArbiter
from m2pem.simulation.executions import Body
from m2pem.teams.arbiter import Teams
from m2pem.teams.capabilities import Capabilities
from m2pem.telemetry.bus import Bus

MOST_STEPS = 100_000
"""A march of four that lasts 100 minutes takes as many, and some seconds of computing."""

REMEMBERED = 500
"""Ends that are kept: an editor asks again at each change, most of which concern other tasks."""

_log = logging.getLogger("m2pem.simulation")


@dataclass(frozen=True, slots=True)
class BehaviorEnd:
    """`at_us`: after its start; None: it is not known, and `reason` says why. `bodies`: as they are
    then."""

    at_us: int | None
    bodies: Mapping[ResourceId, Body]
    reason: str = ""


_MATTERS = "battery", "cruise_m_s"
_known: dict[str, BehaviorEnd] = {}


def simulate_behavior(
    fleet: Fleet,
    connections: Mapping[ResourceId, Connection],
    bodies: Mapping[ResourceId, Body],
    request: BehaviorRequest,
    type_: BehaviorType,
) -> BehaviorEnd:
    """Return how a behavior ends that starts at time 0.

    `connections`, `bodies`: of all that it needs. The bodies are at rest at first, and are moved.
    """
    places = [each.track.at(0) for each in bodies.values()]
    charges = [getattr(each, name, 0.0) for each in bodies.values() for name in _MATTERS]
    key = repr((fleet.origin, connections, places, charges, request, type_))
    end = _known.get(key)
    if end is None:
        if len(_known) >= REMEMBERED:
            _known.clear()
        end = _known[key] = run_virtual(
            lambda clock: _simulate(clock, fleet, connections, bodies, request, type_), 0
        )
    return end


async def _simulate(
    clock: VirtualClock,
    fleet: Fleet,
    connections: Mapping[ResourceId, Connection],
    bodies: Mapping[ResourceId, Body],
    request: BehaviorRequest,
    type_: BehaviorType,
) -> BehaviorEnd:
    """Have the simulated arbiter, or that of teams, do a behavior, without an executive."""
    context = ArbiterContext(clock, Bus(), _log, fleet.origin)
    arbiter = SimArbiter(connections, context, bodies=bodies)
    teams = Teams(fleet, lambda _: arbiter, context, Capabilities(fleet, lambda _: arbiter))
    acting: Arbiter = teams if type_ is BehaviorType.TEAM else arbiter
    ending: asyncio.Future[BehaviorEnd] = asyncio.get_running_loop().create_future()
    steps = 0

    def end(reason: str) -> None:
        if not ending.done():
            ending.set_result(BehaviorEnd(None if reason else clock.now_us(), bodies, reason))

    def before_a_jump(_: float | None) -> bool:
        nonlocal steps
        if ending.done():
            return False
        steps += len(request.resources)
        if steps > MOST_STEPS:
            end("it takes too long to be estimated: rehearse it")
        elif not (arbiter.expects or teams.expects):
            end("it does not end by itself")
        return ending.done()

    async def read(of: Arbiter) -> None:
        async for report in of.reports():
            if of is not acting:
                teams.report_received(report)
            elif report.state.terminal:
                succeeded = report.state is BehaviorState.SUCCEEDED
                end("" if succeeded else report.reason or report.state.value)

    clock.when_idle(before_a_jump)
    await arbiter.connect()
    async with asyncio.TaskGroup() as group:
        reading = [group.create_task(read(each)) for each in dict.fromkeys((arbiter, acting))]
        await acting.start(request)
        await ending
        for each in reading:
            each.cancel()
    return ending.result()
