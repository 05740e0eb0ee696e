import json
import math

import pytest

from m2pem.api.arbiter import ResolvedValue
from m2pem.api.behavior_parameters import (
    BehaviorParameters,
    decode_parameters,
    encode_parameters,
    refusal,
)
from m2pem.fleet.behaviors import SHARED
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.geometry import Area, Point, Route, VehiclePosition

ROUTE = Route(((0.0, 0.0, None), (0.0, 1.0, None)))
PLACE = Point((0.0, 0.0, None))


@pytest.mark.parametrize(
    ("behavior", "type_", "parameters"),
    [
        ("single_vehicle_routing", BehaviorType.VEHICLE, {"route": ROUTE, "loop": True}),
        (
            "single_vehicle_routing",
            BehaviorType.VEHICLE,
            {"route": ROUTE, "altitude_frame": "amsl"},
        ),
        ("single_vehicle_routing", BehaviorType.VEHICLE, {"route": ROUTE, "speed": None}),
        ("ptz_point_at", BehaviorType.PAYLOAD, {"bearing": 0.1, "elevation": 0.2}),
        ("take_picture", BehaviorType.PAYLOAD, {"count": 3}),
        ("formation", BehaviorType.TEAM, {"shape": "wedge"}),
    ],
)
def test_what_fits_the_catalogue_is_not_refused(
    behavior: str, type_: BehaviorType, parameters: dict[str, ResolvedValue]
) -> None:
    assert refusal(SHARED[behavior, type_], parameters) == ""


@pytest.mark.parametrize(
    ("behavior", "type_", "parameters", "said"),
    [
        ("goto", BehaviorType.VEHICLE, {}, "needs the parameter 'target'"),
        ("goto", BehaviorType.VEHICLE, {"target": ROUTE}, "parameter 'target'"),
        ("goto", BehaviorType.VEHICLE, {"target": PLACE, "speed": True}, "finite number"),
        ("goto", BehaviorType.VEHICLE, {"target": PLACE, "speed": math.inf}, "finite number"),
        ("goto", BehaviorType.VEHICLE, {"target": PLACE, "speed": -3.0}, "below"),
        ("goto", BehaviorType.VEHICLE, {"target": PLACE, "altitude_frame": "moon"}, "moon"),
        ("single_vehicle_routing", BehaviorType.VEHICLE, {"route": ROUTE, "loop": "yes"}, "'loop'"),
        ("take_picture", BehaviorType.PAYLOAD, {"count": 2.5}, "whole number"),
        ("ptz_point_at", BehaviorType.PAYLOAD, {"bearing": 1.0}, "'bearing' and 'elevation'"),
        ("ptz_point_at", BehaviorType.PAYLOAD, {"bearing": 1.0, "elevation": 9.0}, "above"),
        ("formation", BehaviorType.TEAM, {"shape": "blob"}, "not one of column"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(
    behavior: str, type_: BehaviorType, parameters: dict[str, ResolvedValue], said: str
) -> None:
    assert said in refusal(SHARED[behavior, type_], parameters)


def test_every_problem_is_said_at_once() -> None:
    spec = SHARED["goto", BehaviorType.VEHICLE]
    problems = refusal(spec, {"speed": -1.0, "colour": "red"})
    assert all(word in problems for word in ("'speed'", "'colour'", "'target'"))


def test_parameters_are_read_in_the_units_that_their_names_say() -> None:
    parameters = BehaviorParameters(
        {
            "route": ROUTE,
            "target": PLACE,
            "speed": 2,
            "heading": 0.0,
            "altitude": 30.0,
            "loop": True,
        }
    )
    assert parameters.route == ROUTE
    assert parameters.target == PLACE
    assert parameters.target_vehicle is None
    assert parameters.speed_m_s == 2.0
    assert parameters.yaw_rad == pytest.approx(math.pi / 2)
    assert (parameters.altitude_m, parameters.altitude_frame) == (30.0, "relative")
    assert parameters.loop
    assert BehaviorParameters({"target": VehiclePosition("usv")}).target_vehicle == "usv"


def test_what_is_not_given_is_the_default_of_the_shared_catalogue_or_none() -> None:
    parameters = BehaviorParameters({"count": None})
    assert parameters.distance_m == 5.0
    assert (parameters.zoom, parameters.count, parameters.interval_s) == (1.0, 1, 1.0)
    assert parameters.overshoot_m == 0.0
    assert parameters.area is None
    assert parameters.duration_s is None
    assert parameters.yaw_rad is None
    assert parameters.text("shape") == ""
    assert not parameters.loop


def test_what_is_of_another_kind_is_not_read_as_a_number_or_geometry() -> None:
    parameters = BehaviorParameters({"speed": True, "area": ROUTE, "route": "alpha"})
    assert parameters.speed_m_s is None
    assert parameters.area is None
    assert parameters.route is None


def test_an_adjustment_replaces_values_of_the_same_names() -> None:
    parameters = BehaviorParameters({"speed": 1.0, "spacing": 8.0})
    parameters.update({"speed": 3.0})
    assert (parameters.speed_m_s, parameters.spacing_m) == (3.0, 8.0)


def test_the_shared_catalogue_gives_a_name_one_default() -> None:
    given: dict[str, set[object]] = {}
    for spec in SHARED.values():
        for parameter in spec.parameters:
            if parameter.default is not None:
                given.setdefault(parameter.name, set()).add(parameter.default)
    assert all(len(defaults) == 1 for defaults in given.values())


def test_parameters_come_back_from_json_without_areas_and_long_routes() -> None:
    kept = {
        "route": ROUTE,
        "position": Point((1.0, 2.0, 3.0), "amsl"),
        "vehicle": VehiclePosition("uav1"),
        "speed": 2.5,
        "count": 3,
        "loop": True,
        "text": "x",
        "mixed": Route.of(((0.0, 0.0, 5.0), (0.0, 1.0, 95.0)), ("relative", "amsl")),
    }
    area = Area(((0.0, 0.0, None), (0.0, 1.0, None), (1.0, 1.0, None)))
    text = json.dumps(encode_parameters({**kept, "area": area, "unset": None}, longest_route=2))
    assert decode_parameters(json.loads(text)) == kept
    assert encode_parameters({"route": ROUTE}, longest_route=1) == {}
    with pytest.raises(KeyError):
        decode_parameters({"position": {"x": 1}})
