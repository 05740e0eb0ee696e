"""The simulated arbiter keeps the contract of every arbiter."""

from pathlib import Path

import pytest

from m2pem.api.arbiter import Arbiter, ArbiterContext, Connection
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Point, Route
from m2pem.simulation.arbiters import SimArbiter
from m2pem.testing.contracts.arbiter import (
    ArbiterCase,
    ArbiterContract,
    CutLink,
    Effects,
    MakeArbiter,
)

UGV1, UGV2 = ResourceId("ugv1"), ResourceId("ugv2")


class TestSimArbiter(ArbiterContract):
    @pytest.fixture
    def make_arbiter(self, tmp_path: Path) -> MakeArbiter:
        def make(context: ArbiterContext) -> Arbiter:
            state = str(tmp_path / "vehicles.sqlite")
            connections = {
                vehicle: Connection(vehicle, "ground", {"state": state}) for vehicle in (UGV1, UGV2)
            }
            return SimArbiter(connections, context)

        return make

    @pytest.fixture
    def case(self) -> ArbiterCase:
        route = Route(((38.108, -77.3192, None), (38.110, -77.3180, None)))
        return ArbiterCase(
            vehicle=UGV1,
            other=UGV2,
            long=("single_vehicle_routing", {"route": route}),
            short=("goto", {"target": Point((38.1077, -77.3192, None))}),
            bad=("speed", -1.0),
            route=("single_vehicle_routing", {"route": route, "speed": 4.0}),
        )

    @pytest.fixture
    def cut_link(self) -> CutLink:
        def cut(arbiter: Arbiter, vehicle: ResourceId) -> None:
            assert isinstance(arbiter, SimArbiter)
            arbiter.lose_link(vehicle)

        return cut

    @pytest.fixture
    def mend_link(self) -> CutLink:
        def mend(arbiter: Arbiter, vehicle: ResourceId) -> None:
            assert isinstance(arbiter, SimArbiter)
            arbiter.restore_link(vehicle)

        return mend

    @pytest.fixture
    def effects(self) -> Effects:
        def count(arbiter: Arbiter, vehicle: ResourceId) -> int:
            assert isinstance(arbiter, SimArbiter)
            return sum(e.kind == "start" and e.resource == vehicle for e in arbiter.effects)

        return count
