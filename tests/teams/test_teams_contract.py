"""Teams keep the promises of every arbiter: a team behavior of one member, on a cart's arbiter."""

import asyncio
from collections.abc import AsyncIterator, Callable, Mapping
from typing import ClassVar

import pytest

from m2pem.api.arbiter import ArbiterContext, BehaviorReport, Connection
from m2pem.api.telemetry import PayloadState, VehicleState
from m2pem.fleet.fleet import Domain, Fleet, Team, Vehicle
from m2pem.mission.catalogue import ResourceId
from m2pem.teams.arbiter import Teams
from m2pem.teams.capabilities import Capabilities
from m2pem.testing import ArbiterCase, ArbiterContract

from .carts import ORIGIN, CartArbiter, WillingCartArbiter, Yard
from .conftest import route

A, B = ResourceId("a"), ResourceId("b")


class Crew(Teams):
    """Teams with the members' arbiter, whose reports and states reach them as in an executive."""

    def __init__(self, yard: Yard, kind: type[CartArbiter], context: ArbiterContext) -> None:
        vehicles = {name: Vehicle(name, Domain.GROUND, "carts", {}) for name in (A, B)}
        teams = {str(name): Team(str(name), (name,), name) for name in vehicles}
        fleet = Fleet("f", "f.yaml", vehicles, {}, teams, {}, ORIGIN)
        self.carts = kind({name: Connection(name, "ground") for name in vehicles}, context)
        self.carts.yard = yard
        self._bus = context.bus
        self._reading: asyncio.Task[None] | None = None

        def arbiter_of(_: ResourceId) -> CartArbiter:
            return self.carts

        super().__init__(fleet, arbiter_of, context, Capabilities(fleet, arbiter_of))

    async def connect(self) -> None:
        await self.carts.connect()
        self._reading = asyncio.create_task(self._read())

    async def _read(self) -> None:
        async for report in self.carts.reports():
            self._hand_over(report)

    def _hand_over(self, report: BehaviorReport) -> None:
        assert self.report_received(report)

    async def telemetry(self) -> AsyncIterator[VehicleState | PayloadState]:  # type: ignore[override]
        async for state in self.carts.telemetry():
            self._bus.publish(state)
            yield state

    async def close(self) -> None:
        await super().close()
        await self.carts.close()
        if self._reading is not None:
            await self._reading


class TestTeams(ArbiterContract):
    unsupported: ClassVar[Mapping[str, str]] = {
        "reconnect": "its executive must say what it asks for; test_restart_run.py has that"
    }
    kind: ClassVar[type[CartArbiter]] = CartArbiter

    @pytest.fixture
    def yard(self) -> Yard:
        return Yard(a=(0, 0), b=(0, -20))

    @pytest.fixture
    def make_arbiter(self, yard: Yard) -> Callable[[ArbiterContext], Crew]:
        return lambda context: Crew(yard, self.kind, context)

    @pytest.fixture
    def case(self) -> ArbiterCase:
        return ArbiterCase(
            vehicle=A,
            other=B,
            long=("road_following_formation", {"route": route((10, 0), (2000, 0)), "speed": 5.0}),
            short=("road_sweep", {"route": route((5, 0), (20, 0)), "speed": 5.0}),
            bad=("shape", "crooked"),
        )

    @pytest.fixture
    def cut_link(self, yard: Yard) -> Callable[[Crew, ResourceId], None]:
        def cut(_: Crew, vehicle: ResourceId) -> None:
            yard.driven[vehicle].mute = True

        return cut

    @pytest.fixture
    def effects(self, yard: Yard) -> Callable[[Crew, ResourceId], int]:
        return lambda _, vehicle: yard.count("single_vehicle_routing", vehicle)


class TestTeamsOfWilling(TestTeams):
    kind: ClassVar[type[CartArbiter]] = WillingCartArbiter
