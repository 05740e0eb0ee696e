"""The expression language of conditions, parameters and assignments (docs/conditions.md).

`parse` reads one of three dialects (bare, Camunda 7 `${...}`, FEEL) to one syntax tree, which is
walked to evaluate it. There is no way out of it: no attribute access on objects, no calls but the
listed functions, bounded length, depth and number size.
"""

from m2pem.mission.expression.dialect import Dialect
from m2pem.mission.expression.expression import (
    EXPRESSION_RULES,
    Expression,
    literal,
    parse,
    template,
)

__all__ = ["EXPRESSION_RULES", "Dialect", "Expression", "literal", "parse", "template"]
