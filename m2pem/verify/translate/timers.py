"""Timers that begin to run in the same moment: the one that is due first fires first."""

from collections.abc import Iterable
from dataclasses import replace

from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.mission.events import TimerEventDefinition, TimerKind
from m2pem.mission.expression import Expression
from m2pem.mission.timers import duration_us, fixed_us
from m2pem.verify.translate.context import TranslationContext
from m2pem.verify.translate.net_builder import Effect, ScopeDraft, Timed, TransitionDraft, product

_2026_US = 1_767_225_600_000_000


def due_us(expression: Expression) -> int | None:
    """A duration that the mission states, in microseconds; None: it does not."""
    if not expression.constant:
        return None
    try:
        return duration_us(expression.evaluate(lambda _: None), _2026_US)
    except (ExpressionError, ExpressionSyntaxError):
        return None


def timer_us(definition: TimerEventDefinition) -> int | None:
    """The same, of a timer event."""
    if definition.kind is not TimerKind.DURATION:
        return None
    return due_us(definition.expression)


def fixed(definition: TimerEventDefinition) -> int | None:
    """The duration of a timer event that the mission states, in microseconds."""
    if definition.kind is not TimerKind.DURATION:
        return None
    return written(definition.expression)


def written(expression: Expression) -> int | None:
    """A duration that is the same whenever it begins, in microseconds; None: it is unknown."""
    if not expression.constant:
        return None
    try:
        return fixed_us(expression.evaluate(lambda _: None))
    except (ExpressionError, ExpressionSyntaxError):
        return None


def runs(
    context: TranslationContext,
    holder: int,
    after_us: int | None,
    running: tuple[int, ...],
    transitions: list[TransitionDraft],
) -> None:
    """A timer begins to run when a token comes to `holder`. It runs while all of `running` have a
    token; `transitions` are what it does when it is due.
    """
    if after_us is not None:
        context.net.timed.setdefault(holder, []).append(Timed(after_us, running, transitions))


def holder_of(scope: ScopeDraft) -> int:
    """The place with whose token the timers of a scope's event subprocesses begin to run: that of
    the activity around it, or of the process itself.
    """
    active = getattr(scope.instance, "active", None)
    if isinstance(active, int):
        return active
    assert scope.open is not None
    return scope.open


def put_in_order(context: TranslationContext) -> None:
    """Prevent a timer from firing while an earlier one that began with it still runs."""
    instead: dict[int, list[TransitionDraft]] = {}
    for together in context.net.timed.values():
        for later in together:
            earlier = [each for each in together if each.after_us < later.after_us]
            for draft in later.transitions:
                instead[id(draft)] = _ordered(context, draft, earlier)
    context.net.drafts = [
        made for draft in context.net.drafts for made in instead.get(id(draft), [draft])
    ]


def _ordered(
    context: TranslationContext, draft: TransitionDraft, earlier: Iterable[Timed]
) -> list[TransitionDraft]:
    effects = [draft.effect]
    for each in earlier:
        effects = _after(context, effects, each)
    return [replace(draft, effect=effect) for effect in effects]


def _after(context: TranslationContext, effects: list[Effect], earlier: Timed) -> list[Effect]:
    """Let a later timer fire only when an earlier one does not run any more.

    Empty: the earlier one runs whenever the later one does.
    """
    stopped: list[Effect] = []
    running: list[int] = []
    for place in earlier.running:
        stopped.append(Effect(read=frozenset(running), inhibit=frozenset({place})))
        running.append(place)
    found = product(effects, stopped)
    distinct = not any(context.net.places[place].several for place in earlier.running)
    # Of several tokens on one place, it may be another one's timer that runs.
    return found if distinct or not found else effects
