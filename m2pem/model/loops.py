"""How often an activity is performed (BPMN 2.0.2, clauses 10.3.8 and 13.3.6)."""

from dataclasses import dataclass
from enum import StrEnum

from m2pem.model.events import EventDefinition
from m2pem.model.expression import Expression


@dataclass(frozen=True, slots=True)
class StandardLoop:
    """Repeats while `condition` is true (table 10.28); None is true.

    `test_before`: asks before each round, not after it. `maximum`: rounds at most; None: no bound.
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
    """Throws `event` at each completion at which `condition` is true (table 10.30)."""

    condition: Expression
    event: EventDefinition


@dataclass(frozen=True, slots=True)
class MultiInstance:
    """Performs an activity for a number of instances (table 10.29).

    How many: `cardinality`, or one for each item of `collection`; `item` is the key under which an
    instance reads its own, "" for none. `output_item` of each instance is collected, in the order
    of the instances, into the list `output_collection`; "" for none.

    `completion` is asked whenever an instance completes; true cancels those that are left.
    `behavior`: NONE throws `event` at each completion, ONE at the first, COMPLEX as `complex`
    says, ALL never. What is thrown is caught by boundary events of the activity.
    """

    sequential: bool
    cardinality: Expression | None = None
    collection: Expression | None = None
    item: str = ""
    output_collection: str = ""
    output_item: str = ""
    completion: Expression | None = None
    behavior: InstanceBehavior = InstanceBehavior.ALL
    event: EventDefinition | None = None
    complex: tuple[ComplexBehavior, ...] = ()
