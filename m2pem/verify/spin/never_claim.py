"""Never claims: a formula in PROMELA, and the bits of each moment that it reads.

`is_N` and `now_N`: a proposition of states, or of transitions, is true. What a transition completes
is true in a moment of its own; a quiet moment follows, in which the `now_N` are cleared. `past_N`,
`count_N` and `held_N`: the memory of operators of the past. All are set with the state itself, so
they distinguish no states but those that the formula must distinguish.
"""

from collections.abc import Callable, Sequence
from itertools import product

from m2pem.verify.ltl import formula as f
from m2pem.verify.ltl.lasso import holds
from m2pem.verify.net.encoding import Encoding
from m2pem.verify.requirements.propositions import Labels

_COUNTED = {True: "byte", False: "int"}
_BYTE = 250


class NeverClaim:
    """A formula without `Next`, and the bits that it needs.

    Raises:
        UnknownDataError: the net does not follow the data that the formula reads.
    """

    def __init__(self, formula: f.Formula, labels: Labels, encoding: Encoding) -> None:
        self.formula = formula
        self._labels = labels
        self._encoding = encoding
        self._true_in = labels.of_states(encoding)
        self._names: dict[f.Formula, str] = {}
        self._transitions: dict[int, list[str]] = {}
        for number, each in enumerate(labels.propositions):
            completed = isinstance(each, f.Completed)
            self._names[each] = f"now_{number}" if completed else f"is_{number}"
            if completed:
                for transition, bits in enumerate(labels.of_transitions):
                    if bits >> number & 1:
                        self._transitions.setdefault(transition, []).append(self._names[each])
        self._past: list[f.Formula] = []
        self._find_past(formula)
        for number, past in enumerate(self._past):
            word = "count" if isinstance(past, f.Count) else "past"
            self._names[past] = f"{word}_{number}"

    def _find_past(self, formula: f.Formula) -> None:
        """Operators inside others come first."""
        for each in f.children(formula):
            self._find_past(each)
        if isinstance(formula, f.PAST) and formula not in self._past:
            self._past.append(formula)

    # --- for the model --------------------------------------------------------------------------

    @property
    def size_bytes(self) -> int:
        """An upper bound of what it adds to a state."""
        return 4 * len(self._names) + sum(len(f.children(each)) for each in self._past)

    @property
    def needs_quiet(self) -> bool:
        """Whether propositions of transitions need a quiet moment."""
        return bool(self._transitions)

    def declarations(self, places: Sequence[str], variables: Sequence[str]) -> list[str]:
        """The bits with their initial values, and what each moment does to them."""
        lines: list[str] = []
        first = self._true_in(self._encoding.initial)
        moment = [p for n, p in enumerate(self._labels.propositions) if first >> n & 1]

        def at_first(formula: f.Formula) -> bool:
            return holds(formula, [frozenset(moment)], [frozenset(moment)])

        does: list[str] = []
        for number, each in enumerate(self._labels.propositions):
            lines.append(f"bit {self._names[each]} = {int(bool(first >> number & 1))};")
            if not isinstance(each, f.Completed):
                does.append(f"{self._names[each]} = {self._truth(number, places, variables)}")
        for past in self._past:
            self._remember(past, at_first, lines, does)
        body = "; ".join(does) or "skip"
        return [*lines, f"inline moment() {{ {body} }}", ""]

    def _remember(
        self,
        past: f.Formula,
        at_first: Callable[[f.Formula], bool],
        lines: list[str],
        does: list[str],
    ) -> None:
        name = self._names[past]
        if not isinstance(past, f.Count):
            lines.append(f"bit {name} = {int(at_first(past))};")
            match past:
                case f.Once(operand):
                    does.append(f"{name} = {name} || {self.text(operand)}")
                case f.Historically(operand):
                    does.append(f"{name} = {name} && {self.text(operand)}")
                case f.Since(left, right):
                    does.append(f"{name} = {self.text(right)} || ({name} && {self.text(left)})")
            return
        most = past.number + 1  # more makes no difference
        begun = sum(at_first(each) for each in past.operands)
        lines.append(f"{_COUNTED[most < _BYTE]} {name} = {min(begun, most)};")
        for at, operand in enumerate(past.operands):
            held = f"held_{name}_{at}"
            now = self.text(operand)
            lines.append(f"bit {held} = {int(at_first(operand))};")
            does.append(f"if :: {now} && !{held} && {name} < {most} -> {name}++ :: else fi")
            does.append(f"{held} = {now}")

    def _truth(self, number: int, places: Sequence[str], variables: Sequence[str]) -> str:
        """Return the expression of a proposition about states."""
        if not isinstance(self._labels.propositions[number], f.Data):
            names = [places[p] for p in sorted(self._labels.places_of(number))]
            return "(" + (" || ".join(f"{name} > 0" for name in names) or "false") + ")"
        asked = sorted(self._labels.variables_of(number))
        net, encoding = self._encoding.net, self._encoding
        true: list[str] = []
        for values in product(*(range(len(net.variables[v].values)) for v in asked)):
            state = encoding.initial
            for variable, value in zip(asked, values, strict=True):
                base = encoding.value_bit[variable]
                state &= ~(((1 << len(net.variables[variable].values)) - 1) << base)
                state |= 1 << (base + value)
            if self._true_in(state) >> number & 1:
                has = [f"{variables[v]} == {n}" for v, n in zip(asked, values, strict=True)]
                true.append("(" + (" && ".join(has) or "true") + ")")
        return "(" + (" || ".join(true) or "false") + ")"

    def after_transition(self, transition: int) -> list[str]:
        """Return the assignments of bits after a transition."""
        return [*(f"{name} = 1" for name in self._transitions.get(transition, ())), "moment()"]

    def quiet_line(self) -> str:
        """The quiet moment, as one more transition."""
        names = sorted({name for each in self._transitions.values() for name in each})
        gone = "; ".join(f"{name} = 0" for name in names)
        return f":: {' || '.join(names)} -> d_step {{ {gone}; moment() }} /* a quiet moment */"

    def claim(self) -> str:
        """The formula, for Spin to prove."""
        return f"ltl required {{ {self.text(self.formula)} }}"

    def text(self, formula: f.Formula) -> str:
        """A formula in Spin's syntax."""
        if isinstance(formula, f.Count):
            return f"({self._names[formula]} {formula.operator} {formula.number})"
        if isinstance(formula, f.PROPOSITIONS) or formula in self._names:
            return self._names[formula]
        inside = [self.text(each) for each in f.children(formula)]
        match formula:
            case f.Constant():
                return "true" if formula.value else "false"
            case f.Not():
                return f"(!{inside[0]})"
            case f.And():
                return f"({' && '.join(inside)})"
            case f.Or():
                return f"({' || '.join(inside)})"
            case f.Implies():
                return f"(!{inside[0]} || {inside[1]})"
            case f.Iff():
                return f"(({inside[0]} && {inside[1]}) || (!{inside[0]} && !{inside[1]}))"
            case f.Always() | f.Eventually():
                return f"({f.PREFIXES[type(formula)]} {inside[0]})"
            case f.Until():
                return f"({inside[0]} {f.OPERATORS[f.Until]} {inside[1]})"
            case f.WeakUntil():
                return f"({inside[1]} V ({inside[0]} || {inside[1]}))"
            case _:
                raise TypeError(f"Spin cannot be asked {formula}")
