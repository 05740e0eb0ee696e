"""The settings `receive` and `send` of the face: MAVLink messages that are events of missions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from m2pem.api import AnswerRule, FaceSettings, Fleet, ReceiveRule, ResourceId, SendRule, read_rules
from m2pem.api.event_rules import ANSWERED
from m2pem.errors import ExpressionError
from m2pem_plugin_mavlink.face.message_fields import FieldError, find_message, made
from m2pem_plugin_mavlink.face.settings import RATES_HZ, Settings, passes_elsewhere
from m2pem_plugin_mavlink.protocol.messages import MessageType

STATIONS = "stations"
COMMAND_LONG, STATUSTEXT = "COMMAND_LONG", "STATUSTEXT"
_ACCEPTED = "result == 0"
_TARGET = ("target_system", "target_component")


@dataclass(frozen=True, slots=True)
class ReceivedMessage:
    """Messages that are events: those of `vehicles`, or of ground stations. `component` None: of
    any. `key`: of the rule in the settings."""

    type: MessageType
    vehicles: frozenset[ResourceId]
    from_stations: bool
    component: int | None
    rule: ReceiveRule
    key: str


@dataclass(frozen=True, slots=True)
class SentMessage:
    """What is sent. `vehicle`: to it, or, with `to_stations`, in its name. `component`: to it.
    `answer`: of a COMMAND_LONG."""

    type: MessageType
    vehicle: ResourceId
    to_stations: bool
    component: int
    answer: AnswerRule | None
    rule: SendRule
    key: str


@dataclass(frozen=True, slots=True)
class EventRules:
    """What is received and sent."""

    received: Sequence[ReceivedMessage] = ()
    sent: Sequence[SentMessage] = ()


def read_event_rules(
    reader: FaceSettings, settings: Settings, fleet: Fleet, *, simulated: bool = False
) -> EventRules:
    """Read the rules. `simulated`: all vehicles are, so that none sends anything.

    Raises:
        PluginError: one is wrong; the text names its key.
    """
    return EventRules(
        tuple(_received(each, fleet, simulated) for each in read_rules(reader, "receive")),
        tuple(_sent(each, settings, fleet, simulated) for each in read_rules(reader, "send")),
    )


def _received(given: FaceSettings, fleet: Fleet, simulated: bool) -> ReceivedMessage:
    rule = ReceiveRule.read(given, ("type", "from", "component"))
    sender = given.text("from", "")
    if sender == STATIONS:
        vehicles = frozenset[ResourceId]()
    elif sender:
        vehicles = frozenset({_vehicle(given, "from", sender, fleet, simulated)})
    else:
        vehicles = frozenset(each for each in fleet.vehicles if not passes_elsewhere(fleet, each))
        if not vehicles and not simulated:
            raise given.error("from", f"the fleet has no MAVLink vehicle here; say {STATIONS}")
    component = given.whole("component", 0, 1, 255) if "component" in given.values else None
    return ReceivedMessage(_type(given), vehicles, sender == STATIONS, component, rule, given.path)


def _sent(given: FaceSettings, settings: Settings, fleet: Fleet, simulated: bool) -> SentMessage:
    receiver = given.text("to", "")
    if not receiver:
        raise given.error("to", f"it is missing: a vehicle, or {STATIONS}")
    type_ = _type(given)
    if receiver == STATIONS:
        return _sent_to_stations(given, type_, fleet)
    vehicle = _vehicle(given, "to", receiver, fleet, simulated)
    if vehicle not in settings.sent_to:
        raise given.error(
            "to",
            "messages of missions go to no vehicle unless the fleet says so: write "
            f"faces: {{mavlink: {{send_to: [{vehicle}]}}}}",
        )
    answered = ANSWERED if type_.name == COMMAND_LONG else ()
    rule = SendRule.read(given, ("type", "to", "component", *answered))
    _check(given, rule, type_)
    default = fleet.vehicles[vehicle].settings.get("component_id", 1)
    component = given.whole("component", default, 0, 255)
    answer = AnswerRule.read(given, _ACCEPTED) if answered else None
    return SentMessage(type_, vehicle, False, component, answer, rule, given.path)


def _sent_to_stations(given: FaceSettings, type_: MessageType, fleet: Fleet) -> SentMessage:
    rule = SendRule.read(given, ("type", "to", "from"))
    if type_.name in RATES_HZ or "target_system" in type_.make._fields:
        raise given.error("type", f"{type_.name} is not sent to ground stations for missions")
    sender = given.text("from", "")
    if not sender:
        raise given.error("from", "it is missing: the vehicle in whose name it is sent")
    given.vehicle("from", sender, fleet.vehicles)
    _check(given, rule, type_)
    return SentMessage(type_, ResourceId(sender), True, 0, None, rule, given.path)


def _type(given: FaceSettings) -> MessageType:
    if "type" not in given.values:
        raise given.error("type", "it is missing: the name of a message, such as STATUSTEXT")
    try:
        return find_message(given.text("type", ""))
    except FieldError as error:
        raise given.error("type", error.problem) from error


def _vehicle(given: FaceSettings, key: str, name: str, fleet: Fleet, simulated: bool) -> ResourceId:
    given.vehicle(key, name, fleet.vehicles)
    if not simulated and (problem := passes_elsewhere(fleet, ResourceId(name))):
        raise given.error(key, f"{name}: {problem}")
    return ResourceId(name)


def _check(given: FaceSettings, rule: SendRule, type_: MessageType) -> None:
    """Find wrong fields before a mission throws."""
    try:
        fields: Mapping[str, object] = rule.constants()
        if wrong := next((each for each in _TARGET if each in fields), ""):
            raise given.error(f"fields.{wrong}", "`to` and `component` say it")
        if type_.name == STATUSTEXT and "text" in fields:  # long ones are sent in chunks
            fields = {**fields, "text": ""}
        made(type_, fields)
    except FieldError as error:
        raise given.error(f"fields.{error.field}", error.problem) from error
    except ExpressionError as error:
        raise given.error("fields", str(error)) from error
