"""The mission pane: a tree of what is active, with what has just finished fading to nothing."""

from textwrap import wrap

from rich.cells import cell_len
from rich.text import Text

from m2pem.api.records import TokenOutcome, Trigger
from m2pem_plugin_terminal.board import Active, Board, Done
from m2pem_plugin_terminal.words import clock_time, shortened

FADES_FOR_S = 10.0
FRESH_FOR_S = 2.0

FRESH = "#8fb89a"
FADING = ("#8a929c", "#747c86", "#5f6771", "#4b525b")
LINES = "#4b525b"
DETAIL = "#9aa4af"

SYMBOLS = {"doing": ("●", "#7fc8a9"), "asking": ("?", "bold #e8c468"), "waiting": ("○", "#8ab4d8")}
OUTCOMES = {
    TokenOutcome.COMPLETED: "✓",
    TokenOutcome.INTERRUPTED: "-",
    TokenOutcome.TERMINATED: "-",
    TokenOutcome.FAILED: "✗",
}


def mission_tree(board: Board, now: float, time_s: float, width: int) -> Text:
    """The tree. `now`: the operator's clock; `time_s`: mission time; `width` in cells."""
    lines: list[Text] = []
    tops = [number for number, scope in board.scopes.items() if scope.parent is None]
    for number in tops:
        process = board.label(board.scopes[number].element)
        lines.append(Text(shortened(process, width), "bold #c8d0d9"))
        lines += _children(board, number, now, time_s, width, "")
    if not tops:
        if board.status.ended:
            detail = f": {board.outcome_detail}" if board.outcome_detail else ""
            text = f"{board.status.value} after {clock_time(board.time_s)}{detail}"
            # A screen that is being set up or taken down has no width yet, or no longer.
            lines += [Text(line, "#c8d0d9") for line in wrap(text, max(1, width))]
        gone = [done for done in board.done if now - done.at < FADES_FOR_S]
        lines += [_done_line(board, done, now, width) for done in gone]
    return Text("\n").join(lines)


def _children(
    board: Board, scope: int, now: float, time_s: float, width: int, indent: str
) -> list[Text]:
    items: list[Active | Done] = [a for a in board.active.values() if a.scope == scope]
    items += [d for d in board.done if _home(board, d) == scope and now - d.at < FADES_FOR_S]
    items.sort(key=lambda item: item.order)
    lines: list[Text] = []
    for place, item in enumerate(items):
        last = place == len(items) - 1
        branch, below = ("└ ", "  ") if last else ("├ ", "│ ")
        room = width - cell_len(indent) - 2
        inner: list[Text] = []
        if isinstance(item, Done):
            own = [_done_line(board, item, now, room)]
        else:
            own = _active_lines(board, item, time_s, room)
            for number, each in board.scopes.items():
                if each.token == item.token and each.parent == scope:
                    inner += _children(board, number, now, time_s, width, indent + below)
        lines.append(Text.assemble((indent + branch, LINES), own[0]))
        lines += [Text.assemble((indent + below, LINES), each) for each in own[1:]]
        lines += inner
    return lines


def _home(board: Board, done: Done) -> int | None:
    """The scope to show it in: its own, or, when that has ended, the first that is left."""
    if done.scope in board.scopes:
        return done.scope
    return next((number for number, s in board.scopes.items() if s.parent is None), None)


def _done_line(board: Board, done: Done, now: float, width: int) -> Text:
    age_s = now - done.at
    colour = FRESH if done.outcome is TokenOutcome.COMPLETED else FADING[0]
    if age_s >= FRESH_FOR_S:
        step = int((age_s - FRESH_FOR_S) / (FADES_FOR_S - FRESH_FOR_S) * len(FADING))
        colour = FADING[min(step, len(FADING) - 1)]
    symbol = OUTCOMES[done.outcome]
    return Text(f"{symbol} {shortened(board.label(done.element), width - 2)}", colour)


def _active_lines(board: Board, active: Active, time_s: float, width: int) -> list[Text]:
    """Its name and what it does: on one line if there is room, else on two."""
    inside = any(scope.token == active.token for scope in board.scopes.values())
    kind = "asking" if active.prompts else "doing" if active.doing or inside else "waiting"
    symbol, colour = SYMBOLS[kind]
    label = shortened(board.label(active.element), width - 2)
    first = Text.assemble((symbol, colour), " ", (label, "#e3e8ee"))
    details = _details(board, active, time_s)
    lines = [first]
    for detail in details:
        if len(lines) == 1 and first.cell_len + 2 + cell_len(detail) <= width:
            first.append(f"  {detail}", DETAIL)
        else:
            lines.append(Text(f"    {shortened(detail, width - 4)}", DETAIL))
    return lines


def _details(board: Board, active: Active, time_s: float) -> list[str]:
    details = []
    for doing in active.doing.values():
        who = ", ".join(doing.who)
        state = f" ({doing.state})" if doing.state == "unsettled" else ""
        details.append(f"{who} {doing.what}{state}".strip())
    if active.prompts:
        details.append("asks the operator")
    for wait in active.waits.values():
        if wait.trigger is Trigger.TIMER:
            left = "a date" if wait.due_s is None else clock_time(max(0.0, wait.due_s - time_s))
            if wait.element == active.element:
                details.append(f"in {left}" if wait.due_s is not None else "until a date")
            else:
                details.append(f"{board.label(wait.element)} in {left}")
        elif wait.element == active.element:
            details.append(f"waits for {wait.trigger.value} {_named(board, wait.ref)}")
    return details


def _named(board: Board, ref: str) -> str:
    root = board.mission.signals.get(ref) or board.mission.messages.get(ref)
    return root.name if root is not None and root.name else ref
