"""Several runs in one terminal: the line of those that go on, and the list of all."""

from m2pem_plugin_terminal.runs import next_run, run_choices
from terminal_world import MISSION, World

from m2pem.api import RunStatus, RunSummary, When

OTHER = MISSION.read_bytes().replace(b'"scout"', b'"uav"')


async def test_a_line_shows_the_runs_that_go_on_and_brackets_change_between_them(
    world: World,
) -> None:
    async with world.terminal() as terminal:
        await world.start()
        await terminal.until_shown("RUNNING")
        assert not terminal.shows("[ ] next")
        await world.control.start(OTHER)
        await terminal.until_shown(" r1 patrol ?", " r2 mission ?", "[ ] next")
        await terminal.press("right_square_bracket")
        await terminal.until_shown("RUNNING   mission  r2")
        await terminal.press("right_square_bracket")
        await terminal.until_shown("RUNNING   patrol  r1")
        await terminal.press("left_square_bracket")
        await terminal.until_shown("RUNNING   mission  r2")
        await terminal.press("p")
        await terminal.until_shown(" r2 mission ?=", "PAUSED")
        await terminal.pilot.click("#runs", offset=(4, 0))
        await terminal.until_shown("RUNNING   patrol  r1")


async def test_the_list_has_what_is_to_come_and_is_searched(world: World) -> None:
    await world.executive.load_schedule()
    world.executive.serve_schedule()
    async with world.terminal() as terminal:
        await world.start()
        entry = await world.control.schedule(MISSION, when=When(at="2031-03-01"), by="bob")
        await terminal.until_shown("RUNNING")
        await terminal.press("r")
        await terminal.until_shown("1 r1 patrol.bpmn  running", f"2 {entry} patrol")
        await terminal.press("z", "z")
        await terminal.until_gone("1 r1 patrol")
        await terminal.until_shown("Runs: zz")
        await terminal.press("backspace", "backspace", *entry[:1], "enter")
        await terminal.until_shown("Hold it", "Cancel it")


def test_runs_that_go_on_come_first_then_the_newest_of_those_that_have_ended() -> None:
    def run(number: int, status: RunStatus) -> RunSummary:
        return RunSummary(f"r{number}", "/missions/a.bpmn", "P", status, 0)

    runs = [
        run(2, RunStatus.COMPLETED),
        run(10, RunStatus.FAILED),
        run(3, RunStatus.PAUSED),
        run(4, RunStatus.RUNNING),
    ]
    assert [each.value for each in run_choices(runs, None)] == ["r4", "r3", "r10", "r2"]


def test_the_next_run_is_found_around_the_end() -> None:
    assert next_run(["r1", "r2"], "r2", 1) == "r1"
    assert next_run(["r1", "r2"], "r1", -1) == "r2"
    assert next_run(["r1", "r2"], "r0", 1) == "r1"  # the run that is shown has ended
    assert next_run(["r1"], "r1", 1) is None
    assert next_run([], "", 1) is None
