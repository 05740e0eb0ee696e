"""From formulas as written to their normal forms."""

from collections.abc import Callable

from m2pem.verify.ltl.formula import (
    Always,
    And,
    Constant,
    Eventually,
    Formula,
    Iff,
    Implies,
    Next,
    Not,
    Or,
    Until,
    WeakUntil,
)
from m2pem.verify.ltl.normal import FALSE, TRUE, Forms


def lower(formula: Formula, forms: Forms, bit: Callable[[Formula], int]) -> int:
    """The normal form. `bit` numbers what is no connective and no operator of the future."""
    return _Lowering(forms, bit).of(formula, True)


class _Lowering:
    def __init__(self, forms: Forms, bit: Callable[[Formula], int]) -> None:
        self.forms = forms
        self.bit = bit

    def of(self, formula: Formula, positive: bool) -> int:
        """The normal form of the formula, or of its negation."""
        forms = self.forms
        match formula:
            case Constant():
                return TRUE if formula.value == positive else FALSE
            case Not():
                return self.of(formula.operand, not positive)
            case And() | Or():
                parts = [self.of(each, positive) for each in formula.operands]
                both = isinstance(formula, And) == positive
                return forms.conjunction(parts) if both else forms.disjunction(parts)
            case Implies(left, right):
                parts = [self.of(left, not positive), self.of(right, positive)]
                return forms.disjunction(parts) if positive else forms.conjunction(parts)
            case Iff(left, right):
                same = forms.conjunction([self.of(left, True), self.of(right, positive)])
                other = forms.conjunction([self.of(left, False), self.of(right, not positive)])
                return forms.disjunction([same, other])
            case Next():
                return forms.next(self.of(formula.operand, positive))
            case Always():
                inner = self.of(formula.operand, positive)
                return forms.release(FALSE, inner) if positive else forms.until(TRUE, inner)
            case Eventually():
                inner = self.of(formula.operand, positive)
                return forms.until(TRUE, inner) if positive else forms.release(FALSE, inner)
            case Until(left, right):
                first, second = self.of(left, positive), self.of(right, positive)
                return forms.until(first, second) if positive else forms.release(first, second)
            case WeakUntil(left, right):
                first, second = self.of(left, positive), self.of(right, positive)
                if positive:  # a W b is b R (a || b)
                    return forms.release(second, forms.disjunction([first, second]))
                return forms.until(second, forms.conjunction([first, second]))
            case _:
                return forms.literal(self.bit(formula), positive)
