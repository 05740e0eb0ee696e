"""Which rules need not be tried in a state, because another order leads to the same.

Stubborn sets (Valmari), for rules of three kinds. What is tried now is one rule that comes from
outside, with all internal steps that it causes (`_Macro`), and everything that could disturb, or
be disturbed by, those. What is left out is only put off. That keeps

- every state in which nothing can move, every rule that can ever fire, and every flag;
- every place that can get a token too many: rules that put tokens on one place are tried in every
  order, unless the structure proves that the place never has two;
- whether the end can be reached from everywhere: a search round a circle of states in which only
  the reduced sets were tried tries all rules there (`explore`).

An interruption disturbs everything in its scope. It is left out all the same where it absorbs: a
step that changes nothing but what the interruption takes away, and does not bear on whether it
may come, leads with it to the same state as the interruption alone.

What a requirement looks at must be `visible`: rules that change it are tried in every order.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Protocol

from m2pem.verify.concurrency import Concurrency, is_small
from m2pem.verify.encoding import Encoding
from m2pem.verify.system import Kind, Role, System

Choose = Callable[[int, Sequence[int]], Sequence[int]]
"""Of the rules that may fire in a state, those to try."""

_MOST_SEEDS = 12
"""Rules of a state that are tried as the one to begin with."""
_MOST_INTERNAL_STATES = 64
"""States of the internal steps that one rule from outside may cause; of more, all is tried."""


class Reduction(Protocol):
    """Chooses, in each state, which of the rules that may fire are tried."""

    def bind(self, encoding: Encoding) -> Choose:
        """Get ready for one way of writing the system's states."""
        ...


class StubbornSets:
    """The reduction of this module."""

    def __init__(self, system: System, visible: Iterable[int] = ()) -> None:
        """`visible`: places that the property looks at."""
        self.visible = frozenset(visible)
        self.safe = safe_places(system)

    def bind(self, encoding: Encoding) -> Choose:
        """See `Reduction`."""
        return _Bound(encoding, self.visible, self.safe).choose


def safe_places(system: System) -> frozenset[int]:
    """Places that the structure proves to have one token at most."""
    if is_small(system):
        rows = Concurrency(system).rows
        return frozenset(p.index for p in system.places if not rows[p.index] >> p.index & 1)
    producers: dict[int, int] = {}
    for rule in system.rules:
        for place, _ in rule.produce:
            producers[place] = producers.get(place, 0) + 1
    return frozenset(p.index for p in system.places if producers.get(p.index, 0) <= 1)


class _Macro:
    """What a rule and the internal steps after it need and change, taken together."""

    __slots__ = ("clears", "forbids", "needs", "sets")

    def __init__(self) -> None:
        self.needs = self.forbids = self.clears = self.sets = 0


