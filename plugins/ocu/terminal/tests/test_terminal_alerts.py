"""Alerts in the terminal: they stay until an operator has seen them."""

import socket

import pytest
from m2pem_plugin_terminal import display
from terminal_world import World

from m2pem.api import Alert
from m2pem.api.runs import LOGGED, SCHEDULE
from m2pem.journal.standbys import standby_of


async def test_alerts_of_no_run_stay_until_they_are_seen(world: World) -> None:
    publish = world.executive.events.publish
    async with world.terminal() as terminal:
        await terminal.press("a")
        await terminal.until_shown("There are no alerts.")
        await terminal.press("escape")
        publish(Alert("", "JOURNAL", "the journal does not write"))
        publish(Alert("", LOGGED, "uav: compass variance"))
        publish(Alert("", LOGGED, "uav: compass variance"))
        publish(Alert("", SCHEDULE, "s1 is scheduled by bob"))
        await terminal.until_shown("s1 is scheduled by bob")
        for _ in range(8):  # each takes a second: the notice gets old
            await terminal.press("escape")
        await terminal.until_shown("2 alerts (a)")
        await terminal.press("a")
        await terminal.until_shown("the journal does not write", "compass variance (2 times)")
        assert terminal.line("journal does not write").count("!") == 1
        assert not terminal.shows("s1 is scheduled")
        await terminal.press("escape")
        await terminal.until_gone("2 alerts (a)")
        await terminal.press("a")
        await terminal.until_shown("the journal does not write")
        assert "!" not in terminal.line("journal does not write")


async def test_the_header_says_who_stands_by_and_an_alert_when_there_is_no_standby_any_more(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(display, "STANDBYS_EVERY_S", 0.01)
    journal, served = world.executive.journal, standby_of(world.executive.fleet.name)
    async with world.terminal() as terminal:
        await terminal.until_shown("no mission is running")
        assert not terminal.shows("standby")
        await journal.serve_fleet(served, ["1"])
        await terminal.until_shown(f"standby: {socket.gethostname()}")
        await world.start()
        await terminal.until_shown("RUNNING", f"standby: {socket.gethostname()}")
        await journal.leave_fleet(served)
        await terminal.until_shown("No executive stands by any more")
        await terminal.until_gone("standby:")
        await terminal.press("a")
        await terminal.until_shown("! ")
        assert "No executive stands by any more" in terminal.line("! ")
