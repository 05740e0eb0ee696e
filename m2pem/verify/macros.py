"""What a rule from outside leads to before anything else can come: a macro.

The internal steps and joins after a rule happen before the next rule from outside. So what a search
puts first or puts off is a rule with all that it may cause, and two such are independent only if
neither lets the other one cause more than it does alone (`Macro.feeds`).
"""

from dataclasses import dataclass, field

from m2pem.verify.encoding import Encoding
from m2pem.verify.footprints import Footprints, Union, bits_of
from m2pem.verify.system import Kind

_MOST_STATES = 64
"""Of the internal steps that one rule may cause; of more, nothing is said."""


@dataclass(frozen=True, slots=True)
class Feed:
    """An internal rule or join that a macro alone does not cause, but may cause with others.

    It waits for bits that are `missing` or `present`, which the macro does not change; or, if those
    are none, for some of a field of bits each of `fields`.
    """

    rule: int
    missing: int
    present: int
    fields: tuple[int, ...] = ()


@dataclass(slots=True)
class Macro:
    """What all its rules need, forbid, clear and set, taken together.

    `alone`: it is one rule that causes nothing.
    """

    needs: int = 0
    forbids: int = 0
    clears: int = 0
    sets: int = 0
    alone: bool = True
    feeds: list[Feed] = field(default_factory=list)


class Macros:
    """Works out macros. Of one that has a visible rule in it, nothing is said."""

    def __init__(self, encoding: Encoding, prints: Footprints, visible: int) -> None:
        """`visible`: rules, as a mask of their numbers."""
        self.encoding = encoding
        self.prints = prints
        rules = encoding.system.rules
        self._visible = bytearray(visible >> rule.index & 1 for rule in rules)
        self._internal_rules = [r.index for r in rules if r.kind is Kind.INTERNAL]
        self._join_rules = [r.index for r in rules if r.kind is Kind.JOIN]
        self._is_internal = bytearray(rule.kind is Kind.INTERNAL for rule in rules)
        self._wanting: dict[int, int] = {}
        self._barred: dict[int, int] = {}
        for rule in rules:
            if rule.kind is not Kind.OUTSIDE:
                self._register(rule.index)
        self._wanting_any = Union(self._wanting)
        self._barred_any = Union(self._barred)
        self._readers: dict[int, list[int]] = {}
        for number in self._internal_rules:
            for low in bits_of(prints.needs[number] | prints.forbids[number]):
                self._readers.setdefault(low, []).append(number)

    def _register(self, number: int) -> None:
        c = self.encoding.rules[number]
        wants, barred = c.need, c.test & ~c.need
        for mask in (*c.any_of, *(mask for mask, _, _ in c.at_least)):
            wants |= mask
        for low in bits_of(wants):
            self._wanting[low] = self._wanting.get(low, 0) | 1 << number
        for low in bits_of(barred):
            self._barred[low] = self._barred.get(low, 0) | 1 << number

    def of(self, number: int, state: int) -> Macro | None:
        """The macro of a rule that may fire in a state.

        None: something in it is visible, it is too large, or it can go on for ever.
        """
        if self._visible[number]:
            return None
        macro = Macro()
        self._add(macro, number)
        if self._is_internal[number]:
            return macro
        after, _ = self.encoding.fire(number, state)
        prints = self.prints
        following: dict[int, list[int]] = {after: []}
        waiting = [(after, prints.clears[number] | prints.sets[number])]
        again = False
        while waiting:
            now, changed = waiting.pop()
            self._feed(macro, state, now)
            for each in self._caused(now, changed) or self._joining(now):
                if self._visible[each]:
                    return None
                macro.alone = False
                self._add(macro, each)
                then, _ = self.encoding.fire(each, now)
                following[now].append(then)
                if then in following:
                    again = True
                    continue
                if len(following) > _MOST_STATES:
                    return None
                following[then] = []
                waiting.append((then, changed | prints.clears[each] | prints.sets[each]))
        if again and _goes_round(following):
            return None
        return macro

    def _add(self, macro: Macro, number: int) -> None:
        prints = self.prints
        macro.needs |= prints.needs[number]
        macro.forbids |= prints.forbids[number]
        macro.clears |= prints.clears[number]
        macro.sets |= prints.sets[number]

    def _caused(self, state: int, changed: int) -> list[int]:
        enabled = self.encoding.enabled
        if changed.bit_count() > len(self._internal_rules):
            return [n for n in self._internal_rules if enabled(n, state)]
        asked: set[int] = set()
        for low in bits_of(changed):
            asked.update(self._readers.get(low, ()))
        return [n for n in asked if enabled(n, state)]

    def _joining(self, state: int) -> list[int]:
        return [n for n in self._join_rules if self.encoding.enabled(n, state)]

    def _feed(self, macro: Macro, before: int, now: int) -> None:
        """Note what does not fire in a state on the way, but may where others have fired first.

        What the macro's own changes keep from firing, they keep from it there too.
        """
        changed = before ^ now
        fed = self._wanting_any(now & changed) | self._barred_any(before & changed)
        while fed:
            low = fed & -fed
            fed ^= low
            number = low.bit_length() - 1
            c = self.encoding.rules[number]
            missing, present = c.need & ~now, c.test & ~c.need & now
            if (missing | present) & changed:
                continue
            if missing or present:
                macro.feeds.append(Feed(number, missing, present))
                continue
            fields = [mask for mask in c.any_of if not now & mask]
            fields += [mask for mask, offset, n in c.at_least if (now & mask) >> offset < n]
            if fields:
                macro.feeds.append(Feed(number, 0, 0, tuple(fields)))


def _goes_round(following: dict[int, list[int]]) -> bool:
    """Whether a graph has a circle."""
    coming = dict.fromkeys(following, 0)
    for targets in following.values():
        for each in targets:
            coming[each] += 1
    free = [node for node, count in coming.items() if not count]
    left = len(coming)
    while free:
        left -= 1
        for each in following[free.pop()]:
            coming[each] -= 1
            if not coming[each]:
                free.append(each)
    return left > 0
