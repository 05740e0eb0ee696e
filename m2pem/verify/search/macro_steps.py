"""Macro steps: an external transition with all internal ones that it causes.

The internal transitions and joins that an external transition enables fire before the next external
one. So a search puts first, or defers, a transition with all that it may cause. Two macro steps are
independent only if neither lets the other one cause more than it does alone (`MacroStep.feeds`).

`DeferrableArrivals` finds exceptions: where a macro step may be put first although, with others, it
causes more than alone. Two branches come to a parallel join, and the last one fires it. If the end
of one branch is put first, the end of the other one fires the join. Where a visible transition
comes between the two ends, that is another run. But it makes no difference if a third branch is
still to come to the join, and its last transition can be deferred: it takes the time of the one
that was put first, and fires the join then. Such a *last transition* only moves a token to where
nothing but the join reads it, and nothing else can observe whether it has fired.

The same holds for the end of a scope, which needs the scope to be empty, in place of the join.
"""

from dataclasses import dataclass, field

from m2pem.verify.net.encoding import Encoding
from m2pem.verify.net.petri_net import Kind
from m2pem.verify.search.read_write_sets import Footprints, Union, bits_of

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


class Relays:
    """Finds last rules that can wait."""

    def __init__(
        self, encoding: Encoding, prints: Footprints, visible: int, safe: frozenset[int]
    ) -> None:
        """`visible`: rules, as a mask; `safe`: places that never have two tokens."""
        self.encoding = encoding
        self.prints = prints
        self._visible = visible
        places = encoding.system.places
        self._safe = encoding.places_mask(
            p.index for p in places if p.index in safe and encoding.width[p.index] == 1
        )
        self._come: dict[int, bool] = {}
        self._gone: dict[int, bool] = {}

    def excused(self, macro: Macro, state: int, left_out: int) -> list[Feed]:
        """The feeds of a macro for which somebody else can wait, or that must wait for such.

        `left_out`: interruptions after which it makes no difference what the macro did.
        """
        if not macro.alone:
            return []
        for feed in macro.feeds:
            if self._waits(feed, state, left_out):
                after = 1 << feed.rule | left_out
                return [e for e in macro.feeds if e is feed or self._only_after(e, after)]
        return []

    def _waits(self, feed: Feed, state: int, left_out: int) -> bool:
        return any(self._comes_last(low, feed.rule) for low in bits_of(feed.missing)) or any(
            self._goes_last(low, feed.rule) and self._unseen(low, feed.rule, state, left_out)
            for low in bits_of(feed.present)
        )

    def _only_after(self, feed: Feed, after: int) -> bool:
        """Whether what a rule waits for is brought about by certain rules alone."""
        prints = self.prints
        return any(not prints.setting.get(low, 0) & ~after for low in bits_of(feed.missing)) or any(
            not prints.clearing.get(low, 0) & ~after for low in bits_of(feed.present)
        )

    def _comes_last(self, bit: int, join: int) -> bool:
        """Whether a token is brought to a place, for one join alone, by rules that can wait."""
        known = self._come.get(bit)
        if known is None:
            known = self._come[bit] = self._is_brought(bit)
        return known and self.prints.needing.get(bit, 0) == 1 << join

    def _goes_last(self, bit: int, end: int) -> bool:
        """Whether a token is taken off a place by rules that can wait."""
        known = self._gone.get(bit)
        if known is None:
            known = self._gone[bit] = self._is_taken(bit)
        return known and bool(self.prints.forbidding.get(bit, 0) >> end & 1)

    def _is_brought(self, bit: int) -> bool:
        """See `_comes_last`.

        What needs the source cannot come while its token is at `bit`, or, with a rule that waits,
        there would be two at the source. So it makes no difference what that does to `bit`.
        """
        prints = self.prints
        needing = prints.needing.get(bit, 0)
        if not bit & self._safe or not needing or needing & (needing - 1):
            return False
        if not bit & self.encoding.rules[needing.bit_length() - 1].need:
            return False
        makers = prints.setting.get(bit, 0)
        return bool(makers) and all(
            (source := self._source(low.bit_length() - 1)) != 0
            and prints.sets[low.bit_length() - 1] == bit
            and prints.forbidding.get(source, 0) == prints.forbidding.get(bit, 0)
            and self._emptying(source) == self._emptying(bit) & ~prints.needing[source]
            for low in bits_of(makers)
        )

    def _is_taken(self, bit: int) -> bool:
        prints = self.prints
        takers = prints.clearing.get(bit, 0) & prints.needing.get(bit, 0)
        return bool(takers) and all(
            self._source(low.bit_length() - 1) == bit
            and all(self._tells_nothing(b, bit) for b in bits_of(prints.sets[low.bit_length() - 1]))
            for low in bits_of(takers)
        )

    def _tells_nothing(self, bit: int, source: int) -> bool:
        """Whether nobody looks at a bit, and it goes when the place its token came from does."""
        prints = self.prints
        return (
            bool(bit & self._safe)
            and not prints.needing.get(bit, 0)
            and not prints.forbidding.get(bit, 0)
            and prints.clearing.get(bit, 0) == self._emptying(source)
        )

    def _emptying(self, bit: int) -> int:
        """The rules that take a token away without looking whether it is there."""
        return self.prints.clearing.get(bit, 0) & ~self.prints.needing.get(bit, 0)

    def _source(self, number: int) -> int:
        """The bit from which a rule that can wait takes its token; 0: it is no such rule."""
        prints, rules = self.prints, self.encoding.system.rules
        rule, c = rules[number], self.encoding.rules[number]
        if self._visible >> number & 1 or rule.kind is not Kind.OUTSIDE or not c.plain:
            return 0
        source = prints.needs[number]
        if source & (source - 1) or not source & self._safe or prints.clears[number] != source:
            return 0
        if prints.forbids[number] or rule.flag is not None:
            return 0
        users = prints.needing.get(source, 0)
        for low in bits_of(users):
            user = low.bit_length() - 1
            outside = rules[user].kind is Kind.OUTSIDE
            if not outside or not source & self.encoding.rules[user].need:
                return 0
        return source

    def _unseen(self, bit: int, end: int, state: int, left_out: int) -> bool:
        """Whether all who wait for a token to go must wait for the same end anyway."""
        prints = self.prints
        kept = 0
        for low in bits_of(self.encoding.rules[end].need & state):
            if not prints.clearing.get(low, 0) & ~(1 << end | left_out):
                kept |= low
        others = prints.forbidding.get(bit, 0) & ~(1 << end)
        for low in bits_of(others):
            c = self.encoding.rules[low.bit_length() - 1]
            if not c.test & ~c.need & kept:
                return False
        return True
