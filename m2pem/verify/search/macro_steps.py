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
from m2pem.verify.search.read_write_sets import ReadWriteSets, Union, bits_of

_MOST_STATES = 64
"""Most states of the internal steps that one transition may cause; larger macro steps are unknown.
"""


@dataclass(frozen=True, slots=True)
class Feed:
    """An internal transition or join that a macro step alone does not cause, but may with others.

    It waits for bits that are `missing` or `present`, which the macro step does not change; or, if
    there are none, for some of a field of bits each of `fields`, or, if there are none of these
    either, for less in a field of `filled`.
    """

    transition: int
    missing: int
    present: int
    fields: tuple[int, ...] = ()
    filled: tuple[int, ...] = ()


@dataclass(slots=True)
class MacroStep:
    """What all transitions of a macro step need, forbid, clear and set, taken together.

    `alone`: it is one transition that causes nothing.
    """

    needs: int = 0
    forbids: int = 0
    clears: int = 0
    sets: int = 0
    alone: bool = True
    feeds: list[Feed] = field(default_factory=list)


class MacroSteps:
    """Computes macro steps. One with a visible transition in it is unknown."""

    def __init__(self, encoding: Encoding, read_write: ReadWriteSets, visible: int) -> None:
        """`visible`: transitions, as a mask of their numbers."""
        self.encoding = encoding
        self.read_write = read_write
        transitions = encoding.net.transitions
        self._visible = bytearray(visible >> transition.index & 1 for transition in transitions)
        self._internal_transitions = [r.index for r in transitions if r.kind is Kind.INTERNAL]
        self._join_transitions = [r.index for r in transitions if r.kind is Kind.JOIN]
        self._is_internal = bytearray(
            transition.kind is Kind.INTERNAL for transition in transitions
        )
        self._wanting: dict[int, int] = {}
        self._barred: dict[int, int] = {}
        for transition in transitions:
            if transition.kind is not Kind.EXTERNAL:
                self._register(transition.index)
        self._wanting_any = Union(self._wanting)
        self._barred_any = Union(self._barred)
        self._readers: dict[int, list[int]] = {}
        for number in self._internal_transitions:
            for low in bits_of(read_write.needs[number] | read_write.forbids[number]):
                self._readers.setdefault(low, []).append(number)

    def _register(self, number: int) -> None:
        c = self.encoding.transitions[number]
        wants, barred = c.need, c.test & ~c.need
        for mask in (*c.any_of, *(mask for mask, _, _ in c.at_least)):
            wants |= mask
        for mask, _, _ in c.at_most:
            barred |= mask
        for low in bits_of(wants):
            self._wanting[low] = self._wanting.get(low, 0) | 1 << number
        for low in bits_of(barred):
            self._barred[low] = self._barred.get(low, 0) | 1 << number

    def of(self, number: int, state: int) -> MacroStep | None:
        """Return the macro step of a transition that is enabled in a state.

        None: something in it is visible, it is too large, or it can go on for ever.
        """
        if self._visible[number]:
            return None
        macro_step = MacroStep()
        self._add(macro_step, number)
        if self._is_internal[number]:
            return macro_step
        after, _ = self.encoding.fire(number, state)
        read_write = self.read_write
        following: dict[int, list[int]] = {after: []}
        waiting = [(after, read_write.clears[number] | read_write.sets[number])]
        again = False
        while waiting:
            now, changed = waiting.pop()
            self._feed(macro_step, state, now)
            for each in self._caused(now, changed) or self._joining(now):
                if self._visible[each]:
                    return None
                macro_step.alone = False
                self._add(macro_step, each)
                then, _ = self.encoding.fire(each, now)
                following[now].append(then)
                if then in following:
                    again = True
                    continue
                if len(following) > _MOST_STATES:
                    return None
                following[then] = []
                waiting.append((then, changed | read_write.clears[each] | read_write.sets[each]))
        if again and _goes_round(following):
            return None
        return macro_step

    def _add(self, macro_step: MacroStep, number: int) -> None:
        read_write = self.read_write
        macro_step.needs |= read_write.needs[number]
        macro_step.forbids |= read_write.forbids[number]
        macro_step.clears |= read_write.clears[number]
        macro_step.sets |= read_write.sets[number]

    def _caused(self, state: int, changed: int) -> list[int]:
        enabled = self.encoding.enabled
        if changed.bit_count() > len(self._internal_transitions):
            return [n for n in self._internal_transitions if enabled(n, state)]
        asked: set[int] = set()
        for low in bits_of(changed):
            asked.update(self._readers.get(low, ()))
        return [n for n in asked if enabled(n, state)]

    def _joining(self, state: int) -> list[int]:
        return [n for n in self._join_transitions if self.encoding.enabled(n, state)]

    def _feed(self, macro_step: MacroStep, before: int, now: int) -> None:
        """Note the transitions that are disabled in a state on the way, but may fire after others.

        What the macro step's own changes disable here, they disable there too.
        """
        changed = before ^ now
        fed = self._wanting_any(now & changed) | self._barred_any(before & changed)
        while fed:
            low = fed & -fed
            fed ^= low
            number = low.bit_length() - 1
            c = self.encoding.transitions[number]
            missing, present = c.need & ~now, c.test & ~c.need & now
            if (missing | present) & changed:
                continue
            if missing or present:
                macro_step.feeds.append(Feed(number, missing, present))
                continue
            fields = [mask for mask in c.any_of if not now & mask]
            fields += [mask for mask, offset, n in c.at_least if (now & mask) >> offset < n]
            filled = [mask for mask, offset, n in c.at_most if (now & mask) >> offset > n]
            if fields or filled:
                macro_step.feeds.append(Feed(number, 0, 0, tuple(fields), tuple(filled)))


