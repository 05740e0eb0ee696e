"""The first line: which mission, how it stands, how far it is, and how long it has been going."""

from rich.text import Text

from m2pem.api.control import RunStatus
from m2pem_plugin_terminal.board import Board
from m2pem_plugin_terminal.words import clock_time, shortened

STATUS_STYLES = {
    RunStatus.RUNNING: "bold #1b2129 on #7fc8a9",
    RunStatus.PAUSED: "bold #1b2129 on #e8c468",
    RunStatus.COMPLETED: "bold #1b2129 on #8ab4d8",
    RunStatus.TERMINATED: "bold #1b2129 on #8ab4d8",
    RunStatus.FAILED: "bold #ffffff on #b3382c",
    RunStatus.STOPPED: "bold #ffffff on #b3382c",
}
BAR_CELLS = 8


def header(board: Board | None, others: int, time_s: float, width: int) -> Text:
    """One line of `width` cells; `others`: runs beside this one that have not ended."""
    if board is None:
        return Text(" m2pem: no mission is running", "#9aa4af")
    done, total = board.progress()
    right = Text()
    if total:
        filled = round(done / total * BAR_CELLS)
        right.append("━" * filled, "#7fc8a9")
        right.append("━" * (BAR_CELLS - filled), "#4b525b")
        right.append(f" {done}/{total} tasks  ", "#9aa4af")
    right.append(f"{clock_time(time_s)} ", "bold #e3e8ee")
    left = Text.assemble(
        (f" {board.status.value.upper()} ", STATUS_STYLES.get(board.status, "")), "  "
    )
    more = f"  +{others} more (r)" if others else ""
    room = width - left.cell_len - right.cell_len - len(more) - len(board.run) - 3
    if board.status is RunStatus.PAUSED:
        room -= len(board.by) + 5
    left.append(shortened(board.name, room), "bold #e3e8ee")
    left.append(f"  {board.run}", "#9aa4af")
    if board.status is RunStatus.PAUSED and board.by:
        left.append(f"  by {board.by}", "#9aa4af")
    left.append(more, "#e8c468")
    gap = max(1, width - left.cell_len - right.cell_len)
    return Text.assemble(left, " " * gap, right)
