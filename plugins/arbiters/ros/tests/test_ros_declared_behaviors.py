"""What a fleet declares that a vehicle can do beside the usual, and what is refused."""

from typing import Any

import pytest

from m2pem.api import (
    SHARED,
    BehaviorSpec,
    BehaviorType,
    ParameterKind,
    ParameterSpec,
    ResourceId,
    ResumePolicy,
    read_declared_behaviors,
)
from m2pem.errors import PluginError

SWEEPER = ResourceId("sweeper1")


def read(value: Any) -> tuple[BehaviorSpec, ...]:
    return read_declared_behaviors(SWEEPER, value)


@pytest.mark.parametrize("value", [None, {}])
def test_nothing_need_be_declared(value: Any) -> None:
    assert read(value) == ()


def test_a_name_alone_is_a_behavior_that_all_arbiters_share() -> None:
    assert read({"area_survey": None}) == (SHARED["area_survey", BehaviorType.VEHICLE],)


def test_a_new_behavior_says_all_that_it_takes() -> None:
    declared = {
        "sweep_street": {
            "doc": "Drive along a route with the brush down.",
            "parameters": {
                "route": {"kind": "route", "required": True, "doc": "The kerb."},
                "passes": {"kind": "count", "minimum": 1, "maximum": 5, "default": 1},
                "brush": {"kind": "text", "choices": ["soft", "hard"], "default": "soft"},
                "wet": {"kind": "boolean", "default": False},
                "speed": "speed",
            },
            "resume": "restart",
            "ends": False,
            "writes": ["sweep.swept", "dust"],
        }
    }
    assert read(declared) == (
        BehaviorSpec(
            "sweep_street",
            BehaviorType.VEHICLE,
            (
                ParameterSpec("route", ParameterKind.ROUTE, required=True, doc="The kerb."),
                ParameterSpec("passes", ParameterKind.COUNT, False, 1.0, 5.0, default=1.0),
                ParameterSpec(
                    "brush", ParameterKind.TEXT, choices=("soft", "hard"), default="soft"
                ),
                ParameterSpec("wet", ParameterKind.BOOLEAN, default=False),
                ParameterSpec("speed", ParameterKind.SPEED),
            ),
            resume=ResumePolicy.RESTART,
            ends=False,
            doc="Drive along a route with the brush down.",
            writes=("sweep.swept", "dust"),
        ),
    )


def test_a_payload_declares_behaviors_of_payloads() -> None:
    declared = {"ptz_track": None, "wipe": {"writes": ["wiper.wiped"]}}
    read = read_declared_behaviors(ResourceId("ugv1/ptz"), declared, BehaviorType.PAYLOAD)
    shared, wipe = read
    assert shared == SHARED["ptz_track", BehaviorType.PAYLOAD]
    assert (wipe.type, wipe.writes) == (BehaviorType.PAYLOAD, ("wiper.wiped",))
    with pytest.raises(PluginError, match="all payloads share no such behavior"):
        read_declared_behaviors(ResourceId("ugv1/ptz"), {"goto": None}, BehaviorType.PAYLOAD)


def test_bounds_and_defaults_carry_units() -> None:
    brush = {"kind": "speed", "minimum": "3.6 km/h", "maximum": 2, "default": "1.5 m/s"}
    (spec,) = read({"sweep": {"parameters": {"speed": brush}}})
    (bounded,) = spec.parameters
    assert (bounded.minimum, bounded.maximum, bounded.default) == (1.0, 2.0, 1.5)


def test_of_several_ways_to_say_where_one_is_enough() -> None:
    declared = {
        "water": {
            "parameters": {"target": "position", "route": "route"},
            "required_one_of": [["target"], ["route"]],
        }
    }
    (spec,) = read(declared)
    assert spec.required_one_of == (("target",), ("route",))


def parameter(**body: Any) -> dict[str, Any]:
    return {"sweep": {"parameters": {"p": body}}}


