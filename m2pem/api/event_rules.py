"""Which messages of other protocols are signals and messages of missions, and the other way round.

A face reads such rules from its settings. What a received message holds is a map of fields; the
conditions and values of a rule are expressions (docs/conditions.md) that read it by dotted names.
"""

import asyncio
import logging
from collections import deque
from collections.abc import AsyncIterator, Collection, Mapping
from dataclasses import dataclass
from typing import Any, Final, Self

from m2pem.api.connection_reader import ConnectionReader
from m2pem.api.control import MissionControl
from m2pem.api.face import FaceSettings
from m2pem.api.runs import RunId, RunStatus, StampedRecord
from m2pem.engine.records import MessageThrown, MissionRevised, SignalThrown
from m2pem.errors import ExpressionError, ExpressionSyntaxError, M2pemError, OperatorError
from m2pem.mission.expression import Expression, literal, parse, template
from m2pem.mission.mission import Mission
from m2pem.mission.values import ReadValue, Value
from m2pem.units import Dimension

log = logging.getLogger("m2pem.face.events")
"""Its warnings are alerts of operators, too."""

Fields = Mapping[str, Value]

RECEIVED = ("signal", "message", "when", "every", "rate", "data")
"""What each rule of `receive` may say, beside what names the messages in its protocol."""
THROWN = ("signal", "message", "fields")
"""What each rule of `send` may say, beside where it is sent to."""
ANSWERED = ("done", "failed", "success", "data")
"""What a rule of `send` may say of the answer, where its protocol has answers."""

MOST_RULES = 200
DEEPEST = 10
"""Levels of maps and lists in `fields`."""
WAITING = 1000
"""Events that wait to be thrown. Of more, the oldest are dropped."""


class Unknown:
    """Stands for a value that is known only when a mission throws."""


UNKNOWN: Final = Unknown()


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


