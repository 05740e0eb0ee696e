"""The contract of arbiters, on vehicles without a network, in virtual time."""

import pytest
from m2pem_plugin_mavlink.arbiter import MavlinkArbiter
from mavlink_double import Body, DoubleStation, at, connections

from m2pem.api import Point, ResourceId
from m2pem.testing import ArbiterCase, ArbiterContract

A, B = ResourceId("a"), ResourceId("b")


class _Doubles(ArbiterContract):
    @pytest.fixture
    def bodies(self):
        raise NotImplementedError

    @pytest.fixture
    def make_arbiter(self, bodies):
        def make(context):
            return MavlinkArbiter(
                connections(bodies), context, lambda *_: DoubleStation(bodies, context)
            )

        return make

    @pytest.fixture
    def cut_link(self, bodies):
        def cut(_arbiter, vehicle) -> None:
            bodies[vehicle].heard_by_us = False

        return cut

    @pytest.fixture
    def mend_link(self, bodies):
        def mend(_arbiter, vehicle) -> None:
            bodies[vehicle].heard_by_us = True

        return mend

    @pytest.fixture
    def effects(self, bodies):
        return lambda _arbiter, vehicle: bodies[vehicle].begun

    @pytest.fixture
    def case(self):
        return ArbiterCase(
            vehicle=A,
            other=B,
            long=("goto", {"target": Point((*at(600.0, 0.0), None)), "speed": 5.0}),
            short=("goto", {"target": Point((*at(30.0, 20.0), None)), "speed": 5.0}),
            bad=("speed", -1.0),
        )


class TestCopters(_Doubles):
    @pytest.fixture
    def bodies(self):
        return {A: Body().fly(), B: Body(east=10.0).fly()}


class TestRovers(_Doubles):
    @pytest.fixture
    def bodies(self):
        return {A: Body("ground"), B: Body("ground", east=10.0)}


class TestCoptersOnARoute(_Doubles):
    @pytest.fixture
    def bodies(self):
        return {A: Body().fly(), B: Body(east=10.0).fly()}

    @pytest.fixture
    def case(self):
        from m2pem.api import Route

        def route(*places):
            return Route(tuple((*at(*place), 20.0) for place in places))

        return ArbiterCase(
            vehicle=A,
            other=B,
            long=("single_vehicle_routing", {"route": route((50, 0), (50, 600)), "speed": 5.0}),
            short=("single_vehicle_routing", {"route": route((20, 0), (20, 20)), "speed": 5.0}),
            bad=("speed", -1.0),
            route=("single_vehicle_routing", {"route": route((9, 9), (9, 90), (80, 90))}),
        )