def _goes_round(following: dict[int, list[int]]) -> bool:
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


class DeferrableArrivals:
    """Finds last transitions that can be deferred."""

    def __init__(
        self, encoding: Encoding, read_write: ReadWriteSets, visible: int, safe: frozenset[int]
    ) -> None:
        """`visible`: transitions, as a mask; `safe`: places that never have two tokens."""
        self.encoding = encoding
        self.read_write = read_write
        self._visible = visible
        places = encoding.net.places
        self._safe = encoding.places_mask(
            p.index for p in places if p.index in safe and encoding.width[p.index] == 1
        )
        self._come: dict[int, bool] = {}
        self._gone: dict[int, bool] = {}

    def excused(self, macro_step: MacroStep, state: int, left_out: int) -> list[Feed]:
        """The feeds of a macro step in whose place another arrival can wait, or that need such a
        feed.

        `left_out`: interruptions after which it makes no difference what the macro step did.
        """
        if not macro_step.alone:
            return []
        for feed in macro_step.feeds:
            if self._waits(feed, state, left_out):
                after = 1 << feed.transition | left_out
                return [e for e in macro_step.feeds if e is feed or self._only_after(e, after)]
        return []

    def _waits(self, feed: Feed, state: int, left_out: int) -> bool:
        return any(self._comes_last(low, feed.transition) for low in bits_of(feed.missing)) or any(
            self._goes_last(low, feed.transition)
            and self._unseen(low, feed.transition, state, left_out)
            for low in bits_of(feed.present)
        )

    def _only_after(self, feed: Feed, after: int) -> bool:
        """Whether only certain transitions bring about what a feed waits for."""
        read_write = self.read_write
        return any(
            not read_write.setting.get(low, 0) & ~after for low in bits_of(feed.missing)
        ) or any(not read_write.clearing.get(low, 0) & ~after for low in bits_of(feed.present))

    def _comes_last(self, bit: int, join: int) -> bool:
        """Whether only deferrable transitions bring a token to a place that one join
        alone reads.
        """
        known = self._come.get(bit)
        if known is None:
            known = self._come[bit] = self._is_brought(bit)
        return known and self.read_write.needing.get(bit, 0) == 1 << join

    def _goes_last(self, bit: int, end: int) -> bool:
        """Whether only deferrable transitions take a token off a place."""
        known = self._gone.get(bit)
        if known is None:
            known = self._gone[bit] = self._is_taken(bit)
        return known and bool(self.read_write.forbidding.get(bit, 0) >> end & 1)

    def _is_brought(self, bit: int) -> bool:
        """See `_comes_last`.

        A transition that needs the source cannot fire while its token is at `bit`; otherwise, with
        a deferred transition, there would be two tokens at the source. So its effect on `bit` makes
        no difference.
        """
        read_write = self.read_write
        needing = read_write.needing.get(bit, 0)
        if not bit & self._safe or not needing or needing & (needing - 1):
            return False
        if not bit & self.encoding.transitions[needing.bit_length() - 1].need:
            return False
        makers = read_write.setting.get(bit, 0)
        return bool(makers) and all(
            (source := self._source(low.bit_length() - 1)) != 0
            and read_write.sets[low.bit_length() - 1] == bit
            and read_write.forbidding.get(source, 0) == read_write.forbidding.get(bit, 0)
            and self._emptying(source) == self._emptying(bit) & ~read_write.needing[source]
            for low in bits_of(makers)
        )

    def _is_taken(self, bit: int) -> bool:
        read_write = self.read_write
        takers = read_write.clearing.get(bit, 0) & read_write.needing.get(bit, 0)
        return bool(takers) and all(
            self._source(low.bit_length() - 1) == bit
            and all(
                self._tells_nothing(b, bit) for b in bits_of(read_write.sets[low.bit_length() - 1])
            )
            for low in bits_of(takers)
        )

    def _tells_nothing(self, bit: int, source: int) -> bool:
        """Whether no transition reads a bit, and it is cleared with the place its token
        came from.
        """
        read_write = self.read_write
        return (
            bool(bit & self._safe)
            and not read_write.needing.get(bit, 0)
            and not read_write.forbidding.get(bit, 0)
            and read_write.clearing.get(bit, 0) == self._emptying(source)
        )

    def _emptying(self, bit: int) -> int:
        """The transitions that take a token away without testing whether it is there."""
        return self.read_write.clearing.get(bit, 0) & ~self.read_write.needing.get(bit, 0)

    def _source(self, number: int) -> int:
        """The bit from which a deferrable transition takes its token; 0: it is not deferrable."""
        read_write, transitions = self.read_write, self.encoding.net.transitions
        transition, c = transitions[number], self.encoding.transitions[number]
        if self._visible >> number & 1 or transition.kind is not Kind.EXTERNAL or not c.plain:
            return 0
        source = read_write.needs[number]
        if source & (source - 1) or not source & self._safe or read_write.clears[number] != source:
            return 0
        if read_write.forbids[number] or transition.flag is not None:
            return 0
        users = read_write.needing.get(source, 0)
        for low in bits_of(users):
            user = low.bit_length() - 1
            outside = transitions[user].kind is Kind.EXTERNAL
            if not outside or not source & self.encoding.transitions[user].need:
                return 0
        return source

    def _unseen(self, bit: int, end: int, state: int, left_out: int) -> bool:
        """Whether all that wait for a token to go must wait for the same end anyway."""
        read_write = self.read_write
        kept = 0
        for low in bits_of(self.encoding.transitions[end].need & state):
            if not read_write.clearing.get(low, 0) & ~(1 << end | left_out):
                kept |= low
        others = read_write.forbidding.get(bit, 0) & ~(1 << end)
        for low in bits_of(others):
            c = self.encoding.transitions[low.bit_length() - 1]
            if not c.test & ~c.need & kept:
                return False
        return True
