"""Registers the simulated arbiter, through the same hook as any other, and warns of batteries that
would not last and of what leaves the fence, by its kinematics."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from m2pem import hookimpl

if TYPE_CHECKING:
    from collections.abc import Sequence

    from m2pem.api.arbiter import Arbiter
    from m2pem.findings import Finding
    from m2pem.fleet.fleet import Fleet
    from m2pem.mission.mission import Mission


@hookimpl
def m2pem_register_arbiters(register: "Callable[[str, Callable[..., Arbiter]], None]") -> None:
    from m2pem.simulation.arbiters import SimArbiter  # noqa: PLC0415  # starting up must stay fast

    register("sim", SimArbiter)


@hookimpl
def m2pem_check_mission(mission: "Mission", fleet: "Fleet | None") -> "Sequence[Finding]":
    """Warn of vehicles whose stated endurance is not enough, and find what leaves the fence."""
    found: list[Finding] = []
    if fleet is not None and fleet.fenced:
        from m2pem.simulation.fencing import fence_findings  # noqa: PLC0415  # as above

        found += fence_findings(mission, fleet)
    if fleet is not None and any(each.endurance_s for each in fleet.vehicles.values()):
        from m2pem.simulation.estimates import endurance_findings  # noqa: PLC0415  # as above

        found += endurance_findings(mission, fleet)
    return found
