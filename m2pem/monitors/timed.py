"""The monitor of a formula with bounds in mission time.

The rest of the formula takes an operator with bounds as a proposition, whose truth is known later.
So moments wait until it is. What is known of those that wait, and of all that can still come, may
decide the formula before.
"""

from itertools import chain

from m2pem.monitors.anticipation import Verdict, anticipation, completions
from m2pem.monitors.dense_time import (
    Known,
    Range,
    Segments,
    Signal,
    delays_us,
    horizon_us,
    truth_of,
    union,
)
from m2pem.verify.ltl.formula import Formula, Proposition, Timed, propositions, walk


def base_propositions(formula: Formula) -> tuple[Proposition, ...]:
    """The propositions of a formula that say something of one moment."""
    found = (
        each for part in walk(formula) for each in propositions(part) if not isinstance(each, Timed)
    )
    return tuple(dict.fromkeys(found))


class TimedPlan:
    """What all evaluations of a formula with bounds have in common; see `TimedEvaluation`."""

    def __init__(self, formula: Formula) -> None:
        self.base = base_propositions(formula)
        self.anticipation = anticipation(formula)
        own = self.anticipation.propositions
        self.timed = [(1 << n, each) for n, each in enumerate(own) if isinstance(each, Timed)]
        self.bits: dict[Formula, int] = {each: 1 << n for n, each in enumerate(self.base)}
        self.direct = [
            (self.bits[each], 1 << n) for n, each in enumerate(own) if not isinstance(each, Timed)
        ]
        self.horizon_us = max((horizon_us(each) for _, each in self.timed), default=0)
        delays = frozenset(chain.from_iterable(delays_us(each) for _, each in self.timed))
        self.delays_us = sorted(delays) or [0]
        self._free: dict[tuple[int, int, int], int | None] = {}

    def free_step(self, state: int, letter: int, unknown: int) -> int | None:
        """The state after a moment with this letter of `base`, if no operator with bounds matters
        in it; else None."""
        key = (state, letter, unknown)
        if key not in self._free:
            own, own_unknown = self.direct_letter(letter, unknown)
            bounded = sum(bit for bit, _ in self.timed)
            step = self.anticipation.step
            after = {step(state, each, own_unknown) for each in completions(own, bounded)}
            self._free[key] = after.pop() if len(after) == 1 else None
        return self._free[key]

    def direct_letter(self, letter: int, unknown: int) -> tuple[int, int]:
        """The letter of the formula, and what is not known of it, without operators with bounds."""
        own = own_unknown = 0
        for theirs, mine in self.direct:
            own |= mine if letter & theirs else 0
            own_unknown |= mine if unknown & theirs else 0
        return own, own_unknown


