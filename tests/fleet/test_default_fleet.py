from dataclasses import replace

from m2pem.findings import Finding
from m2pem.fleet.check import check_mission
from m2pem.fleet.default_fleet import ORIGIN, fleet_for
from m2pem.fleet.fleet import Domain, Fleet
from m2pem.geo.local_frame import distance_m
from m2pem.mission.behavior import Behavior, BehaviorType, ServiceCall
from m2pem.mission.geometry import Area, Point, Route

from .fleets import everything
from .missions import READ_LATER, behavior, drive, mission, payload, team, vehicle

PAYLOAD, TEAM = BehaviorType.PAYLOAD, BehaviorType.TEAM

TASKS: list[Behavior | ServiceCall] = [
    drive(vehicle("evsg1"), route="alpha"),
    behavior("goto", vehicle("evsg2"), target="gate", speed="2 m/s"),
    behavior("goto", vehicle("evsg2"), target="evsg9"),
    behavior("follow", vehicle("evsg2"), target="evsg9"),
    behavior("takeoff", vehicle("uav1"), altitude="20 m"),
    behavior("area_survey", team("section"), type_=TEAM, area="field"),
    behavior("zoom", payload("evsg3/ptz"), type_=PAYLOAD, level="2"),
    behavior("goto", vehicle("evsg1"), target="[38, -77]"),
    ServiceCall("Detector", 30, (payload("evsg1/gpr", "detector"),)),
]


def check(fleet: Fleet, *tasks: Behavior | ServiceCall) -> list[Finding]:
    return check_mission(mission(*tasks), fleet, everything)


def test_a_made_up_fleet_fits_its_mission() -> None:
    assert check(fleet_for(mission(*TASKS)), *TASKS) == []


def test_everything_that_the_mission_names_is_there_and_nothing_else() -> None:
    fleet = fleet_for(mission(*TASKS))
    assert {name: type(found) for name, found in fleet.geometries.items()} == {
        "alpha": Route,
        "gate": Point,
        "field": Area,
    }
    assert set(fleet.payloads) == {"evsg3/ptz", "evsg1/gpr"}
    assert fleet.vehicles["evsg3"].payloads == ("evsg3/ptz",)
    assert fleet.detectors == ("evsg1/gpr",)
    section = fleet.teams["section"]
    assert section.members == ("section_1", "section_2", "section_3")
    assert section.lead == "section_1"
    assert set(fleet.vehicles) == {"evsg1", "evsg2", "evsg3", "evsg9", "uav1", *section.members}


def test_what_takes_off_flies_and_the_rest_drives() -> None:
    fleet = fleet_for(
        mission(*TASKS, behavior("goto", vehicle("uav2"), target="gate", altitude="9 m"))
    )
    flying = {name for name, found in fleet.vehicles.items() if found.domain is Domain.AIR}
    assert flying == {"uav1", "uav2"}


def test_aircraft_begin_on_the_ground_if_the_mission_has_a_take_off_else_in_the_air() -> None:
    survey = behavior("area_survey", vehicle("uav1"), area="field", altitude="9 m")
    assert check(fleet_for(mission(survey)), survey) == []
    tasks = [behavior("takeoff", vehicle("uav2"), altitude="9 m"), survey]
    assert [each.rule for each in check(fleet_for(mission(*tasks)), *tasks)] == ["no-takeoff"]


def test_vehicles_start_apart_and_near_the_origin() -> None:
    fleet = fleet_for(mission(*TASKS))
    homes = [vehicle.settings["home"] for vehicle in fleet.vehicles.values()]
    apart = [distance_m(ORIGIN[:2], home[:2]) for home in homes]
    assert all(abs(d - 10 * i) < 0.1 for i, d in enumerate(apart))


def test_routes_are_a_few_hundred_metres_long_and_apart() -> None:
    tasks = [drive(vehicle("evsg1"), route=name) for name in ("alpha", "bravo")]
    alpha, bravo = fleet_for(mission(*tasks)).geometries.values()
    assert isinstance(alpha, Route)
    assert isinstance(bravo, Route)
    assert 290 < distance_m(ORIGIN[:2], alpha.waypoints[-1][:2]) < 310
    assert alpha.waypoints[-1] != bravo.waypoints[-1]


def test_the_same_mission_gives_the_same_fleet() -> None:
    assert fleet_for(mission(*TASKS)) == fleet_for(mission(*TASKS))


def test_vehicles_start_where_the_mission_has_drawn_unless_that_is_near() -> None:
    bare = mission(*TASKS[:-2])  # the one before the last has coordinates near the fixed origin
    for north, expected in ((47.3, (47.3, 8.5)), (ORIGIN[0] + 0.05, ORIGIN[:2])):
        east = 8.5 if north == 47.3 else ORIGIN[1]
        lane = Route(((north, east, None), (north + 0.001, east, 20.0)))
        fleet = fleet_for(replace(bare, geometries={"alpha": lane}))
        assert fleet.origin[:2] == expected
        homes = [vehicle.settings["home"] for vehicle in fleet.vehicles.values()]
        assert all(distance_m(expected, home[:2]) < 100 for home in homes)
        assert "alpha" not in fleet.geometries
        gate = fleet.geometries["gate"]
        assert isinstance(gate, Point)
        assert distance_m(expected, gate.position[:2]) < 200
        assert check_mission(replace(bare, geometries={"alpha": lane}), fleet, everything) == []


def test_a_detector_service_without_roles_gets_a_detector() -> None:
    call = ServiceCall("Detector", 30)
    assert fleet_for(mission(TASKS[0], call)).detectors == ("evsg1/detector",)
    assert fleet_for(mission(call)).detectors == ("vehicle_1/detector",)
    assert fleet_for(mission(*TASKS, call)).detectors == ("evsg1/gpr",)


def test_names_of_an_arbiters_own_behavior_are_guessed_from_its_parameters() -> None:
    own = behavior("plough", vehicle("evsg1"), area="field", depth="x")
    assert list(fleet_for(mission(own)).geometries) == ["field"]


def test_a_value_that_is_read_later_names_nothing() -> None:
    fleet = fleet_for(mission(drive(vehicle("evsg1"), route=READ_LATER)))
    assert fleet.geometries == {}


def test_a_mission_that_commands_nothing_needs_no_vehicle() -> None:
    assert fleet_for(mission(behavior("hold", duration="5 s"))).vehicles == {}
