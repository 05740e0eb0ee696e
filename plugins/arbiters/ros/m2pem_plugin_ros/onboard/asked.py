"""What a command asks for, as m2pem_interfaces/msg/BehaviorCommand carries it. Needs no ROS."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from m2pem.api import BehaviorRequest, BehaviorSpec, ResolvedValue, ResourceId
from m2pem.api.refusal import refusal
from m2pem_plugin_ros.wire import WireError, decode_parameters


class Verb(IntEnum):
    """The constants of the message."""

    START = 1
    CANCEL = 2
    HOLD = 3
    RESUME = 4
    QUERY = 5
    ADJUST = 6


@dataclass(frozen=True, slots=True)
class Asked:
    """A command that is one. `of_vehicle`: it is about whatever the vehicle does."""

    verb: Verb
    id: str
    run: str
    epoch: int

    @property
    def of_vehicle(self) -> bool:
        """Whether it names no behavior."""
        return self.verb in (Verb.HOLD, Verb.RESUME)


def read_command(message: Any) -> Asked:
    """What a message asks for.

    Raises:
        WireError: an unknown verb, or no id where one is needed.
    """
    try:
        verb = Verb(message.verb)
    except ValueError:
        raise WireError(f"a command with a verb of {message.verb}") from None
    asked = Asked(verb, message.id, message.run, message.epoch)
    if not asked.id and not asked.of_vehicle:
        raise WireError(f"a command to {verb.name} without an id")
    return asked


def read_parameters(message: Any) -> dict[str, ResolvedValue]:
    """The parameters of a START or an ADJUST.

    Raises:
        WireError: one cannot be understood.
    """
    return decode_parameters((pair.key, pair.value) for pair in message.parameters)


def read_request(message: Any, vehicle: str) -> BehaviorRequest:
    """What a START asks for. `vehicle`: or the payload, such as evsg2/ptz, whose node this is.

    Raises:
        WireError: a parameter cannot be understood, or it is for another vehicle.
    """
    roles = {
        allocation.role: tuple(ResourceId(resource) for resource in allocation.resources)
        for allocation in message.allocation
    }
    resources = tuple(dict.fromkeys(resource for role in roles.values() for resource in role))
    ours = {vehicle, *(each for each in resources if each.startswith(f"{vehicle}/"))}
    if resources and ours.isdisjoint(resources):
        raise WireError(f"it is for {', '.join(resources)}, and this is {vehicle}")
    return BehaviorRequest(
        message.id,
        message.epoch,
        message.behavior,
        read_parameters(message),
        resources or (ResourceId(vehicle),),
        roles,
        tuple(message.preempts),
    )


def misfit(
    catalogue: Sequence[BehaviorSpec],
    vehicle: str,
    behavior: str,
    parameters: Mapping[str, ResolvedValue],
) -> str:
    """Why a behavior is not one of the catalogue; "" if it is."""
    for spec in catalogue:
        if spec.name == behavior:
            return refusal(spec, parameters)
    known = ", ".join(spec.name for spec in catalogue)
    return f"{vehicle} has no behavior '{behavior[:100]}'; it has {known}"
