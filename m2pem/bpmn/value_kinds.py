"""Expressions whose kinds of values do not go together, by what is known of the names they read.

Each language has its own rule for a text beside a number (docs/conditions.md): an error, null, or
the number that the text writes. Earlier versions compared all alike.
"""

from collections.abc import Iterator
from itertools import product

from m2pem.bpmn.rules.data import MIXED_KINDS, OTHER_VALUE
from m2pem.bpmn.rules.rule import Rule
from m2pem.mission.expression import Expression
from m2pem.mission.expression.dialect import Dialect
from m2pem.mission.expression.kinds import DATA, Of, kinds
from m2pem.mission.expression.tree import Arithmetic, Compare, Comparison, Node, Operation, walk

_EQUALITY = (Comparison.EQUAL, Comparison.NOT_EQUAL)
_RULES = {
    Dialect.BARE: "is an error",
    Dialect.FEEL: "has no value",
    Dialect.JUEL: "has another value than in earlier versions: JUEL coerces them",
    Dialect.TEMPLATE: "has another value than in earlier versions: JUEL coerces them",
    Dialect.XPATH: "has another value than in earlier versions: XPath converts them",
}
_WRITE = "write number(x) or text(x), or compare what is of one kind"


def doubts(expression: Expression, of: Of) -> Iterator[tuple[Rule, str, str]]:
    """Yield the rule, what is wrong and what would be right, for an expression over data.

    `of`: what the names that it reads may be, besides null. What may be anything raises no doubt.
    """
    dialect, free = expression.dialect, expression.names
    coerced = dialect not in (Dialect.BARE, Dialect.FEEL)

    def kinds_of(node: Node) -> frozenset[str]:
        return kinds(node, coerced=coerced, of=lambda name: of(name) if name in free else DATA)

    for node, _ in walk(expression.tree):
        if not isinstance(node, Compare | Arithmetic):
            continue
        left, right = kinds_of(node.left), kinds_of(node.right)
        if not left or not right or left >= DATA or right >= DATA:
            continue
        sign = node.operator
        said = f"in '{expression.text.strip()}', '{sign}' of {_named(left)} and {_named(right)}"
        if coerced:
            if any(_differs(sign, *pair, dialect) for pair in product(left, right)):
                yield OTHER_VALUE, f"{said} {_RULES[dialect]}", _WRITE
        elif isinstance(node, Arithmetic):
            if not kinds_of(node):
                yield MIXED_KINDS, f"{said} {_RULES[dialect]}", _WRITE
        elif all(_mixed(*pair, dialect) for pair in product(left, right)):
            yield MIXED_KINDS, f"{said} {_RULES[dialect]}", _WRITE


def _mixed(left: str, right: str, dialect: Dialect) -> bool:
    """Whether a comparison of two kinds never has a value."""
    return {left, right} == {"number", "text"} if dialect is Dialect.BARE else left != right


def _differs(sign: Comparison | Operation, left: str, right: str, dialect: Dialect) -> bool:
    """Whether a language that coerces values gives another one than the rule of all before."""
    if isinstance(sign, Operation):
        return sign is Operation.ADD and left == right == "text"
    if left == right:
        return left == "text" and dialect is Dialect.XPATH and sign not in _EQUALITY
    return "text" in (left, right) and bool({left, right} & {"number", "boolean"})


def _named(found: frozenset[str]) -> str:
    return "a " + " or a ".join(sorted(found))
