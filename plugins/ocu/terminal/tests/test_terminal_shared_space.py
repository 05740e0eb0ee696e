"""Shared space in the terminal: who has a place, and who waits since when."""

from pathlib import Path

from m2pem_plugin_terminal.app import TerminalApp
from terminal_world import SIZE, Hand, Terminal

from m2pem.fleet.fleet_file import load_fleet
from m2pem.testing.harness import run_executive
from tests.deconfliction.test_clearance_simulate import both_ways, write_rovers


async def test_who_is_on_the_bridge_and_who_waits_for_it_is_shown(tmp_path: Path) -> None:
    hand = Hand()
    async with run_executive(load_fleet(write_rovers(tmp_path)), speed=2.0) as control:
        app = TerminalApp(control, now=hand.now, by="anna@gcs1")
        async with app.run_test(size=SIZE) as pilot:
            terminal = Terminal(app, pilot, hand)
            run = await control.start(both_ways())
            while not await control.waiting():
                await pilot.pause(0.01)
            await terminal.press("f")
            await terminal.until_shown(
                "Shared space and waiting tasks",
                "bridge  1 of 1 taken",
                f"one ({run}.b1)",
                f"West of {run} waits since",
                "Tasks that wait, in the order of service",
            )
