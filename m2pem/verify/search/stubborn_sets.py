"""Stubborn sets (Valmari): transitions that need not be tried in a state.

Another order of the same transitions leads to the same state.

They are computed for transitions of three kinds. What is tried now is one external transition, with
all internal ones that it causes (`MacroStep`), and everything that could disturb, or be disturbed
by, those. What is left out is only deferred. That keeps

- every deadlock, every transition that can ever fire, and every flag;
- every place that can get a token too many: transitions that put tokens on one place are tried in
  every order, unless the structure proves that the place never has two;
- whether the end can be reached from everywhere, and what can go on for ever.

An interruption disturbs everything in its scope. It is left out all the same where it absorbs: a
step that changes nothing but what the interruption resets, and does not affect whether the
interruption is enabled, leads with it to the same state as the interruption alone. For the same
reason, one that must be tried, because it comes of the same task as another step, does not draw in
all of its scope.

The transitions that affect a requirement are `visible`. Where anything is deferred, all that is
tried is invisible (Peled's condition). So whatever is left out is, to the requirement, a run that
is tried, with steps between that the requirement does not see. That holds for an interruption that
absorbs as well, visible or not: the step before it is invisible, and undone. It holds for
requirements that a finite run violates as for those that only an infinite one does, as nothing is
deferred for ever.

The *ignoring proviso* ensures that. A run that cycles a cycle on which a transition is always
left out never comes to that transition. So every cycle must have a state in which nothing was
deferred (`states_to_expand`). External transitions can only be deferred in a state that has no
others, and internal ones only in a state with such transitions: both kinds of state are looked at
apart. (A cycle may well have a state in which all internal transitions are tried, and defer
external ones in every other state.)
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from typing import Protocol

from m2pem.verify.ltl.automaton import components
from m2pem.verify.net.concurrency import Concurrency, is_small
from m2pem.verify.net.encoding import Encoding
from m2pem.verify.net.petri_net import Kind, PetriNet
from m2pem.verify.search.macro_steps import DeferrableArrivals, Feed, MacroStep, MacroSteps
from m2pem.verify.search.read_write_sets import ReadWriteSets, bits_of

_A_FEW = 500
"""For each so many states of a component, one more is chosen."""


def states_to_expand(
    targets: Sequence[Sequence[int]], inner: Collection[int], partly: Collection[int]
) -> set[int]:
    """Return few states in which nothing may be deferred, so that nothing is deferred for ever.

    `targets`: by state, its successors. `inner`: states with internal transitions or joins.
    `partly`: states in which something was deferred. Empty: the proviso holds.
    """
    inside = {state for state in partly if state in inner}
    outside = {state for state in partly if state not in inner}
    return _breaking(targets, outside | set(inner), outside) | _breaking(targets, inside, inside)


def _breaking(
    targets: Sequence[Sequence[int]], states: Collection[int], partly: Collection[int]
) -> set[int]:
    """Choose states of `partly` such that each cycle within `states` that has one of `partly` has a
    chosen one.
    """
    found: set[int] = set()
    waiting = [sorted(states)] if partly else []
    while waiting:
        for part in _circles(targets, waiting.pop()):
            first = [state for state in part if state in partly][: 1 + len(part) // _A_FEW]
            if first:
                found.update(first)
                waiting.append([state for state in part if state not in found])
    return found


def _circles(targets: Sequence[Sequence[int]], states: list[int]) -> Iterator[list[int]]:
    """The strongly connected components of some states, without states on no cycle."""
    place = {state: at for at, state in enumerate(states)}
    among = [[place[each] for each in targets[state] if each in place] for state in states]
    parts: dict[int, list[int]] = {}
    for at, number in enumerate(components(among)):
        parts.setdefault(number, []).append(at)
    for part in parts.values():
        if len(part) > 1 or part[0] in among[part[0]]:
            yield [states[at] for at in part]


Choose = Callable[[int, Sequence[int]], Sequence[int]]
"""Chooses, of the transitions enabled in a state, those to try."""

_MOST_SEEDS = 12
"""Most transitions that are tried as the seed of a set."""


class Reduction(Protocol):
    """Chooses, in each state, which of the enabled transitions are tried."""

    def bind(self, encoding: Encoding) -> Choose:
        """Prepare the choice for one encoding of the net's states."""


class StubbornSets:
    """The reduction by stubborn sets."""

    def __init__(self, net: PetriNet, visible: Iterable[int] = ()) -> None:
        """`visible`: transitions that may change what the property observes, or are observed."""
        self.visible = frozenset(visible)
        self.safe = safe_places(net)

    def bind(self, encoding: Encoding) -> Choose:
        """See `Reduction`."""
        return _Chooser(encoding, self.visible, self.safe).choose