class EventCondition:
    """When a received message is an event: when `when` becomes true, or each time that it is true
    (`every`, the default without a `when`); never more often than `rate`.

    It belongs to one thread.
    """

    def __init__(
        self,
        when: Expression,
        data: Mapping[str, Expression],
        *,
        every: bool,
        period_s: float,
    ) -> None:
        self._when = when
        self._data = data
        self._every = every
        self._period_s = period_s
        self._held = False
        self._last_s: float | None = None

    @classmethod
    def read(cls, given: ConnectionReader, data: Mapping[str, Expression]) -> Self:
        """Read `when`, `every` and `rate`. `data`: what an event brings.

        Raises:
            PluginError: one is wrong; it names the key.
        """
        rate_hz = given.quantity("rate", 1.0, Dimension.FREQUENCY, 0.001, 50.0)
        return cls(
            _expression(given, "when", given.text("when", "true")),
            data,
            every=given.flag("every", "when" not in given.values),
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


class ReceiveRule:
    """Received messages, such as those of a topic, and what they are to missions."""

    def __init__(self, thrown: Thrown, condition: EventCondition) -> None:
        self.thrown = thrown
        self._condition = condition

    @classmethod
    def read(cls, given: FaceSettings, own: Collection[str]) -> Self:
        """Read a rule. `own`: the keys that the face itself reads.

        Raises:
            PluginError: one is wrong; it names the key.
        """
        given.refuse_others([*own, *RECEIVED])
        data = given.inner("data", '{alarm.level: "${level}"}')
        values = {name: read_template(data, name) for name in data.values}
        return cls(_thrown(given), EventCondition.read(given, values))

    def occurs(self, fields: Fields, now_s: float) -> Fields | None:
        """See `EventCondition.occurs`."""
        return self._condition.occurs(fields, now_s)

    async def throw(self, control: MissionControl, data: Fields, by: str) -> None:
        """Throw it in every run that goes on and has it."""
        if self.thrown.signal:  # at once: what comes often must not read the list of all runs
            try:
                await control.signal(self.thrown.signal, data=data, by=by)
            except OperatorError as error:  # mostly that no run has it
                log.info("%s by %s: %s", self.thrown, by, error)
            return
        for run in await control.runs():
            if run.status not in (RunStatus.RUNNING, RunStatus.PAUSED):
                continue
            try:
                for message in self.thrown.ids(await control.mission(run.run)):
                    await control.message(message, run=run.run, data=data, by=by)
            except M2pemError as error:  # it may have ended meanwhile
                log.info("%s for %s by %s: %s", self.thrown, run.run, by, error)


class EventThrower:
    """Throws events one after the other, in the order in which they came.

    It belongs to the event loop; `run` goes on until cancelled.
    """

    def __init__(self, control: MissionControl) -> None:
        self._control = control
        self._waiting: deque[tuple[ReceiveRule, Fields, str]] = deque()
        self._wake = asyncio.Event()
        self._dropped = 0

    def put(self, rule: ReceiveRule, data: Fields, by: str) -> None:
        """Throw an event soon. `by`: where it came from, such as "ros /alarm"."""
        if len(self._waiting) >= WAITING:
            self._waiting.popleft()
            if not self._dropped:
                log.warning("events from outside come too fast: the oldest are dropped")
            self._dropped += 1
        self._waiting.append((rule, data, by))
        self._wake.set()

    async def run(self) -> None:
        """Throw what comes, until cancelled."""
        while True:
            await self._wake.wait()
            self._wake.clear()
            while self._waiting:
                rule, data, by = self._waiting.popleft()
                try:
                    await rule.throw(self._control, data, by)
                except M2pemError as error:
                    log.warning("%s by %s: %s", rule.thrown, by, error)
            self._dropped = 0


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
        return dict(_filled(self._fields, data))

    def constants(self) -> dict[str, Any]:
        """Return the fields, with `UNKNOWN` for what depends on what is thrown.

        Raises:
            ExpressionError: a value cannot be evaluated.
        """
        return dict(_filled(self._fields, None))


class AnswerRule:
    """What the answer to something sent is to the run that threw it: the signal `done` or `failed`,
    if it is named, with `data` of the answer's fields."""

    def __init__(
        self, done: str, failed: str, success: Expression, data: Mapping[str, Expression]
    ) -> None:
        self.done = done
        self.failed = failed
        self._success = success
        self._data = data

    @classmethod
    def read(cls, given: FaceSettings, success: str) -> Self:
        """Read it. `success`: the usual condition for `done`.

        Raises:
            PluginError: something is wrong; it names the key.
        """
        data = given.inner("data", '{gate.text: "${message}"}')
        return cls(
            given.text("done", ""),
            given.text("failed", ""),
            _expression(given, "success", given.text("success", success)),
            {name: read_template(data, name) for name in data.values},
        )

    async def throw(
        self, control: MissionControl, run: RunId, answer: Fields | None, by: str, problem: str = ""
    ) -> None:
        """Throw the signal for an answer. None: there was none, because of the `problem`."""
        data: dict[str, Value] = {}
        try:
            fields = answer if answer is not None else {}
            read = _reader(fields)
            succeeded = answer is not None and self._success.holds(read)
            data = {name: value.evaluate(read) for name, value in self._data.items()}
        except ExpressionError as error:
            succeeded, problem = False, f"its answer: {error}"
        if not succeeded:
            log.warning("%s: %s, asked by run %s", by, problem or "it was not done", run)
        if signal := self.done if succeeded else self.failed:
            try:
                await control.signal(signal, run=run, data=data, by=by)
            except M2pemError as error:
                log.warning("the answer of %s: %s", by, error)


class ThrownEvents:
    """What missions throw, from when this is made, that a rule is about. What others throw into
    them, a face among them, is not.

    Iterate over it: each is the rule, the run, and the data. It ends with the executive.
    """

    def __init__(self, control: MissionControl, rules: Collection[SendRule]) -> None:
        self._control = control
        self._rules = rules
        self._events = control.subscribe()
        self._missions: dict[RunId, Mission] = {}

    async def __aiter__(self) -> AsyncIterator[tuple[SendRule, RunId, Fields]]:
        while True:
            try:
                async for event in self._events:
                    if isinstance(event, StampedRecord):
                        for rule, data in await self._meant(event):
                            yield rule, event.run, data
            except OperatorError as error:
                log.warning("what missions threw may not have been sent: %s", error)
                self._events = self._control.subscribe()
            else:
                return

    async def _meant(self, event: StampedRecord) -> list[tuple[SendRule, Fields]]:
        record = event.record
        if isinstance(record, MissionRevised):
            self._missions.pop(event.run, None)
        if not isinstance(record, SignalThrown | MessageThrown) or not record.element:
            return []
        try:
            mission = await self._mission(event.run)
        except M2pemError as error:
            log.warning("what run %s throws is not sent: %s", event.run, error)
            return []
        is_signal = isinstance(record, SignalThrown)
        id_ = record.signal if isinstance(record, SignalThrown) else record.message
        return [
            (rule, record.data)
            for rule in self._rules
            if is_signal == bool(rule.thrown.signal) and id_ in rule.thrown.ids(mission)
        ]

    async def _mission(self, run: RunId) -> Mission:
        if run not in self._missions:
            if len(self._missions) > 100:
                self._missions.clear()
            self._missions[run] = await self._control.mission(run)
        return self._missions[run]


def read_rules(given: FaceSettings, key: str) -> list[FaceSettings]:
    """Return a reader of each rule of a list, such as `receive`; its errors say which it is.

    Raises:
        PluginError: it is no list of maps, or too long.
    """
    value = given.values.get(key, [])
    if not isinstance(value, list) or not all(isinstance(each, Mapping) for each in value):
        raise given.error(key, "it is not a list of rules such as - {signal: alarm, ...}")
    if len(value) > MOST_RULES:
        raise given.error(key, f"it has {len(value)} rules; {MOST_RULES} are the most")
    return [
        FaceSettings(given.resource, each, f"{given.path}.{key}[{number}]")
        for number, each in enumerate(value)
    ]


def _thrown(given: FaceSettings) -> Thrown:
    signal, message = given.text("signal", ""), given.text("message", "")
    if bool(signal) == bool(message):
        raise given.error("signal", "name either a `signal` or a `message` of missions")
    return Thrown(signal, message)


def _expression(given: ConnectionReader, key: str, text: str) -> Expression:
    try:
        return parse(text)
    except ExpressionSyntaxError as error:
        raise given.error(key, str(error)) from None


def read_template(given: ConnectionReader, key: str) -> Expression:
    """Return a value or template of fields.

    Raises:
        PluginError: it is neither.
    """
    value = given.values[key]
    if not isinstance(value, str):
        if value is None or isinstance(value, bool | int | float):
            return literal(value)
        raise given.error(key, f"{value!r} is no text, number or boolean")
    try:
        return template(value)
    except ExpressionSyntaxError as error:
        raise given.error(key, str(error)) from None


def _tree(given: FaceSettings, level: int = 1) -> dict[str, Any]:
    """Fields as they are written: maps and lists in each other, with expressions for values."""
    return {str(key): _branch(given, key, value, level) for key, value in given.values.items()}


def _branch(given: FaceSettings, key: str, value: Any, level: int) -> Any:
    if level > DEEPEST:
        raise given.error(key, f"it is nested deeper than {DEEPEST} levels")
    if isinstance(value, Mapping):
        return _tree(FaceSettings(given.resource, value, f"{given.path}.{key}"), level + 1)
    if isinstance(value, list):
        return [
            _branch(FaceSettings(given.resource, {name: each}, given.path), name, each, level + 1)
            for number, each in enumerate(value)
            for name in [f"{key}[{number}]"]
        ]
    return read_template(FaceSettings(given.resource, {key: value}, given.path), key)


def _filled(tree: Any, data: Fields | None) -> Any:
    """Evaluate a tree; `data` None: only what is constant."""
    if isinstance(tree, Mapping):
        return {key: _filled(each, data) for key, each in tree.items()}
    if isinstance(tree, list):
        return [_filled(each, data) for each in tree]
    if data is None and not tree.constant:
        return UNKNOWN
    return tree.evaluate(_reader(data or {}))


def _reader(fields: Fields) -> ReadValue:
    """Read fields by dotted names, through maps within maps."""

    def read(name: str) -> Value:
        if name in fields:
            return _plain(fields[name])
        value: Any = fields
        for part in name.split("."):
            if not isinstance(value, Mapping) or part not in value:
                return None
            value = value[part]
        return _plain(value)

    return read


def _plain(value: Any) -> Value:
    """A face may convert maps when they are read; what an expression gets is whole."""
    if isinstance(value, Mapping):
        return {key: _plain(each) for key, each in value.items()}
    return value  # type: ignore[no-any-return]
