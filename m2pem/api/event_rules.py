"""Which messages of other protocols are signals and messages of missions, and the other way round.

A face reads such rules from its settings. What a received message holds is a map of fields; the
conditions and values of a rule are expressions (docs/conditions.md) that read it by dotted names.
"""

import logging
from collections.abc import AsyncIterator, Collection, Mapping
from dataclasses import dataclass
from typing import Any, Self

from m2pem.api.control import MissionControl
from m2pem.api.face import FaceSettings
from m2pem.api.runs import RunId, RunStatus, StampedRecord
from m2pem.engine.records import MessageThrown, SignalThrown
from m2pem.errors import ExpressionSyntaxError, M2pemError, OperatorError
from m2pem.mission.expression import Expression, literal, parse, template
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.units import Dimension

log = logging.getLogger("m2pem.face")

Fields = Mapping[str, Value]

RECEIVED = ("signal", "message", "when", "every", "rate", "data")
"""What each rule of `receive` may say, beside what names the messages in its protocol."""
THROWN = ("signal", "message", "fields")
"""What each rule of `send` may say, beside where it is sent to."""


@dataclass(frozen=True, slots=True)
class Thrown:
    """What a rule is about. One of `signal` and `message` is an id or a name in missions, the other
    is ""."""

    signal: str
    message: str

    def __str__(self) -> str:
        return f"signal {self.signal!r}" if self.signal else f"message {self.message!r}"

    def ids(self, mission: Mission) -> list[str]:
        """The ids in a mission that it means: by an id, else by the names."""
        declared: Mapping[str, Any] = mission.signals if self.signal else mission.messages
        wanted = self.signal or self.message
        if wanted in declared:
            return [wanted]
        return [key for key, each in declared.items() if each.name == wanted]


class ReceiveRule:
    """Received messages, such as those of a topic, and what they are to missions.

    They are an event when `when` becomes true, or each time that it is true (`every`); never
    more often than `rate`.
    """

    def __init__(
        self,
        thrown: Thrown,
        when: Expression,
        data: Mapping[str, Expression],
        *,
        every: bool,
        period_s: float,
    ) -> None:
        self.thrown = thrown
        self._when = when
        self._data = data
        self._every = every
        self._period_s = period_s
        self._held = False
        self._last_s: float | None = None

    @classmethod
    def read(cls, given: FaceSettings, own: Collection[str]) -> Self:
        """Read a rule. `own`: the keys that the face itself reads.

        Raises:
            PluginError: one is wrong; it names the key.
        """
        given.refuse_others([*own, *RECEIVED])
        rate_hz = given.quantity("rate", 1.0, Dimension.FREQUENCY, 0.001, 50.0)
        data = given.inner("data", '{alarm.level: "${level}"}')
        return cls(
            _thrown(given),
            _expression(given, "when", given.text("when", "true")),
            {name: _template(data, name) for name in data.values},
            every=given.flag("every", False),
            period_s=1 / rate_hz,
        )

    def occurs(self, fields: Fields, now_s: float) -> Fields | None:
        """Return the data of the event that a message is; None if it is none.

        `now_s`: by a clock that does not go back.

        Raises:
            ExpressionError: the condition or a value cannot be evaluated on these fields.
        """
        read = _reader(fields)
        holds = self._when.holds(read)
        before, self._held = self._held, holds
        if not holds or (before and not self._every):
            return None
        if self._last_s is not None and now_s - self._last_s < self._period_s:
            # A change that came too early is not forgotten: it counts when it is still there.
            self._held = before
            return None
        data = {name: value.evaluate(read) for name, value in self._data.items()}
        self._last_s = now_s
        return data

    async def throw(self, control: MissionControl, data: Fields, by: str) -> None:
        """Throw it in every run that goes on and has it."""
        if self.thrown.signal:
            try:
                await control.signal(self.thrown.signal, data=data, by=by)
            except OperatorError as error:
                log.info("%s by %s: %s", self.thrown, by, error)
            return
        for run in await control.runs():
            if run.status not in (RunStatus.RUNNING, RunStatus.PAUSED):
                continue
            try:
                for message in self.thrown.ids(await control.mission(run.run)):
                    await control.message(message, run=run.run, data=data, by=by)
            except M2pemError as error:
                log.warning("%s for %s by %s: %s", self.thrown, run.run, by, error)


