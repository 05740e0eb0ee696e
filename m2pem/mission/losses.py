"""Losses: the ends of a behavior by which its vehicle or payload cannot do the rest of its work.

A role with `onLoss="reassign"` lets another one do the rest (docs/allocation.md).
"""

from dataclasses import dataclass

from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorState

LINK_LOST = "LINK_LOST"
BATTERY_LOW = "BATTERY_LOW"
TAKEN_OVER = "TAKEN_OVER"
PREEMPTED = "PREEMPTED"
FAILED = "FAILED"
REJECTED = "REJECTED"
INCOMPLETE = "INCOMPLETE"
UNAVAILABLE = "RESOURCE_UNAVAILABLE"

_STATES = frozenset({BehaviorState.LOST, BehaviorState.REJECTED})


@dataclass(frozen=True, slots=True)
class Loss:
    """Why a task lost a resource: the error `code` and the reason, for people."""

    code: str
    reason: str


def is_loss(kind: BehaviorType, state: BehaviorState | None, code: str) -> bool:
    """Whether an end of a behavior is a loss of what did it. `state`: as reported; None: a fault
    ended it. Only of a payload it is known that a failure is its own: a route may be blocked for
    all vehicles."""
    if code == FAILED and kind is BehaviorType.PAYLOAD:
        return True
    return state in _STATES or code in (LINK_LOST, BATTERY_LOW, TAKEN_OVER, PREEMPTED)


def is_excluded(code: str) -> bool:
    """Whether a task does not get what it lost again. Of what is only not free now, the fleet's
    availability says when it is."""
    return code not in (UNAVAILABLE, PREEMPTED)


def may_return(code: str) -> bool:
    """Whether what was lost may do the rest later: one that failed or refused it will not."""
    return code in (LINK_LOST, BATTERY_LOW, TAKEN_OVER, PREEMPTED, UNAVAILABLE)
