"""Taking vehicles and payloads from the missions, and giving them back: the list and its texts."""

import re
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from rich.text import Text

from m2pem_plugin_terminal.dialogs import Choice
from m2pem_plugin_terminal.formatting import shortened

if TYPE_CHECKING:
    from m2pem.api import ResourceId
    from m2pem.api.control import TakeEffect
    from m2pem.fleet.fleet import Fleet

TITLE = "Take, or give back"
TEXT = "Takes what is free or with a mission; gives back yours. Asks before it does."
RETURNED = "Missions may command it again from then on: it may move."
REMARK_CELLS = 34
BEHAVIOR = re.compile(r"r\d+\.b\d+")
"""An id of a behavior, as MissionControl.holders has it in place of an operator's name."""


def with_operator(holder: str) -> bool:
    """Whether a holder is an operator, not a behavior."""
    return bool(holder) and BEHAVIOR.fullmatch(holder) is None


def taken(holders: Mapping["ResourceId", str]) -> dict[str, str]:
    """Return the resources that operators have taken, with the operator of each."""
    return {resource: holder for resource, holder in holders.items() if with_operator(holder)}


def choices(
    fleet: "Fleet", holders: Mapping["ResourceId", str], by: str, task: Callable[[str], str]
) -> list[Choice]:
    """Vehicles, each with its payloads, and who has them.

    `by` is the operator here; `task` gives the label of a behavior's task by the behavior's id.
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
        text.append(f"{each}.\n", "" if each.caught_by else "bold #e07a6a")
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
