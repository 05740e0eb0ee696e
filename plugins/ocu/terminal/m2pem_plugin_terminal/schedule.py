"""The schedule as lists to choose from: its entries, and what can be done with one."""

from pathlib import Path

from m2pem.api import Schedule, ScheduledMission, ScheduledStatus, When
from m2pem_plugin_terminal.dialogs import Choice

TITLE = "Scheduled missions"
NOTHING_SCHEDULED = (
    "Nothing is scheduled. `m2pem start MISSION --when ...` has a mission started later."
)
WHEN_HINT = (
    "When: 08:00 or 2027-03-01 08:00, after r3 (when that run has completed), or by cron: 0 8 * * *"
)
CRON_FIELDS = 5
ALL = "all"
"""The value of the line that holds the whole schedule, or releases it."""


def schedule_choices(schedule: Schedule) -> list[Choice]:
    """Return a line for each entry that may still start something, and one for all of them."""
    lines = [
        Choice(each.entry, f"{each.entry} {Path(each.mission).stem}, {each.when_text}", each.status)
        for each in schedule.entries
        if not each.status.over
    ]
    what = "Release the whole schedule" if schedule.hold else "Hold the whole schedule"
    return [*lines, Choice(ALL, what)]


def entry_choices(mission: ScheduledMission) -> list[Choice]:
    """Return what can be done with an entry."""
    held = mission.status is ScheduledStatus.HELD
    hold = Choice("release", "Release it") if held else Choice("hold", "Hold it")
    return [
        hold,
        Choice("cancel", "Cancel it: it starts nothing any more"),
        Choice("start", "Start it now, whatever it waits for"),
    ]


def when_of(text: str) -> When:
    """Return when a mission is to start, as operators type it (`WHEN_HINT`); the executive refuses
    what makes no sense."""
    words = text.split()
    if words[0] == "after":
        return When(after=" ".join(words[1:]))
    if len(words) == CRON_FIELDS:
        return When(cron=" ".join(words))
    return When(at=" ".join(words))
