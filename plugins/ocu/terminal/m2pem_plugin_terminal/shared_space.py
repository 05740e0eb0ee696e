"""Shared space and the tasks that wait, as `m2pem fleet --running` shows them."""

from collections.abc import Sequence

from rich.text import Text

from m2pem.api.allocation import SharedSpaceState, WaitingTask

TITLE = "Shared space and waiting tasks"
NOTHING = "The fleet has no shared space, and no task waits."


def space_text(spaces: Sequence[SharedSpaceState], waiting: Sequence[WaitingTask]) -> Text:
    """Return each shared space with who is in it and who waits, then all tasks that wait."""
    if not spaces and not waiting:
        return Text(NOTHING)
    text = Text()
    for space in spaces:
        full = len(space.holders) >= space.capacity
        text.append(f"{space.name}", "bold #e3e8ee")
        taken = f"  {len(space.holders)} of {space.capacity} taken\n"
        text.append(taken, "#e8c468" if full else "#7fc8a9")
        for holder in space.holders:
            text.append(f"  {holder}\n", "bold #e07a6a" if holder.lost else "#c8d0d9")
        for task in space.waiting:
            text.append(f"  {task.in_short()}\n", "#8ab4d8")
    if waiting:
        text.append("\nTasks that wait, in the order of service\n", "bold #e3e8ee")
        for task in waiting:
            text.append(f"  {task}\n", "#c8d0d9")
    return text
