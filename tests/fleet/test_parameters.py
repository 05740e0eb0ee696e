import math
from typing import Any

import pytest

from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.parameters import ParameterError, examine, resolve
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorSpec, ParameterKind, ParameterSpec
from m2pem.mission.geometry import Area, Geometry, Point, Route, VehiclePosition
from m2pem.mission.values import Value

PLACE = (38.0, -77.0, None)
GEOMETRIES: dict[str, Geometry] = {
    "alpha": Route((PLACE, PLACE)),
    "field": Area(((PLACE, PLACE, PLACE, PLACE),)),
    "gate": Point(PLACE, "amsl"),
}
VEHICLES = ("evsg1", "evsg2")


def shared(name: str, type_: BehaviorType = BehaviorType.VEHICLE) -> BehaviorSpec:
    return SHARED[name, type_]


def read(spec: BehaviorSpec, **raw: Value) -> dict[str, Any]:
    return resolve(spec, raw, GEOMETRIES.get, VEHICLES)


def problems(spec: BehaviorSpec, **raw: Value) -> list[tuple[str, str]]:
    with pytest.raises(ParameterError) as refused:
        read(spec, **raw)
    return [(problem.name, problem.rule) for problem in refused.value.problems]


def message(spec: BehaviorSpec, **raw: Value) -> str:
    with pytest.raises(ParameterError) as refused:
        read(spec, **raw)
    return str(refused.value)


def test_texts_become_si_numbers_and_geometries() -> None:
    given = {"route": "alpha", "speed": "18 km/h", "altitude": "100 ft", "loop": "true"}
    assert read(shared("single_vehicle_routing"), **given) == {
        "route": GEOMETRIES["alpha"],
        "speed": pytest.approx(5.0),
        "altitude": pytest.approx(30.48),
        "loop": True,
    }


def test_values_of_the_data_store_are_taken_as_they_are() -> None:
    assert read(shared("goto"), target=[38, -77.5], speed=2, tolerance=0.5) == {
        "target": Point((38.0, -77.5, None)),
        "speed": 2.0,
        "tolerance": 0.5,
    }


def test_a_default_fills_what_is_not_given_or_null() -> None:
    assert read(shared("reverse")) == {"distance": 5.0}
    assert read(shared("reverse"), distance=None) == {"distance": 5.0}
    assert read(shared("reverse"), distance="2 m") == {"distance": 2.0}


@pytest.mark.parametrize(
    ("target", "position"),
    [
        ("gate", GEOMETRIES["gate"]),
        ("evsg2", VehiclePosition("evsg2")),
        ("[38.5, -77.5, 20]", Point((38.5, -77.5, 20.0))),
        (" [38.5, -77.5]", Point((38.5, -77.5, None))),
        ([38.5, -77.5, 20], Point((38.5, -77.5, 20.0))),
    ],
)
def test_a_position_is_a_name_or_coordinates(target: Value, position: Geometry) -> None:
    assert read(shared("goto"), target=target) == {"target": position}


def test_the_altitude_frame_is_that_of_coordinates_and_not_of_named_points() -> None:
    coordinates = read(shared("goto"), target="[1, 2, 3]", altitude_frame="terrain")
    assert coordinates["target"] == Point((1.0, 2.0, 3.0), "terrain")
    named = read(shared("goto"), target="gate", altitude_frame="terrain")
    assert named == {"target": GEOMETRIES["gate"], "altitude_frame": "terrain"}


def test_an_arbiters_own_behavior_takes_an_altitude_frame_too() -> None:
    own = BehaviorSpec(
        "dip", BehaviorType.VEHICLE, (ParameterSpec("depth", ParameterKind.ALTITUDE),)
    )
    assert read(own, depth=3, altitude_frame="amsl") == {"depth": 3.0, "altitude_frame": "amsl"}
    assert problems(shared("reverse"), altitude_frame="amsl") == [
        ("altitude_frame", "unknown-parameter")
    ]


def test_a_point_that_an_operator_handed_over_goes_before_a_vehicle_of_that_name() -> None:
    handed_over = Point((1.0, 2.0, None))
    values = resolve(shared("goto"), {"target": "evsg1"}, lambda name: handed_over, VEHICLES)
    assert values == {"target": handed_over}


def test_a_followed_vehicle_is_a_moving_position() -> None:
    values = read(shared("follow"), target="evsg1", bearing="180 deg")
    assert values == {"target": VehiclePosition("evsg1"), "bearing": pytest.approx(math.pi)}


def test_all_problems_come_at_once() -> None:
    assert problems(
        shared("single_vehicle_routing"), speed="5 m", altitude="high", lop="true", loop="yes"
    ) == [
        ("lop", "unknown-parameter"),
        ("route", "missing-parameter"),
        ("speed", "bad-value"),
        ("altitude", "bad-value"),
        ("loop", "bad-value"),
    ]