class SendRule:
    """A signal or message that missions throw, and the fields of what is sent for it."""

    def __init__(self, thrown: Thrown, fields: Mapping[str, Any]) -> None:
        self.thrown = thrown
        self._fields = fields

    @classmethod
    def read(cls, given: FaceSettings, own: Collection[str]) -> Self:
        """Read a rule. `own`: the keys that the face itself reads.

        Raises:
            PluginError: one is wrong; it names the key.
        """
        given.refuse_others([*own, *THROWN])
        return cls(_thrown(given), _tree(given.inner("fields", '{data: "${level}"}')))

    def filled(self, data: Fields) -> dict[str, Any]:
        """Return the fields, with the values of what was thrown.

        Raises:
            ExpressionError: a value cannot be evaluated on this data.
        """
        return _filled(self._fields, data)


async def thrown_by_missions(
    control: MissionControl, rules: Collection[SendRule]
) -> AsyncIterator[tuple[SendRule, RunId, Fields]]:
    """Yield what missions throw, from now on, that a rule is about. What others throw into them,
    a face among them, is not."""
    missions: dict[RunId, Mission] = {}
    async for event in control.subscribe():
        if not isinstance(event, StampedRecord):
            continue
        record = event.record
        if not isinstance(record, SignalThrown | MessageThrown) or not record.element:
            continue
        if event.run not in missions:
            if len(missions) > 100:
                missions.clear()
            missions[event.run] = await control.mission(event.run)
        for rule in rules:
            is_signal = isinstance(record, SignalThrown)
            id_ = record.signal if isinstance(record, SignalThrown) else record.message
            if is_signal == bool(rule.thrown.signal) and id_ in rule.thrown.ids(
                missions[event.run]
            ):
                yield rule, event.run, record.data


def _thrown(given: FaceSettings) -> Thrown:
    signal, message = given.text("signal", ""), given.text("message", "")
    if bool(signal) == bool(message):
        raise given.error("signal", "name either a `signal` or a `message` of missions")
    return Thrown(signal, message)


def _expression(given: FaceSettings, key: str, text: str) -> Expression:
    try:
        return parse(text)
    except ExpressionSyntaxError as error:
        raise given.error(key, str(error)) from None


def _template(given: FaceSettings, key: str) -> Expression:
    value = given.values[key]
    if not isinstance(value, str):
        if value is None or isinstance(value, bool | int | float):
            return literal(value)
        raise given.error(key, f"{value!r} is no text, number or boolean")
    try:
        return template(value)
    except ExpressionSyntaxError as error:
        raise given.error(key, str(error)) from None


def _tree(given: FaceSettings) -> dict[str, Any]:
    """Fields as they are written: maps within maps, with expressions in place of values."""
    return {
        key: _tree(given.inner(key, "{x: 1}"))
        if isinstance(value, Mapping)
        else [_template(FaceSettings("", {key: each}, given.path), key) for each in value]
        if isinstance(value, list)
        else _template(given, key)
        for key, value in given.values.items()
    }


def _filled(fields: Mapping[str, Any], data: Fields) -> dict[str, Any]:
    read = _reader(data)

    def value_of(value: Any) -> Any:
        if isinstance(value, Mapping):
            return {key: value_of(each) for key, each in value.items()}
        if isinstance(value, list):
            return [value_of(each) for each in value]
        return value.evaluate(read)

    return {key: value_of(value) for key, value in fields.items()}


def _reader(fields: Fields) -> Any:
    """Read fields by dotted names, through maps within maps."""

    def read(name: str) -> Value:
        if name in fields:
            return fields[name]
        value: Any = fields
        for part in name.split("."):
            if not isinstance(value, Mapping) or part not in value:
                return None
            value = value[part]
        return value if not isinstance(value, Mapping) else dict(value)

    return read
