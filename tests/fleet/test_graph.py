from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.graph import ResourceGraph
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorSpec, ResourceId

from .fleets import everything, patrol

VEHICLE, PAYLOAD, TEAM = BehaviorType.VEHICLE, BehaviorType.PAYLOAD, BehaviorType.TEAM


@pytest.fixture
def graph(tmp_path: Path) -> ResourceGraph:
    return ResourceGraph(patrol(tmp_path), everything)


def test_the_graph_knows_what_each_name_is(graph: ResourceGraph) -> None:
    names = ("evsg1", "evsg3/ptz", "section", "evsg9")
    assert [graph.kind(name) for name in names] == [VEHICLE, PAYLOAD, TEAM, None]


def test_payloads_are_mounted_on_vehicles(graph: ResourceGraph) -> None:
    assert graph.payloads(ResourceId("evsg3")) == ("evsg3/ptz",)
    assert graph.payloads(ResourceId("evsg2")) == ()
    assert graph.vehicle(ResourceId("evsg3/ptz")) == "evsg3"
    assert graph.vehicle(ResourceId("evsg3")) is None


def test_vehicles_are_members_of_teams_and_the_lead_is_first(graph: ResourceGraph) -> None:
    assert graph.members("section") == ("evsg1", "evsg3")
    assert graph.teams(ResourceId("evsg1")) == ("section", "convoy")
    assert graph.teams(ResourceId("evsg2")) == ()


def test_who_offers_a_behavior_is_found_by_name_and_type(graph: ResourceGraph) -> None:
    assert graph.offering("goto", VEHICLE) == ("evsg1", "evsg3", "lead")
    assert graph.offering("drive_stop", VEHICLE) == ("evsg1", "evsg2", "evsg3", "lead")
    assert graph.offering("zoom", PAYLOAD) == ("evsg1/gpr", "evsg3/ptz")
    assert graph.offering("area_survey", TEAM) == ("section", "convoy")
    assert graph.offering("zoom", VEHICLE) == ()
    assert graph.offering("somersault", VEHICLE) == ()


def test_a_resource_offers_what_its_fleet_allows(graph: ResourceGraph) -> None:
    assert [spec.name for spec in graph.offers("evsg2")] == ["drive_stop"]
    assert {spec.type for spec in graph.offers("evsg1")} == {VEHICLE, TEAM}
    assert {spec.type for spec in graph.offers("evsg3/ptz")} == {PAYLOAD}
    assert graph.offers("evsg9") == ()


def test_a_team_offers_what_all_members_do(tmp_path: Path) -> None:
    def some(resource: ResourceId) -> Sequence[BehaviorSpec]:
        names = ("formation", "escort") if resource == "evsg1" else ("formation", "road_sweep")
        return [SHARED[name, TEAM] for name in names]

    graph = ResourceGraph(patrol(tmp_path), some)
    assert [spec.name for spec in graph.offers("section")] == ["formation"]
    assert graph.spec("section", "formation", TEAM) is SHARED["formation", TEAM]
    assert graph.spec("section", "escort", TEAM) is None
    assert graph.offering("escort", TEAM) == ()


def test_each_arbiter_keeps_its_own_way_to_take_a_behavior(tmp_path: Path) -> None:
    shared = SHARED["goto", VEHICLE]
    own = replace(shared, doc="As this arbiter does it.")

    def differing(resource: ResourceId) -> Sequence[BehaviorSpec]:
        return [own if resource == "evsg3" else shared]

    graph = ResourceGraph(patrol(tmp_path), differing)
    assert graph.spec("evsg3", "goto", VEHICLE) is own
    assert graph.spec("evsg1", "goto", VEHICLE) is shared
    assert graph.spec("evsg2", "goto", VEHICLE) is None
    assert graph.spec("evsg9", "goto", VEHICLE) is None
