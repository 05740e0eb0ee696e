"""The mission pane: a tree of active elements; finished ones fade away."""

from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import wrap

from rich.cells import cell_len
from rich.text import Text

from m2pem.api import RunView
from m2pem.api.description import printable, waiting
from m2pem.api.records import TokenOutcome, Trigger
from m2pem.api.run_view import Allocation, Behavior, FinishedToken, Token
from m2pem_plugin_terminal.formatting import clock_time, shortened

SHOWN_WHEN_DONE = frozenset(
    {
        "Task",
        "ManualTask",
        "UserTask",
        "ScriptTask",
        "ServiceTask",
        "SendTask",
        "ReceiveTask",
        "CallActivity",
        "SubProcess",
        "IntermediateCatchEvent",
        "BoundaryEvent",
    }
)
"""Kinds of elements that are shown when done; gateways and start events only pass tokens on."""

FADES_FOR_S = 10.0
FRESH_FOR_S = 2.0

FRESH = "#8fb89a"
FADING = ("#8a929c", "#747c86", "#5f6771", "#4b525b")
LINES = "#4b525b"
DETAIL = "#9aa4af"

SYMBOLS = {
    "stopped": ("!", "bold #e07a6a"),
    "doing": ("●", "#7fc8a9"),
    "asking": ("?", "bold #e8c468"),
    "waiting": ("○", "#8ab4d8"),
}
OUTCOMES = {
    TokenOutcome.COMPLETED: "✓",
    TokenOutcome.INTERRUPTED: "-",
    TokenOutcome.TERMINATED: "-",
    TokenOutcome.FAILED: "✗",
}


@dataclass(frozen=True, slots=True)
class Done:
    """A token that has left an element, `at` seconds by the operator's clock."""

    token: FinishedToken
    at: float


def shown_when_done(view: RunView, token: FinishedToken) -> bool:
    """Return whether the element of a finished token is shown for a while."""
    found = view.mission.elements.get(token.element) if view.mission is not None else None
    return type(found).__name__ in SHOWN_WHEN_DONE


def mission_tree(
    view: RunView, done: Sequence[Done], now: float, time_s: float, width: int
) -> Text:
    """Return the tree of active elements.

    `done`: tokens that have left lately. `now`: seconds of the operator's clock. `time_s`: mission
    time. `width`: in cells.
    """
    recent = [each for each in done if now - each.at < FADES_FOR_S]
    lines: list[Text] = []
    tops = [number for number, scope in view.scopes.items() if scope.parent is None]
    for number in tops:
        process = view.label(view.scopes[number].element)
        lines.append(Text(shortened(process, width), "bold #c8d0d9"))
        lines += _children(view, recent, number, now, time_s, width, "")
    if not tops:
        if view.status.ended:
            detail = f": {view.summary.detail}" if view.summary.detail else ""
            text = f"{view.status.value} after {clock_time(view.t_s)}{detail}"
            # While Textual opens or closes the screen, it has no width.
            lines += [Text(line, "#c8d0d9") for line in wrap(text, max(1, width))]
        lines += [_done_line(view, each, now, width) for each in recent]
    return Text("\n").join(lines)


def _children(
    view: RunView,
    recent: Sequence[Done],
    scope: int,
    now: float,
    time_s: float,
    width: int,
    indent: str,
) -> list[Text]:
    items: list[Token | Done] = [each for each in view.tokens.values() if each.scope == scope]
    items += [each for each in recent if _scope_shown(view, each) == scope]
    items.sort(key=lambda item: item.token.seq if isinstance(item, Done) else item.seq)
    lines: list[Text] = []
    for place, item in enumerate(items):
        last = place == len(items) - 1
        branch, below = ("└ ", "  ") if last else ("├ ", "│ ")
        room = width - cell_len(indent) - 2
        inner: list[Text] = []
        if isinstance(item, Done):
            own = [_done_line(view, item, now, room)]
        else:
            own = _active_lines(view, item, time_s, room)
            for number, each in view.scopes.items():
                if each.token == item.id and each.parent == scope:
                    inner += _children(view, recent, number, now, time_s, width, indent + below)
        lines.append(Text.assemble((indent + branch, LINES), own[0]))
        lines += [Text.assemble((indent + below, LINES), each) for each in own[1:]]
        lines += inner
    return lines


def _scope_shown(view: RunView, done: Done) -> int | None:
    """Return the scope of a finished token, or the nearest active one around it."""
    if done.token.scope in view.scopes:
        return done.token.scope
    return next((number for number, s in view.scopes.items() if s.parent is None), None)


def _done_line(view: RunView, done: Done, now: float, width: int) -> Text:
    age_s = now - done.at
    colour = FRESH if done.token.outcome is TokenOutcome.COMPLETED else FADING[0]
    if age_s >= FRESH_FOR_S:
        step = int((age_s - FRESH_FOR_S) / (FADES_FOR_S - FRESH_FOR_S) * len(FADING))
        colour = FADING[min(step, len(FADING) - 1)]
    symbol = OUTCOMES[done.token.outcome]
    return Text(f"{symbol} {shortened(view.label(done.token.element), width - 2)}", colour)


def _active_lines(view: RunView, active: Token, time_s: float, width: int) -> list[Text]:
    """Return the name of an element and its activity, on one line or two."""
    inside = any(scope.token == active.id for scope in view.scopes.values())
    works = any(not isinstance(each, Allocation) for each in active.work.values())
    kind = "asking" if active.prompts else "doing" if works or inside else "waiting"
    if any(each.token == active.id for each in view.incidents.values()):
        kind = "stopped"
    symbol, colour = SYMBOLS[kind]
    label = shortened(view.label(active.element), width - 2)
    first = Text.assemble((symbol, colour), " ", (label, "#e3e8ee"))
    details = _details(view, active, time_s)
    lines = [first]
    for detail in details:
        if len(lines) == 1 and first.cell_len + 2 + cell_len(detail) <= width:
            first.append(f"  {detail}", DETAIL)
        else:
            lines.append(Text(f"    {shortened(detail, width - 4)}", DETAIL))
    return lines


def _details(view: RunView, active: Token, time_s: float) -> list[str]:
    details = []
    for work in active.work.values():
        if isinstance(work, Behavior):
            unsettled = " (unsettled)" if work.state == "unsettled" else ""
            details.append(f"{', '.join(work.resources)} {work.name}{unsettled}".strip())
        elif isinstance(work, Allocation):
            details.append(printable(waiting(work.reason)))
        else:
            details.append(work.name)
    for incident in view.incidents.values():
        if incident.token == active.id:
            details.append(f"stopped by {incident.code}: press i")
    if active.prompts:
        details.append("asks the operator")
    for wait in active.waits.values():
        if wait.trigger is Trigger.TIMER:
            left = "a date" if wait.due_s is None else clock_time(max(0.0, wait.due_s - time_s))
            if wait.element == active.element:
                details.append(f"in {left}" if wait.due_s is not None else "until a date")
            else:
                details.append(f"{view.label(wait.element)} in {left}")
        elif wait.element == active.element:
            details.append(f"waits for {wait.trigger.value} {view.reference(wait.ref)}")
    return details
