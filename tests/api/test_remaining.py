"""What is left of routes and surveys, as parameters that are resolved to the same behavior."""

import json
import math
from dataclasses import replace
from itertools import pairwise

import pytest

from m2pem.api.remaining import (
    RemainingRoute,
    RemainingSurvey,
    RemainingWork,
    raw_parameters,
    restored_work,
)
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.parameters import resolve
from m2pem.geo.local_frame import LocalFrame
from m2pem.geo.survey_tracks import SurveyTracks
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.geometry import Area, Route, VehiclePosition
from tests.geo.passes import lawn_mower

FRAME = LocalFrame((38.0, -77.0))
SPEC = SHARED["single_vehicle_routing", BehaviorType.VEHICLE]
PLACES = [(0.0, 0.0), (100.0, 0.0), (100.0, 50.0), (0.0, 50.0)]
ROUTE = Route(
    tuple(
        (*FRAME.to_latlon(place), up)
        for place, up in zip(PLACES, (20.0, 40.0, None, 60.0), strict=True)
    ),
    "amsl",
)
PARAMETERS = {"route": ROUTE, "speed": 5.0}


def routing() -> RemainingRoute:
    return RemainingRoute(raw_parameters(PARAMETERS), ROUTE, FRAME)


def left(work: RemainingWork) -> Route:
    said = work.left()
    assert said is not None
    values = resolve(SPEC, json.loads(json.dumps(said)), lambda _: None, ())
    assert values["speed"] == 5.0
    route = values["route"]
    assert isinstance(route, Route)
    return route


def length_m(route: Route) -> float:
    places = [FRAME.to_local(waypoint[:2]) for waypoint in route.waypoints]
    return sum(math.dist(a, b) for a, b in pairwise(places))


def test_nothing_of_a_route_is_done_on_the_way_to_its_first_waypoint() -> None:
    work = routing()
    work.moved((50.0, 0.0), 0)
    assert left(work) == ROUTE


def test_the_rest_begins_where_the_vehicle_is_on_its_leg() -> None:
    work = routing()
    work.moved((25.0, 3.0), 1)
    rest = left(work)
    assert rest.altitude_frame == "amsl"
    assert FRAME.to_local(rest.waypoints[0][:2]) == pytest.approx((25.0, 0.0), abs=1e-3)
    assert rest.waypoints[0][2] == pytest.approx(25.0), "between the altitudes of its neighbours"
    assert rest.waypoints[1:] == ROUTE.waypoints[1:]
    work.moved((100.0, 20.0), 2)
    assert left(work).waypoints[0][2] is None, "the next waypoint has no altitude"


def test_the_rest_goes_on_at_the_speed_of_the_waypoint_before() -> None:
    route = replace(ROUTE, speeds_m_s=(2.0, None, 8.0, None))
    work = RemainingRoute(raw_parameters({**PARAMETERS, "route": route}), route, FRAME)
    work.moved((0.0, 0.0), 0)
    assert left(work).speeds_m_s == (2.0, None, 8.0, None)
    work.moved((25.0, 3.0), 1)
    assert left(work).speeds_m_s == (2.0, None, 8.0, None)
    work.reached(1)
    assert left(work).speeds_m_s == (2.0, 8.0, None)
    work.moved((60.0, 50.0), 3)
    assert left(work).speeds_m_s == (8.0, None)
    again = restored_work(json.loads(json.dumps(work.state())), FRAME)
    assert left(again).speeds_m_s == (8.0, None)


def test_the_rest_keeps_the_altitude_frame_of_each_waypoint() -> None:
    frames = ("relative", "amsl", "amsl", "terrain")
    route = Route.of(ROUTE.waypoints, frames)
    work = RemainingRoute(raw_parameters({**PARAMETERS, "route": route}), route, FRAME)
    work.moved((25.0, 3.0), 1)
    rest = left(work)
    assert rest.frames == ("amsl", "amsl", "amsl", "terrain")
    assert rest.waypoints[0][2] is None, "between two frames it keeps the height that it has"
    again = restored_work(json.loads(json.dumps(work.state())), FRAME)
    assert left(again) == rest
    work.reached(1)
    assert left(work).frames == ("amsl", "amsl", "terrain")


def test_a_waypoint_that_was_reached_is_where_the_rest_begins() -> None:
    work = routing()
    work.reached(2)
    assert left(work).waypoints == ROUTE.waypoints[2:]
    work.reached(1)
    work.moved((10.0, 0.0), 1)
    assert left(work).waypoints == ROUTE.waypoints[2:], "it never falls back"
    work.reached(3)
    assert left(work).waypoints == ROUTE.waypoints[3:]


