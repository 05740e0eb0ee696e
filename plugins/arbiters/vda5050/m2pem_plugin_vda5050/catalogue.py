"""The behaviors of VDA 5050 vehicles: shared ones, and the actions of each vehicle.

`own_behaviors` of a connection names actions. Those that the standard predefines need no more than
their name. Of others, or to give them other names, the fleet lists the parameters, and `action`
says what is sent:

    own_behaviors:
      pick:
      sweep:
        action: {type: startSweeping, scope: node, blocking: SOFT}
        parameters: {width: {kind: distance, required: true}}

A `factsheet` offers all actions that it lists, and says which parameters they require; without
it, the version of the standard does. A behavior with the parameter `target` or `route` drives there
first, in the same order.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, Literal

from msgspec import UNSET

from m2pem.api import (
    SHARED,
    BehaviorSpec,
    BehaviorType,
    ConnectionReader,
    ParameterKind,
    ParameterSpec,
    ResourceId,
    ResumePolicy,
    read_declared_behaviors,
)
from m2pem.errors import PluginError
from m2pem_plugin_vda5050.messages import Factsheet, FactsheetAction

USUAL = tuple(
    SHARED[name, BehaviorType.VEHICLE]
    for name in ("single_vehicle_routing", "goto", "hold", "drive_stop", "reverse")
)
STOPS = ("hold", "drive_stop")
"""Behaviors that pause the vehicle; all others are orders or actions."""

CONTROL = ("startPause", "stopPause", "cancelOrder", "stateRequest", "factsheetRequest")
"""Actions with which the arbiter itself controls the vehicle: no behaviors."""

DRIVING_PARAMETERS = ("target", "route", "speed", "altitude", "altitude_frame")
"""Of an own behavior, these say how to get to where its action is done."""

Blocking = Literal["NONE", "SOFT", "HARD"]


class Scope(StrEnum):
    """How an action is sent: on the last node of an order, or as an instant action."""

    NODE = "node"
    INSTANT = "instant"


@dataclass(frozen=True, slots=True)
class OwnBehavior:
    """A behavior that is an action of the vehicle."""

    spec: BehaviorSpec
    action: str
    scope: Scope = Scope.NODE
    blocking: Blocking = "HARD"


_REQUIRED_TEXT = {"kind": "text", "required": True}
_REQUIRED_NUMBER = {"kind": "number", "required": True}
_LOAD = {
    **{"target": "position", "speed": "speed", "lhd": "text"},
    **{"stationType": _REQUIRED_TEXT, "stationName": "text"},
    **{"loadType": _REQUIRED_TEXT, "loadId": "text", "height": "distance", "depth": "distance"},
    "side": "text",
}
_MAP = {"mapId": _REQUIRED_TEXT, "mapVersion": _REQUIRED_TEXT}
_INSTANT = {"scope": "instant"}

PREDEFINED: Mapping[str, Mapping[str, Any]] = {
    "pick": {"parameters": _LOAD, "doc": "Pick a load up."},
    "drop": {"parameters": _LOAD, "doc": "Put a load down."},
    "startCharging": {
        "parameters": {"target": "position", "speed": "speed"},
        "doc": "Begin to charge the battery.",
    },
    "stopCharging": {"doc": "End charging."},
    "detectObject": {"parameters": {"objectType": "text"}, "doc": "Detect an object."},
    "finePositioning": {
        "parameters": {"stationType": "text", "stationName": "text"},
        "doc": "Position the vehicle exactly.",
    },
    "waitForTrigger": {
        "parameters": {"target": "position", "speed": "speed", "triggerType": _REQUIRED_TEXT},
        "doc": "Wait for a trigger at the vehicle, such as a button.",
    },
    "initPosition": {
        "parameters": {
            **{"x": _REQUIRED_NUMBER, "y": _REQUIRED_NUMBER},
            **{"theta": {"kind": "angle", "required": True}, "mapId": _REQUIRED_TEXT},
            "lastNodeId": _REQUIRED_TEXT,
        },
        "action": _INSTANT,
        "doc": "Tell the vehicle where it is on its map.",
    },
    "enableMap": {"parameters": _MAP, "action": _INSTANT, "doc": "Use a map."},
    "downloadMap": {
        "parameters": {**_MAP, "mapDownloadLink": _REQUIRED_TEXT, "mapHash": "text"},
        "action": _INSTANT,
        "doc": "Load a map onto the vehicle.",
    },
    "deleteMap": {"parameters": _MAP, "action": _INSTANT, "doc": "Remove a map."},
    "logReport": {
        "parameters": {"reason": _REQUIRED_TEXT},
        "action": _INSTANT,
        "doc": "Have the vehicle store a log report.",
    },
}
"""The actions of the standard (1.1 to 2.1, section 6.8.1), as `own_behaviors` would declare them.

