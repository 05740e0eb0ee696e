"""The messages of VDA 5050, versions 1.1, 2.0 and 2.1: their types, their topics, and reading them.

`msgspec` checks the types of fields when it reads a message. Fields that are not here are ignored:
a later minor version may have more. Enumerations of what a vehicle sends are plain texts: one with
a value that is not known is still understood.
"""

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Annotated, Any, Literal, TypeVar

import msgspec
from msgspec import UNSET, Meta, Struct, UnsetType

VERSION = "2.1.0"
SPOKEN = "m2pem speaks 1.1, 2.0 and 2.1 alone"
LARGEST_MESSAGE = 4 << 20
"""In bytes. Larger messages are not read."""

FURTHEST = 1e6
"""In metres: a map is a plane, and a number beyond this gives no position on Earth."""

Whole = Annotated[int, Meta(ge=0)]
NotNegative = Annotated[float, Meta(ge=0)]
Direction = Annotated[float, Meta(ge=-3.1416, le=3.1416)]
"""In radians; the bounds leave room for rounding."""


class MessageError(ValueError):
    """A message is not one of VDA 5050. The text says what is wrong with it."""


class Message(Struct, rename="camel", kw_only=True, omit_defaults=False):
    """The header of every message. `header_id` counts the messages of one topic."""

    header_id: int
    timestamp: str
    version: str
    manufacturer: str
    serial_number: str


class Part(Struct, rename="camel", kw_only=True, omit_defaults=False):
    """A part of a message."""


# --- from the master control --------------------------------------------------------------------


class ActionParameter(Part):
    key: str
    value: Any


class Action(Part):
    """`action_name`: the schema of version 2.0 calls the type of an instant action so, its text
    `actionType`."""

    action_type: str
    action_id: str
    blocking_type: Literal["NONE", "SOFT", "HARD"]
    action_parameters: list[ActionParameter] | UnsetType = UNSET
    action_name: str | UnsetType = UNSET


class NodePosition(Part):
    """In metres and radians in the frame of a map. `allowed_deviation_xy`: the schema of version
    2.0 spells it so, its text as the other one."""

    x: float
    y: float
    map_id: str
    theta: Direction | UnsetType = UNSET
    allowed_deviation_x_y: NotNegative | UnsetType = msgspec.field(
        default=UNSET, name="allowedDeviationXY"
    )
    allowed_deviation_xy: NotNegative | UnsetType = UNSET
    allowed_deviation_theta: Direction | UnsetType = UNSET


class Node(Part):
    node_id: str
    sequence_id: Whole
    released: bool
    actions: list[Action]
    node_position: NodePosition | UnsetType = UNSET


class Edge(Part):
    edge_id: str
    sequence_id: Whole
    released: bool
    start_node_id: str
    end_node_id: str
    actions: list[Action]
    max_speed: NotNegative | UnsetType = UNSET
    orientation: Direction | UnsetType = UNSET
    orientation_type: Literal["GLOBAL", "TANGENTIAL"] | UnsetType = UNSET
    rotation_allowed: bool | UnsetType = UNSET
    trajectory: dict[str, Any] | UnsetType = UNSET
    corridor: dict[str, Any] | UnsetType = UNSET


class Order(Message):
    order_id: str
    order_update_id: Whole
    nodes: Annotated[list[Node], Meta(min_length=1)]
    edges: list[Edge]


class InstantActions(Message):
    """`instant_actions`: the same list under its name in version 1.1. Some vehicles of 2.0 read it
    in place of `actions` (vda-5050-lib 1.4.0); the schema of 2.0 allows other members."""

    actions: list[Action]
    instant_actions: list[Action] | UnsetType = UNSET


# --- from the vehicle ---------------------------------------------------------------------------


class NodeState(Part):
    node_id: str
    sequence_id: int
    released: bool


class EdgeState(Part):
    edge_id: str
    sequence_id: int
    released: bool


