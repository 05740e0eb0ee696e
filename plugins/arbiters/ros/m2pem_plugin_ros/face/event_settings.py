"""The settings `receive` and `send` of the face: topics and services that are events of missions.

Reading them loads the types that they name, so that a wrong one is found before anything begins.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from m2pem.api import AnswerRule, Dimension, ReceiveRule, SendRule, read_rules
from m2pem.api.event_rules import ANSWERED
from m2pem.errors import ExpressionError
from m2pem_plugin_ros.installation import RosError
from m2pem_plugin_ros.interfaces.fill_fields import FieldError, fill
from m2pem_plugin_ros.interfaces.types import MESSAGE, SERVICE, find_type, full_name
from m2pem_plugin_ros.settings import NAME

if TYPE_CHECKING:
    from m2pem.api import FaceSettings

TIMEOUT_S, LONGEST_TIMEOUT_S = 10.0, 600.0
"""How long a service has for its answer, by default and at most."""

_SUCCESS = "success != false"
"""The usual condition for `done`: responses without the field `success` are one."""


@dataclass(frozen=True, slots=True)
class ReceivedTopic:
    """A topic whose messages are events. `key`: of its rule in the settings."""

    topic: str
    type_name: str
    type: Any
    rule: ReceiveRule
    key: str


@dataclass(frozen=True, slots=True)
class SentTopic:
    """A topic on which a rule publishes. `latched`: late subscribers get the last message."""

    topic: str
    type_name: str
    type: Any
    latched: bool
    rule: SendRule
    key: str


@dataclass(frozen=True, slots=True)
class CalledService:
    """A service that a rule calls."""

    service: str
    type_name: str
    type: Any
    timeout_s: float
    answer: AnswerRule
    rule: SendRule
    key: str


@dataclass(frozen=True, slots=True)
class EventRules:
    """What is received and sent."""

    received: Sequence[ReceivedTopic] = ()
    sent: Sequence[SentTopic | CalledService] = ()


def read_event_rules(settings: "FaceSettings") -> EventRules:
    """Read the rules.

    Raises:
        PluginError: one is wrong; the text names its key.
    """
    return EventRules(
        tuple(_received(each) for each in read_rules(settings, "receive")),
        tuple(_sent(each) for each in read_rules(settings, "send")),
    )


def _received(given: "FaceSettings") -> ReceivedTopic:
    rule = ReceiveRule.read(given, ("topic", "type"))
    name, type_ = _type(given, MESSAGE)
    return ReceivedTopic(_name(given, "topic"), name, type_, rule, given.path)


def _sent(given: "FaceSettings") -> SentTopic | CalledService:
    if ("topic" in given.values) == ("service" in given.values):
        raise given.error("topic", "name either a `topic` or a `service`")
    if "topic" in given.values:
        rule = SendRule.read(given, ("topic", "type", "latched"))
        name, type_ = _type(given, MESSAGE)
        _check(given, rule, type_)
        latched = given.flag("latched", False)
        return SentTopic(_name(given, "topic"), name, type_, latched, rule, given.path)
    rule = SendRule.read(given, ("service", "type", "timeout", *ANSWERED))
    name, type_ = _type(given, SERVICE)
    _check(given, rule, type_.Request)
    return CalledService(
        _name(given, "service"),
        name,
        type_,
        given.quantity("timeout", TIMEOUT_S, Dimension.DURATION, 0.1, LONGEST_TIMEOUT_S),
        AnswerRule.read(given, _SUCCESS),
        rule,
        given.path,
    )


def _name(given: "FaceSettings", key: str) -> str:
    value = given.text(key, "")
    if not NAME.fullmatch(value) or "__" in value:
        raise given.error(key, f"{value!r} is not the name of a ROS {key} such as /alarm")
    return value


def _type(given: "FaceSettings", kind: str) -> tuple[str, Any]:
    example = "std_msgs/msg/Bool" if kind == MESSAGE else "std_srvs/srv/SetBool"
    if "type" not in given.values:
        raise given.error("type", f"it is missing: the type of the messages, such as {example}")
    try:
        name = full_name(given.text("type", ""), kind)
        return name, find_type(name, kind)
    except RosError as error:
        raise given.error("type", str(error)) from error


def _check(given: "FaceSettings", rule: SendRule, type_: Any) -> None:
    """Find wrong fields before a mission throws."""
    try:
        fill(type_, rule.constants())
    except FieldError as error:
        raise given.error(f"fields.{error.path}", error.problem) from error
    except (ExpressionError, RosError) as error:
        raise given.error("fields", str(error)) from error