REFUSED = [
    (["sweep"], "own_behaviors: .* is not a map of names of behaviors"),
    ({"sweep": None}, r"\.sweep: all vehicles share no such behavior; For a new one, list its"),
    ({"area_survay": None}, r"\.area_survay: .*did you mean 'area_survey'"),
    ({"goto": {"parameters": {}}}, r"\.goto: 'goto' is the same for all vehicles; write"),
    ({"sweep": {"params": {}}}, r"\.sweep\.params: .* did you mean 'parameters'\?"),
    ({"sweep": {"parameters": ["route"]}}, r"\.sweep\.parameters: .* is not a map"),
    (
        {"sweep": {"parameters": {"p": "rout"}}},
        r"\.p\.kind: 'rout' is none of .*did you mean 'route'",
    ),
    ({"sweep": {"parameters": {"p": 5}}}, r"\.p: 5 is not a map of a kind"),
    ({"sweep": {"resume": "retry"}}, r"\.resume: 'retry' is none of restart, fail, hold"),
    ({"sweep": {"ends": "no"}}, r"\.ends: 'no' is neither true nor false"),
    ({"sweep": {"doc": 5}}, r"\.doc: 5 is not a text"),
    ({"sweep": {"writes": "dust"}}, r"\.writes: 'dust' is not a list of names"),
    ({"sweep": {"writes": ["so much"]}}, r"\.writes: 'so much' is not a name of the data store"),
    ({"sweep": {"required_one_of": ["route"]}}, r"\.required_one_of: .* is not a list of lists"),
    ({"sweep": {"required_one_of": [["route"]]}}, r"\.required_one_of: 'route' is none of"),
    (parameter(required=True), r"\.p\.kind: it is missing: one of duration, "),
    (parameter(kind="speed", max=3), r"\.p\.max: there is no such key; did you mean 'maximum'\?"),
    (parameter(kind="speed", minimum="2 kg"), r"\.p\.minimum: .*'kg'"),
    (parameter(kind="angle", minimum=1.5), r"\.p\.minimum: .* '1\.5 deg' or '1\.5 rad'"),
    (parameter(kind="speed", minimum=float("nan")), r"\.p\.minimum: nan is not "),
    (parameter(kind="number", minimum=float("nan")), r"\.p\.minimum: nan is not a number"),
    (parameter(kind="number", minimum="2 m/s"), r"\.p\.minimum: '2 m/s' is not a number"),
    (parameter(kind="speed", minimum=True), r"\.p\.minimum: True is not a speed"),
    (parameter(kind="speed", minimum=3, maximum=2), r"\.p\.minimum: 3 is above the maximum, 2"),
    (parameter(kind="count", minimum=1.5), r"\.p\.minimum: 1\.5 is not a whole number"),
    (parameter(kind="route", minimum=1), r"\.p\.minimum: a route is not a number"),
    (parameter(kind="area", default="field"), r"\.p\.default: an area is not a number"),
    (parameter(kind="speed", choices=["slow"]), r"\.p\.choices: only a text has choices"),
    (parameter(kind="text", choices="slow"), r"\.p\.choices: 'slow' is not a list of texts"),
    (parameter(kind="text", choices=["a"], default="b"), r"\.p\.default: 'b' is none of a"),
    (parameter(kind="speed", minimum=1, default=0.5), r"\.p\.default: 0\.5 is below the minimum"),
    (parameter(kind="speed", maximum=1, default=2), r"\.p\.default: 2 is above the maximum"),
    (parameter(kind="speed", default=None), r"\.p\.default: it is empty"),
    (parameter(kind="boolean", default=1), r"\.p\.default: 1 is neither true nor false"),
    (parameter(kind="speed", required=True, default=1), r"\.p\.default: a required parameter is"),
]


@pytest.mark.parametrize(("declared", "message"), REFUSED)
def test_what_is_wrong_is_refused_with_its_place(declared: Any, message: str) -> None:
    with pytest.raises(PluginError, match=message) as refused:
        read(declared)
    assert str(refused.value).startswith("sweeper1: connection.own_behaviors")
