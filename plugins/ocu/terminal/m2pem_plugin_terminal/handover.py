"""Acquiring and releasing control of vehicles and payloads: the list and its texts."""

import re
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from rich.text import Text

from m2pem_plugin_terminal.dialogs import Choice
from m2pem_plugin_terminal.formatting import shortened

if TYPE_CHECKING:
    from m2pem.api import ResourceId
    from m2pem.api.allocation import TakeEffect
    from m2pem.fleet.fleet import Fleet

TITLE = "Take, or give back"
TEXT = "Take a resource that is free or in a mission; give yours back; ask others for theirs."
FORCED = "Why do you give it back? All operators see it."
RETURNED = "Missions may command it again from then on: it may move."
REMARK_CELLS = 34
OF_MISSIONS = re.compile(r"r\d+\.[abik]\d+")
"""The id of a behavior, request, incident or of what a run keeps between tasks:
`MissionControl.holders` has one, or the name of an operator."""


def with_operator(holder: str) -> bool:
    """Return whether a holder is an operator, not what a run has."""
    return bool(holder) and OF_MISSIONS.fullmatch(holder) is None


def taken(holders: Mapping["ResourceId", str]) -> dict[str, str]:
    """Return the resources that operators have taken, with the operator of each."""
    return {resource: holder for resource, holder in holders.items() if with_operator(holder)}


def choices(
    fleet: "Fleet", holders: Mapping["ResourceId", str], by: str, task: Callable[[str], str]
) -> list[Choice]:
    """Return the choices: vehicles, each with its payloads, and who controls them.

    `by` is the operator here; `task` gives the label of a task by what has a resource for it.
    """
    return [
        Choice(resource, resource, shortened(_who(holders[resource], by, task), REMARK_CELLS))
        for vehicle in fleet.vehicles.values()
        for resource in (vehicle.id, *vehicle.payloads)
        if resource in holders
    ]


def effects_text(resource: str, effects: Sequence["TakeEffect"]) -> Text:
    """Return what taking a resource does to the missions, to be read before it is taken."""
    text = Text()
    for each in effects:
        text.append(f"{each}.\n", "" if each.caught_by or each.direct else "bold #e07a6a")
    if not effects:
        text.append(f"No mission is commanding {resource}.\n")
    text.append("Until it is given back, tasks that need it fail: RESOURCE_UNAVAILABLE.")
    return text


def _who(holder: str, by: str, task: Callable[[str], str]) -> str:
    if not holder:
        return "free"
    if with_operator(holder):
        return f"{holder} (you)" if holder == by else holder
    return task(holder)
