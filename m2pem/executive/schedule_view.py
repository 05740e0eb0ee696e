"""The schedule as operators see it, made from its entries and from what the scheduler knows."""

from m2pem.api.schedule import ScheduledMission, ScheduledStatus
from m2pem.executive.scheduled_start import Look
from m2pem.scheduling import times
from m2pem.scheduling.entry import EntryState, ScheduleEntry
from m2pem.scheduling.times import Due


def scheduled_mission(entry: ScheduleEntry, look: Look, held: str, now_us: int) -> ScheduledMission:
    """Return an entry as operators see it. `held`: by whom, and why; "": it is not."""
    plan, state = entry.plan, entry.state
    found = times.due(plan, state, now_us) if state.active else Due()
    return ScheduledMission(
        entry.id,
        plan.mission_name,
        plan.process,
        plan.when,
        times.described(plan.when),
        _status(state, found, look, held),
        plan.priority,
        plan.by,
        plan.scheduled_us,
        found.next_us,
        found.due_us,
        found.deadline_us,
        look.starts_us if state.active and not held else None,
        held or (look.reason if state.active else state.detail),
        state.run,
        state.times,
    )


def _status(state: EntryState, found: Due, look: Look, held: str) -> ScheduledStatus:
    if not state.active:
        return ScheduledStatus(state.status.value)
    if held:
        return ScheduledStatus.HELD
    if look.starts_us is not None:
        return ScheduledStatus.STARTING
    return ScheduledStatus.SCHEDULED if found.due_us is None else ScheduledStatus.WAITING
