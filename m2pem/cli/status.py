"""The status of a run by its journal: tokens, behaviors, tasks that wait, requirements, data."""

from typing import Any

import msgspec

from m2pem.api.description import waiting
from m2pem.api.requirement_states import requirements_of
from m2pem.cli.requirement_table import as_data, requirement_table
from m2pem.cli.table import table
from m2pem.engine.inputs import Input
from m2pem.engine.records import DataWritten, Record
from m2pem.engine.run import MissionRun
from m2pem.executive.run_summary import summary
from m2pem.journal.base import RunInfo
from m2pem.journal.mission import fleet_of, mission_of
from m2pem.mission.mission import SHORT, Mission, version_of
from m2pem.mission.values import Value


def run_of(line: RunInfo) -> MissionRun:
    """The run of a journal before anything has happened in it."""
    header = line.header
    return MissionRun(mission_of(header), fleet_of(header) if header.fleet else None, line.run)


class RunStatusView:
    """The state of a run, rebuilt by applying its records."""

    def __init__(self, line: RunInfo) -> None:
        self._summary = summary(line)
        self._run = run_of(line)
        self._data: dict[str, Value] = {}

    @property
    def mission(self) -> Mission:
        """The version of the mission that holds after the last record."""
        return self._run.state.mission

    def take(self, record: Record, item: Input) -> None:
        """Apply the next record, and the input that it was decided from."""
        state = self._run.state
        self._run.replay([record], item)
        # Kept here, as the state forgets the root's data when it ends.
        if isinstance(record, DataWritten) and state.root and record.store == state.root.id:
            self._data[record.key] = record.value

    def commanded(self) -> dict[str, str]:
        """The present behavior of each vehicle and payload that the run commands."""
        state = self._run.state
        return {
            resource: state.behaviors[holders[-1]].name
            for resource, holders in state.held.items()
            if holders
        }

    def as_data(self) -> dict[str, Any]:
        """Return the status as JSON values."""
        state = self._run.state
        return {
            "run": state.run,
            "status": self._summary.status.value,
            "detail": state.detail,
            "version": version_of(state.mission),
            "tokens": [
                {
                    "token": token.id,
                    "process": token.scope.container.process.id,
                    "element": token.node.id,
                    "scope": token.scope.id,
                }
                for token in state.tokens.values()
            ],
            "behaviors": [
                {
                    "behavior": behavior.id,
                    "name": behavior.name,
                    "resources": behavior.resources,
                    "phase": behavior.phase.value,
                    "state": behavior.state.value if behavior.state is not None else None,
                }
                for behavior in state.behaviors.values()
            ],
            "waiting": [
                {
                    "allocation": request.id,
                    "element": request.token.node.id,
                    "reason": request.reason,
                    "holders": request.holders,
                }
                for request in state.allocations.values()
            ],
            "prompts": [
                {"prompt": prompt.id, "element": prompt.token.node.id, "text": prompt.text}
                for prompt in state.prompts.values()
            ],
            "incidents": [
                {
                    "incident": incident.id,
                    "element": incident.token.node.id,
                    "code": incident.code,
                    "reason": incident.reason,
                    "choices": list(incident.choices),
                    "resources": list(incident.resources),
                }
                for incident in state.incidents.values()
            ],
            "requirements": [as_data(each) for each in requirements_of(state).values()],
            "data": self._data,
        }

    def as_text(self) -> str:
        """Return the status as text."""
        state = self._run.state
        detail = f": {state.detail}" if state.detail else ""
        parts = [f"\n{state.run} is {self._summary.status.value}{detail}"]
        if state.mission is not self._run.begun_with:
            version = version_of(state.mission)[:SHORT]
            parts.append(f"its mission is version {version} of {state.mission.file}, by a revision")
        if state.tokens:
            rows = [
                (str(token.id), token.scope.container.process.id, token.node.label)
                for token in state.tokens.values()
            ]
            parts.append(table(("TOKEN", "PROCESS", "IS ON"), rows))
        if state.behaviors:
            rows = [
                (each.name, ", ".join(each.resources), (each.state or each.phase).value.lower())
                for each in state.behaviors.values()
            ]
            parts.append(table(("BEHAVIOR", "OF", "STATE"), rows))
        if state.allocations:
            waits = [
                (each.token.node.label, waiting(each.reason)) for each in state.allocations.values()
            ]
            parts.append(table(("TASK", "WAITS"), waits))
        if state.incidents:
            stopped = [
                (each.id, each.token.node.label, each.code, ", ".join(each.resources))
                for each in state.incidents.values()
            ]
            parts.append(table(("INCIDENT", "STOPS", "ERROR", "HOLDS"), stopped))
        if state.requirements:
            parts.append(requirement_table(requirements_of(state).values()))
        if self._data:
            written = [
                (key, msgspec.json.encode(value).decode())
                for key, value in sorted(self._data.items())
            ]
            parts.append(table(("DATA", "VALUE"), written))
        return "\n\n".join(parts)
