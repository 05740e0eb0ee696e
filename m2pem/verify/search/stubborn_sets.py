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

The *ignoring proviso* ensures that. A run that goes round a cycle on which a transition is always
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
from m2pem.verify.net.petri_net import Kind, System
from m2pem.verify.search.macro_steps import Feed, Macro, Macros, Relays
from m2pem.verify.search.read_write_sets import Footprints, bits_of

_A_FEW = 500
"""Of so many states that lie on circles together, one is chosen at a time."""


def ignoring(
    targets: Sequence[Sequence[int]], inner: Collection[int], partly: Collection[int]
) -> set[int]:
    """States in which nothing may be put off, so that nothing is put off for ever; few of them.

    `targets`: by state, those after it. `inner`: states with internal steps or joins. `partly`:
    states in which something was put off. Empty: all is well.
    """
    inside = {state for state in partly if state in inner}
    outside = {state for state in partly if state not in inner}
    return _breaking(targets, outside | set(inner), outside) | _breaking(targets, inside, inside)


def _breaking(
    targets: Sequence[Sequence[int]], states: Collection[int], partly: Collection[int]
) -> set[int]:
    """Of `partly`, such that each circle with one of these, of `states` alone, has a found one."""
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
    """Some states, in parts of which each can reach each other, without those on no circle."""
    place = {state: at for at, state in enumerate(states)}
    among = [[place[each] for each in targets[state] if each in place] for state in states]
    parts: dict[int, list[int]] = {}
    for at, number in enumerate(components(among)):
        parts.setdefault(number, []).append(at)
    for part in parts.values():
        if len(part) > 1 or part[0] in among[part[0]]:
            yield [states[at] for at in part]


Choose = Callable[[int, Sequence[int]], Sequence[int]]
"""Of the rules that may fire in a state, those to try."""

_MOST_SEEDS = 12
"""Rules of a state that are tried as the one to begin with."""


class Reduction(Protocol):
    """Chooses, in each state, which of the rules that may fire are tried."""

    def bind(self, encoding: Encoding) -> Choose:
        """Get ready for one way of writing the system's states."""
        ...


class StubbornSets:
    """The reduction of this module."""

    def __init__(self, system: System, visible: Iterable[int] = ()) -> None:
        """`visible`: rules that may change what the property looks at, or are what it looks at."""
        self.visible = frozenset(visible)
        self.safe = safe_places(system)

    def bind(self, encoding: Encoding) -> Choose:
        """See `Reduction`."""
        return _Bound(encoding, self.visible, self.safe).choose


def safe_places(system: System) -> frozenset[int]:
    """Places that the structure proves to have one token at most, or to get them from one rule."""
    if system.single is not None:
        return system.single
    if is_small(system):
        return Concurrency(system).single
    producers: dict[int, int] = {}
    for rule in system.rules:
        made = {place for place, _ in rule.produce}
        for place in made | {target for _, target in (*rule.moves, *rule.copies)}:
            producers[place] = producers.get(place, 0) + 1
    return frozenset(p.index for p in system.places if producers.get(p.index, 0) <= 1)


