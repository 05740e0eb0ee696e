"""Deciding about incidents: the lists and texts of the dialogs (docs/incidents.md)."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rich.text import Text

from m2pem.api import IncidentPreview, IncidentVerdict, OpenIncident, RequirementProspect
from m2pem.api.allocation import WaitingTask, blocked_by
from m2pem_plugin_terminal.dialogs import Choice

if TYPE_CHECKING:
    from m2pem.api import Fleet, Value

TITLE = "Errors that stop a task"
NONE = "No error stops a task here"

LABELS = {
    "retry": "Retry: it starts again",
    "retry_with": "Retry with another vehicle or payload",
    "skip": "Skip: it counts as done",
    "set_data": "Set data, and decide afterwards",
    "move": "Move the token to another element",
    "end": "End the run with the error",
}


@dataclass(frozen=True, slots=True)
class Decision:
    """What an operator has chosen about an incident, with what it needs."""

    choice: str
    data: "dict[str, Value]" = field(default_factory=dict)
    to: str = ""
    roles: dict[str, list[str]] = field(default_factory=dict)


def incident_choices(incidents: Sequence[OpenIncident]) -> list[Choice]:
    """Return a line for each incident."""
    return [Choice(each.incident, f"{each.run}: {each.task}", each.code) for each in incidents]


def blocked_text(incident: OpenIncident, waiting: Sequence[WaitingTask]) -> str:
    """Return the incident, and the tasks that wait for what it holds."""
    blocked = blocked_by(incident.incident, waiting)
    lines = [f"blocked: {each.in_short()}" for each in blocked]
    return "\n".join([str(incident), *(lines or ["no other task waits for it"])])


def decision_choices(incident: OpenIncident) -> list[Choice]:
    """Return a line for each choice about an incident."""
    return [Choice(choice, LABELS.get(choice, choice)) for choice in incident.choices]


def role_choices(incident: OpenIncident) -> list[Choice]:
    """Return a line for each role of the failed behavior."""
    return [Choice(role, role, ", ".join(ids)) for role, ids in incident.roles.items()]


def resource_choices(fleet: "Fleet") -> list[Choice]:
    """Return a line for each vehicle, payload and team."""
    return [Choice(name, name) for name in (*fleet.vehicles, *fleet.payloads, *fleet.teams)]


def target_choices(incident: OpenIncident) -> list[Choice]:
    """Return a line for each element to which the token can move."""
    return [
        Choice(id_, label, "" if label == id_ else id_) for id_, label in incident.targets.items()
    ]


def effect_text(incident: OpenIncident, decision: Decision, preview: IncidentPreview) -> Text:
    """Return what is confirmed: the incident, the choice, and what the checker says of it."""
    text = Text(f"{incident}\n\n", "#c8d0d9")
    text.append(f"{LABELS[decision.choice]}\n", "bold #e3e8ee")
    for what in (decision.to, *(f"{k} = {v}" for k, v in decision.data.items())):
        if what:
            text.append(f"{what}\n", "#9aa4af")
    for role, ids in decision.roles.items():
        text.append(f"{role}: {', '.join(ids)}\n", "#9aa4af")
    good = preview.verdict is IncidentVerdict.COMPLETES and all(
        each.verdict is RequirementProspect.HOLDS for each in preview.requirements
    )
    text.append(str(preview), "#7fc8a9" if good else "#e8c468")
    return text
