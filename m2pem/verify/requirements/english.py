"""Formulas in plain English."""

from collections import Counter
from collections.abc import Mapping, Sequence

from m2pem.verify.ltl.formula import (
    Active,
    Always,
    And,
    Commanded,
    Completed,
    Constant,
    Count,
    Data,
    Ended,
    Eventually,
    Formula,
    Historically,
    Iff,
    Implies,
    Measured,
    Next,
    Not,
    Once,
    Or,
    Since,
    Timed,
    Until,
    WeakUntil,
    show_measured,
    show_us,
)

_ENDS = {
    "": "the mission is over",
    "completed": "the mission has ended as completed",
    "terminated": "the mission was ended by a terminate end event",
    "failed": "the mission has failed",
}
_BOUNDS = {
    ">=": "at least {} times",
    ">": "more than {} times",
    "<=": "at most {} times",
    "<": "fewer than {} times",
    "==": "exactly {} times",
    "!=": "not exactly {} times",
}

_STARTS = frozenset(
    {
        *("after", "again", "always", "at", "before", "each", "exactly", "fewer"),
        *("between", "for", "from", "if", "in", "more", "never", "not", "nothing", "of"),
        *("on", "once", "the", "until", "whatever", "whenever", "within"),
    }
)
"""First words of sentences that get a capital letter; names of vehicles and data do not."""


class English:
    """Writes formulas in English; `names` are the names of elements, by id."""

    def __init__(self, names: Mapping[str, str]) -> None:
        self._names = names
        counts = Counter(names.values())
        self._shared = {name for name, count in counts.items() if count > 1}

    def sentence(self, formula: Formula) -> str:
        """The whole formula as a sentence."""
        return sentence(self.of(formula))

    def element(self, element: str) -> str:
        """The name of an element."""
        name = self._names.get(element) or element
        return f"'{name}' ({element})" if name in self._shared else f"'{name}'"

    def each(self, formulas: Sequence[Formula], word: str = "and") -> str:
        """Several clauses, one after the other."""
        said = [self._inside(each) for each in formulas]
        if word == "then" or len(said) == 1:
            return ", then ".join(said)
        return f"{', '.join(said[:-1])} {word} {said[-1]}"

    def of(self, formula: Formula) -> str:
        """A formula as a clause."""
        match formula:
            case Active() | Completed() | Commanded() | Ended() | Data():
                return self._proposition(formula, "is")
            case Measured():
                return show_measured(formula)
            case Timed(operand):
                return self._timed(formula, operand)
            case Constant():
                return "whatever happens" if formula.value else "nothing may happen"
            case Not(operand):
                return self._negated(operand)
            case And(operands):
                return self.each(operands)
            case Or(operands):
                return self.each(operands, "or")
            case Implies(left, right):
                return f"if {self._inside(left)}, then {self.of(right)}"
            case Iff(left, right):
                return f"{self._inside(left)} if and only if {self._inside(right)}"
            case Always(Implies(left, right)):
                return f"whenever {self._inside(left)}, {self._then(right)}"
            case Always(Not(operand)):
                return f"never {self._inside(operand)}"
            case Always(Eventually(operand)):
                return f"again and again {self._inside(operand)}"
            case Always(operand):
                return f"always {self._inside(operand)}"
            case Eventually(Always(operand)):
                return f"from some point on, always {self._inside(operand)}"
            case Eventually(operand):
                return f"at some point {self._inside(operand)}"
            case _:
                return self._of_two(formula)

    def _of_two(self, formula: Formula) -> str:
        match formula:
            case Until(left, right):
                return f"{self._inside(left)} until {self._inside(right)}, which comes"
            case WeakUntil(Not(left), right):
                return f"never {self._inside(left)} before {self._inside(right)}"
            case WeakUntil(left, right):
                return f"{self._inside(left)} until {self._inside(right)}, if that comes"
            case Next(operand):
                return f"in the next step {self._inside(operand)}"
            case Once(operand):
                return f"at some time before (or now) {self._inside(operand)}"
            case Historically(operand):
                return f"until now always {self._inside(operand)}"
            case Since(left, right):
                return f"{self._inside(left)} ever since {self._inside(right)}"
            case Count(operands, operator, number):
                times = _BOUNDS[operator].format(number).replace(" 1 times", " once")
                return f"{times} so far {self.each(operands, 'or')}"
            case _:
                raise TypeError(f"no formula: {formula}")

    def _timed(self, formula: Timed, operand: Formula) -> str:
        high = show_us(formula.high_us)
        if formula.low_us:
            when = f"between {show_us(formula.low_us)} and {high} from then"
        else:
            when = f"for {high}" if isinstance(operand, Always) else f"within {high}"
        match operand:
            case Always(inner) if formula.low_us:
                return f"{when} always {self._inside(inner)}"
            case Always(inner) | Eventually(inner):
                return f"{when} {self._inside(inner)}"
            case Until(left, right):
                return f"{self._inside(left)} until {self._inside(right)}, which comes {when}"
            case _:
                raise TypeError(f"no operator with bounds: {operand}")

    def _then(self, formula: Formula) -> str:
        if isinstance(formula, Eventually):
            return f"then or later {self._inside(formula.operand)}"
        return self.of(formula)

    def _inside(self, formula: Formula) -> str:
        simple = isinstance(
            formula, (Active, Completed, Commanded, Ended, Data, Constant, Once, Measured)
        )
        if simple or (isinstance(formula, Not) and not isinstance(formula.operand, (And, Or))):
            return self.of(formula)
        return f"({self.of(formula)})"

    def _negated(self, formula: Formula) -> str:
        if isinstance(formula, (Active, Completed, Commanded, Ended, Data)):
            return self._proposition(formula, "is not")
        return f"not {self._inside(formula)}"

    def _proposition(self, each: Active | Completed | Commanded | Ended | Data, is_: str) -> str:
        match each:
            case Active():
                return f"{self.element(each.element)} {is_} active"
            case Completed():
                return f"{self.element(each.element)} {is_} completed"
            case Commanded(resource, behavior):
                return f"{resource} {is_} " + (f"doing {behavior}" if behavior else "commanded")
            case Ended(outcome):
                said = _ENDS[outcome]
                return said if is_ == "is" else f"not ({said})"
            case Data():
                text = each.expression.text.strip()
                return text if is_ == "is" else f"not ({text})"


def measured_subject(condition: Measured) -> str:
    """What a condition on telemetry compares: "uav1's battery"."""
    first, *others = condition.resources
    if others:
        return f"the {condition.quantity} of {first} and {others[0]}"
    return f"{first}'s {condition.quantity}"


def sentence(clause: str) -> str:
    """A clause as a sentence."""
    if clause.startswith("(") and clause.endswith(")") and clause.count("(") == 1:
        clause = clause[1:-1]
    begins = clause.partition(" ")[0] in _STARTS
    return f"{clause[:1].upper() if begins else clause[:1]}{clause[1:]}."
