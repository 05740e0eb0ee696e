"""From formulas to automata, by writing each formula as what holds now and what must hold next.

A state is a formula: what the rest of the run must fulfil. `a U b` is "b, or else a and `a U b`
next", and the second choice postpones its promise; `a R b` is "b, and either a or `a R b` next".
States are made as they are reached.
"""

from dataclasses import dataclass

from m2pem.errors import M2pemError
from m2pem.verify.ltl.automaton import Automaton, Edge, reduced
from m2pem.verify.ltl.normal import FALSE, TRUE, Forms, Op

MAX_STATES = 20_000
MAX_CHOICES = 50_000


class FormulaTooLargeError(M2pemError):
    """A formula needs more states than are tried; saying it in parts helps."""

    exit_status = 2


@dataclass(frozen=True, slots=True)
class _Choice:
    """One way to fulfil a formula: bits now, formulas next, promises (untils) postponed."""

    set_: int = 0
    unset: int = 0
    next: frozenset[int] = frozenset()
    postponed: frozenset[int] = frozenset()

    def beats(self, other: "_Choice") -> bool:
        return (
            self.set_ & other.set_ == self.set_
            and self.unset & other.unset == self.unset
            and self.next <= other.next
            and self.postponed <= other.postponed
        )


_FREE = (_Choice(),)


def translate(formula: int, forms: Forms) -> Automaton:
    """The automaton of a formula in normal form.

    Raises:
        FormulaTooLargeError: it would have more than `MAX_STATES` states.
    """
    choices = _Choices(forms)
    numbers = {formula: 0}
    order = [formula]
    promises: dict[int, int] = {}
    edges: list[tuple[Edge, ...]] = []
    while len(edges) < len(order):
        made: list[Edge] = []
        for choice in choices.of(order[len(edges)]):
            target = forms.conjunction(tuple(choice.next))
            if target == FALSE:
                continue
            if target not in numbers:
                numbers[target] = len(order)
                order.append(target)
                if len(order) > MAX_STATES:
                    raise FormulaTooLargeError(
                        f"the formula needs an automaton of more than {MAX_STATES:,} states; "
                        "split it into several requirements"
                    )
            postponed = 0
            for until in choice.postponed:
                postponed |= 1 << promises.setdefault(until, len(promises))
            made.append(Edge(choice.set_, choice.unset, numbers[target], postponed))
        edges.append(tuple(made))
    return reduced(Automaton(tuple(edges), 0, len(promises)))


class _Choices:
    """How formulas can be fulfilled; each is worked out once."""

    def __init__(self, forms: Forms) -> None:
        self.forms = forms
        self.known: dict[int, tuple[_Choice, ...]] = {TRUE: _FREE, FALSE: ()}

    def of(self, formula: int) -> tuple[_Choice, ...]:
        known = self.known.get(formula)
        if known is None:
            known = self.known[formula] = self._of(formula)
        return known

    def _of(self, formula: int) -> tuple[_Choice, ...]:
        forms = self.forms
        arguments = forms.arguments(formula)
        match forms.op(formula):
            case Op.LITERAL:
                bit = 1 << arguments[0]
                return (_Choice(set_=bit),) if arguments[1] else (_Choice(unset=bit),)
            case Op.NEXT:
                return (_Choice(next=frozenset({arguments[0]})),)
            case Op.OR:
                return _best([each for part in arguments for each in self.of(part)])
            case Op.AND:
                result: tuple[_Choice, ...] = _FREE
                for part in arguments:
                    result = _both(result, self.of(part))
                return result
            case Op.UNTIL:
                later = _Choice(next=frozenset({formula}), postponed=frozenset({formula}))
                waits = _both(self.of(arguments[0]), (later,))
                return _best([*self.of(arguments[1]), *waits])
            case _:  # RELEASE
                later = _Choice(next=frozenset({formula}))
                goes_on = _best([*self.of(arguments[0]), later])
                return _both(self.of(arguments[1]), goes_on)


def _both(left: tuple[_Choice, ...], right: tuple[_Choice, ...]) -> tuple[_Choice, ...]:
    if len(left) * len(right) > MAX_CHOICES:
        raise FormulaTooLargeError(
            "the formula combines too many choices; split it into several requirements"
        )
    found = []
    for one in left:
        for two in right:
            set_, unset = one.set_ | two.set_, one.unset | two.unset
            if not set_ & unset:
                next_, postponed = one.next | two.next, one.postponed | two.postponed
                found.append(_Choice(set_, unset, next_, postponed))
    return _best(found)


def _best(choices: list[_Choice]) -> tuple[_Choice, ...]:
    """Without choices that another one makes needless."""
    kept: list[_Choice] = []
    for choice in dict.fromkeys(choices):
        if not any(other.beats(choice) for other in kept):
            kept = [other for other in kept if not choice.beats(other)]
            kept.append(choice)
    return tuple(kept)
