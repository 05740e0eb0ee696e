"""m2pem_interfaces/msg/BehaviorStatus, read and written."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from m2pem.api import BehaviorState, Value
from m2pem_plugin_ros.interfaces import own_messages
from m2pem_plugin_ros.interfaces.key_values import WireError, decode_outputs, encode_outputs

STATES: Mapping[int, BehaviorState] = {
    1: BehaviorState.ACCEPTED,
    2: BehaviorState.RUNNING,
    3: BehaviorState.SUCCEEDED,
    4: BehaviorState.FAILED,
    5: BehaviorState.CANCELLED,
    6: BehaviorState.REJECTED,
    7: BehaviorState.LOST,
    8: BehaviorState.UNKNOWN,
}
"""By the constants of BehaviorStatus.msg."""

CONSTANTS: Mapping[BehaviorState, int] = {state: number for number, state in STATES.items()}

ENDS = frozenset(state for state in STATES.values() if state.terminal) - {BehaviorState.UNKNOWN}
"""The states that end a behavior."""

LONGEST_CODE = 64
LONGEST_REASON = 2000
"""Longer texts of a vehicle are cut, as they go into journals."""


@dataclass(frozen=True, slots=True)
class Status:
    """The status of a behavior. `number` rises with each change, from 1; UNKNOWN has 0. `outputs`
    of a behavior that has ended go to the mission's data store. `remaining` of one that is RUNNING:
    the parameters by which another vehicle would do what is left; None: not said."""

    id: str
    number: int
    state: BehaviorState
    code: str = ""
    reason: str = ""
    native_ref: str = ""
    outputs: Mapping[str, Value] = field(default_factory=dict)
    remaining: Mapping[str, Value] | None = None


def read_status(message: Any) -> Status:
    """Read a message. The end of a behavior counts also if one of its outputs is invalid: `reason`
    says so.

    Raises:
        WireError: it breaks the rules of BehaviorStatus.msg; the text says which.
    """
    if not message.id:
        raise WireError("a status without an id")
    state = STATES.get(message.state)
    if state is None:
        raise WireError(f"a status of {message.id} with the unknown state {message.state}")
    if (state is BehaviorState.UNKNOWN) != (message.number == 0):
        raise WireError(f"a status of {message.id} with state {state} and number {message.number}")
    outputs, wrong = decode_outputs((pair.key, pair.value) for pair in message.outputs)
    reason = "; ".join(each for each in (message.reason, *wrong) if each)
    return Status(
        message.id,
        message.number,
        state,
        message.code[:LONGEST_CODE],
        reason[:LONGEST_REASON],
        message.native_ref,
        outputs if state in ENDS else {},
        outputs if state is BehaviorState.RUNNING and outputs and not wrong else None,
    )


def write_status(status: Status) -> Any:
    """Return a message without a stamp."""
    messages = own_messages()
    pairs = encode_outputs(status.outputs if status.remaining is None else status.remaining)
    return messages.BehaviorStatus(
        id=status.id,
        number=status.number,
        state=CONSTANTS[status.state],
        code=status.code,
        reason=status.reason,
        native_ref=status.native_ref,
        outputs=[messages.KeyValue(key=key, value=value) for key, value in pairs],
    )