class AgvPosition(Part):
    x: float
    y: float
    theta: float
    map_id: str
    position_initialized: bool


class Velocity(Part):
    """In the frame of the vehicle."""

    vx: float | UnsetType = UNSET
    vy: float | UnsetType = UNSET
    omega: float | UnsetType = UNSET


class ActionState(Part):
    action_id: str
    action_status: str
    action_type: str | UnsetType = UNSET
    result_description: str | UnsetType = UNSET


class BatteryState(Part):
    """`battery_charge` in percent."""

    battery_charge: float
    charging: bool


class ErrorReference(Part):
    reference_key: str
    reference_value: str


class Error(Part):
    error_type: str
    error_level: str
    error_references: list[ErrorReference] | UnsetType = UNSET
    error_description: str | UnsetType = UNSET


class SafetyState(Part):
    e_stop: str
    field_violation: bool


class State(Message):
    order_id: str
    order_update_id: int
    last_node_id: str
    last_node_sequence_id: int
    driving: bool
    operating_mode: str
    node_states: list[NodeState]
    edge_states: list[EdgeState]
    action_states: list[ActionState]
    battery_state: BatteryState
    errors: list[Error]
    safety_state: SafetyState
    paused: bool | UnsetType = UNSET
    new_base_request: bool | UnsetType = UNSET
    agv_position: AgvPosition | UnsetType = UNSET
    velocity: Velocity | UnsetType = UNSET
    loads: list[dict[str, Any]] | UnsetType = UNSET


class Visualization(Part):
    """Its header is optional."""

    agv_position: AgvPosition | UnsetType = UNSET
    velocity: Velocity | UnsetType = UNSET
    header_id: int | UnsetType = UNSET
    timestamp: str | UnsetType = UNSET


class ConnectionMessage(Message):
    connection_state: str


class FactsheetParameter(Part):
    key: str
    value_data_type: str
    is_optional: bool | UnsetType = UNSET
    description: str | UnsetType = UNSET


class FactsheetAction(Part):
    action_type: str
    action_scopes: list[str]
    action_parameters: list[FactsheetParameter] | UnsetType = UNSET
    action_description: str | UnsetType = UNSET
    blocking_types: list[Any] | UnsetType = UNSET


class ProtocolFeatures(Part):
    agv_actions: list[FactsheetAction]


class ProtocolLimits(Part):
    max_array_lens: dict[str, Any] | UnsetType = UNSET


class PhysicalParameters(Part):
    speed_max: float | UnsetType = UNSET


class Factsheet(Part):
    """Of a factsheet, m2pem reads this only. Its header is not looked at."""

    protocol_features: ProtocolFeatures
    protocol_limits: ProtocolLimits | UnsetType = UNSET
    physical_parameters: PhysicalParameters | UnsetType = UNSET

    def action(self, action_type: str) -> FactsheetAction | None:
        """Return what it lists of an action; None: nothing."""
        actions = self.protocol_features.agv_actions
        return next((each for each in actions if each.action_type == action_type), None)

    @property
    def most_nodes(self) -> int | None:
        """The most nodes of an order; None: there is no limit."""
        limits = self.protocol_limits
        lengths = UNSET if limits is UNSET else limits.max_array_lens
        most = None if lengths is UNSET else lengths.get("order.nodes")
        return most if isinstance(most, int) and most > 0 else None


T = TypeVar("T", bound=Struct)

_TYPES: Mapping[str, type[Struct]] = {
    "order": Order,
    "instantActions": InstantActions,
    "state": State,
    "visualization": Visualization,
    "connection": ConnectionMessage,
    "factsheet": Factsheet,
}
_DECODERS = {name: msgspec.json.Decoder(type_) for name, type_ in _TYPES.items()}
_BY_TYPE = {type_: name for name, type_ in _TYPES.items()}
_ENCODER = msgspec.json.Encoder()


