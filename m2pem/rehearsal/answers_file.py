"""The shape of an answers file (docs/rehearsal.md), and whether it fits a mission."""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StringConstraints,
    ValidationError,
    model_validator,
)

from m2pem.api.arbiter import Connection
from m2pem.engine.elements.behaviors import RECOVERY_DECISIONS
from m2pem.engine.elements.subprocesses import COMPLETE
from m2pem.errors import AnswersError, FleetError
from m2pem.findings import Finding
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.yaml_source import YamlSource, note_shape_findings, parse_yaml, read_yaml
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.elements import (
    Activity,
    AdHocSubProcess,
    FlowNode,
    ScriptTask,
    SendTask,
    ServiceTask,
    UserTask,
)
from m2pem.mission.mission import Mission
from m2pem.simulation.settings import SETTING_KEYS, read_settings
from m2pem.suggestions import suggest
from m2pem.units import Dimension, quantity

_NAME = "answers.yaml"
"""What findings call a text that did not come from a file."""


def _seconds(value: object) -> float:
    seconds = quantity(value, Dimension.DURATION)
    if seconds < 0:
        raise ValueError(f"{value!r} is below 0")
    return seconds


Seconds = Annotated[float, BeforeValidator(_seconds)]
"""A duration with its unit, or a number of seconds; 0 is one."""

Text = Annotated[str, StringConstraints(min_length=1)]


