"""Scripted vehicles that keep to MAVLink's specification of its microservices (`mavlink_lossy`)."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from m2pem_plugin_mavlink.protocol.messages import Message, message_type
from mavlink_lossy import GROUND, Silent
from pymavlink.dialects.v20 import ardupilotmega as dialect

ACK = message_type("COMMAND_ACK")
COMMANDS = ("COMMAND_LONG", "COMMAND_INT")


def ack(command: int, result: int = 0, **more: Any) -> Message:
    """A COMMAND_ACK for us."""
    named = {"target_system": GROUND.system, "target_component": GROUND.component, **more}
    return ACK.make(command=command, result=result, **named)


def mission_ack(result: int, mission_type: int = 0) -> Message:
    return message_type("MISSION_ACK").make(
        target_system=GROUND.system,
        target_component=GROUND.component,
        type=result,
        mission_type=mission_type,
    )


def text(words: str, severity: int = dialect.MAV_SEVERITY_CRITICAL, **more: Any) -> Message:
    return message_type("STATUSTEXT").make(severity=severity, text=words.encode(), **more)


class Commanded(Silent):
    """Does what it is commanded. `does`: of a command, what it answers; `effects`: what it did."""

    def __init__(self, does: Callable[[Any, "Commanded"], Sequence[Message]]) -> None:
        self.does = does
        self.effects: list[Any] = []
        self.received: list[Any] = []

    def hear(self, message: Message, now_s: float) -> Sequence[Message]:
        assert message.TYPE.name in COMMANDS
        self.received.append(message)
        return self.does(message, self)


def takes_off(command: Any, vehicle: Commanded) -> Sequence[Message]:
    """As ArduPilot does: to take off once more is accepted, and changes nothing."""
    if not vehicle.effects:
        vehicle.effects.append("takeoff")
    return (ack(command.command),)


class Slow(Silent):
    """Takes 20 s for a command, and tells how far it is every two seconds."""

    def __init__(self, command: int) -> None:
        self.command, self.effects, self.done = command, 0, 0

    def hear(self, message: Message, now_s: float) -> Sequence[Message]:
        if self.done >= 100:
            return (ack(self.command),)
        if not self.effects:
            self.effects, self.next_s = 1, now_s + 2.0
        return (ack(self.command, dialect.MAV_RESULT_IN_PROGRESS, progress=self.done),)

    def wake(self, now_s: float) -> Sequence[Message]:
        self.done += 10
        if self.done >= 100:
            self.next_s = None
            return (ack(self.command),)
        self.next_s = now_s + 2.0
        return (ack(self.command, dialect.MAV_RESULT_IN_PROGRESS, progress=self.done),)


class Stored(Silent):
    """Stores missions, fences and rally points, each as a whole or not at all.

    `asks`: the message that it asks for items with; `gives`: the one that it gives them in;
    `complains`: says of an item that it did not ask for that it is out of sequence, as ArduPilot
    does; `refuses`: items that it does not like, and what it says of them.
    """

    RETRY_S, TIMEOUT_S = 1.0, 8.0

    def __init__(
        self,
        asks: str = "MISSION_REQUEST",
        gives: str = "MISSION_ITEM_INT",
        *,
        complains: bool = True,
        refuses: Mapping[int, int] | None = None,
    ) -> None:
        self.stored: dict[int, list[Any]] = {0: [], 1: [], 2: []}
        self.asks, self.gives = message_type(asks), message_type(gives)
        self.complains, self.refuses = complains, refuses or {}
        self.uploads = self.clears = 0
        self.acknowledged: list[int] = []
        self._type = self._due = 0
        self._coming: list[Any] | None = None
        self._quiet_s = 0.0

    def hear(self, message: Message, now_s: float) -> Sequence[Message]:
        return self.HEARS[message.TYPE.name](self, message, now_s)

    def wake(self, now_s: float) -> Sequence[Message]:
        if now_s - self._quiet_s >= self.TIMEOUT_S:
            return self._stop(dialect.MAV_MISSION_OPERATION_CANCELLED)
        return self._ask(now_s)

    def _stop(self, result: int) -> Sequence[Message]:
        self._coming, self.next_s = None, None
        return (mission_ack(result, self._type),)

    def _ask(self, now_s: float) -> Sequence[Message]:
        self.next_s = now_s + self.RETRY_S
        assert self._coming is not None
        return (
            self.asks.make(
                seq=len(self._coming),
                target_system=GROUND.system,
                target_component=GROUND.component,
                mission_type=self._type,
            ),
        )

    def _count(self, message: Any, now_s: float) -> Sequence[Message]:
        self._type, self._due, self._coming = message.mission_type, message.count, []
        self._quiet_s = now_s
        return self._ask(now_s) if message.count else self._take()

    def _item(self, message: Any, now_s: float) -> Sequence[Message]:
        if self._coming is None:
            return ()
        if message.seq != len(self._coming) or message.mission_type != self._type:
            wrong = mission_ack(dialect.MAV_MISSION_INVALID_SEQUENCE, self._type)
            return (wrong,) if self.complains else self._ask(now_s)
        if message.seq in self.refuses:
            return self._stop(self.refuses[message.seq])
        self._coming.append(message)
        self._quiet_s = now_s
        return self._ask(now_s) if len(self._coming) < self._due else self._take()

    def _take(self) -> Sequence[Message]:
        self.uploads += 1
        self.stored[self._type] = self._coming or []
        return self._stop(dialect.MAV_MISSION_ACCEPTED)

    def _clear(self, message: Any, now_s: float) -> Sequence[Message]:
        self.clears += bool(self.stored[message.mission_type])
        self.stored[message.mission_type] = []
        return (mission_ack(dialect.MAV_MISSION_ACCEPTED, message.mission_type),)

    def _list(self, message: Any, now_s: float) -> Sequence[Message]:
        return (
            message_type("MISSION_COUNT").make(
                count=len(self.stored[message.mission_type]),
                target_system=GROUND.system,
                target_component=GROUND.component,
                mission_type=message.mission_type,
            ),
        )

    def _request(self, message: Any, now_s: float) -> Sequence[Message]:
        stored = self.stored[message.mission_type]
        if message.seq >= len(stored):
            return (mission_ack(dialect.MAV_MISSION_INVALID_SEQUENCE, message.mission_type),)
        item = stored[message.seq]
        given = item._replace(target_system=GROUND.system, target_component=GROUND.component)
        if self.gives.name == "MISSION_ITEM":
            given = given._replace(x=item.x / 1e7, y=item.y / 1e7)
        return (self.gives.make(*given),)

    def _acknowledged(self, message: Any, now_s: float) -> Sequence[Message]:
        self.acknowledged.append(message.type)
        if message.type == dialect.MAV_MISSION_OPERATION_CANCELLED:
            self._coming, self.next_s = None, None
        return ()

    HEARS: Mapping[str, Any] = {
        "MISSION_COUNT": _count,
        "MISSION_ITEM_INT": _item,
        "MISSION_CLEAR_ALL": _clear,
        "MISSION_REQUEST_LIST": _list,
        "MISSION_REQUEST_INT": _request,
        "MISSION_ACK": _acknowledged,
    }


class Parameters(Silent):
    """Has parameters; says nothing of others."""

    def __init__(self, values: Mapping[str, tuple[float, int]]) -> None:
        self.values = dict(values)

    def hear(self, message: Message, now_s: float) -> Sequence[Message]:
        name = message.param_id.decode()
        if name not in self.values:
            return ()
        value, type_ = self.values[name]
        return (
            message_type("PARAM_VALUE").make(
                param_id=name.encode(),
                param_value=value,
                param_type=type_,
                param_index=list(self.values).index(name),
                param_count=len(self.values),
            ),
        )
