"""Timers that begin to run in the same moment: the one that is due first comes first.

An activity's boundary timers, the limit of its own work, and the timers of the event subprocesses
inside it begin together; so do the timers behind an event-based gateway, and those of the event
subprocesses of a process. Only durations that are written in the mission can be compared, and of
those not the ones that have months or years, which are as long as the calendar says.
"""

from collections.abc import Iterable
from dataclasses import replace

from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.mission.duration import duration_us, fixed_us
from m2pem.mission.events import TimerEventDefinition, TimerKind
from m2pem.mission.expression import Expression
from m2pem.verify.translate.context import Making
from m2pem.verify.translate.net_builder import Area, Draft, Effect, Timed, product

_2026_US = 1_767_225_600_000_000


def due_us(expression: Expression) -> int | None:
    """A duration that is written in the mission, in microseconds; None: it is not."""
    if not expression.constant:
        return None
    try:
        value = expression.evaluate(lambda _: None)
        return duration_us(value, _2026_US) if isinstance(value, str) else None
    except (ExpressionError, ExpressionSyntaxError):
        return None


def timer_us(definition: TimerEventDefinition) -> int | None:
    """The same, of a timer event."""
    if definition.kind is not TimerKind.DURATION:
        return None
    return due_us(definition.expression)


def fixed(definition: TimerEventDefinition) -> int | None:
    """The duration of a timer event that is written in the mission, in microseconds."""
    if definition.kind is not TimerKind.DURATION:
        return None
    return written(definition.expression)


def written(expression: Expression) -> int | None:
    """A duration that is the same whenever it begins, in microseconds; None: it is not known."""
    if not expression.constant:
        return None
    try:
        return fixed_us(expression.evaluate(lambda _: None))
    except (ExpressionError, ExpressionSyntaxError):
        return None


def runs(
    making: Making, holder: int, after_us: int | None, running: tuple[int, ...], rules: list[Draft]
) -> None:
    """A timer begins to run when a token comes to `holder`; it runs while all of `running` have
    a token, and `rules` are what it does then."""
    if after_us is not None:
        making.net.timed.setdefault(holder, []).append(Timed(after_us, running, rules))


def holder_of(making: Making, area: Area) -> int:
    """With what the timers of an area's event subprocesses begin to run: the activity around it,
    or the process itself."""
    active = getattr(area.host, "active", None)
    if isinstance(active, int):
        return active
    assert area.open is not None
    return area.open


def put_in_order(making: Making) -> None:
    """No timer comes while one that began with it, and is due earlier, still runs."""
    instead: dict[int, list[Draft]] = {}
    for together in making.net.timed.values():
        for later in together:
            earlier = [each for each in together if each.after_us < later.after_us]
            for draft in later.rules:
                instead[id(draft)] = _ordered(making, draft, earlier)
    making.net.drafts = [
        made for draft in making.net.drafts for made in instead.get(id(draft), [draft])
    ]


def _ordered(making: Making, draft: Draft, earlier: Iterable[Timed]) -> list[Draft]:
    effects = [draft.effect]
    for each in earlier:
        effects = _after(making, effects, each)
    return [replace(draft, effect=effect) for effect in effects]


def _after(making: Making, effects: list[Effect], earlier: Timed) -> list[Effect]:
    """What a later timer does once an earlier one does not run any more; nothing, where that one
    runs whenever the later one does."""
    stopped: list[Effect] = []
    running: list[int] = []
    for place in earlier.running:
        stopped.append(Effect(read=frozenset(running), inhibit=frozenset({place})))
        running.append(place)
    found = product(effects, stopped)
    told_apart = not any(making.net.places[place].several for place in earlier.running)
    # Of several tokens on one place, it may be another one's timer that runs.
    return found if told_apart or not found else effects
