"""Two runs of simulated vehicles wait for each other: the screen says so, and one is stopped."""

from m2pem_plugin_terminal.app import TerminalApp
from terminal_world import SIZE, Hand, Terminal

from m2pem.api.runs import RunStatus
from m2pem.testing import scenarios
from m2pem.testing.harness import run_executive
from tests.waiting_circle import GO, NONE_GOES_ON, holding_and_waiting


async def test_an_operator_stops_one_of_two_runs_that_wait_for_each_other() -> None:
    fleet = scenarios.fleet("sim", {"ugv1": {}, "ugv2": {}})
    hand = Hand()
    async with run_executive(fleet, speed=5.0) as control:
        app = TerminalApp(control, now=hand.now, by="anna@gcs1")
        async with app.run_test(size=SIZE) as pilot:
            terminal = Terminal(app, pilot, hand)
            first = await control.start(holding_and_waiting("ugv1", "ugv2"))
            second = await control.start(holding_and_waiting("ugv2", "ugv1"))
            await control.signal(GO)
            # The log has it whole, on several lines.
            await terminal.until_shown(NONE_GOES_ON, "Stop one of them (`m2pem stop", f"{second}`)")
            await terminal.press("r")
            await terminal.until_shown("─ Runs ─", f"1 {second}", f"2 {first}")
            await terminal.press("1")
            await terminal.until_shown(f"{second}  +1 more (r)", NONE_GOES_ON)
            await terminal.press("ctrl+x")
            await terminal.until_shown(f"STOP {second}?")
            await terminal.press("ctrl+x")
            stopped = await control.wait(second)
            assert stopped.detail == "stopped by anna@gcs1"
            assert (await control.wait(first)).status is RunStatus.TERMINATED
