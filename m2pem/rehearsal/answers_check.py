"""Whether an answers file fits a mission."""

from collections.abc import Collection, Mapping

from m2pem.engine.elements.behaviors import RECOVERY_DECISIONS
from m2pem.engine.elements.subprocesses import COMPLETE
from m2pem.findings import Finding
from m2pem.fleet.yaml_source import YamlSource
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
from m2pem.rehearsal.answers_file import AnswersModel, TimedEntry
from m2pem.suggestions import suggest


def check(model: AnswersModel, source: YamlSource, mission: Mission) -> list[Finding]:
    """A finding for everything in the file that the mission does not have."""
    findings = _Check(YamlSource(source.file, lines=source.lines), mission)
    findings.answers(model.answers)
    findings.services(model.services)
    findings.behaviors(model.behaviors)
    findings.events("signals", model.signals, mission.signals)
    findings.events("messages", model.messages, mission.messages)
    return findings.source.findings


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

    def answers(self, answers: Mapping[str, list[str]]) -> None:
        for element, decisions in answers.items():
            # After a restart an operator may be asked about a behavior, too.
            known = self._decisions.get(element)
            if known is None and element in self._commanding:
                known = [each["value"] for each in RECOVERY_DECISIONS]
            if known is None:
                self._unknown(("answers", element), element, "user task", self._decisions)
                continue
            for place, decision in enumerate(decisions):
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
