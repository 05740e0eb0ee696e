"""Which missions with teams are accepted, and who serves them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, cast

import pytest

from m2pem.api.arbiter import ArbiterContext, Connection
from m2pem.api.clock import SystemClock
from m2pem.bpmn import parse_mission
from m2pem.executive.fleet_connections import FleetArbiters
from m2pem.executive.loading import findings_for
from m2pem.findings import Finding
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.facts import unfit
from m2pem.fleet.fleet import Domain, Fleet, Team, Vehicle
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorSpec, ResourceId
from m2pem.plugins import PluginManager
from m2pem.testing.contracts.arbiter_harness import context

from .conftest import one_task, route

ROUTING = "single_vehicle_routing"
TEAM, VEHICLE = BehaviorType.TEAM, BehaviorType.VEHICLE


class Offering:
    """An arbiter that offers what its name says, apart by +."""

    def __init__(self, names: str) -> None:
        self._specs = [
            SHARED[name.removesuffix("!"), TEAM if name.endswith("!") else VEHICLE]
            for name in names.split("+")
        ]

    def catalogue(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        return self._specs


class Plugins:
    def arbiter(self, name: str) -> Any:
        def make(connections: Mapping[ResourceId, Connection], _: ArbiterContext) -> Offering:
            return Offering(name)

        return make


def arbiters(*names: str, behaviors: tuple[str, ...] | None = None) -> FleetArbiters:
    ids = [ResourceId(f"v{index}") for index in range(len(names))]
    vehicles = {
        id_: Vehicle(id_, Domain.GROUND, name, {}, behaviors)
        for id_, name in zip(ids, names, strict=True)
    }
    team = Team("crew", tuple(ids), ids[0])
    fleet = Fleet("f", "fleet.yaml", vehicles, {}, {"crew": team}, {"road": route((0, 0), (9, 0))})
    return FleetArbiters(fleet, cast("Any", Plugins()), context(SystemClock()))


def findings(known: FleetArbiters, name: str, **parameters: str) -> list[Finding]:
    mission = parse_mission(one_task(name, **parameters), "m.bpmn")
    return findings_for(mission, known, PluginManager(block=("all",)))


def test_members_that_can_drive_a_route_can_march_together() -> None:
    assert findings(arbiters(ROUTING, f"{ROUTING}+goto"), "road_sweep", route="road") == []


def test_a_vehicle_in_no_team_cannot_fill_a_role_of_a_team_behavior() -> None:
    member = arbiters(ROUTING)
    alone = FleetArbiters(
        replace(member.fleet, teams={}), cast("Any", Plugins()), context(SystemClock())
    )
    of = "road_sweep", TEAM, ResourceId("v0")
    assert unfit(member.fleet, member.graph, *of) == ""
    said = "it offers no team behavior road_sweep, as it is in no team of the fleet file"
    assert unfit(alone.fleet, alone.graph, *of) == said


def test_what_keeps_a_member_out_is_said() -> None:
    (finding,) = findings(arbiters(ROUTING, "goto"), "road_sweep", route="road")
    assert finding.rule == "unknown-behavior"
    assert "v1" in finding.message
    assert f"a member needs {ROUTING}, which it does not offer" in finding.remedy


def test_an_escort_needs_members_that_follow() -> None:
    found = findings(arbiters(ROUTING, f"{ROUTING}+follow"), "escort", target="[1, 2]")
    assert ["v0" in each.message for each in found] == [True]
    assert "follow" in found[0].remedy


def test_a_fleet_that_allows_too_little_of_a_member_keeps_it_out() -> None:
    known = arbiters(ROUTING, ROUTING, behaviors=("road_sweep",))
    found = findings(known, "road_sweep", route="road")
    assert len(found) == 2
    assert all("the fleet does not let it do" in each.remedy for each in found)


def test_a_fleet_that_does_not_allow_the_team_behavior_keeps_its_members_out() -> None:
    known = arbiters(ROUTING, ROUTING, behaviors=(ROUTING,))
    assert {each.rule for each in findings(known, "road_sweep", route="road")} == {
        "behavior-not-allowed"
    }


@pytest.mark.parametrize(
    ("names", "native"),
    [
        (("road_sweep!+goto", "road_sweep!+goto"), True),
        ((ROUTING, ROUTING), False),
        ((f"road_sweep!+{ROUTING}", ROUTING), False),
    ],
)
def test_an_arbiter_that_offers_it_for_all_members_keeps_it(
    names: tuple[str, ...], native: bool
) -> None:
    known = arbiters(*names)
    assert findings(known, "road_sweep", route="road") == []
    ids = list(known.fleet.vehicles)
    serving = known.serving(ids, "road_sweep", TEAM)
    assert serving is (known.of(ids[0]) if native else known.teams)


def test_a_behavior_of_vehicles_on_two_arbiters_is_done_by_each() -> None:
    known = arbiters(ROUTING, f"{ROUTING}+goto")
    assert known.serving(list(known.fleet.vehicles), ROUTING, VEHICLE) is known.teams


def test_a_behavior_of_vehicles_goes_to_their_arbiter_where_that_takes_several() -> None:
    known = arbiters(ROUTING, ROUTING)
    ids = list(known.fleet.vehicles)
    assert known.serving(ids, ROUTING, VEHICLE) is known.of(ids[0])


def test_who_is_in_no_team_is_offered_none() -> None:
    known = arbiters(ROUTING)
    alone = Fleet("f", "f.yaml", known.fleet.vehicles)
    single = FleetArbiters(alone, cast("Any", Plugins()), context(SystemClock()))
    assert [spec.name for spec in single.offered(ResourceId("v0"))] == [ROUTING]
