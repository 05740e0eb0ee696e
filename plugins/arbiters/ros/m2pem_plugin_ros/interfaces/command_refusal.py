"""m2pem_interfaces/msg/CommandRefusal, written by the node on a vehicle and read by the executive.

A node that was built before there was this message refuses without it.
"""

from dataclasses import dataclass
from typing import Any

from m2pem_plugin_ros.interfaces import own_messages
from m2pem_plugin_ros.interfaces.behavior_command import Command

CODE = "STALE_EPOCH"


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
    return Refusal(message.run, message.newest if message.code == CODE else 0, message.reason)


def write_refusal(command: Command, newest: int) -> Any:
    """Return a message without a stamp."""
    return own_messages().CommandRefusal(
        verb=int(command.verb),
        id=command.id,
        run=command.run,
        epoch=command.epoch,
        newest=newest,
        code=CODE,
        reason=past_reason(command.epoch, newest),
    )
