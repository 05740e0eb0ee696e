"""STOP and Ctrl-C: by two presses, over everything."""

import pytest
from terminal_world import World

from m2pem.api.runs import RunStatus


async def status(world: World, run: str) -> RunStatus:
    return next(each.status for each in await world.control.runs() if each.run == run)


async def test_the_second_press_stops_the_mission(world: World) -> None:
    async with world.terminal() as terminal:
        run = await world.start()
        await terminal.until_shown("RUNNING", "^X STOP")
        await terminal.press("ctrl+x")
        await terminal.until_shown("STOP r1?")
        assert await status(world, run) is RunStatus.RUNNING
        await terminal.press("ctrl+x")
        await terminal.until_shown("STOPPED")
        assert (await world.control.runs())[0].detail == "stopped by anna@gcs1"


async def test_another_key_stops_every_mission(world: World) -> None:
    async with world.terminal() as terminal:
        run = await world.start()
        await terminal.until_shown("RUNNING")
        await terminal.press("ctrl+a")
        await terminal.until_shown("STOP all runs?", "Press ^A again")
        assert await status(world, run) is RunStatus.RUNNING
        await terminal.press("ctrl+a")
        await terminal.until_shown("STOPPED")


@pytest.mark.parametrize(
    "keys",
    [
        ["s"],
        *(pytest.param([key], marks=pytest.mark.long) for key in ("t", "r", "question_mark", "q")),
        ["slash", "x"],
    ],
)
async def test_stop_works_over_everything(world: World, keys: list[str]) -> None:
    async with world.terminal() as terminal:
        await world.start()
        await terminal.until_shown("RUNNING", "Question 1 of 2")
        await terminal.press(*keys)
        await terminal.until_shown("STOP")
        await terminal.press("ctrl+x")
        await terminal.until_shown("STOP r1?")
        await terminal.press("ctrl+x")
        await terminal.until_shown("STOPPED")
        assert len(terminal.app.screen_stack) == 1


async def test_escape_thinks_better_of_it(world: World) -> None:
    async with world.terminal() as terminal:
        run = await world.start()
        await terminal.until_shown("RUNNING")
        await terminal.press("s", "ctrl+x")
        await terminal.until_shown("STOP r1?", "Send a signal")
        await terminal.press("escape")
        await terminal.until_gone("STOP r1?")
        assert terminal.shows("Send a signal")
        await terminal.press("ctrl+x")
        await terminal.until_shown("STOP r1?")
        assert await status(world, run) is RunStatus.RUNNING


async def test_a_press_long_after_the_first_is_a_first_again(world: World) -> None:
    async with world.terminal() as terminal:
        run = await world.start()
        await terminal.until_shown("RUNNING")
        await terminal.press("ctrl+x")
        world.hand.now_s += 60
        await terminal.until_gone("STOP r1?")
        await terminal.press("ctrl+x")
        await terminal.until_shown("STOP r1?")
        assert await status(world, run) is RunStatus.RUNNING


async def test_ctrl_c_asks_once_and_then_stops(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        await terminal.until_shown("RUNNING")
        await terminal.press("ctrl+c")
        await terminal.until_shown("STOP r1?")
        await terminal.press("ctrl+c")
        await terminal.until_shown("STOPPED")
        assert terminal.app.is_running


async def test_ctrl_c_quits_when_nothing_runs(world: World) -> None:
    async with world.terminal() as terminal:
        await terminal.until_shown("no mission is running")
        await terminal.press("ctrl+c")
        await terminal.until_shown("Quit?  Press ^C again")
        await terminal.press("ctrl+c")
        await terminal.until(lambda: not terminal.app.is_running)


async def test_any_of_several_operators_can_stop(world: World) -> None:
    async with world.terminal("anna@gcs1") as anna, world.terminal("bob@gcs2") as bob:
        await world.start()
        await anna.until_shown("RUNNING")
        await bob.until_shown("RUNNING")
        await bob.press("ctrl+x")
        await bob.press("ctrl+x")
        await anna.until_shown("STOPPED", "r1 stopped: stopped by bob@gcs2")
