"""The contract of arbiters, on vehicles without ROS, in virtual time."""

from dataclasses import replace
from uuid import UUID

import pytest
from ros_double import Dynamics, arbiter, at

from m2pem.api import ResourceId, Route
from m2pem.testing import ArbiterCase, ArbiterContract

A, B = ResourceId("a"), ResourceId("b")
ROUTE = Route(tuple(at(*place).position for place in ((5.0, 0.0), (105.0, 0.0), (105.0, 80.0))))
JOURNAL = UUID("5a0cf3a8-1f5c-4b53-8f67-7c26a7f3b1d4")


class TestRosVehicles(ArbiterContract):
    @pytest.fixture
    def bodies(self):
        return {A: Dynamics(), B: Dynamics(east=10.0)}

    @pytest.fixture
    def make_arbiter(self, bodies):
        return lambda context: arbiter(bodies, replace(context, journal=JOURNAL))

    @pytest.fixture
    def cut_link(self, bodies):
        def cut(_arbiter, vehicle) -> None:
            bodies[vehicle].linked = False

        return cut

    @pytest.fixture
    def mend_link(self, bodies):
        def mend(_arbiter, vehicle) -> None:
            bodies[vehicle].linked = True

        return mend

    @pytest.fixture
    def effects(self, bodies):
        return lambda _arbiter, vehicle: bodies[vehicle].begun

    @pytest.fixture
    def case(self):
        return ArbiterCase(
            vehicle=A,
            other=B,
            long=("goto", {"target": at(600.0, 0.0), "speed": 5.0}),
            short=("goto", {"target": at(30.0, 20.0), "speed": 5.0}),
            bad=("speed", -1.0),
            route=("single_vehicle_routing", {"route": ROUTE, "speed": 5.0}),
        )
