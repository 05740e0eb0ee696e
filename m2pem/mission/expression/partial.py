"""The truth of a condition of which only some names are known.

Strong three-valued logic (Kleene): what the unknown names cannot change is true or false.
"""

from collections.abc import Callable

from m2pem.mission.expression.evaluate import evaluate
from m2pem.mission.expression.expression import Expression
from m2pem.mission.expression.operators import begin_work
from m2pem.mission.expression.rules import Rules
from m2pem.mission.expression.tree import And, If, Node, Not, Or, names
from m2pem.mission.values import ReadValue

IsKnown = Callable[[str], bool]
"""Whether the value of a name is known."""


def possible_truth(expression: Expression, known: IsKnown, read: ReadValue) -> bool | None:
    """Return whether a condition holds; None: it depends on names that are not known.

    Raises:
        ExpressionError: a part that is known has a wrong type.
    """
    begin_work()
    return _truth(expression.tree, known, read, expression.rules)


def first_false(expression: Expression, known: IsKnown, read: ReadValue) -> frozenset[str]:
    """Return the names of the first part of a false conjunction that makes it false."""
    begin_work()
    tree, rules = expression.tree, expression.rules
    for part in tree.operands if isinstance(tree, And) else (tree,):
        if _truth(part, known, read, rules) is False:
            return names(part)
    return names(tree)


def _truth(node: Node, known: IsKnown, read: ReadValue, rules: Rules) -> bool | None:
    if all(map(known, names(node))):
        return rules.truth(evaluate(node, read, rules), "a condition")
    match node:
        case And(operands=operands) | Or(operands=operands):
            decisive = isinstance(node, Or)
            found = [_truth(each, known, read, rules) for each in operands]
            return decisive if decisive in found else None if None in found else not decisive
        case Not(operand=operand):
            inner = _truth(operand, known, read, rules)
            return None if inner is None else not inner
        case If():
            chosen = _truth(node.condition, known, read, rules)
            if chosen is not None:
                return _truth(node.then if chosen else node.otherwise, known, read, rules)
            first = _truth(node.then, known, read, rules)
            return first if first is _truth(node.otherwise, known, read, rules) else None
    return None
