import math

import pytest

from m2pem.api.arbiter import ResolvedValue
from m2pem.api.refusal import refusal
from m2pem.fleet.behaviors import SHARED
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.geometry import Point, Route

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
