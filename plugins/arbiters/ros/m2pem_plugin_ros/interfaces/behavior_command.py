"""m2pem_interfaces/msg/BehaviorCommand, read by the node on a vehicle and written by the executive;
and CommandRefusal, its answer to a command of a past epoch, which older nodes do not send."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any
from uuid import UUID

from m2pem.api import BehaviorRequest, BehaviorSpec, ResolvedValue, ResourceId
from m2pem.api.behavior_parameters import refusal
from m2pem_plugin_ros.drivers.driver import Order
from m2pem_plugin_ros.interfaces import own_messages, set_stamp
from m2pem_plugin_ros.interfaces.key_values import WireError, decode_parameters, encode_parameters


class Verb(IntEnum):
    """The constants of BehaviorCommand.msg."""

    START = 1
    CANCEL = 2
    HOLD = 3
    RESUME = 4
    QUERY = 5
    ADJUST = 6
    CLAIM = 7


@dataclass(frozen=True, slots=True)
class Command:
    """A valid command."""

    verb: Verb
    id: str
    run: str
    epoch: int


def read_command(message: Any) -> Command:
    """Read a command.

    Raises:
        WireError: an unknown verb, or no id where one is needed.
    """
    try:
        verb = Verb(message.verb)
    except ValueError:
        raise WireError(f"a command with the unknown verb {message.verb}") from None
    if not message.id and verb not in (Verb.HOLD, Verb.RESUME, Verb.CLAIM):
        raise WireError(f"a command to {verb.name} without an id")
    return Command(verb, message.id, message.run, message.epoch)


def read_parameters(message: Any) -> dict[str, ResolvedValue]:
    """Read the parameters of a START or an ADJUST.

    Raises:
        WireError: a parameter is invalid.
    """
    return decode_parameters((pair.key, pair.value) for pair in message.parameters)


def read_request(message: Any, vehicle: str) -> BehaviorRequest:
    """Read the request of a START. `vehicle`: the vehicle, or the payload, whose node this is.

    Raises:
        WireError: a parameter is invalid, or the request is for another vehicle.
    """
    roles = {
        allocation.role: tuple(ResourceId(resource) for resource in allocation.resources)
        for allocation in message.allocation
    }
    resources = tuple(dict.fromkeys(resource for role in roles.values() for resource in role))
    own = {vehicle, *(each for each in resources if each.startswith(f"{vehicle}/"))}
    if resources and own.isdisjoint(resources):
        raise WireError(f"the command is for {', '.join(resources)}, but this is {vehicle}")
    return BehaviorRequest(
        message.id,
        message.epoch,
        message.behavior,
        read_parameters(message),
        resources or (ResourceId(vehicle),),
        roles,
        tuple(message.preempts),
    )


def mismatch(
    catalogue: Sequence[BehaviorSpec],
    vehicle: str,
    behavior: str,
    parameters: Mapping[str, ResolvedValue],
) -> str:
    """Return why a behavior is not in the catalogue, or its parameters do not fit; "" if they
    do."""
    for spec in catalogue:
        if spec.name == behavior:
            return refusal(spec, parameters)
    known = ", ".join(spec.name for spec in catalogue)
    return f"{vehicle} has no behavior '{behavior[:100]}'; it has {known}"


def start_command(order: Order, now_us: int) -> Any:
    """Return a START. It is the goal of the action, too.

    Raises:
        WireError: a parameter cannot be encoded.
    """
    message = behavior_command(Verb.START, order, now_us)
    message.behavior = order.request.behavior
    message.parameters = _parameters(order.request.parameters)
    message.allocation = [
        own_messages().Allocation(role=role, resources=list(resources))
        for role, resources in _roles(order.request).items()
    ]
    message.preempts = [str(goal) for goal in order.preempts]
    return message


def adjust_command(order: Order, parameters: Mapping[str, ResolvedValue], now_us: int) -> Any:
    """Return an ADJUST.

    Raises:
        WireError: a parameter cannot be encoded.
    """
    message = behavior_command(Verb.ADJUST, order, now_us)
    message.parameters = _parameters(parameters)
    return message


def behavior_command(verb: int, order: Order, now_us: int, epoch: int = 0) -> Any:
    """Return a CANCEL or QUERY. `epoch` is that of the sending executive, if known. An order from
    before a restart has the epoch of its START."""
    epoch = max(epoch, order.request.epoch)
    return _message(verb, now_us, id=str(order.goal), run=str(order.run), epoch=epoch)


def goal_command(verb: int, goal: UUID, now_us: int) -> Any:
    """Return a CANCEL or QUERY of a goal whose order is not known."""
    return _message(verb, now_us, id=str(goal))


def vehicle_command(verb: int, run: UUID | None, epoch: int, now_us: int) -> Any:
    """Return a HOLD, RESUME or CLAIM of the executive that drives a run with this epoch; `run`:
    None: the vehicle has no behavior of a run."""
    return _message(verb, now_us, run="" if run is None else str(run), epoch=epoch)


def _roles(request: BehaviorRequest) -> Mapping[str, tuple[str, ...]]:
    """Return the resources by role. Without roles, all have the role ""."""
    return {role: tuple(resources) for role, resources in request.roles.items()} or {
        "": tuple(request.resources)
    }


def _parameters(parameters: Mapping[str, ResolvedValue]) -> list[Any]:
    key_value = own_messages().KeyValue
    return [key_value(key=key, value=value) for key, value in encode_parameters(parameters)]


def _message(verb: int, now_us: int, **fields: Any) -> Any:
    message = own_messages().BehaviorCommand(verb=verb, **fields)
    set_stamp(message.stamp, now_us)
    return message


REFUSAL_CODE = "STALE_EPOCH"


@dataclass(frozen=True, slots=True)
class Refusal:
    """A command of a run with a past epoch. `newest`: the epoch that was seen of the run."""

    run: str
    newest: int
    reason: str


def past_reason(epoch: int, newest: int) -> str:
    """Return why a command of a past epoch is refused."""
    return f"epoch {epoch} is past: another executive drives the run with epoch {newest}"


def read_refusal(message: Any) -> Refusal:
    """Read a message. Refusals for other reasons than an epoch have a `newest` of 0."""
    return Refusal(
        message.run, message.newest if message.code == REFUSAL_CODE else 0, message.reason
    )


def write_refusal(command: Command, newest: int) -> Any:
    """Return a message without a stamp."""
    return own_messages().CommandRefusal(
        verb=int(command.verb),
        id=command.id,
        run=command.run,
        epoch=command.epoch,
        newest=newest,
        code=REFUSAL_CODE,
        reason=past_reason(command.epoch, newest),
    )
