"""What operators do with values in each language: `RULES` has them by dialect.

The bare dialect and FEEL compare and compute values of one kind; JUEL and XPath coerce them first.
"""

from collections.abc import Callable
from dataclasses import dataclass

from m2pem.mission.expression import juel, xpath
from m2pem.mission.expression.dialect import Dialect
from m2pem.mission.expression.operators import ARITHMETIC, COMPARISONS, Binary, Test, negate, truth
from m2pem.mission.expression.temporal import Computed, to_data
from m2pem.mission.expression.tree import Comparison, Operation
from m2pem.mission.values import Value


@dataclass(frozen=True, slots=True)
class Rules:
    """`truth`: of a value, which is named in its error. `result`: what data holds of a value."""

    truth: Callable[[Computed, str], bool]
    compare: dict[Comparison, Test]
    arithmetic: dict[Operation, Binary]
    negate: Callable[[Computed], Computed]
    result: Callable[[Computed], Value] | None = None


BARE = Rules(truth, COMPARISONS, ARITHMETIC, negate)
_JUEL = Rules(juel.truth, juel.COMPARISONS, juel.ARITHMETIC, juel.negate, juel.result)

RULES = {
    Dialect.BARE: BARE,
    Dialect.TEXT: BARE,
    Dialect.FEEL: Rules(truth, COMPARISONS, ARITHMETIC, negate, to_data),
    Dialect.JUEL: _JUEL,
    Dialect.TEMPLATE: _JUEL,
    Dialect.XPATH: Rules(
        xpath.truth, xpath.COMPARISONS, xpath.ARITHMETIC, xpath.negate, juel.result
    ),
}
