"""What operators do with values in each language: `RULES` has them by dialect.

The bare dialect and FEEL compare and compute values of one kind; JUEL and XPath coerce them first.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from m2pem.mission.expression import feel_arithmetic, feel_values, juel, xpath
from m2pem.mission.expression.dialect import Dialect
from m2pem.mission.expression.operators import ARITHMETIC, COMPARISONS, Binary, negate, truth
from m2pem.mission.expression.temporal import Computed
from m2pem.mission.expression.tree import Comparison, Operation
from m2pem.mission.values import Value


@dataclass(frozen=True, slots=True)
class Rules:
    """`truth`: of a value, which is named in its error. `result`: what data holds of a value.
    `ternary`: FEEL's logic of three values, in which what is wrong is null."""

    truth: Callable[[Computed, str], bool]
    compare: Mapping[Comparison, Callable[[Computed, Computed], bool | None]]
    arithmetic: Mapping[Operation, Binary]
    negate: Callable[[Computed], Computed]
    result: Callable[[Computed], Value] | None = None
    ternary: bool = False


BARE = Rules(truth, COMPARISONS, ARITHMETIC, negate)
_JUEL = Rules(juel.truth, juel.COMPARISONS, juel.ARITHMETIC, juel.negate, juel.result)

RULES = {
    Dialect.BARE: BARE,
    Dialect.TEXT: BARE,
    Dialect.FEEL: Rules(
        truth,
        feel_values.COMPARISONS,
        feel_arithmetic.ARITHMETIC,
        feel_arithmetic.negate,
        feel_values.to_data,
        ternary=True,
    ),
    Dialect.JUEL: _JUEL,
    Dialect.TEMPLATE: _JUEL,
    Dialect.XPATH: Rules(
        xpath.truth, xpath.COMPARISONS, xpath.ARITHMETIC, xpath.negate, juel.result
    ),
}