class _Model(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


def _answer(said: object) -> object:
    if isinstance(said, str):
        return {"decision": said}
    if isinstance(said, Mapping | AnswerEntry):
        return said
    raise ValueError(f"{said!r} is no decision: write a text, or {{decision: ..., after: ...}}")


class AnswerEntry(_Model):
    """The answer to one prompt, and how long the operator takes for it."""

    decision: Text
    after: Seconds = 0.0


class ServiceEntry(_Model):
    """The result of one visit to a service task: values that it writes, or an error code."""

    after: Seconds = 0.0
    write: dict[Text, Any] = Field(default_factory=dict)
    error: Text | None = None

    @model_validator(mode="after")
    def _one_end(self) -> Self:
        if self.error is not None and self.write:
            raise ValueError("it has both 'write' and 'error': a service writes or fails")
        return self


class BehaviorEntry(_Model):
    """The end of one behavior that a task commands on simulated vehicles or payloads. `factor`: how
    many times as long it takes as by its motion."""

    after: Seconds = 0.0
    factor: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 1.0
    end: Literal["succeeded", "failed", "stalled", "lost", "simulated"]
    error: Text | None = None

    @model_validator(mode="after")
    def _error_of_a_failure(self) -> Self:
        if ("after" in self.model_fields_set) != (self.end != "simulated"):
            raise ValueError("'after' goes with every end but 'simulated', which comes by itself")
        if "factor" in self.model_fields_set and self.end != "simulated":
            raise ValueError(f"'factor' goes with 'end: simulated', not {self.end}")
        if self.error is not None and self.end in ("succeeded", "stalled", "simulated"):
            raise ValueError(f"'error' goes with 'end: failed' or 'end: lost', not {self.end}")
        return self


class IncidentEntry(_Model):
    """The choice about one incident of an element; `data` is written before it."""

    choice: Literal["retry", "retry_with", "skip", "move", "end"]
    after: Seconds = 0.0
    data: dict[Text, Any] = Field(default_factory=dict)
    to: Text | None = None
    roles: dict[Text, list[Text]] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _whole(self) -> Self:
        if (self.to is not None) != (self.choice == "move"):
            raise ValueError("'to' goes with 'choice: move'")
        if bool(self.roles) != (self.choice == "retry_with"):
            raise ValueError("'roles' goes with 'choice: retry_with'")
        return self


class TimedEntry(_Model):
    """A signal or message from outside; `at` counts from the start of the run."""

    at: Seconds
    id: Text
    data: dict[Text, Any] = Field(default_factory=dict)


class Wind(_Model):
    """The wind in which simulated aircraft fly; `from` is clockwise from north."""

    speed: Any
    from_: Any = Field("0 deg", alias="from")


class AnswersModel(_Model):
    """A whole file. Lists are used visit by visit. `vehicles`: settings of simulated vehicles and
    payloads, in place of those of the fleet."""

    answers: dict[Text, list[Annotated[AnswerEntry, BeforeValidator(_answer)]]] = Field(
        default_factory=dict
    )
    signals: list[TimedEntry] = Field(default_factory=list)
    messages: list[TimedEntry] = Field(default_factory=list)
    services: dict[Text, list[ServiceEntry]] = Field(default_factory=dict)
    behaviors: dict[Text, list[BehaviorEntry]] = Field(default_factory=dict)
    incidents: dict[Text, list[IncidentEntry]] = Field(default_factory=dict)
    vehicles: dict[Text, dict[Text, Any]] = Field(default_factory=dict)
    wind: Wind | None = None

    def settings_of(self, resource: str) -> dict[str, Any]:
        """Return the settings of a simulated vehicle or payload that the file changes."""
        settings = dict(self.vehicles.get(resource, {}))
        if self.wind is not None:
            settings = {"wind": self.wind.speed, "wind_from": self.wind.from_, **settings}
        return settings


def read_answers(answers: Path | bytes) -> tuple[AnswersModel, YamlSource]:
    """What a file says, or its text, and where in it it says so.

    Raises:
        AnswersError: with every finding, each with its line and the dotted path of the key.
    """
    source = parse_yaml(answers, _NAME) if isinstance(answers, bytes) else read_yaml(answers)
    model = AnswersModel()
    if not source.findings and source.data is not None:
        try:
            model = AnswersModel.model_validate(source.data)
        except ValidationError as error:
            note_shape_findings(source, error, AnswersModel)
    if source.findings:
        raise AnswersError(f"{source.file} is no answers file that can be used", source.findings)
    return model, source


def check(model: AnswersModel, source: YamlSource, mission: Mission) -> list[Finding]:
    """A finding for everything in the file that the mission does not have."""
    findings = _Check(YamlSource(source.file, lines=source.lines), mission)
    findings.answers(model.answers)
    findings.services(model.services)
    findings.behaviors(model.behaviors)
    findings.incidents(model.incidents)
    findings.events("signals", model.signals, mission.signals)
    findings.events("messages", model.messages, mission.messages)
    return findings.source.findings


def check_vehicles(model: AnswersModel, source: YamlSource, fleet: Fleet) -> list[Finding]:
    """A finding for each setting of a simulated vehicle that cannot be, and for the wind."""
    noted = YamlSource(source.file, lines=source.lines)
    known = [*fleet.vehicles, *fleet.payloads]
    if model.wind is not None:
        wind = {"wind": model.wind.speed, "wind_from": model.wind.from_}
        _check_settings(
            noted, ("wind",), "air", wind, fleet, {"wind": "speed", "wind_from": "from"}
        )
    for name, settings in model.vehicles.items():
        path = ("vehicles", name)
        if name not in known:
            message = f"{fleet.file} has no vehicle or payload '{name}'"
            noted.error(path, "unknown-resource", message, suggest(name, known, "vehicles"))
            continue
        for key in settings:
            if key not in SETTING_KEYS:
                message = f"a simulated vehicle has no setting '{key}'"
                remedy = suggest(key, SETTING_KEYS, "settings")
                noted.error((*path, key), "unknown-key", message, remedy)
        _check_settings(noted, path, name, settings, fleet)
    return noted.findings


def _check_settings(
    noted: YamlSource,
    path: tuple[str, ...],
    resource: str,
    settings: Mapping[str, Any],
    fleet: Fleet,
    keys: Mapping[str, str] | None = None,
) -> None:
    try:
        read_settings(Connection(ResourceId(resource), "air", settings), fleet.origin)
    except FleetError as error:
        for finding in error.findings:
            key = finding.element.rpartition(".connection.")[2].partition("[")[0]
            key = (keys or {}).get(key, key)
            noted.error((*path, key), "bad-value", finding.message, finding.remedy)


class _Check:
    def __init__(self, source: YamlSource, mission: Mission) -> None:
        self.source = source
        self._mission = mission
        self._decisions: dict[str, list[str]] = {}
        self._calls: dict[str, str] = {}
        self._commanding: list[str] = []
        for task in mission.activities():
            self._sort(task)

    def _sort(self, task: Activity) -> None:
        if isinstance(task, UserTask) and task.prompt is not None:
            self._decisions[task.id] = [each.value for each in task.prompt.decisions]
        elif isinstance(task, AdHocSubProcess):
            self._decisions[task.id] = [*(each.id for each in task.entries), COMPLETE]
        elif isinstance(task, ScriptTask | ServiceTask | SendTask) and task.behavior is not None:
            self._commanding.append(task.id)
        elif isinstance(task, ServiceTask) and task.call is not None:
            self._calls[task.id] = task.call.service

    def answers(self, answers: Mapping[str, list[AnswerEntry]]) -> None:
        for element, decisions in answers.items():
            # After a restart an operator may be asked about a behavior, too.
            known = self._decisions.get(element)
            if known is None and element in self._commanding:
                known = [each["value"] for each in RECOVERY_DECISIONS]
            if known is None:
                self._unknown(("answers", element), element, "user task", self._decisions)
                continue
            for place, entry in enumerate(decisions):
                decision = entry.decision
                if decision not in known:
                    message = f"the prompt of {element} has no decision '{decision}'"
                    remedy = suggest(decision, known, "decisions")
                    path = ("answers", element, place)
                    self.source.error(path, "unknown-decision", message, remedy)

    def services(self, services: Collection[str]) -> None:
        known = dict.fromkeys([*self._calls, *self._calls.values()])
        for name in services:
            if name not in known:
                self._unknown(("services", name), name, "service task or class", known)

    def behaviors(self, behaviors: Collection[str]) -> None:
        for element in behaviors:
            if element not in self._commanding:
                what = "task with a behavior"
                self._unknown(("behaviors", element), element, what, self._commanding)

    def incidents(self, incidents: Collection[str]) -> None:
        nodes = [node.id for node in self._mission.nodes]
        for element in incidents:
            if element not in nodes:
                self._unknown(("incidents", element), element, "element with tokens", nodes)

    def events(self, kind: str, events: list[TimedEntry], known: Collection[str]) -> None:
        for place, event in enumerate(events):
            if event.id not in known:
                message = f"the mission has no {kind.removesuffix('s')} with id '{event.id}'"
                remedy = suggest(event.id, known, kind)
                self.source.error((kind, place, "id"), f"unknown-{kind[:-1]}", message, remedy)

    def _unknown(self, path: tuple[str, str], name: str, what: str, known: Collection[str]) -> None:
        there = self._mission.elements.get(name)
        if isinstance(there, FlowNode):
            message = f"'{name}' (line {there.line} of {self._mission.file_of(there)}) is no {what}"
        else:
            message = f"{self._mission.file} has no {what} '{name}'"
        plural = what.replace("task", "tasks", 1)
        self.source.error(path, "unknown-element", message, suggest(name, known, plural))
