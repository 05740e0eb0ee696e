"""How often an activity is performed (BPMN 2.0.2, clauses 10.3.8, 13.3.6 and 13.3.7)."""

from dataclasses import dataclass
from enum import StrEnum

from m2pem.mission.events import EventDefinition
from m2pem.mission.expression import Expression

LOOP_COUNTER = "loopCounter"
"""The name under which each instance, or round, reads its number, from 0 (tables 10.28, 10.31)."""

INSTANCE_COUNTS = (
    "numberOfInstances",
    "numberOfActiveInstances",
    "numberOfCompletedInstances",
    "numberOfTerminatedInstances",
)
"""The names under which a multi-instance activity reads how far it is (table 10.31)."""


@dataclass(frozen=True, slots=True)
class StandardLoop:
    """Repeats while `condition` is true (table 10.28); None is true.

    `test_before`: asks before the first round too. `maximum`: rounds at most; None: no bound.
    """

    condition: Expression | None
    test_before: bool = False
    maximum: int | None = None


class InstanceBehavior(StrEnum):
    """Which completions of instances throw an event (table 10.29, `behavior`)."""

    NONE = "None"
    ONE = "One"
    ALL = "All"
    COMPLEX = "Complex"


@dataclass(frozen=True, slots=True)
class ComplexBehavior:
    """Throws `events` at each completion at which `condition` is true (table 10.30)."""

    condition: Expression
    events: tuple[EventDefinition, ...]


@dataclass(frozen=True, slots=True)
class MultiInstance:
    """Performs an activity for a number of instances (table 10.29).

    How many: `cardinality`, or one for each item of `collection`; `item` is the key under which an
    instance reads its own, "" for none. What each instance gives is collected, in the order of the
    instances, into the list `output_collection`, "" for none: the value of `output`, or, without
    it, what the instance wrote under the key `output_item`, which is its own.

    `completion` is asked whenever an instance completes; true cancels those that are left.
    `behavior`: NONE throws `events` at each completion, ONE at the first, COMPLEX as `complex`
    says, ALL never. What is thrown is caught by boundary events of the activity, and outwards.
    """

    sequential: bool
    cardinality: Expression | None = None
    collection: Expression | None = None
    item: str = ""
    output_collection: str = ""
    output_item: str = ""
    output: Expression | None = None
    completion: Expression | None = None
    behavior: InstanceBehavior = InstanceBehavior.ALL
    events: tuple[EventDefinition, ...] = ()
    complex: tuple[ComplexBehavior, ...] = ()
