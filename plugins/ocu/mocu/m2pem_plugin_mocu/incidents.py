"""Incidents as prompts: an error that stops a task is a question, whose answer is the choice.

A choice that needs something has it after a colon: `move:Home`, `retry_with:scout=uav2`,
`set_data:speed=3`. With several roles, a semicolon is between them. An exclamation mark at the end
confirms a choice after which the mission cannot complete: `skip!`.
"""

from collections.abc import Mapping
from typing import Any

from m2pem.api import OpenPrompt, RunView
from m2pem.api import records as r
from m2pem.errors import OperatorError
from m2pem.fleet.yaml_source import parse_yaml
from m2pem.mission.behavior import Decision

_LABELS = {
    "retry": ("retry", "start again"),
    "retry_with": ("retry_with:ROLE=RESOURCE", "start again with another vehicle or payload"),
    "skip": ("skip", "it counts as done"),
    "set_data": ("set_data:NAME=VALUE", "write a value, and decide afterwards"),
    "move": ("move:ELEMENT", "move the token"),
    "end": ("end", "end the run with the error"),
}


def is_incident(prompt: str) -> bool:
    """Whether the id that a client answers is that of an incident: "r1.i2"."""
    return prompt.partition(".")[2].startswith("i")


def prompt_of(view: RunView, record: r.IncidentOpened) -> OpenPrompt:
    """Return an incident as a prompt."""
    held = f" Held for it: {', '.join(record.resources)}." if record.resources else ""
    text = f"{view.label(record.element)} is stopped by {record.code}: {record.reason}.{held}"
    decisions = tuple(Decision(*_LABELS[choice]) for choice in record.choices)
    place = (view.run, record.incident, record.element)
    return OpenPrompt(*place, text, decisions, record.operator_role)


def choice_of(decision: str) -> Mapping[str, Any]:
    """Return what an answer says: choice, data, to, roles, even_if_stuck.

    Raises:
        OperatorError: it lacks what its choice needs, or is not of the form.
    """
    confirmed = decision.endswith("!")
    choice, _, rest = decision.removesuffix("!").partition(":")
    found: dict[str, Any] = {"data": {}, "to": "", "roles": {}}
    if choice == "move":
        found["to"] = rest
    elif choice == "set_data":
        name, value = _named(rest, decision, choice)
        source = parse_yaml(value.encode("utf-8", "replace"), name)
        if source.findings:
            raise OperatorError(f"the value of {name}: {source.findings[0].message}")
        found["data"] = {name: source.data}
    elif choice == "retry_with":
        named = [_named(each, decision, choice) for each in rest.split(";")]
        found["roles"] = {role: resources.split(",") for role, resources in named}
    return {"choice": choice, "even_if_stuck": confirmed, **found}


def _named(text: str, decision: str, choice: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not (name and equals):
        raise OperatorError(f"{decision!r} is not of the form {_LABELS[choice][0]}")
    return name, value
