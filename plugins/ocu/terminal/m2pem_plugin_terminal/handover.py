"""Who has which vehicle and payload, and the list from which to take them or give them back."""

import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from m2pem_plugin_terminal.dialogs import Choice
from m2pem_plugin_terminal.words import shortened

if TYPE_CHECKING:
    from m2pem.api import ResourceId
    from m2pem.resources.fleet import Fleet

TITLE = "Take, or give back"
TEXT = "Takes what is free or with a mission; gives back yours."
REMARK_CELLS = 34
BEHAVIOR = re.compile(r"r\d+\.b\d+")
"""An id of a behavior, as MissionControl.holders has it in place of an operator's name."""


def with_operator(holder: str) -> bool:
    """Whether a holder is an operator, and no behavior."""
    return bool(holder) and BEHAVIOR.fullmatch(holder) is None


def taken(holders: Mapping["ResourceId", str]) -> dict[str, str]:
    """What operators have, and who."""
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


def _who(holder: str, by: str, task: Callable[[str], str]) -> str:
    if not holder:
        return "free"
    if with_operator(holder):
        return f"{holder} (you)" if holder == by else holder
    return task(holder)