The row of `drop` calls `stationType` and `loadType` optional and refers to `pick`, which requires
them; there are vehicles that refuse a `drop` without. In version 3.0 both are optional for both.
"""

_NEW_IN_2_1 = ("enableMap", "downloadMap", "deleteMap")
_ANY_SCOPE = ("startCharging", "stopCharging", "finePositioning", "initPosition", "enableMap")

_ENDLESS = (ParameterKind.AREA, ParameterKind.VEHICLE, ParameterKind.OFFSETS)
_KINDS = {
    "BOOL": ParameterKind.BOOLEAN,
    "NUMBER": ParameterKind.NUMBER,
    "INTEGER": ParameterKind.NUMBER,
    "FLOAT": ParameterKind.NUMBER,
    "STRING": ParameterKind.TEXT,
}


def required_parameters(action: str, factsheet: Factsheet | None) -> tuple[str, ...]:
    """Return the keys of the parameters without which a vehicle refuses an action: by its
    factsheet, or by versions 1.1 to 2.1."""
    body = PREDEFINED.get(action, {}).get("parameters", {})
    standard = tuple(
        key for key, each in body.items() if isinstance(each, Mapping) and each.get("required")
    )
    listed = None if factsheet is None else factsheet.action(action)
    if listed is None:
        return standard
    parameters = () if listed.action_parameters is UNSET else listed.action_parameters
    return tuple(
        each.key
        for each in parameters
        if each.is_optional is False or (each.is_optional is UNSET and each.key in standard)
    )


def why_unsupported(own: OwnBehavior, version: str, factsheet: Factsheet | None) -> str:
    """Return why a vehicle refuses an action, whatever its parameters are: by its factsheet, or by
    its version; "" if it does not."""
    action, scope = own.action, own.scope.value
    if factsheet is not None:
        listed = factsheet.action(action)
        if listed is None or scope.upper() not in listed.action_scopes:
            return f"the vehicle's factsheet has no {scope} action {action}"
        return ""
    if action not in PREDEFINED:
        return ""
    if action in _NEW_IN_2_1 and version < "2.1":
        return f"VDA 5050 {version} has no action {action}, which is new in 2.1"
    allowed = PREDEFINED[action].get("action", {}).get("scope", "node")
    if scope != allowed and action not in _ANY_SCOPE:
        return f"VDA 5050 has no {scope} action {action}: write `scope: {allowed}`"
    return ""


def lacking(
    own: OwnBehavior, given: Collection[str], version: str, factsheet: Factsheet | None
) -> str:
    """Return which parameters that an action requires are not among the given ones; "": none."""
    required = required_parameters(own.action, factsheet)
    missing = [key for key in required if key not in given]
    source = f"VDA 5050 {version}" if factsheet is None else "the vehicle's factsheet"
    return f"{source} requires {' and '.join(missing)} of {own.action}" if missing else ""


def read_own_behaviors(
    resource: ResourceId, value: Any, version: str, factsheet: Factsheet | None
) -> tuple[OwnBehavior, ...]:
    """Read `own_behaviors`, and add the actions of the factsheet that it does not declare.
    `version`: of VDA 5050, as the vehicle speaks it.

    Raises:
        PluginError: something is missing or wrong; the text names the resource and the key.
    """
    bodies = value
    if isinstance(value, Mapping):
        bodies = {
            name: PREDEFINED[name] if body is None and name in PREDEFINED else body
            for name, body in value.items()
        }
    specs = read_declared_behaviors(resource, bodies, more_keys=("action",))
    declared = {spec.name: _declared(resource, spec, bodies[spec.name]) for spec in specs}
    for name, own in declared.items():
        place = f"{resource}: connection.own_behaviors.{name}"
        is_standard = value[name] is None
        declared[name] = _judged(place, own, version, factsheet, is_standard=is_standard)
    for usual in USUAL:
        if usual.name in declared:
            place = f"{resource}: connection.own_behaviors.{usual.name}"
            raise PluginError(
                f"{place}: every vehicle of this arbiter has it already; leave it out"
            )
    actions = [] if factsheet is None else factsheet.protocol_features.agv_actions
    known = {*declared, *(own.action for own in declared.values()), *(own.name for own in USUAL)}
    offered = [_of_factsheet(each) for each in actions if each.action_type not in known]
    return (*declared.values(), *(each for each in offered if each is not None))


def _declared(resource: ResourceId, spec: BehaviorSpec, body: Any) -> OwnBehavior:
    path = f"connection.own_behaviors.{spec.name}"
    given = body.get("action", {}) if isinstance(body, Mapping) else {}
    if isinstance(given, str):
        given = {"type": given}
    if not isinstance(given, Mapping):
        example = "{type: pick, scope: node, blocking: HARD}"
        raise PluginError(f"{resource}: {path}.action: {given!r} is not a map such as {example}")
    reader = ConnectionReader(resource, given, f"{path}.action")
    reader.refuse_others(("type", "scope", "blocking"))
    scope = reader.choice("scope", Scope, Scope.NODE)
    blocking = reader.values.get("blocking", "HARD")
    if blocking not in ("NONE", "SOFT", "HARD"):
        raise reader.error("blocking", f"{blocking!r} is none of NONE, SOFT, HARD")
    for parameter in spec.parameters:
        drives = parameter.name in ("target", "route")
        if parameter.kind in _ENDLESS or (
            parameter.kind in (ParameterKind.POSITION, ParameterKind.ROUTE) and not drives
        ):
            raise PluginError(
                f"{resource}: {path}.parameters.{parameter.name}: no action of VDA 5050 takes "
                f"{parameter.kind.value}; a position is called `target`, a route `route`"
            )
        if drives and scope is Scope.INSTANT:
            raise PluginError(
                f"{resource}: {path}.parameters.{parameter.name}: an instant action drives nowhere"
            )
    if spec.name in CONTROL or reader.values.get("type") in CONTROL:
        raise reader.error("type", "m2pem itself sends this action to control the vehicle")
    return OwnBehavior(spec, reader.text("type", spec.name), scope, blocking)


def _judged(
    place: str, own: OwnBehavior, version: str, factsheet: Factsheet | None, *, is_standard: bool
) -> OwnBehavior:
    """Return a behavior that requires what the vehicle does. `is_standard`: only its name is given.

    Raises:
        PluginError: the vehicle would refuse the action, or a required parameter is not declared.
    """
    if reason := why_unsupported(own, version, factsheet):
        raise PluginError(f"{place}: {reason}")
    declared = [each.name for each in own.spec.parameters]
    if reason := lacking(own, declared, version, factsheet):
        remedy = "declare them, or name the `factsheet` of a vehicle that does without"
        raise PluginError(f"{place}.parameters: {reason}: {remedy}")
    required = required_parameters(own.action, factsheet)
    parameters = tuple(
        replace(
            each,
            required=(each.name in required and each.default is None)
            or (each.required and not is_standard),
        )
        for each in own.spec.parameters
    )
    return replace(own, spec=replace(own.spec, parameters=parameters))


def _of_factsheet(action: FactsheetAction) -> OwnBehavior | None:
    """Return the behavior of an action; None if m2pem cannot send it."""
    scopes = action.action_scopes
    if action.action_type in CONTROL or not {"NODE", "INSTANT"} & set(scopes):
        return None
    parameters = () if action.action_parameters is UNSET else action.action_parameters
    specs = []
    for each in parameters:
        kind = _KINDS.get(each.value_data_type)
        if kind is not None:
            doc = "" if each.description is UNSET else each.description
            specs.append(ParameterSpec(each.key, kind, required=not each.is_optional, doc=doc))
        elif not each.is_optional:
            return None
    scope = Scope.NODE if "NODE" in scopes else Scope.INSTANT
    if scope is Scope.NODE and not {"target", "speed"} & {each.name for each in specs}:
        specs += [
            ParameterSpec("target", ParameterKind.POSITION),
            ParameterSpec("speed", ParameterKind.SPEED, minimum=0.01),
        ]
    blockings = [] if action.blocking_types is UNSET else action.blocking_types
    blocking: Blocking = "HARD" if "HARD" in blockings or not blockings else "SOFT"
    if blockings and blocking not in blockings:
        blocking = "NONE"
    doc = "" if action.action_description is UNSET else action.action_description
    spec = BehaviorSpec(
        action.action_type,
        BehaviorType.VEHICLE,
        tuple(specs),
        resume=ResumePolicy.HOLD,
        doc=doc or "An action of the vehicle's factsheet.",
    )
    return OwnBehavior(spec, action.action_type, scope, blocking)