class _Bound:
    def __init__(self, encoding: Encoding, visible: frozenset[int], safe: frozenset[int]) -> None:
        self.encoding = encoding
        system = encoding.system
        self.rules = system.rules
        seen = _mask(visible)
        self.prints = prints = Footprints(encoding)
        self.macros = Macros(encoding, prints, seen)
        self.relays = Relays(encoding, prints, seen, safe)
        self.seen = seen
        self.internal = _mask(r.index for r in self.rules if r.kind is Kind.INTERNAL)
        self.outside = _mask(r.index for r in self.rules if r.kind is Kind.OUTSIDE)
        self.every = (1 << len(self.rules)) - 1
        self.unsafe = encoding.places_mask(p.index for p in system.places if p.index not in safe)
        self._bit = [1 << rule.index for rule in self.rules]
        self._visible = bytearray(rule.index in visible for rule in self.rules)
        self.joins = _mask(r.index for r in self.rules if r.kind is Kind.JOIN)
        # The same in all states: what goes on at once is gone through branch by branch.
        self._rank = [0] * len(self.rules)
        kills = [each.bit_count() for each in prints.kill]
        for rank, number in enumerate(sorted(range(len(kills)), key=kills.__getitem__)):
            self._rank[number] = rank
        self._rivals_of: dict[int, int] = {}
        self._all_bits = (1 << encoding.bits) - 1

    # --- choosing -------------------------------------------------------------------------------

    def choose(self, state: int, usable: Sequence[int]) -> Sequence[int]:
        """The smallest set found, or all."""
        first = self.rules[usable[0]].kind
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
        """Rules that need what a rule takes, itself among them: they are in its set in any case."""
        found = self._rivals_of.get(number)
        if found is None:
            taken = self.prints.clears[number] & ~self.prints.kill[number]
            found = self._rivals_of[number] = self.prints.needing_any(taken)
        return found

    def _close(self, state: int, seed: int, usable: int, candidates: int, most: int) -> int | None:
        """The stubborn set of a rule; None: it is not smaller than `most`.

        Interruptions that absorb the seed are left out of account: whatever comes before one of
        them, the seed could have come first, and what else is tried need not bear with them.
        """
        macro = self.macros.of(seed, state)
        if macro is None:
            return None
        add, left_out = self._disturbed(macro)
        candidates &= ~left_out
        closed, clears, sets = 1 << seed, macro.clears, macro.sets
        fed = self._fed(macro, state, left_out)
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
                macro = self.macros.of(number, state)
                if macro is None:
                    return None
                clears, sets = clears | macro.clears, sets | macro.sets
                add = self._disturbed(macro)[0] & (candidates | self.joins) & ~closed
                add &= ~self._undone_by(number, macro, add)
                fed += self._fed(macro, state, left_out)
            else:
                add = self._enabling(number, state, closed, (clears, sets), candidates)

    def _fed(self, macro: Macro, state: int, left_out: int) -> list[Feed]:
        """What a macro might cause with others, unless somebody else can wait."""
        if not macro.feeds:
            return []
        excused = self.relays.excused(macro, state, left_out)
        return [each for each in macro.feeds if each not in excused]

    def _feeding(self, feed: Feed, closed: int, candidates: int) -> int:
        """Rules one of which must fire before what a macro might cause can be: few new ones."""
        prints = self.prints
        best = -1
        for register, bits in ((prints.setting, feed.missing), (prints.clearing, feed.present)):
            for low in bits_of(bits):
                found = register.get(low, 0) & ~closed & candidates
                if best < 0 or found.bit_count() < best.bit_count():
                    best = found
                    if not best & (best - 1):
                        return best
        return best if best >= 0 else prints.setting_any(feed.fields[0])

    def _enabling(
        self, number: int, state: int, closed: int, own: tuple[int, int], candidates: int
    ) -> int:
        """Rules one of which must fire before a disabled one can: few that are not in already.

        `own`: bits that the rules that are in already clear, and set.
        """
        c = self.encoding.rules[number]
        clearing, setting = self.prints.clearing, self.prints.setting
        present, missing = c.test & ~c.need & state, c.need & ~state
        for register, bits in ((clearing, present & own[0]), (setting, missing & own[1])):
            for low in bits_of(bits):
                if not register.get(low, 0) & ~closed & candidates:
                    return 0
        best = -1
        for register, bits in ((setting, missing), (clearing, present)):
            for low in bits_of(bits):
                found = register.get(low, 0) & ~closed & candidates
                if not found:
                    return 0
                if best < 0 or found.bit_count() < best.bit_count():
                    best = found
                    if not best & (best - 1):
                        return best
        if best >= 0:
            return best
        for mask in c.any_of:
            if not state & mask:
                return self.prints.setting_any(mask)
        for mask, offset, count in c.at_least:
            if (state & mask) >> offset < count:
                return self.prints.setting_any(mask)
        return 0

    # --- what a step disturbs -------------------------------------------------------------------

    def _disturbed(self, macro: Macro) -> tuple[int, int]:
        """Rules whose order with a step matters, and interruptions that absorb it."""
        prints = self.prints
        clears, sets = macro.clears, macro.sets
        found = prints.needing_any(clears) | prints.setting_any(clears | macro.forbids)
        found |= prints.forbidding_any(sets) | prints.setting_any(sets & self.unsafe)
        killers = prints.clearing_any(sets) | prints.clearing_any(macro.needs)
        absorbing = self._absorbing(clears | sets) & killers & ~found
        return found | (killers & ~absorbing), absorbing

    def _absorbing(self, changes: int) -> int:
        """Interruptions that make a step before them undone, and are not kept from coming."""
        prints = self.prints
        found = self.every
        for low in bits_of(changes):
            found &= prints.killing.get(low, 0)
            if not found:
                return 0
        return found & ~(prints.needing_any(changes) | prints.forbidding_any(changes))

    def _undone_by(self, number: int, macro: Macro, disturbed: int) -> int:
        """Of the rules that a step disturbs, those that it makes undone if it interrupts.

        Whether they come before it or not at all, the state after it is the same, and it can come
        just as well. The seed of a set must not count on that: it would put them off for ever.
        """
        prints = self.prints
        kill = prints.kill[number]
        if not kill:
            return 0
        bearing = prints.needs[number] | prints.forbids[number]
        found = disturbed & self._within(kill) & ~self.seen
        found &= ~(prints.clearing_any(bearing) | prints.setting_any(bearing))
        # What happens by itself must not happen after the interruption in place of before it.
        found &= self.outside | prints.needing_any(kill & ~macro.sets)
        return 0 if disturbed & self.joins & ~found else found

    def _within(self, kill: int) -> int:
        """The rules that change nothing but what an interruption takes away."""
        beside = self._all_bits & ~kill
        return self.every & ~(self.prints.clearing_any(beside) | self.prints.setting_any(beside))


def _mask(rules: Iterable[int]) -> int:
    found = 0
    for number in rules:
        found |= 1 << number
    return found
