"""The schedule in the terminal: what starts later, held, released and cancelled."""

from terminal_world import MISSION, World

from m2pem.api import When


async def test_entries_are_listed_held_released_and_cancelled(world: World) -> None:
    await world.executive.load_schedule()
    world.executive.serve_schedule()
    async with world.terminal() as terminal:
        await terminal.press("c")
        await terminal.until_shown("Nothing is scheduled")
        await terminal.press("escape")
        when = When(cron="0 8 * * *", time_zone="UTC")
        await world.control.schedule(MISSION, when=when, by="bob@gcs2")
        await terminal.until_shown("s1 is scheduled by bob@gcs2")
        await terminal.press("c")
        await terminal.until_shown("1 s1 patrol, by cron 0 8 * * * (UTC)  scheduled")
        await terminal.press("1")
        await terminal.until_shown("Hold it", "2 Cancel it", "3 Start it now")
        await terminal.press("1")
        await terminal.until_shown("s1 is held by anna@gcs1")
        await terminal.press("c")
        await terminal.press("1")
        await terminal.until_shown("1 Release it")
        await terminal.press("1")
        await terminal.until_shown("s1 is released by anna@gcs1")
        await terminal.press("c")
        await terminal.press("1")
        await terminal.press("2")
        await terminal.until_shown("s1 is cancelled by anna@gcs1")
    (entry,) = (await world.control.scheduled()).entries
    assert entry.status == "cancelled"


async def test_stop_of_all_holds_the_schedule_which_the_list_releases(world: World) -> None:
    await world.executive.load_schedule()
    world.executive.serve_schedule()
    await world.control.schedule(MISSION, when=When(cron="0 8 * * *", time_zone="UTC"))
    async with world.terminal() as terminal:
        await terminal.press("ctrl+a")
        await terminal.press("ctrl+a")
        await terminal.until_shown("the schedule is held by anna@gcs1")
        await terminal.press("c")
        await terminal.until_shown("2 Release the whole schedule")
        await terminal.press("2")
        await terminal.until_shown("the schedule is released by anna@gcs1")
    assert (await world.control.scheduled()).hold == ""