def encode(message: Struct) -> bytes:
    """Return the JSON text of a message."""
    return _ENCODER.encode(message)


def decode(payload: bytes, type_: type[T]) -> T:
    """Read a message, and check the types of its fields.

    Raises:
        MessageError: it is not one of this type.
    """
    if len(payload) > LARGEST_MESSAGE:
        raise MessageError(f"it has {len(payload)} bytes, more than {LARGEST_MESSAGE}")
    decoder = _DECODERS[_BY_TYPE[type_]]
    try:
        try:
            message = decoder.decode(payload)
        except msgspec.ValidationError:
            # JSON has no integers: 2.0 is the number 2 (JSON Schema 2020-12, Core, 4.2.3).
            message = msgspec.convert(_ANY.decode(payload), decoder.type)
    except (msgspec.DecodeError, RecursionError, UnicodeDecodeError) as error:
        raise MessageError(str(error)) from None
    position = getattr(message, "agv_position", UNSET)
    velocity = getattr(message, "velocity", UNSET)
    numbers = [] if position is UNSET else [position.x, position.y, position.theta]
    if velocity is not UNSET:
        numbers += [each for each in (velocity.vx, velocity.vy) if each is not UNSET]
    if not all(abs(number) <= FURTHEST for number in numbers):
        raise MessageError(f"a position or velocity is beyond {FURTHEST:g} (SI)")
    return message  # type: ignore[return-value]  # its decoder was chosen by the type


def _number(text: str) -> int | float:
    value = float(text)
    return int(value) if value.is_integer() else value


_ANY = msgspec.json.Decoder(float_hook=_number)


class _AnyHeader(Struct):
    version: str = ""


_ANY_HEADER = msgspec.json.Decoder(_AnyHeader)


def other_version(payload: bytes, major: str = "2.") -> str:
    """Return the version in the header of a message, if it does not begin with `major`; else ""."""
    try:
        version = _ANY_HEADER.decode(payload[:LARGEST_MESSAGE]).version
    except (msgspec.DecodeError, RecursionError, UnicodeDecodeError):
        return ""
    return "" if version.startswith(major) else version


def seconds_of(timestamp_: str) -> float | None:
    """Return an ISO 8601 time, of UTC if it does not say another zone, in seconds since the Unix
    epoch; None: it is none."""
    try:
        moment = datetime.fromisoformat(timestamp_)
    except ValueError:
        return None
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()


def timestamp(time_us: int) -> str:
    """Return microseconds since the Unix epoch as ISO 8601, UTC, in milliseconds."""
    moment = datetime.fromtimestamp(time_us / 1e6, UTC)
    return f"{moment:%Y-%m-%dT%H:%M:%S}.{moment.microsecond // 1000:03d}Z"


class Headers:
    """Makes the headers of the messages to or from one vehicle: ids rise by one on each topic."""

    def __init__(self, manufacturer: str, serial_number: str, version: str = VERSION) -> None:
        self._fixed = {
            "version": version,
            "manufacturer": manufacturer,
            "serial_number": serial_number,
        }
        self._next: dict[str, int] = {}

    @property
    def has_two_spellings(self) -> bool:
        """Whether the version is 2.0, whose schemas spell two fields otherwise than its text, or
        1.1, which has no schemas."""
        return self._fixed["version"].startswith(("1.1.", "2.0."))

    def of(self, topic: str, time_us: int) -> dict[str, Any]:
        """Return the fields of the next header on a topic."""
        number = self._next.get(topic, 0)
        self._next[topic] = (number + 1) % 2**32
        return {"header_id": number, "timestamp": timestamp(time_us), **self._fixed}


QOS = {"connection": 1}
"""By topic; all others have 0."""

RETAINED = frozenset({"connection", "factsheet"})
FROM_VEHICLE = ("state", "visualization", "connection", "factsheet")
TO_VEHICLE = ("order", "instantActions")
