"""Formulas in negation normal form, simplified; each distinct formula is stored once.

A formula is a number here, so comparing two and collecting them in sets is cheap. `lower`
translates a syntax tree into this form. Only operators of the future are left: those of the past,
and counts, have become propositions (`observer.py`), which are bits 0, 1, ... of a letter.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

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


class Op(IntEnum):
    """The operator of a formula."""

    TRUE = 0
    FALSE = 1
    LITERAL = 2
    """Arguments: the bit, and 1 if it must be set, 0 if it must not."""
    AND = 3
    OR = 4
    NEXT = 5
    UNTIL = 6
    RELEASE = 7
    """`a R b`: b holds up to and including when a does; for ever if it never does."""


@dataclass(frozen=True, slots=True)
class _Node:
    op: Op
    arguments: tuple[int, ...]


TRUE, FALSE = 0, 1


class Forms:
    """All formulas of one conversion. Its constructors simplify a formula first."""

    def __init__(self) -> None:
        self._nodes = [_Node(Op.TRUE, ()), _Node(Op.FALSE, ())]
        self._known: dict[tuple[Op, tuple[int, ...]], int] = {
            (Op.TRUE, ()): TRUE,
            (Op.FALSE, ()): FALSE,
        }

    def op(self, formula: int) -> Op:
        return self._nodes[formula].op

    def arguments(self, formula: int) -> tuple[int, ...]:
        """The operands of a formula."""
        return self._nodes[formula].arguments

    def _make(self, op: Op, *arguments: int) -> int:
        key = (op, arguments)
        known = self._known.get(key)
        if known is None:
            known = self._known[key] = len(self._nodes)
            self._nodes.append(_Node(op, arguments))
        return known

    def literal(self, bit: int, positive: bool) -> int:
        """A proposition, or its negation."""
        return self._make(Op.LITERAL, bit, int(positive))

    def next(self, formula: int) -> int:
        """The formula holds in the next moment."""
        return formula if formula in (TRUE, FALSE) else self._make(Op.NEXT, formula)

    def conjunction(self, formulas: "list[int] | tuple[int, ...]") -> int:
        parts = self._flat(Op.AND, formulas)
        if FALSE in parts or self._contradict(parts):
            return FALSE
        parts.discard(TRUE)
        for each in list(parts):
            if self.op(each) is Op.RELEASE:  # a R b has b; false R b has b for ever
                parts -= self._parts(Op.AND, self.arguments(each)[1]) - {each}
        for each in list(parts):
            if self._follows(each, parts):
                parts.discard(each)
        if FALSE in parts:
            return FALSE
        return self._joined(Op.AND, parts, TRUE)

    def disjunction(self, formulas: "list[int] | tuple[int, ...]") -> int:
        parts = self._flat(Op.OR, formulas)
        if TRUE in parts or self._contradict(parts):
            return TRUE
        parts.discard(FALSE)
        for each in list(parts):
            if self.op(each) is Op.UNTIL:  # b makes a U b true at once
                parts -= self._parts(Op.OR, self.arguments(each)[1]) - {each}
        for each in list(parts):
            if self.op(each) is Op.AND and parts & set(self.arguments(each)):
                parts.discard(each)
        eventually = [e for e in parts if self.op(e) is Op.UNTIL and self.arguments(e)[0] == TRUE]
        if len(eventually) > 1:  # <>a || <>b
            parts -= set(eventually)
            parts.add(
                self.until(TRUE, self.disjunction([self.arguments(e)[1] for e in eventually]))
            )
        return self._joined(Op.OR, parts, FALSE)

    def _follows(self, formula: int, parts: set[int]) -> bool:
        """Whether other parts of a conjunction imply a part."""
        if self.op(formula) is Op.OR:
            return bool(parts & set(self.arguments(formula)))
        if self.op(formula) is Op.UNTIL:
            return self.arguments(formula)[1] in parts or any(
                self.op(each) is Op.RELEASE and self.arguments(each) == (FALSE, formula)
                for each in parts
            )
        return False

    def _flat(self, op: Op, formulas: "list[int] | tuple[int, ...]") -> set[int]:
        parts: set[int] = set()
        for each in formulas:
            parts |= self._parts(op, each)
        return parts

    def _parts(self, op: Op, formula: int) -> set[int]:
        return set(self.arguments(formula)) if self.op(formula) is op else {formula}

    def _contradict(self, parts: set[int]) -> bool:
        bits = [self.arguments(each) for each in parts if self.op(each) is Op.LITERAL]
        return len({bit for bit, _ in bits}) < len(bits)

    def _joined(self, op: Op, parts: set[int], empty: int) -> int:
        if not parts:
            return empty
        return parts.pop() if len(parts) == 1 else self._make(op, *sorted(parts))

    def until(self, left: int, right: int) -> int:
        """`left U right`."""
        if right in (TRUE, FALSE) or left in (FALSE, right):
            return right
        op, arguments = self.op(right), self.arguments(right)
        if op is Op.UNTIL and arguments[0] == left:  # a U (a U b)
            return right
        if left == TRUE:
            if op is Op.UNTIL:  # <>(a U b)
                return self.until(TRUE, arguments[1])
            if self._repeats(right):  # <>[]<>a
                return right
            if op is Op.AND:
                lasting = [each for each in arguments if self._repeats(each)]
                if lasting:
                    rest = [each for each in arguments if each not in lasting]
                    return self.conjunction([*lasting, self.until(TRUE, self.conjunction(rest))])
        return self._make(Op.UNTIL, left, right)

    def release(self, left: int, right: int) -> int:
        """`left R right`."""
        if right in (TRUE, FALSE) or left in (TRUE, right):
            return right
        op, arguments = self.op(right), self.arguments(right)
        if op is Op.RELEASE and arguments[0] == left:
            return right
        if left == FALSE:
            if op is Op.RELEASE:  # [](a R b)
                return self.release(FALSE, arguments[1])
            if self._settles(right):  # []<>[]a
                return right
            if op is Op.OR:
                lasting = [each for each in arguments if self._settles(each)]
                if lasting:
                    rest = [each for each in arguments if each not in lasting]
                    return self.disjunction([*lasting, self.release(FALSE, self.disjunction(rest))])
        return self._make(Op.RELEASE, left, right)

    def _repeats(self, formula: int) -> bool:
        """Whether it is `[]<>a` or `<>[]a`, which hold now if they hold at any time."""
        return self._always_eventually(formula) or self._eventually_always(formula)

    _settles = _repeats

    def _always_eventually(self, formula: int) -> bool:
        if self.op(formula) is not Op.RELEASE or self.arguments(formula)[0] != FALSE:
            return False
        inner = self.arguments(formula)[1]
        return self.op(inner) is Op.UNTIL and self.arguments(inner)[0] == TRUE

    def _eventually_always(self, formula: int) -> bool:
        if self.op(formula) is not Op.UNTIL or self.arguments(formula)[0] != TRUE:
            return False
        inner = self.arguments(formula)[1]
        return self.op(inner) is Op.RELEASE and self.arguments(inner)[0] == FALSE


def lower(formula: Formula, forms: Forms, bit: Callable[[Formula], int]) -> int:
    """Return the normal form. `bit` numbers what is neither a connective nor an operator of the
    future.
    """
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
