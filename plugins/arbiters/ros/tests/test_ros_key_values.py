"""Parameters as JSON: they come back as they were, and what is none is refused by name."""

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from m2pem_interfaces.msg import BehaviorCommand, BehaviorStatus, KeyValue
from m2pem_plugin_ros.interfaces.behavior_command import Verb
from m2pem_plugin_ros.interfaces.behavior_status import STATES, Status, read_status, write_status
from m2pem_plugin_ros.interfaces.key_values import (
    LONGEST,
    WireError,
    decode_parameters,
    encode_parameters,
)

from m2pem.api import Area, BehaviorState, Point, Route, VehiclePosition

finite = st.floats(allow_nan=False, allow_infinity=False)
positions = st.tuples(
    st.floats(-90.0, 90.0), st.floats(-180.0, 180.0), st.one_of(st.none(), finite)
)
frames = st.sampled_from(["relative", "amsl", "terrain"])
rings = st.lists(positions, min_size=3, max_size=6).map(lambda ring: (*ring, ring[0]))
values = st.one_of(
    finite,
    st.integers(),
    st.booleans(),
    st.text(),
    st.builds(Point, positions, frames),
    st.builds(Route, st.lists(positions, min_size=1, max_size=6).map(tuple), frames),
    st.lists(st.tuples(positions, frames), min_size=1, max_size=6).map(
        lambda both: Route.of((place for place, _ in both), (frame for _, frame in both))
    ),
    st.builds(Area, st.lists(rings, min_size=1, max_size=3).map(tuple), frames),
    st.builds(VehiclePosition, st.text(min_size=1)),
)


@given(st.dictionaries(st.text(min_size=1), values))
def test_parameters_come_back_as_they_were(parameters: dict[str, object]) -> None:
    back = decode_parameters(encode_parameters(parameters))  # type: ignore[arg-type]
    assert back == parameters
    assert {key: type(value) for key, value in back.items()} == {
        key: type(value) for key, value in parameters.items()
    }


@given(st.text())
def test_any_text_is_read_or_refused_with_the_key(text: str) -> None:
    try:
        value = decode_parameters([("speed", text)])["speed"]
    except WireError as error:
        assert str(error).startswith("parameter 'speed': ")
    else:
        assert json.loads(text) == value


@given(
    st.recursive(
        st.one_of(st.none(), st.booleans(), finite, st.text()),
        lambda inner: st.one_of(
            st.lists(inner),
            st.dictionaries(
                st.sampled_from(
                    ["type", "geometry", "coordinates", "properties", "altitude_frame", "vehicle"]
                ),
                inner,
            ),
        ),
    )
)
def test_any_json_is_read_or_refused(tree: object) -> None:
    for value in (tree, {"type": "Feature", "geometry": tree}):
        try:
            assert decode_parameters([("target", json.dumps(value))]).keys() == {"target"}
        except WireError as error:
            assert str(error)


def test_a_route_is_a_feature_with_the_longitude_first() -> None:
    route = Route(((38.1, -77.3, None), (38.2, -77.4, 5.0)), "amsl")
    assert encode_parameters({"route": route, "speed": 1.5, "loop": None}) == [
        (
            "route",
            '{"type":"Feature","geometry":{"type":"LineString","coordinates":[[-77.3,38.1],'
            '[-77.4,38.2,5.0]]},"properties":{"altitude_frame":"amsl"}}',
        ),
        ("speed", "1.5"),
    ]


LINE = [[0, 0], [1, 1]]


def feature(kind: str, coordinates: object, **properties: object) -> str:
    geometry = {"type": kind, "coordinates": coordinates}
    return json.dumps({"type": "Feature", "geometry": geometry, "properties": properties})


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "is not JSON"),
        ("{", "is not JSON"),
        ("NaN", "NaN is not a number of JSON"),
        ("-Infinity", "-Infinity is not a number of JSON"),
        ("1e999", "1e999 is too large"),
        ("[" * 100_000, "is not JSON"),
        ("9" * 5000, "is not JSON"),
        (" " * (LONGEST + 1), "characters are too many"),
        ("[38.1, -77.3]", "is neither a number"),
        ('{"vehicle": 7}', "'vehicle' must be the name of a vehicle"),
        ('{"vehicle": ""}', "'vehicle' must be the name of a vehicle"),
        ('{"type": "Feature"}', "the Feature has no geometry"),
        (feature("Circle", []), "a geometry of type 'Circle' is none of Point, LineString"),
        (feature("Point", [1.0]), "is not a position"),
        (feature("Point", [True, 1.0]), "is not a position"),
        (feature("Point", [38.1, -97.3]), "is not on Earth; longitude is first"),
        (feature("LineString", [[0, 0]]), "2 or more positions are expected"),
        (feature("Polygon", []), "a Polygon is a list of rings"),
        (feature("Polygon", [[[0, 0], [1, 0], [1, 1], [0, 1]]]), "a ring ends where it begins"),
        (feature("Point", [0, 0], altitude_frame="agl"), "altitude_frame 'agl' is none of"),
        (
            feature("LineString", LINE, altitude_frame=["amsl"]),
            "is a list of 1, not one a position",
        ),
        (
            feature("LineString", LINE, altitude_frame=["amsl", "x"]),
            "altitude_frame 'x' is none of",
        ),
        (feature("MultiPoint", [[0, 0]], altitude_frame=["amsl"]), "['amsl'] is none of"),
    ],
)
def test_what_is_no_value_is_refused(text: str, problem: str) -> None:
    with pytest.raises(WireError, match=r"^parameter 'target': ") as refused:
        decode_parameters([("target", text)])
    assert problem in str(refused.value)
    assert len(str(refused.value)) < 300


