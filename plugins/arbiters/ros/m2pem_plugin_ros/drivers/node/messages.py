"""Commands to an m2pem node on a vehicle, as messages."""

from collections.abc import Mapping
from typing import Any
from uuid import UUID

from m2pem_interfaces import msg as interfaces

from m2pem.api import BehaviorRequest, ResolvedValue
from m2pem_plugin_ros.drivers.driver import Order
from m2pem_plugin_ros.stamps import stamp
from m2pem_plugin_ros.wire import encode_parameters

Command = interfaces.BehaviorCommand


def start(order: Order, now_us: int) -> Any:
    """START, also the goal of the action.

    Raises:
        WireError: a parameter is none that the wire can carry.
    """
    message = about(Command.START, order, now_us)
    message.behavior = order.request.behavior
    message.parameters = _parameters(order.request.parameters)
    message.allocation = [
        interfaces.Allocation(role=role, resources=list(resources))
        for role, resources in _roles(order.request).items()
    ]
    message.preempts = [str(goal) for goal in order.preempts]
    return message


def adjust(order: Order, parameters: Mapping[str, ResolvedValue], now_us: int) -> Any:
    """ADJUST.

    Raises:
        WireError: a parameter is none that the wire can carry.
    """
    message = about(Command.ADJUST, order, now_us)
    message.parameters = _parameters(parameters)
    return message


def about(verb: int, order: Order, now_us: int, epoch: int = 0) -> Any:
    """CANCEL or QUERY. `epoch`: that of the executive that sends it, if it is known; an order that
    was given before a restart has the one of its START."""
    return Command(
        stamp=stamp(now_us),
        verb=verb,
        id=str(order.goal),
        run=str(order.run),
        epoch=max(epoch, order.request.epoch),
    )


def of_goal(verb: int, goal: UUID, now_us: int) -> Any:
    """CANCEL or QUERY of a behavior of which nothing else is known."""
    return Command(stamp=stamp(now_us), verb=verb, id=str(goal))


def of_vehicle(verb: int, now_us: int) -> Any:
    """HOLD or RESUME: whatever it does."""
    return Command(stamp=stamp(now_us), verb=verb)


def _roles(request: BehaviorRequest) -> Mapping[str, tuple[str, ...]]:
    """The resources by role; those of a request without roles are of the role ""."""
    return {role: tuple(resources) for role, resources in request.roles.items()} or {
        "": tuple(request.resources)
    }


def _parameters(parameters: Mapping[str, ResolvedValue]) -> list[interfaces.KeyValue]:
    return [
        interfaces.KeyValue(key=key, value=value) for key, value in encode_parameters(parameters)
    ]
