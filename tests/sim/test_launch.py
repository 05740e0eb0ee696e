"""Which manoeuvre each resource of a request does."""

import logging

from m2pem.api.arbiter import ArbiterContext, BehaviorId, BehaviorRequest, Connection
from m2pem.executive.clock import VirtualClock, run_virtual
from m2pem.gateway.bus import Bus
from m2pem.model.catalogue import ResourceId
from m2pem.sim.frame import Frame
from m2pem.sim.launch import Assignment, Launcher
from m2pem.sim.settings import read_settings
from m2pem.sim.vehicles import SimVehicle

ORIGIN = (38.1, -77.3, 0.0)
SECTION = tuple(ResourceId(name) for name in ("ugv1", "ugv2", "ugv3"))


def assigned(behavior: str, resources: tuple[ResourceId, ...]) -> list[Assignment]:
    """What three vehicles, of which the fleet makes a team led by ugv1, do for a behavior."""
    request = BehaviorRequest(BehaviorId("r1.b1"), 1, behavior, {}, resources)

    async def main(clock: VirtualClock) -> list[Assignment]:
        frame = Frame(ORIGIN)
        connections = {name: Connection(name, "ground") for name in SECTION}
        bodies = {
            name: SimVehicle(connection, read_settings(connection), frame, place, clock.now_us())
            for place, (name, connection) in enumerate(connections.items())
        }
        context = ArbiterContext(
            clock, Bus(), logging.getLogger("test"), ORIGIN, {"section": SECTION}
        )
        launcher = Launcher(connections, context, frame, dict(bodies))
        return launcher.assign(request, clock.now_us())

    return run_virtual(main, 0)


def test_the_first_resource_of_a_request_leads_whatever_other_teams_it_is_in() -> None:
    rear_first = (SECTION[2], SECTION[0], SECTION[1])
    lead, *others = assigned("formation", rear_first)
    assert lead.body.id == "ugv3"
    assert lead.plan is not None and lead.plan.duration_s == 0.0
    assert [other.body.id for other in others] == ["ugv1", "ugv2"]
    assert all(other.plan is not None and other.plan.duration_s > 0.0 for other in others)