@pytest.mark.parametrize(
    ("name", "raw", "rule", "text"),
    [
        ("goto", {"target": "gate", "speeed": "1 m/s"}, "unknown-parameter", "mean 'speed'"),
        ("goto", {}, "missing-parameter", "goto needs the parameter 'target'"),
        ("goto", {"target": None}, "missing-parameter", "goto needs the parameter 'target'"),
        ("goto", {"target": "gate", "heading": "90"}, "bad-value", "'90 deg' or '90 rad'"),
        ("goto", {"target": "gate", "speed": "5 m/z"}, "bad-value", "did you mean 'm/s'"),
        ("goto", {"target": "gate", "speed": "0 m/s"}, "out-of-bounds", "0 m/s is below 0.01 m/s"),
        ("goto", {"target": "gate", "speed": True}, "bad-value", "True is not a speed"),
        ("goto", {"target": "gat"}, "unknown-geometry", "no point or vehicle named 'gat'"),
        ("goto", {"target": "evsg3"}, "unknown-geometry", "did you mean 'evsg2' or 'evsg1'"),
        ("goto", {"target": "alpha"}, "wrong-geometry", "'alpha' is a route, not a point"),
        ("goto", {"target": "[1, 2, 3, 4]"}, "bad-value", "[latitude, longitude, altitude]"),
        ("goto", {"target": "[1, 2"}, "bad-value", "[latitude, longitude, altitude]"),
        ("goto", {"target": [98, 2]}, "bad-value", "latitude 98 is not within -90..90"),
        ("goto", {"target": 5}, "bad-value", "5 is not the name of a point"),
        ("goto", {"target": "gate", "altitude_frame": "msl"}, "bad-value", "mean 'amsl'"),
        ("single_vehicle_routing", {"route": "beta"}, "unknown-geometry", "no route named 'beta'"),
        ("single_vehicle_routing", {"route": "field"}, "wrong-geometry", "an area, not a route"),
        ("single_vehicle_routing", {"route": [1, 2]}, "bad-value", "not the name of a route"),
        ("follow", {"target": "evsg9"}, "unknown-vehicle", "no vehicle is named 'evsg9'"),
        ("follow", {"target": "gate"}, "unknown-vehicle", "known vehicles: evsg1, evsg2"),
        ("area_observe", {}, "missing-parameter", "area_observe needs 'area', or 'target'"),
        ("deploy", {"actuator": 5}, "bad-value", "5 is not a text"),
        ("deploy", {"actuator": "a", "value": "5 m"}, "bad-value", "has the unit 'm'"),
        ("deploy", {"actuator": "a", "value": "x"}, "bad-value", "'x' is not a number"),
    ],
)
def test_a_problem_says_what_would_be_right(
    name: str, raw: dict[str, Value], rule: str, text: str
) -> None:
    spec = shared(name)
    assert [found for _, found in problems(spec, **raw)] == [rule]
    assert text in message(spec, **raw)


def test_a_group_must_be_given_whole() -> None:
    point_at = shared("ptz_point_at", BehaviorType.PAYLOAD)
    assert problems(point_at, bearing="1 rad") == [("", "missing-parameter")]
    assert "'target', or 'bearing' and 'elevation'" in message(point_at, bearing="1 rad")
    assert read(point_at, bearing="1 rad", elevation="0 rad") == {"bearing": 1.0, "elevation": 0.0}
    assert problems(point_at, bearing="1 rad", elevation="91 deg") == [
        ("elevation", "out-of-bounds")
    ]


@pytest.mark.parametrize(("count", "value"), [("3", 3), (3, 3), (3.0, 3), ("1e2", 100)])
def test_a_count_is_a_whole_number(count: Value, value: int) -> None:
    counted = read(shared("take_picture", BehaviorType.PAYLOAD), count=count)["count"]
    assert (counted, type(counted)) == (value, int)


@pytest.mark.parametrize("count", ["2.5", -1, "three", True])
def test_what_is_no_count_is_refused(count: Value) -> None:
    take_picture = shared("take_picture", BehaviorType.PAYLOAD)
    assert problems(take_picture, count=count) == [("count", "bad-value")]


def test_a_deferred_value_counts_as_given_and_is_not_read() -> None:
    spec = shared("single_vehicle_routing")
    values, found = examine(spec, {"speed": "2 m/s"}, GEOMETRIES.get, VEHICLES, ["route"])
    assert (values, found) == ({"speed": 2.0}, [])
    _, found = examine(spec, {}, GEOMETRIES.get, VEHICLES, ["rout"])
    assert [problem.rule for problem in found] == ["unknown-parameter", "missing-parameter"]
