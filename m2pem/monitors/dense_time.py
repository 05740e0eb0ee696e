"""The truth of formulas with bounds over a run, in dense time.

A moment lasts until the next one, so a run is a row of *segments*, each with a letter and two times
that belong to both it and its neighbours; moments at the same time are segments without length.
Times are in half microseconds: a formula whose bounds are whole microseconds is true or false in
all of the open time between two whole ones, which the odd number between them represents.

A *position* is a time in a segment. Positions are numbered: the number is the time plus the number
of the segment, so those of one segment are in a row, and the next segment follows. A *signal* is
the positions at which a formula is true: ranges of numbers, in order, with gaps between them.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Iterator, Sequence

from m2pem.verify.ltl.formula import (
    Always,
    And,
    Constant,
    Eventually,
    Formula,
    Iff,
    Implies,
    Not,
    Or,
    Timed,
    Until,
)

Range = tuple[int, int]
Signal = list[Range]


class Segments:
    """Segments from a time on. `starts`: of each; the end of one is the start of the next, and
    `end` that of the last."""

    def __init__(self, starts: Sequence[int], end: int) -> None:
        self.starts = starts
        self.ends = [*starts[1:], end]
        self.first = starts[0]
        self.last = end + len(starts) - 1
        """The numbers of the first and the last position."""

    def range_of(self, segment: int) -> Range:
        """The positions of a segment."""
        return self.starts[segment] + segment, self.ends[segment] + segment

    def segment_of(self, position: int) -> int:
        """The segment of a position."""
        firsts = [start + number for number, start in enumerate(self.starts)]
        return bisect_right(firsts, position) - 1

    def time_of(self, position: int) -> int:
        """The time of a position."""
        return position - self.segment_of(position)

    def first_at(self, time: int) -> int:
        """The first position at a time or later."""
        segment = bisect_left(self.ends, time)
        return max(time, self.first) + segment

    def last_at(self, time: int) -> int:
        """The last position at a time or earlier; before the first one, if there is none."""
        if time < self.first:
            return self.first - 1
        segment = bisect_right(self.starts, time) - 1
        return min(time, self.ends[segment]) + segment


def union(ranges: Iterable[Range]) -> Signal:
    """Join ranges that touch or overlap."""
    found: Signal = []
    for first, last in sorted(ranges):
        if first > last:
            continue
        if found and first <= found[-1][1] + 1:
            found[-1] = (found[-1][0], max(found[-1][1], last))
        else:
            found.append((first, last))
    return found


def intersection(left: Signal, right: Signal) -> Signal:
    return union(
        (max(a, c), min(b, d)) for a, b in left for c, d in right if max(a, c) <= min(b, d)
    )


def complement(signal: Signal, segments: Segments) -> Signal:
    found, at = [], segments.first
    for first, last in signal:
        found.append((at, first - 1))
        at = last + 1
    return union([*found, (at, segments.last)])


def until(left: Signal, right: Signal, low: int, high: int, segments: Segments) -> Signal:
    """`left U[low, high] right`; bounds are in half microseconds."""
    found = list(right) if low == 0 else []
    for first, last in left:
        for begin, end in right:
            # From a position of `left` it holds until the one after the range of `left`.
            y1, y2 = max(begin, first), min(end, last + 1)
            if y1 > y2:
                continue
            x1 = max(first, segments.first_at(segments.time_of(y1) - high))
            x2 = min(last, y2, segments.last_at(segments.time_of(y2) - low))
            found.append((x1, x2))
    return union(found)


Known = tuple[Signal, Signal]
"""Where a formula is certainly true, and where it may be."""


def truth_of(
    formula: Formula, of_proposition: Callable[[Formula], Known], segments: Segments
) -> Known:
    """Where a formula without unbounded operators is true. `of_proposition`: where others are."""

    def of(each: Formula) -> Known:
        return truth_of(each, of_proposition, segments)

    whole = [(segments.first, segments.last)]
    match formula:
        case Constant(value):
            return (whole, whole) if value else ([], [])
        case Not(operand):
            certain, possible = of(operand)
            return complement(possible, segments), complement(certain, segments)
        case And(operands):
            found = (whole, whole)
            for each in operands:
                certain, possible = of(each)
                found = intersection(found[0], certain), intersection(found[1], possible)
            return found
        case Or(operands):
            known = [of(each) for each in operands]
            return (
                union(span for certain, _ in known for span in certain),
                union(span for _, possible in known for span in possible),
            )
        case Implies(left, right):
            return of(Or((Not(left), right)))
        case Iff(left, right):
            return of(Or((And((left, right)), And((Not(left), Not(right))))))
        case Timed(Eventually(operand), low, high):
            certain, possible = of(operand)
            return (
                until(whole, certain, 2 * low, 2 * high, segments),
                until(whole, possible, 2 * low, 2 * high, segments),
            )
        case Timed(Always(operand), low, high):
            return of(Not(Timed(Eventually(Not(operand)), low, high)))
        case Timed(Until(left, right), low, high):
            one, two = of(left), of(right)
            return (
                until(one[0], two[0], 2 * low, 2 * high, segments),
                until(one[1], two[1], 2 * low, 2 * high, segments),
            )
        case _:
            return of_proposition(formula)


def horizon_us(formula: Formula) -> int:
    """How long after a moment the truth of a formula with bounds is known, in microseconds."""
    inner = [horizon_us(each) for each in _children(formula)]
    most = max(inner, default=0)
    return most + formula.high_us if isinstance(formula, Timed) else most


def delays_us(formula: Formula) -> frozenset[int]:
    """After which times a change may decide a formula with bounds, in microseconds."""
    inner = frozenset({0}).union(*(delays_us(each) for each in _children(formula)))
    if not isinstance(formula, Timed):
        return inner
    own = {formula.low_us, formula.high_us, formula.high_us - formula.low_us}
    return frozenset(a + b for a in inner for b in own) - {0}  # a change is read anyway


def _children(formula: Formula) -> Iterator[Formula]:
    match formula:
        case Timed(operand) | Not(operand) | Eventually(operand) | Always(operand):
            yield operand
        case And(operands) | Or(operands):
            yield from operands
        case Implies(left, right) | Iff(left, right) | Until(left, right):
            yield left
            yield right
        case _:
            return
