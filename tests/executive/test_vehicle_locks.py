"""One executive commands a vehicle, whatever arbiter it has: by the address or by all settings."""

import os
from typing import Any, cast

import pytest

from m2pem.api import ArbiterCapabilities, ArbiterContext
from m2pem.executive.fleet_connections import FleetArbiters
from m2pem.executive.vehicle_locks import VehicleInUseError, VehicleLocks, addresses_of
from m2pem.fleet.fleet import Domain, Fleet, Vehicle
from m2pem.mission.catalogue import ResourceId

UAV1 = ResourceId("uav1")


class Unaddressed:
    """An arbiter that does not say what it connects to."""

    def catalogue(self, resource: ResourceId) -> tuple[()]:
        return ()


class Addressed(Unaddressed):
    """An arbiter that knows a vehicle by its radio alone."""

    capabilities = ArbiterCapabilities(addresses=True)

    def __init__(self, radio: str) -> None:
        self._radio = radio

    def addresses(self, resource: ResourceId) -> list[str]:
        return [self._radio]


class Plugins:
    def arbiter(self, name: str) -> Any:
        return lambda connections, context: (
            Addressed(connections[UAV1].settings["radio"]) if name == "radio" else Unaddressed()
        )


def locks(arbiter: str, **settings: Any) -> VehicleLocks:
    fleet = Fleet("fleet", "fleet.yaml", {UAV1: Vehicle(UAV1, Domain.AIR, arbiter, settings)})
    plugins, context = cast("Any", Plugins()), cast("ArbiterContext", object())
    return VehicleLocks(addresses_of(FleetArbiters(fleet, plugins, context)))


@pytest.mark.parametrize(
    ("arbiter", "settings", "same", "other"),
    [
        ("plain", {"port": 7}, {"port": 7}, {"port": 8}),
        ("radio", {"radio": "a", "speed": 2}, {"radio": "a", "speed": 3}, {"radio": "b"}),
    ],
)
def test_a_vehicle_of_any_arbiter_has_one_executive(
    arbiter: str, settings: dict[str, Any], same: dict[str, Any], other: dict[str, Any]
) -> None:
    first, second, elsewhere = (locks(arbiter, **each) for each in (settings, same, other))
    first.acquire()
    elsewhere.acquire()
    with pytest.raises(VehicleInUseError, match=f"uav1: process {os.getpid()} commands it already"):
        second.acquire()
    first.release()
    second.acquire()
    second.release()
    elsewhere.release()


def test_an_executive_that_has_several_vehicles_is_named_once() -> None:
    addresses = {ResourceId(name): [f"{name} a", f"{name} b"] for name in ("uav1", "uav2")}
    first, second = VehicleLocks(addresses), VehicleLocks(addresses)
    first.acquire()
    try:
        with pytest.raises(VehicleInUseError) as refused:
            second.acquire()
    finally:
        first.release()
    assert str(refused.value).startswith(f"uav1, uav2: process {os.getpid()} commands it already")
    assert str(refused.value).count("commands it already") == 1