def test_a_parameter_without_a_name_or_there_twice_is_refused() -> None:
    with pytest.raises(WireError, match="a parameter has no name"):
        decode_parameters([("", "1")])
    with pytest.raises(WireError, match="there are two parameters 'speed'"):
        decode_parameters([("speed", "1"), ("speed", "2")])


@pytest.mark.parametrize("value", [math.nan, math.inf, Point((math.nan, 0.0, None)), Route(())])
def test_what_the_wire_cannot_carry_is_not_sent(value: object) -> None:
    with pytest.raises(WireError, match="parameter 'target': "):
        encode_parameters({"target": value})  # type: ignore[dict-item]


def test_states_and_verbs_are_the_constants_of_the_messages() -> None:
    for number, state in STATES.items():
        assert getattr(BehaviorStatus, state.name) == number
    for verb in Verb:
        assert getattr(BehaviorCommand, verb.name) == verb


def test_a_status_comes_back_as_it_was() -> None:
    outputs = {"picture.files": ["1.jpg", "2.jpg"], "picture.time": 5, "swept": {"m": 2.5}}
    status = Status("a", 3, BehaviorState.FAILED, "ROUTE_BLOCKED", "a wall", "n1", outputs)
    assert read_status(write_status(status)) == status


@pytest.mark.parametrize(
    ("name", "value", "problem"),
    [
        ("speed", "{", "output 'speed' was left out: { is not JSON"),
        ("speed", "NaN", "it has a number that is not finite"),
        ("speed", "[1, -Infinity]", "it has a number that is not finite"),
        ("speed", str(2**63), "of more than 64 bits"),
        ("speed", "[" * 30 + "]" * 30, "more than 20 levels deep"),
        ("speed", "[" * 50_000, "is not JSON"),
        ("speed", '"' + "a" * 100_001 + '"', "at most 100000 are allowed"),
        ("", "1", "it has no name"),
        ("good", "2", "the name is used twice"),
    ],
)
def test_an_end_counts_also_with_an_output_that_cannot_be(
    name: str, value: str, problem: str
) -> None:
    message = BehaviorStatus(id="a", number=3, state=BehaviorStatus.SUCCEEDED)
    pairs = [("good", "1"), (name, value), ("also.good", '"yes"')]
    message.outputs = [KeyValue(key=key, value=text) for key, text in pairs]
    status = read_status(message)
    assert status.state is BehaviorState.SUCCEEDED
    assert status.outputs == {"good": 1, "also.good": "yes"}
    assert problem in status.reason


def test_what_has_not_ended_has_no_outputs() -> None:
    message = BehaviorStatus(id="a", number=2, state=BehaviorStatus.RUNNING)
    message.outputs = [KeyValue(key="good", value="1")]
    assert read_status(message).outputs == {}


@pytest.mark.parametrize(
    ("fields", "problem"),
    [
        ({"state": 2, "number": 1}, "a status without an id"),
        ({"id": "a", "state": 0, "number": 1}, "a status of a with the unknown state 0"),
        ({"id": "a", "state": 9, "number": 1}, "a status of a with the unknown state 9"),
        ({"id": "a", "state": 2, "number": 0}, "with state RUNNING and number 0"),
        ({"id": "a", "state": 8, "number": 1}, "with state UNKNOWN and number 1"),
    ],
)
def test_a_status_that_breaks_the_rules_is_refused(fields: dict[str, object], problem: str) -> None:
    with pytest.raises(WireError, match=problem):
        read_status(BehaviorStatus(**fields))
