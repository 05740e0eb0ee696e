"""States as integers: each place is a field of bits, each variable has a bit for each value.

A place where one token is meant has one bit; a transition over such places is two masks. A place
that was found to get more is given more bits, and the search starts again (`search.explore`).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from m2pem.mission.values import Value
from m2pem.verify.net.petri_net import PetriNet, Transition

SEVERAL_BITS = 2
"""Bits of a place where several tokens are meant: up to three."""


@dataclass(frozen=True, slots=True)
class Marking:
    """A marking: tokens by place (places that have any), and values by variable."""

    tokens: Mapping[int, int]
    values: Mapping[int, int]


@dataclass(slots=True)
class CompiledTransition:
    """A transition as masks. `plain`: the masks say it all; else the lists add the rest.

    `erase`: of the bits that are cleared, those that go after tokens have moved; the others are
    consumed before. `reset`: of those, the places that are emptied whatever they hold. `moves`:
    masks of the first and second place, the offset of the second, whether the first is emptied, and
    the offset of the first.
    """

    test: int = 0
    need: int = 0
    clear: int = 0
    erase: int = 0
    put: int = 0
    plain: bool = True
    any_of: list[int] = field(default_factory=list)
    at_least: list[tuple[int, int, int]] = field(default_factory=list)
    at_most: list[tuple[int, int, int]] = field(default_factory=list)
    takes: list[tuple[int, int]] = field(default_factory=list)
    moves: list[tuple[int, int, int, bool, int]] = field(default_factory=list)
    gives: list[tuple[int, int, int, int]] = field(default_factory=list)
    reset: int = 0
    reads: int = 0
    changes: int = 0


class Encoding:
    """The encoding of a net's states as integers, and of its transitions as masks."""

    def __init__(self, net: PetriNet, wider: Mapping[int, int] | None = None) -> None:
        """`wider`: the width in bits of places that need more than usual."""
        self.net = net
        self.wider = dict(wider or {})
        self.offset: list[int] = []
        self.width: list[int] = []
        self.mask: list[int] = []
        self._place_of_bit: list[int] = []
        at = 0
        for place in net.places:
            width = self.wider.get(place.index, SEVERAL_BITS if place.several else 1)
            most = max(len(place.free), len(place.kept), place.most)
            width = max(width, most.bit_length())
            self.offset.append(at)
            self.width.append(width)
            self.mask.append(((1 << width) - 1) << at)
            self._place_of_bit += [place.index] * width
            at += width
        self.value_bit: list[int] = []
        for variable in net.variables:
            self.value_bit.append(at)
            at += len(variable.values)
        self.bits = at
        self.initial = 0
        for place_index, count in net.initial:
            self.initial |= count << self.offset[place_index]
        for variable in net.variables:
            self.initial |= 1 << (self.value_bit[variable.index] + variable.initial)
        self._counted = self.places_mask(p.index for p in net.places if p.counts_moves)
        self._reset_masks: dict[tuple[int, ...], int] = {}
        self.transitions = [self._compile(transition) for transition in net.transitions]

    def places_mask(self, places: Iterable[int]) -> int:
        """Return the bits of some places."""
        mask = 0
        for place in places:
            mask |= self.mask[place]
        return mask

    def _reset_mask(self, places: tuple[int, ...]) -> int:
        """All bits of the places that a transition resets; many transitions share the
        same places.
        """
        known = self._reset_masks.get(places)
        if known is None:
            known = self._reset_masks[places] = self.places_mask(places)
        return known

    def _values_mask(self, variable: int, values: Iterable[int]) -> int:
        mask = 0
        for value in values:
            mask |= 1 << (self.value_bit[variable] + value)
        return mask

    def _compile(self, transition: Transition) -> CompiledTransition:
        c = CompiledTransition()
        taken = dict(transition.consume)
        for place, count in transition.consume:
            if self.width[place] == 1 and count == 1:
                c.test |= self.mask[place]
                c.need |= self.mask[place]
                c.clear |= self.mask[place]
            else:
                c.at_least.append((self.mask[place], self.offset[place], count))
                c.takes.append((place, count << self.offset[place]))
        for place in transition.read:
            if place in taken:
                continue
            if self.width[place] == 1:
                c.test |= self.mask[place]
                c.need |= self.mask[place]
            else:
                c.any_of.append(self.mask[place])
        for place in transition.inhibit:
            c.test |= self.mask[place]
            if place in taken or place in transition.read:  # which it never can
                c.at_least.append((self.mask[place], self.offset[place], 1 << self.width[place]))
        for place, count in transition.at_most:
            c.at_most.append((self.mask[place], self.offset[place], count))
        for variable, values in transition.guard:
            mask = self._values_mask(variable, values)
            if len(values) == 1:
                c.test |= mask
                c.need |= mask
            elif len(values) < len(self.net.variables[variable].values):
                c.any_of.append(mask)
        if transition.reset:
            c.reset = self._reset_mask(transition.reset)
            c.erase = c.reset
        for pairs, gone in ((transition.moves, True), (transition.copies, False)):
            for source, target in pairs:
                masks = self.mask[source], self.mask[target]
                c.moves.append((*masks, self.offset[target], gone, self.offset[source]))
        for place, count in transition.produce:
            if self.width[place] == 1 and count == 1:
                c.put |= self.mask[place]
            else:
                c.gives.append(
                    (
                        self.mask[place],
                        self.offset[place],
                        count,
                        (1 << self.width[place]) - 1,
                    )
                )
        for variable, value in transition.assign:
            all_of = self._values_mask(variable, range(len(self.net.variables[variable].values)))
            c.erase |= all_of
            c.put |= 1 << (self.value_bit[variable] + value)
        c.clear |= c.erase
        c.plain = not (c.any_of or c.at_least or c.at_most or c.takes or c.moves or c.gives)
        c.reads = c.test
        for mask in c.any_of:
            c.reads |= mask
        for mask, _, _ in (*c.at_least, *c.at_most):
            c.reads |= mask
        c.changes = c.clear | c.put
        for place, _ in c.takes:
            c.changes |= self.mask[place]
        for source, target, _, gone, _ in c.moves:
            c.reads |= source
            c.changes |= target | (source if gone else 0)
        for mask, *_ in c.gives:
            c.changes |= mask
        return c

    # --- firing ---------------------------------------------------------------------------------

    def enabled(self, number: int, state: int) -> bool:
        """Whether a transition's tests hold. The priorities of kinds are not considered."""
        c = self.transitions[number]
        if state & c.test != c.need:
            return False
        if c.plain:
            return True
        for mask in c.any_of:
            if not state & mask:
                return False
        for mask, offset, count in c.at_most:
            if (state & mask) >> offset > count:
                return False
        return all((state & mask) >> offset >= count for mask, offset, count in c.at_least)

    def fire(self, number: int, state: int) -> tuple[int, int]:
        """Return the state after an enabled transition, and the bits of places that overflow.

        A place that is full stays full.
        """
        c = self.transitions[number]
        if c.plain:
            state &= ~c.clear
            return state | c.put, state & c.put
        return self._fire_slowly(c, number, state)

    def _fire_slowly(self, c: CompiledTransition, number: int, state: int) -> tuple[int, int]:
        for _, unit in c.takes:
            state -= unit
        consumed = 0
        for place, _ in self.net.transitions[number].consume:
            if self.width[place] == 1:
                consumed |= self.mask[place]
        state &= ~consumed
        full = 0
        for source, target, offset, gone, source_offset in c.moves:
            if state & source:
                count, room = (state & source) >> source_offset, (target & ~state) >> offset
                if gone:
                    state &= ~source
                state += min(count, room) << offset
                if count > room:
                    full |= target
        state &= ~c.erase
        full = full & self._counted & ~c.erase | state & c.put
        state |= c.put
        for mask, offset, count, most in c.gives:
            if ((state & mask) >> offset) + count > most:
                full |= mask
                state |= mask
            else:
                state += count << offset
        return state, full

    def places_in(self, bits: int) -> list[int]:
        """The places that have some of these bits."""
        return [place for place, mask in enumerate(self.mask) if mask & bits]

    # --- reading --------------------------------------------------------------------------------

    def marking(self, state: int) -> Marking:
        """Decode a state into a marking."""
        tokens: dict[int, int] = {}
        rest = state & (1 << len(self._place_of_bit)) - 1
        while rest:  # most places have none
            place = self._place_of_bit[(rest & -rest).bit_length() - 1]
            tokens[place] = (state & self.mask[place]) >> self.offset[place]
            rest &= ~self.mask[place]
        values: dict[int, int] = {}
        for variable in self.net.variables:
            bits = state >> self.value_bit[variable.index] & (1 << len(variable.values)) - 1
            if bits:
                values[variable.index] = bits.bit_length() - 1
        return Marking(tokens, values)

    def value(self, state: int, variable: int) -> Value:
        """The value that a variable has in a state."""
        return self.net.variables[variable].values[self.marking(state).values[variable]]