class TimedEvaluation:
    """What is certain of a formula with bounds, as moments and time come.

    Letters have bit n for the n-th of `base`. Times are microseconds and never go back.
    """

    def __init__(self, plan: TimedPlan) -> None:
        self.verdict = Verdict.OPEN
        self._plan = plan
        self._anticipation = plan.anticipation
        self._state = plan.anticipation.start
        self._timed, self._bits = plan.timed, plan.bits
        self._horizon_us, self._delays_us = plan.horizon_us, plan.delays_us
        self._starts: list[int] = []
        self._changes_us: list[int] = []
        """When moments began that may still decide it, as time passes."""
        self._letters: list[tuple[int, int]] = []
        self._now_us = 0
        self.due_us: int | None = None
        """When time alone may decide it: then `advance` is to be called, if nothing comes before.

        A bound belongs to its interval: what comes in the same microsecond counts.
        """

    def read(self, t_us: int, letter: int, unknown: int = 0) -> Verdict:
        """A moment begins, with a letter of which some bits are not known."""
        self._now_us = t_us
        if len(self._letters) <= 1 and self._reads_freely(t_us, letter, unknown):
            return self.verdict
        self._starts.append(2 * t_us)
        self._changes_us = [
            *(each for each in self._changes_us if each + self._delays_us[-1] >= t_us),
            t_us,
        ]
        self._letters.append((letter, unknown))
        return self._evaluate(2 * t_us)

    def _reads_freely(self, t_us: int, letter: int, unknown: int) -> bool:
        """Read a moment if operators with bounds matter neither in it nor in the one before, which
        is the only one that is kept: then nothing waits."""
        free_step = self._plan.free_step
        before = self._state
        if self._letters:
            after = free_step(before, *self._letters[0])
            if after is None:
                return False
            before = after
        here = free_step(before, letter, unknown)
        if here is None:
            return False
        self._state = before
        self._starts, self._letters, self._changes_us = [2 * t_us], [(letter, unknown)], []
        self.verdict = self._anticipation.verdicts[here]
        self.due_us = None
        return True

    def advance(self, t_us: int) -> Verdict:
        """Time has passed without another moment."""
        if t_us > self._now_us and self._starts:
            self._now_us = t_us
            return self._evaluate(2 * t_us)
        return self.verdict

    def end(self) -> Verdict:
        """The last moment remains for ever."""
        if self.verdict is not Verdict.OPEN or not self._starts:
            return self.verdict
        settled = 2 * (self._now_us + self._horizon_us) + 1
        segments = Segments(self._starts, settled + 2 * self._horizon_us + 1)
        state, letter, unknown = self._state, 0, 0
        for _, letter, unknown in self._pieces(segments, segments.last_at(settled), known=True):
            state = self._anticipation.step(state, letter, unknown)
        self.verdict = self._anticipation.at_end(state, letter, unknown)
        self.due_us = None
        return self.verdict

    def _next_due_us(self) -> int | None:
        if self.verdict is not Verdict.OPEN:
            return None
        now = self._now_us
        dues = (t_us + delay + 1 for t_us in self._changes_us for delay in self._delays_us)
        return min((due for due in dues if due > now), default=None)

    def _evaluate(self, end: int) -> Verdict:
        if self.verdict is not Verdict.OPEN:
            return self.verdict
        # Behind what is known comes one more segment, of which nothing is known and which may
        # begin at once.
        segments = Segments([*self._starts, end], end + 2 * self._horizon_us + 2)
        last_known = end + len(self._starts) - 1
        state, waits, kept = self._state, False, segments.first
        for (_, last), letter, unknown in self._pieces(segments, last_known, known=False):
            waits = waits or any(unknown & bit for bit, _ in self._timed) or last == last_known
            state = self._anticipation.step(state, letter, unknown)
            if not waits:
                self._state, kept = state, last + 1
        self._forget(segments, kept)
        self.verdict = self._anticipation.verdicts[state]
        self.due_us = self._next_due_us()
        return self.verdict

    def _forget(self, segments: Segments, kept: int) -> None:
        """Forget what was before a position."""
        segment = segments.segment_of(kept)
        del self._starts[:segment], self._letters[:segment]
        if self._starts:
            self._starts[0] = kept - segment

    def _pieces(
        self, segments: Segments, until: int, *, known: bool
    ) -> list[tuple[Range, int, int]]:
        """Ranges of positions with one letter of the formula: it, and what is unknown of it.

        `known`: the last of the segments is known, too.
        """
        truths = self._truths(segments, known=known)
        cuts = {segments.range_of(n)[0] for n in range(len(self._letters))}
        for first, last in chain.from_iterable(chain.from_iterable(truths)):
            cuts |= {first, last + 1}
        order = sorted(cut for cut in cuts if segments.first <= cut <= until)
        found = []
        direct = self._plan.direct_letter
        for place, first in enumerate(order):
            last = order[place + 1] - 1 if place + 1 < len(order) else until
            letter, unknown = direct(*self._letters[segments.segment_of(first)])
            for (bit, _), (certain, possible) in zip(self._timed, truths, strict=True):
                if _has(certain, first):
                    letter |= bit
                elif _has(possible, first):
                    unknown |= bit
            found.append(((first, last), letter & ~unknown, unknown))
        return found

    def _truths(self, segments: Segments, *, known: bool) -> list[Known]:
        """Of each operator with bounds: where it is certainly true, and where it may be."""
        future = [] if known else [segments.range_of(len(self._letters))]

        def of_proposition(each: Formula) -> Known:
            bit = self._bits[each]
            certain, possible = [], list(future)
            for number, (letter, unknown) in enumerate(self._letters):
                span = segments.range_of(number)
                if unknown & bit:
                    possible.append(span)
                elif letter & bit:
                    certain.append(span)
            return union(certain), union([*certain, *possible])

        return [truth_of(each, of_proposition, segments) for _, each in self._timed]


def _has(signal: Signal, position: int) -> bool:
    return any(first <= position <= last for first, last in signal)