class _Bound:
    def __init__(self, encoding: Encoding, visible: frozenset[int], safe: frozenset[int]) -> None:
        self.encoding = encoding
        system = encoding.system
        self.rules = system.rules
        count = len(self.rules)
        self.internal = 0
        self.outside = 0
        for rule in self.rules:
            if rule.kind is Kind.INTERNAL:
                self.internal |= 1 << rule.index
            elif rule.kind is Kind.OUTSIDE:
                self.outside |= 1 << rule.index
        self.needs: list[int] = [0] * count
        self.forbids: list[int] = [0] * count
        self.clears: list[int] = [0] * count
        self.sets: list[int] = [0] * count
        self.kill: list[int] = [0] * count
        self.killing = 0
        for number in range(count):
            self._masks(number)
        for number in range(count):
            if self.kill[number]:
                self.killing |= 1 << number
        self.needing: dict[int, int] = {}
        self.forbidding: dict[int, int] = {}
        self.clearing: dict[int, int] = {}
        self.setting: dict[int, int] = {}
        for masks, register in (
            (self.needs, self.needing),
            (self.forbids, self.forbidding),
            (self.clears, self.clearing),
            (self.sets, self.setting),
        ):
            _register(masks, self.kill if register is self.clearing else (), register)
        self.unsafe = encoding.places_mask(p.index for p in system.places if p.index not in safe)
        self.visible = encoding.places_mask(visible)
        self.seeing = 0
        for number in range(count):
            if (self.clears[number] | self.sets[number]) & self.visible:
                self.seeing |= 1 << number
        self.readers = self._readers()
        self.entangled = self._entangled()
        self._join_rules = [r.index for r in self.rules if r.kind is Kind.JOIN]
        self._internal_rules = [r.index for r in self.rules if r.kind is Kind.INTERNAL]

    def _masks(self, number: int) -> None:
        encoding = self.encoding
        c = encoding.rules[number]
        needs, forbids = c.need, c.test & ~c.need
        for mask in c.any_of:
            needs |= mask
            forbids |= mask
        for mask, _, _ in c.at_least:
            needs |= mask
        clears, sets = c.clear, c.put
        for place, _ in c.takes:
            clears |= encoding.mask[place]
        for source, target, _, gone in c.moves:
            needs |= source
            forbids |= source
            sets |= target
            if gone:
                clears |= source
        for mask, *_ in c.gives:
            sets |= mask
        self.needs[number], self.forbids[number] = needs, forbids
        self.clears[number], self.sets[number] = clears, sets
        self.kill[number] = encoding.places_mask(self.rules[number].kill)

    def _readers(self) -> dict[int, list[int]]:
        """Internal rules by the bits that they need."""
        found: dict[int, list[int]] = {}
        for rule in self.rules:
            if rule.kind is Kind.INTERNAL:
                for low in bits_of(self.needs[rule.index] | self.forbids[rule.index]):
                    found.setdefault(low, []).append(rule.index)
        return found

    def _entangled(self) -> int:
        """Bits of places at joins that get their token together with another one elsewhere.

        What such a join leads to may come before, or after, what the other token leads to: a
        rule that feeds such a join is never tried alone.
        """
        system = self.encoding.system
        tokens = {p.index for p in system.places if p.role not in (Role.CONTROL, Role.END)}
        joined: set[int] = set()
        for rule in self.rules:
            if rule.kind is not Kind.OUTSIDE:
                consumed = [p for p, _ in rule.consume if p in tokens]
                if len(consumed) > 1:
                    joined.update(consumed)
        found = 0
        for rule in self.rules:
            made = [p for p, _ in rule.produce if p in tokens]
            made += [t for _, t in (*rule.moves, *rule.copies) if t in tokens]
            if len(made) > 1 or any(n > 1 for _, n in rule.produce):
                for place in made:
                    if place in joined:
                        found |= self.encoding.mask[place]
        return found

    # --- choosing -------------------------------------------------------------------------------

    def choose(self, state: int, usable: Sequence[int]) -> Sequence[int]:
        """The smallest set found, or all."""
        first = self.rules[usable[0]].kind
        if first is Kind.JOIN:
            return usable
        together = 0
        for number in usable:
            together |= 1 << number
        candidates = self.internal if first is Kind.INTERNAL else self.internal | self.outside
        best: Sequence[int] = usable
        order = sorted(usable, key=lambda n: self.kill[n].bit_count())
        for seed in order[:_MOST_SEEDS]:
            closed = self._close(state, seed, together, candidates, len(best))
            if closed is None:
                continue
            chosen = [n for n in usable if closed >> n & 1]
            if len(chosen) < len(best):
                best = chosen
                if len(best) == 1:
                    break
        return best

    def _close(self, state: int, seed: int, usable: int, candidates: int, most: int) -> int | None:
        """The stubborn set of a rule; None: it is not smaller than `most`.

        Interruptions that absorb all that is tried are left out of account: what was put off
        makes no difference after one of them.
        """
        macro = self._macro(seed, state)
        if macro is None:
            return None
        left_out = self._disturbed(macro)[1]
        while True:
            closed = self._close_without(state, seed, usable, candidates, left_out, most)
            if not isinstance(closed, tuple):
                return closed
            left_out &= ~closed[0]

    def _close_without(
        self, state: int, seed: int, usable: int, candidates: int, left_out: int, most: int
    ) -> int | tuple[int] | None:
        """The same; or, in a tuple, rules that may not be left out."""
        candidates &= ~left_out
        closed, own = 1 << seed, 0
        waiting = [seed]
        while waiting:
            number = waiting.pop()
            if usable >> number & 1:
                macro = self._macro(number, state)
                if macro is None:
                    return None
                own |= macro.clears
                add, _ = self._disturbed(macro)
                if add & left_out:
                    return (add,)
            elif self._enabled(number, state):
                return None  # an internal rule, while only those from outside are tried
            else:
                add = self._enabling(number, state, closed, own, candidates)
            add &= candidates & ~closed
            closed |= add
            if (closed & usable).bit_count() >= most:
                return None
            while add:
                low = add & -add
                add ^= low
                waiting.append(low.bit_length() - 1)
        return closed

    def _enabled(self, number: int, state: int) -> bool:
        return self.encoding.enabled(number, state)

    def _enabling(self, number: int, state: int, closed: int, own: int, candidates: int) -> int:
        """Rules one of which must fire before a disabled one can: few that are not in already.

        `own`: bits that the rules that are in already clear.
        """
        c = self.encoding.rules[number]
        present = c.test & ~c.need & state
        for low in bits_of(present & own):
            if not self.clearing.get(low, 0) & ~closed & candidates:
                return 0
        best = -1
        for register, bits in ((self.setting, c.need & ~state), (self.clearing, present)):
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
                return self._setting_any(mask)
        for mask, offset, count in c.at_least:
            if (state & mask) >> offset < count:
                return self._setting_any(mask)
        return 0

    def _setting_any(self, mask: int) -> int:
        found = 0
        for low in bits_of(mask):
            found |= self.setting.get(low, 0)
        return found

    # --- what a step does -----------------------------------------------------------------------

    def _macro(self, number: int, state: int) -> _Macro | None:
        """A rule with all internal steps that it can cause; None: they are too many."""
        macro = _Macro()
        self._add(macro, number)
        if self.rules[number].kind is Kind.INTERNAL:
            return macro
        after, _ = self.encoding.fire(number, state)
        seen = {after}
        waiting = [(after, self.clears[number] | self.sets[number])]
        while waiting:
            now, changed = waiting.pop()
            for each in self._caused(now, changed) or self._joining(now):
                self._add(macro, each)
                following, _ = self.encoding.fire(each, now)
                if following not in seen:
                    if len(seen) > _MOST_INTERNAL_STATES:
                        return None
                    seen.add(following)
                    waiting.append((following, changed | self.clears[each] | self.sets[each]))
        if macro.sets & self.entangled:
            return None
        return macro

    def _caused(self, state: int, changed: int) -> list[int]:
        if changed.bit_count() > len(self._internal_rules):
            return [n for n in self._internal_rules if self.encoding.enabled(n, state)]
        asked: set[int] = set()
        for low in bits_of(changed):
            asked.update(self.readers.get(low, ()))
        return [n for n in asked if self.encoding.enabled(n, state)]

    def _joining(self, state: int) -> list[int]:
        return [n for n in self._join_rules if self.encoding.enabled(n, state)]

    def _add(self, macro: _Macro, number: int) -> None:
        macro.needs |= self.needs[number]
        macro.forbids |= self.forbids[number]
        macro.clears |= self.clears[number]
        macro.sets |= self.sets[number]

    def _disturbed(self, macro: _Macro) -> tuple[int, int]:
        """Rules whose order with a step matters, and interruptions that absorb it."""
        found = 0
        for low in bits_of(macro.clears):
            found |= self.needing.get(low, 0) | self.setting.get(low, 0)
        for low in bits_of(macro.sets):
            found |= self.forbidding.get(low, 0)
            if low & self.unsafe:
                found |= self.setting.get(low, 0)
        killers = 0
        for low in bits_of(macro.sets | macro.needs):
            killers |= self.clearing.get(low, 0)
        for low in bits_of(macro.forbids):
            found |= self.setting.get(low, 0)
        changes = macro.clears | macro.sets
        if changes & self.visible:
            found |= self.seeing
        left = killers & ~found
        absorbing = 0
        while left:
            low = left & -left
            left ^= low
            if self._absorbs(low.bit_length() - 1, changes):
                absorbing |= low
        return found | (killers & ~absorbing), absorbing

    def _absorbs(self, number: int, changes: int) -> bool:
        """Whether an interruption makes a step before it undone, and is not kept from coming."""
        kill = self.kill[number]
        return (
            changes & ~kill == 0
            and not changes & (self.needs[number] | self.forbids[number])
            and not kill & self.visible
        )


def _register(masks: Sequence[int], kill: Sequence[int], register: dict[int, int]) -> None:
    """By bit, the rules whose masks have it. Many rules `kill` the same bits: those go together."""
    alike: dict[int, int] = {}
    for number, mask in enumerate(masks):
        own = mask
        if kill and kill[number]:
            own &= ~kill[number]
            alike[kill[number]] = alike.get(kill[number], 0) | 1 << number
        for low in bits_of(own):
            register[low] = register.get(low, 0) | 1 << number
    for mask, numbers in alike.items():
        for low in bits_of(mask):
            register[low] = register.get(low, 0) | numbers


def bits_of(mask: int) -> Iterable[int]:
    """Each bit of a mask, as a mask of its own."""
    while mask:
        low = mask & -mask
        yield low
        mask ^= low