def safe_places(net: PetriNet) -> frozenset[int]:
    """Places that the structure proves to have one token at most, or to get tokens from one
    transition.
    """
    counted = frozenset(  # by their own laws
        place.index for place in net.places if place.free or place.kept
    )
    if net.single is not None:
        return net.single | counted
    if is_small(net):
        return Concurrency(net).single | counted
    producers: dict[int, int] = {}
    for transition in net.transitions:
        made = {place for place, _ in transition.produce}
        for place in made | {target for _, target in (*transition.moves, *transition.copies)}:
            producers[place] = producers.get(place, 0) + 1
    return counted | {p.index for p in net.places if producers.get(p.index, 0) <= 1}


class _Chooser:
    def __init__(self, encoding: Encoding, visible: frozenset[int], safe: frozenset[int]) -> None:
        self.encoding = encoding
        net = encoding.net
        self.transitions = net.transitions
        seen = _mask(visible)
        self.read_write = read_write = ReadWriteSets(encoding)
        self.macro_steps = MacroSteps(encoding, read_write, seen)
        self.deferrable = DeferrableArrivals(encoding, read_write, seen, safe)
        self.seen = seen
        self.internal = _mask(r.index for r in self.transitions if r.kind is Kind.INTERNAL)
        self.outside = _mask(r.index for r in self.transitions if r.kind is Kind.EXTERNAL)
        self.every = (1 << len(self.transitions)) - 1
        self.unsafe = encoding.places_mask(p.index for p in net.places if p.index not in safe)
        self._bit = [1 << transition.index for transition in self.transitions]
        self._visible = bytearray(transition.index in visible for transition in self.transitions)
        self.joins = _mask(r.index for r in self.transitions if r.kind is Kind.JOIN)
        # The same in all states: what goes on at once is gone through branch by branch.
        self._rank = [0] * len(self.transitions)
        resets = [each.bit_count() for each in read_write.reset]
        for rank, number in enumerate(sorted(range(len(resets)), key=resets.__getitem__)):
            self._rank[number] = rank
        self._rivals_of: dict[int, int] = {}
        self._all_bits = (1 << encoding.bits) - 1

    # --- choosing -------------------------------------------------------------------------------

    def choose(self, state: int, usable: Sequence[int]) -> Sequence[int]:
        """Return the smallest set found, or all enabled transitions."""
        first = self.transitions[usable[0]].kind
        if first is Kind.JOIN:
            return usable
        visible = self._visible
        together = sum(map(self._bit.__getitem__, usable))
        candidates = self.internal if first is Kind.INTERNAL else self.every
        best: Sequence[int] = usable
        order = sorted([n for n in usable if not visible[n]], key=self._rank.__getitem__)
        for seed in order[:_MOST_SEEDS]:
            if len(best) <= (self._rivals(seed) & together).bit_count():
                continue
            closed = self._close(state, seed, together, candidates, len(best))
            if closed is None:
                continue
            chosen = [low.bit_length() - 1 for low in bits_of(closed & together)]
            if len(chosen) < len(best):
                best = chosen
                if len(best) == 1:
                    break
        return best

    def _rivals(self, number: int) -> int:
        """Transitions that need what a transition takes, and itself: they are in its set in any
        case.
        """
        found = self._rivals_of.get(number)
        if found is None:
            taken = self.read_write.clears[number] & ~self.read_write.reset[number]
            found = self._rivals_of[number] = self.read_write.needing_any(taken)
        return found

    def _close(self, state: int, seed: int, usable: int, candidates: int, most: int) -> int | None:
        """Return the stubborn set of a transition; None: it is not smaller than `most`.

        Interruptions that absorb the seed are left out: whatever comes before one of them, the seed
        could have come first, and what else is tried need not commute with them.
        """
        macro_step = self.macro_steps.of(seed, state)
        if macro_step is None:
            return None
        add, left_out = self._disturbed(macro_step)
        candidates &= ~left_out
        closed, clears, sets = 1 << seed, macro_step.clears, macro_step.sets
        fed = self._fed(macro_step, state, left_out)
        waiting: list[int] = []
        while True:
            add &= candidates & ~closed
            closed |= add
            if (closed & usable).bit_count() >= most:
                return None
            waiting += [low.bit_length() - 1 for low in bits_of(add)]
            if not waiting:
                if not fed:
                    return closed
                add = self._feeding(fed.pop(), closed, candidates)
            elif usable >> (number := waiting.pop()) & 1:
                macro_step = self.macro_steps.of(number, state)
                if macro_step is None:
                    return None
                clears, sets = clears | macro_step.clears, sets | macro_step.sets
                add = self._disturbed(macro_step)[0] & (candidates | self.joins) & ~closed
                add &= ~self._undone_by(number, macro_step, add)
                fed += self._fed(macro_step, state, left_out)
            else:
                add = self._enabling(number, state, closed, (clears, sets), candidates)

    def _fed(self, macro_step: MacroStep, state: int, left_out: int) -> list[Feed]:
        """The feeds of a macro step, unless another arrival can wait in their place."""
        if not macro_step.feeds:
            return []
        excused = self.deferrable.excused(macro_step, state, left_out)
        return [each for each in macro_step.feeds if each not in excused]

    def _feeding(self, feed: Feed, closed: int, candidates: int) -> int:
        """A small set of transitions, one of which must fire before a feed can."""
        read_write = self.read_write
        best = self._fewest(feed.missing, feed.present, candidates & ~closed)
        if best >= 0:
            return best
        if feed.fields:
            return read_write.setting_any(feed.fields[0])
        return read_write.clearing_any(feed.filled[0])

    def _enabling(
        self, number: int, state: int, closed: int, own: tuple[int, int], candidates: int
    ) -> int:
        """A small set of transitions, one of which must fire before a disabled one can.

        `own`: bits that the transitions that are in the set already clear, and set.
        """
        c = self.encoding.transitions[number]
        clearing, setting = self.read_write.clearing, self.read_write.setting
        present, missing = c.test & ~c.need & state, c.need & ~state
        for register, bits in ((clearing, present & own[0]), (setting, missing & own[1])):
            for low in bits_of(bits):
                if not register.get(low, 0) & ~closed & candidates:
                    return 0
        best = self._fewest(missing, present, candidates & ~closed)
        if best >= 0:
            return best
        for mask in c.any_of:
            if not state & mask:
                return self.read_write.setting_any(mask)
        for mask, offset, count in c.at_least:
            if (state & mask) >> offset < count:
                return self.read_write.setting_any(mask)
        for mask, offset, count in c.at_most:
            if (state & mask) >> offset > count:
                return self.read_write.clearing_any(mask)
        return 0

    def _fewest(self, missing: int, present: int, candidates: int) -> int:
        """The smallest set of candidates that set a missing bit, or clear one that is present; -1:
        there are no such bits. The first with one candidate, or with none, is small enough."""
        best = -1
        for register, bits in (
            (self.read_write.setting, missing),
            (self.read_write.clearing, present),
        ):
            for low in bits_of(bits):
                found = register.get(low, 0) & candidates
                if best < 0 or found.bit_count() < best.bit_count():
                    best = found
                    if not best & (best - 1):
                        return best
        return best

    # --- what a step disturbs -------------------------------------------------------------------

    def _disturbed(self, macro_step: MacroStep) -> tuple[int, int]:
        """Transitions whose order with a step matters, and interruptions that absorb it."""
        read_write = self.read_write
        clears, sets = macro_step.clears, macro_step.sets
        found = read_write.needing_any(clears) | read_write.setting_any(clears | macro_step.forbids)
        found |= read_write.forbidding_any(sets) | read_write.setting_any(sets & self.unsafe)
        resetters = read_write.clearing_any(sets) | read_write.clearing_any(macro_step.needs)
        absorbing = self._absorbing(clears | sets) & resetters & ~found
        return found | (resetters & ~absorbing), absorbing

    def _absorbing(self, changes: int) -> int:
        """Interruptions that undo a step before them, and are not disabled by it."""
        read_write = self.read_write
        found = self.every
        for low in bits_of(changes):
            found &= read_write.resetting.get(low, 0)
            if not found:
                return 0
        return found & ~(read_write.needing_any(changes) | read_write.forbidding_any(changes))

    def _undone_by(self, number: int, macro_step: MacroStep, disturbed: int) -> int:
        """Of the transitions that a step disturbs, those that it undoes if it is an interruption.

        Whether they come before it or not, the state after it is the same, and it is enabled just
        as well. The seed of a set must not count on that: it would defer them for ever.
        """
        read_write = self.read_write
        reset = read_write.reset[number]
        if not reset:
            return 0
        bearing = read_write.needs[number] | read_write.forbids[number]
        found = disturbed & self._within(reset) & ~self.seen
        found &= ~(read_write.clearing_any(bearing) | read_write.setting_any(bearing))
        # What happens by itself must not happen after the interruption in place of before it.
        found &= self.outside | read_write.needing_any(reset & ~macro_step.sets)
        return 0 if disturbed & self.joins & ~found else found

    def _within(self, reset: int) -> int:
        """The transitions that change nothing but what an interruption resets."""
        beside = self._all_bits & ~reset
        return self.every & ~(
            self.read_write.clearing_any(beside) | self.read_write.setting_any(beside)
        )


def _mask(transitions: Iterable[int]) -> int:
    found = 0
    for number in transitions:
        found |= 1 << number
    return found
