"""The truth of a condition of which only some names are known.

Strong three-valued logic (Kleene): what the unknown names cannot change is true or false.
"""

from collections.abc import Callable

from m2pem.mission.expression.evaluate import evaluate
from m2pem.mission.expression.expression import Expression
from m2pem.mission.expression.operators import begin_work, truth
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
    return _truth(expression.tree, known, read)


def first_false(expression: Expression, known: IsKnown, read: ReadValue) -> frozenset[str]:
    """Return the names of the first part of a false conjunction that makes it false."""
    begin_work()
    tree = expression.tree
    for part in tree.operands if isinstance(tree, And) else (tree,):
        if _truth(part, known, read) is False:
            return names(part)
    return names(tree)


def _truth(node: Node, known: IsKnown, read: ReadValue) -> bool | None:
    match node:
        case And(operands=operands):
            return _all(operands, known, read)
        case Or(operands=operands):
            negated = _all(tuple(Not(each) for each in operands), known, read)
            return None if negated is None else not negated
        case Not(operand=operand):
            inner = _truth(operand, known, read)
            return None if inner is None else not inner
        case If():
            chosen = _truth(node.condition, known, read)
            if chosen is not None:
                return _truth(node.then if chosen else node.otherwise, known, read)
            first = _truth(node.then, known, read)
            return first if first is _truth(node.otherwise, known, read) else None
    if all(map(known, names(node))):
        return truth(evaluate(node, read), "a condition")
    return None


def _all(operands: tuple[Node, ...], known: IsKnown, read: ReadValue) -> bool | None:
    found = [_truth(each, known, read) for each in operands]
    if False in found:
        return False
    return None if None in found else True
