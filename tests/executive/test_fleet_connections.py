from collections.abc import Callable, Mapping
from typing import Any, cast

import pytest

from m2pem.api import Arbiter, ArbiterContext, Area, Connection, Route
from m2pem.executive.fleet_connections import FleetArbiters
from m2pem.fleet.fence import fence_of
from m2pem.fleet.fleet import Domain, Fleet, Payload, Vehicle, simulated_fleet
from m2pem.mission.catalogue import ResourceId

FIELD = Area((((47.0, 8.0, None), (47.0, 8.1, None), (47.1, 8.1, None), (47.0, 8.0, None)),))
UAV1, CAMERA = ResourceId("uav1"), ResourceId("uav1/camera")


class Nothing:
    """An arbiter that offers nothing."""

    def catalogue(self, resource: ResourceId) -> tuple[()]:
        return ()


class Plugins:
    """Keeps the connections that an arbiter would be made with."""

    def __init__(self) -> None:
        self.connections: dict[ResourceId, Connection] = {}

    def arbiter(self, name: str) -> Callable[..., Arbiter]:
        def make(connections: Mapping[ResourceId, Connection], context: ArbiterContext) -> Arbiter:
            self.connections.update(connections)
            return cast("Arbiter", Nothing())

        return make


@pytest.mark.parametrize(("fence", "lent"), [("field", FIELD), ("", None)])
def test_an_arbiter_is_told_the_failsafe_and_the_fence(fence: str, lent: Area | None) -> None:
    vehicle = Vehicle(UAV1, Domain.AIR, "mavlink", {}, failsafe="return_to_launch")
    fleet = Fleet(
        "fleet",
        "fleet.yaml",
        {UAV1: vehicle},
        {CAMERA: Payload(CAMERA, UAV1, "mavlink", {})},
        geometries={"field": FIELD, "alpha": Route(((47.0, 8.0, None),))},
        fence=fence,
    )
    plugins = Plugins()
    FleetArbiters(fleet, cast("Any", plugins), cast("ArbiterContext", object()))
    for resource in (UAV1, CAMERA):
        connection = plugins.connections[resource]
        assert connection.failsafe == "return_to_launch"
        assert connection.fence is fence_of(fleet, Domain.AIR)
        assert (connection.fence is None) is (lent is None)


@pytest.mark.parametrize(
    ("arbiter", "sitl", "simulated", "nothing_is_real"),
    [
        ("sim", False, False, True),
        ("ros", True, False, True),
        ("ros", False, True, True),
        ("ros", False, False, False),
    ],
)
def test_a_fleet_says_whether_anything_real_moves(
    arbiter: str, sitl: bool, simulated: bool, nothing_is_real: bool
) -> None:
    vehicles = {UAV1: Vehicle(UAV1, Domain.AIR, arbiter, {}, sitl=sitl)}
    fleet = Fleet("fleet", "fleet.yaml", vehicles)
    arbiters = FleetArbiters(
        simulated_fleet(fleet) if simulated else fleet,
        cast("Any", Plugins()),
        cast("ArbiterContext", object()),
    )
    assert arbiters.nothing_is_real is nothing_is_real
