"""Whether a formula holds of a run that ends in a cycle, evaluated directly by its semantics.

It uses no automaton, so answers found with one are checked against it.
"""

from collections.abc import Sequence

from m2pem.verify.ltl.formula import (
    Always,
    And,
    Constant,
    Count,
    Eventually,
    Formula,
    Historically,
    Iff,
    Implies,
    Next,
    Not,
    Once,
    Or,
    Proposition,
    Since,
    Until,
    WeakUntil,
    walk,
)

Moment = frozenset[Proposition]
"""What is true in a moment."""


def holds(formula: Formula, prefix: Sequence[Moment], cycle: Sequence[Moment]) -> bool:
    """Whether a formula holds of `prefix` and then `cycle` for ever; the cycle is not empty."""
    # After as many rounds, nothing that is said of the past or counted changes from round to round.
    rounds = 1
    for each in walk(formula):
        if isinstance(each, (Once, Historically, Since)):
            rounds += 1
        elif isinstance(each, Count):
            rounds += each.number + 2
    return _Lasso([*prefix, *(list(cycle) * rounds)], list(cycle)).of(formula)[0]


class _Lasso:
    def __init__(self, prefix: list[Moment], cycle: list[Moment]) -> None:
        self.moments = prefix + cycle
        self.back_to = len(prefix)
        self.known: dict[Formula, list[bool]] = {}

    def of(self, formula: Formula) -> list[bool]:
        """For each moment, whether the formula holds there."""
        known = self.known.get(formula)
        if known is None:
            known = self.known[formula] = self._of(formula)
        return known

    def _of(self, formula: Formula) -> list[bool]:
        size = len(self.moments)
        match formula:
            case Constant():
                return [formula.value] * size
            case Not():
                return [not each for each in self.of(formula.operand)]
            case And():
                return [all(each) for each in zip(*map(self.of, formula.operands), strict=True)]
            case Or():
                return [any(each) for each in zip(*map(self.of, formula.operands), strict=True)]
            case Implies(left, right):
                return [not a or b for a, b in zip(self.of(left), self.of(right), strict=True)]
            case Iff(left, right):
                return [a == b for a, b in zip(self.of(left), self.of(right), strict=True)]
            case Next():
                inner = self.of(formula.operand)
                return [*inner[1:], inner[self.back_to]]
            case Eventually():
                return self._until([True] * size, self.of(formula.operand), False)
            case Always():
                return self._until(self.of(formula.operand), [False] * size, True)
            case Until(left, right):
                return self._until(self.of(left), self.of(right), False)
            case WeakUntil(left, right):
                return self._until(self.of(left), self.of(right), True)
            case Once() | Historically() | Since() | Count():
                return self._past(formula)
            case _:
                return [formula in moment for moment in self.moments]

    def _until(self, left: list[bool], right: list[bool], for_ever: bool) -> list[bool]:
        later = for_ever
        result = [False] * len(left)
        for _ in range(2):  # the second time round knows what comes after the end
            for at in reversed(range(len(left))):
                later = right[at] or (left[at] and later)
                result[at] = later
            later = result[self.back_to]
        return result

    def _past(self, formula: Once | Historically | Since | Count) -> list[bool]:
        if isinstance(formula, Count):
            return self._count(formula)
        if isinstance(formula, Since):
            left, right = self.of(formula.left), self.of(formula.right)
        elif isinstance(formula, Once):
            right = self.of(formula.operand)
            left = [True] * len(right)
        else:
            operand = self.of(formula.operand)
            return [all(operand[: at + 1]) for at in range(len(operand))]
        result: list[bool] = []
        for a, b in zip(left, right, strict=True):
            result.append(b or (a and bool(result) and result[-1]))
        return result

    def _count(self, formula: Count) -> list[bool]:
        operands = [self.of(each) for each in formula.operands]
        total, result = 0, []
        for at in range(len(self.moments)):
            total += sum(each[at] and not (at and each[at - 1]) for each in operands)
            n = formula.number
            result.append(
                {
                    ">=": total >= n,
                    "<=": total <= n,
                    ">": total > n,
                    "<": total < n,
                    "==": total == n,
                    "!=": total != n,
                }[formula.operator]
            )
        return result
