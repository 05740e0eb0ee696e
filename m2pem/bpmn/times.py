"""Times of timers and timeouts, judged while a file is read: by value, else by kind."""

from collections.abc import Callable

from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.mission.events import TimerKind
from m2pem.mission.expression import Expression
from m2pem.mission.expression.kinds import kinds
from m2pem.mission.expression.temporal import DATE, DAYS, MOMENT, MONTHS
from m2pem.mission.expression.vocabulary import COERCING
from m2pem.mission.timers import cycle, date_us, duration_us
from m2pem.mission.values import Value

READERS: dict[str, Callable[[Value], object]] = {
    TimerKind.DURATION: lambda value: duration_us(value, 0),
    TimerKind.DATE: date_us,
    TimerKind.CYCLE: cycle,
}
_TAKES = {
    TimerKind.DATE: ("a date", {"text", "number", DATE, MOMENT}),
    TimerKind.DURATION: ("a duration", {"text", "number", DAYS, MONTHS}),
    TimerKind.CYCLE: ("a cycle, which is a text", {"text"}),
}


def wrong_time(expression: Expression, kind: TimerKind) -> str:
    """What is wrong with the time that an expression gives; "" if it is, or may be, right."""
    if expression.constant:
        try:
            READERS[kind](expression.evaluate(lambda _: None))
        except (ExpressionSyntaxError, ExpressionError) as error:
            return str(error)
        return ""
    found = kinds(expression.tree, coerced=expression.dialect in COERCING)
    what, takes = _TAKES[kind]
    if takes & found:
        return ""
    gives = f"gives a {' or a '.join(sorted(found))}" if found else "has no value"
    return f"'{expression.text.strip()}' {gives}, not {what}"
