"""When a rule may be put before others although, with them, it causes more than alone.

Two branches come to a parallel join. Whichever comes last causes it; put the end of one branch
first, and it is the other's end that causes the join. Where a visible rule comes between the two
ends, that is another run. But it makes no difference if a third branch is still to come to the join
whose last rule can wait: in place of the rule that was put first, it comes when that one came, and
causes the join then. Such a *last rule* only moves a token to where nothing but the join waits for
it, and nobody else can tell whether it has done so.

The same with the end of a scope, for which the scope must be empty, in place of the join.
"""

from m2pem.verify.encoding import Encoding
from m2pem.verify.footprints import Footprints, bits_of
from m2pem.verify.macros import Feed, Macro
from m2pem.verify.system import Kind


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
