"""The shape of a file of scenarios (docs/testing-missions.md), and whether it fits its mission."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StringConstraints,
    ValidationError,
)

from m2pem.errors import FindingsError
from m2pem.fleet.yaml_source import KeyPath, YamlSource, note_shape_findings, read_yaml
from m2pem.mission.mission import Mission
from m2pem.rehearsal.answers import Answers
from m2pem.rehearsal.answers_file import AnswersModel, read_answers
from m2pem.suggestions import suggest
from m2pem.units import Dimension, quantity

SUFFIX = ".test.yaml"
"""`NAME.test.yaml` has the scenarios of `NAME.bpmn` in the same folder."""

Ending = Literal["completed", "failed", "terminated", "stopped"]
THROWN = ("signal", "message", "escalation", "error")
"""What begins an entry of `throws`: `error BLOCKED`."""

Text = Annotated[str, StringConstraints(min_length=1)]


class ScenarioError(FindingsError):
    """A file of scenarios cannot be used, or does not fit its mission."""


def _words(said: object) -> object:
    """Ids with blanks between, as in the project's conformance cases; or a list."""
    return said.split() if isinstance(said, str) else said


def _one_or_more(said: object) -> object:
    return [said] if isinstance(said, str) else said


def _script(said: object) -> object:
    return {"file": said} if isinstance(said, str) else said


def _seconds(said: object) -> float:
    return quantity(said, Dimension.DURATION)


def _expected(said: object) -> object:
    return {"ended": said} if isinstance(said, str) else said


Words = Annotated[list[Text], BeforeValidator(_words)]