def test_a_vehicle_far_from_its_way_has_not_come_farther() -> None:
    work = routing()
    work.moved((60.0, 90.0), 1)
    assert left(work) == ROUTE


def test_there_and_back_on_one_road_are_told_apart() -> None:
    back = Route((*ROUTE.waypoints[:2], ROUTE.waypoints[0]))
    work = RemainingRoute(raw_parameters(PARAMETERS), back, FRAME)
    work.find((70.0, 0.0), 128.0, 60.0, 200.0)
    assert length_m(left(work)) == pytest.approx(70.0, abs=0.01)


@pytest.mark.parametrize("anywhere", [False, True])
def test_a_way_is_followed_by_places_alone(*, anywhere: bool) -> None:
    back = Route((*ROUTE.waypoints[:2], ROUTE.waypoints[0]))
    work = RemainingRoute(raw_parameters(PARAMETERS), back, FRAME)
    work.follow((150.0, 40.0), anywhere=anywhere)
    assert length_m(left(work)) == pytest.approx(200.0, abs=0.01), "it is not on its way yet"
    lengths = []
    begin = 40.0 if anywhere else 0.0
    for step in range(round(begin), 196, 5):
        east = step if step <= 100 else 200 - step
        work.follow((float(east), 0.5), anywhere=anywhere)
        lengths.append(length_m(left(work)))
    assert all(a > b for a, b in pairwise(lengths))
    assert lengths[0] == pytest.approx(200.0 - begin, abs=1.0)
    assert lengths[-1] == pytest.approx(5.0, abs=6.0)


def test_who_cuts_the_corner_at_the_beginning_is_on_the_way_all_the_same() -> None:
    work = routing()
    for place in ((30.0, -40.0), (16.0, -8.0), (25.0, -4.0)):
        work.follow(place)
        assert left(work) == ROUTE
    work.follow((35.0, -3.0))
    assert length_m(left(work)) == pytest.approx(215.0, abs=0.1)


def test_reports_are_few() -> None:
    work = routing()
    said = 0
    for step in range(1, 251):
        work.find(work.line.at(float(step)), float(step), step - 5.0, step + 5.0)
        said += work.to_report() is not None
    assert said == 19
    assert work.to_report() is None
    assert work.to_report(least_m=1.0) is not None, "at an end, when it is asked for"
    assert work.to_report(least_m=1.0) is None


def test_angles_have_their_unit_and_vehicles_their_name() -> None:
    raw = raw_parameters({"heading": 1.5, "target": VehiclePosition("ugv1"), "altitude": None})
    assert raw == {"heading": "1.5 rad", "target": "ugv1"}


@pytest.mark.parametrize("up_m", [None, 55.0])
def test_what_is_left_of_a_survey_is_a_survey(up_m: float | None) -> None:
    places = [(0.0, 0.0), (100.0, 0.0), (100.0, 95.0), (0.0, 95.0), (0.0, 0.0)]
    area = Area((tuple((*FRAME.to_latlon(place), up_m) for place in places),), "amsl")
    tracks = SurveyTracks.over([places], 20.0, 0.0)
    parameters = raw_parameters({"area": area, "speed": 4.0})
    work: RemainingWork = RemainingSurvey(parameters, tracks, FRAME, up_m, "amsl")
    work.moved((40.0, 28.5), 3)
    work = restored_work(json.loads(json.dumps(work.state())), FRAME)
    said = work.left()
    assert said is not None
    spec = SHARED["area_survey", BehaviorType.VEHICLE]
    values = resolve(spec, json.loads(json.dumps(said)), lambda _: None, ())
    rest = values["area"]
    assert isinstance(rest, Area)
    assert (rest.altitude_frame, rest.rings[0][0][2]) == ("amsl", up_m)
    assert values["speed"] == 4.0
    heading, spacing = values["heading"], values["spacing"]
    assert isinstance(heading, float)
    assert isinstance(spacing, float)
    rings = [[FRAME.to_local(corner[:2]) for corner in ring] for ring in rest.rings]
    points = lawn_mower(rings, spacing, math.pi / 2 - heading)
    passes = [math.dist(*points[index : index + 2]) for index in range(0, len(points), 2)]
    assert passes == pytest.approx([40.0, 100.0, 100.0, 100.0], abs=0.1)


def test_a_route_goes_on_from_its_state() -> None:
    work = routing()
    work.moved((25.0, 0.0), 1)
    assert work.to_report() is not None
    again = restored_work(json.loads(json.dumps(work.state())), FRAME)
    assert left(again) == left(work)
    assert again.to_report() is None