class _Model(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


class Given(_Model):
    """What a scenario begins with. What is absent is that of the whole file."""

    fleet: Text | None = None
    process: Text | None = None
    data: dict[Text, Any] = Field(default_factory=dict)


class When(AnswersModel):
    """What happens from outside: what an answers file says, or such a file, from this one."""

    file: Text | None = None


class Expected(_Model):
    """What is so at the end; what is None is not looked at.

    `detail`: a part of the text of how it ended. `entered`, `throws`: these, in this order, among
    others. `commanded`: all behaviors of each of these vehicles or payloads, in order. `within`:
    seconds of mission time.
    """

    ended: Ending | None = None
    detail: Text | None = None
    entered: Words | None = None
    not_entered: Words | None = None
    throws: Annotated[list[Text], BeforeValidator(_one_or_more)] | None = None
    data: dict[Text, Any] | None = None
    requirements: dict[Text, Literal["satisfied", "violated", "open"]] | None = None
    commanded: dict[Text, Words] | None = None
    within: Annotated[float, BeforeValidator(_seconds)] | None = None


class Scenario(_Model):
    """Given this, when that happens while the mission runs, then it does this. `scenario` is its
    title."""

    scenario: Text
    given: Given = Field(default_factory=Given)
    when: Annotated[When, BeforeValidator(_script)] = Field(default_factory=When)
    then: Annotated[Expected, BeforeValidator(_expected)]


class ScenariosModel(_Model):
    """A whole file. `fleet`, `process` and `data` are those of all scenarios without their own.

    `path`: folders of processes that the mission calls. `complete`: whether it is an error if
    anything is neither seen nor in `unreached`. `unreached`: what no scenario sees, by id (`error
    CODE` for an error that ends the run), and why.
    """

    fleet: Text = "sim"
    process: Text | None = None
    path: list[Text] = Field(default_factory=list)
    data: dict[Text, Any] = Field(default_factory=dict)
    complete: bool = False
    unreached: dict[Text, Text] = Field(default_factory=dict)
    scenarios: list[Scenario] = Field(default_factory=list)


@dataclass(frozen=True, slots=True)
class ScenarioFile:
    """A file that was read. `path` None: what a mission without one has. `folder`: in which the
    file, or the mission, is."""

    model: ScenariosModel
    source: YamlSource
    path: Path | None
    folder: Path

    def line(self, number: int) -> int:
        """The line of a scenario, by its place in the list."""
        return self.source.line(("scenarios", number))

    def process_of(self, scenario: Scenario) -> str | None:
        """The process that a scenario begins with; None: the main one."""
        return scenario.given.process or self.model.process

    def fleet_of(self, scenario: Scenario) -> str:
        """The fleet file of a scenario, or `sim`."""
        return self.located(scenario.given.fleet or self.model.fleet)

    def located(self, fleet: str) -> str:
        """A fleet file, as a path from here, or `sim`."""
        return fleet if fleet == "sim" else str(self.folder / fleet)

    def data_of(self, scenario: Scenario) -> dict[str, Any]:
        """The data that a scenario begins with."""
        return {**self.model.data, **scenario.given.data}

    def answers_of(self, number: int) -> Answers:
        """Return the answers of a scenario, by its place in the list; nothing has used them.

        Raises:
            AnswersError: its answers file cannot be used.
        """
        when = self.model.scenarios[number].when
        if when.file is not None:
            return Answers(*read_answers(self.folder / when.file))
        path: KeyPath = ("scenarios", number, "when")
        lines = {
            key[len(path) :]: line
            for key, line in self.source.lines.items()
            if key[: len(path)] == path
        }
        return Answers(when, YamlSource(self.source.file, lines=lines))


def read_scenarios(path: Path) -> ScenarioFile:
    """Read a file of scenarios.

    Raises:
        ScenarioError: with every finding, each with its line and the dotted path of the key.
    """
    source = read_yaml(path)
    model = ScenariosModel()
    if not source.findings and source.data is not None:
        try:
            model = ScenariosModel.model_validate(source.data)
        except ValidationError as error:
            note_shape_findings(source, error, ScenariosModel)
    titles: set[str] = set()
    for number, each in enumerate(model.scenarios):
        where = ("scenarios", number)
        if each.scenario in titles:
            source.error((*where, "scenario"), "duplicate", "another scenario has this title, too")
        titles.add(each.scenario)
        if each.when.file is not None and len(each.when.model_fields_set) > 1:
            message = "it has an answers file ('file') and other answers"
            source.error((*where, "when"), "bad-value", message, "remove one")
    if source.findings:
        raise ScenarioError(f"{path} is no file of scenarios that can be used", source.findings)
    return ScenarioFile(model, source, path, path.parent)


def no_scenarios(mission: Path, fleet: str = "sim") -> ScenarioFile:
    """Return what a mission without a file of scenarios has. `fleet`: from here, not from it."""
    located = fleet if fleet == "sim" else str(Path(fleet).absolute())
    return ScenarioFile(
        ScenariosModel(fleet=located), YamlSource(str(mission)), None, mission.parent
    )


def refuse_misfits(file: ScenarioFile, mission: Mission) -> None:
    """Refuse a file that names what its mission does not have.

    Raises:
        ScenarioError: with every finding.
    """
    noted = YamlSource(file.source.file, lines=file.source.lines)
    nodes = [node.id for node in mission.nodes]
    flows = [flow.id for flow in mission.flows]
    for key in file.model.unreached:
        if not key.startswith("error "):
            _refuse_unknown(noted, ("unreached", key), key, [*nodes, *flows], "element or flow")
    for path, process in _processes(file.model):
        known = [each.id for each in mission.processes if not each.global_task]
        _refuse_unknown(noted, path, process, known, "process")
    for number, scenario in enumerate(file.model.scenarios):
        path = ("scenarios", number, "then")
        for name in ("entered", "not_entered"):
            for place, element in enumerate(getattr(scenario.then, name) or ()):
                _refuse_unknown(noted, (*path, name, place), element, nodes, "element")
        for place, thrown in enumerate(scenario.then.throws or ()):
            kind, _, rest = thrown.partition(" ")
            if kind not in THROWN or not rest:
                message = f"{thrown!r} is not {', '.join(THROWN)} with an id or code behind it"
                noted.error((*path, "throws", place), "bad-value", message, "error BLOCKED")
    if noted.findings:
        raise ScenarioError(f"{file.source.file} does not fit {mission.file}", noted.findings)


def _processes(model: ScenariosModel) -> Iterator[tuple[KeyPath, str]]:
    if model.process is not None:
        yield ("process",), model.process
    for number, scenario in enumerate(model.scenarios):
        if scenario.given.process is not None:
            yield ("scenarios", number, "given", "process"), scenario.given.process


def _refuse_unknown(
    noted: YamlSource, path: KeyPath, name: str, known: Collection[str], what: str
) -> None:
    if name not in known:
        plural = {"process": "processes", "element": "elements"}.get(what, "elements and flows")
        noted.error(
            path, "unknown-element", f"the mission has no {what} '{name}'",
            suggest(name, known, plural),
        )  # fmt: skip
