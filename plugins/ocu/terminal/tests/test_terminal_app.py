"""What the other keys do, and what the screen shows of missions."""

from dataclasses import replace

import pytest
from m2pem_plugin_terminal.mission_pane import mission_tree
from m2pem_plugin_terminal.vehicles_pane import Vehicles
from terminal_world import MISSION, World, scout

from m2pem.api.telemetry import (
    GeoPosition,
    LinkState,
    PayloadState,
    TeamMemberState,
    TeamState,
    VehicleState,
)
from m2pem.mission.catalogue import BehaviorState, ResourceId

POINT = {"type": "Point", "coordinates": [-77.3, 38.1]}


async def test_the_tree_shows_who_does_what_and_where(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        await terminal.until_shown("PATROL", "0/4 tasks")
        await world.clock.advance(30)
        await terminal.until_shown("five minutes  in 4:30", "0:30")
        assert terminal.line("DRIVE").startswith(" ├ ● DRIVE  scout drive_stop")
        assert terminal.line("? GATE").startswith(" ├ ? GATE  asks the operator")
        assert terminal.line("WATCH").startswith(" └ ● WATCH")
        assert terminal.line("five minutes").startswith("   └ ○ five minutes")


async def test_what_is_done_fades_and_goes(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        await terminal.until_shown("● DRIVE")
        await world.fake.until_called("start", "r1.b1")
        for state in (BehaviorState.ACCEPTED, BehaviorState.RUNNING, BehaviorState.SUCCEEDED):
            world.fake.report("r1.b1", state)
        await terminal.until_shown("✓ DRIVE", "scout ends drive_stop: succeeded", "1/4 tasks")
        fresh = terminal.app.export_screenshot()
        world.hand.now_s += 5
        await terminal.until(lambda: terminal.app.export_screenshot() != fresh)
        assert terminal.shows("✓ DRIVE")
        world.hand.now_s += 6
        await terminal.until_gone("✓ DRIVE")
        assert terminal.shows("scout ends drive_stop: succeeded")


async def test_pause_and_go_on(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        await terminal.until_shown("RUNNING", "p Pause")
        await terminal.press("p")
        await terminal.until_shown("PAUSED", "by anna@gcs1", "p Go on")
        await terminal.press("p")
        await terminal.until_shown("RUNNING", "r1 resumed by anna@gcs1")


async def test_a_signal_is_chosen_by_its_name(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        await terminal.until_shown("● DRIVE")
        await terminal.press("s")
        await terminal.until_shown("1 Come home  awaited", "2 Take a photo")
        await terminal.press("1")
        await terminal.until_shown("anna@gcs1: signal 'Come home'", "- DRIVE")
        assert not terminal.shows("Send a signal")


@pytest.mark.long
async def test_escape_sends_no_signal(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        await terminal.until_shown("● DRIVE")
        await terminal.press("s")
        await terminal.until_shown("Come home")
        await terminal.press("escape")
        await terminal.until_gone("Come home")
        assert terminal.shows("● DRIVE")


async def test_digits_in_a_dialog_answer_no_question(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        await terminal.until_shown("Question 1 of 2")
        await terminal.press("question_mark")
        await terminal.until_shown("answer the question")
        await terminal.press("1")
        await terminal.press("escape")
        await terminal.until_gone("answer the question")
        assert len(world.control.prompts()) == 2


async def test_the_filter_leaves_out_other_lines(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        await terminal.until_shown("GATE asks", "of PATROL started")
        await terminal.press("slash", *"bridge", "enter")
        await terminal.until_shown("Log: bridge", "BRIDGE asks")
        assert not terminal.shows("GATE asks")
        await terminal.press("2")  # keys are commands again
        await terminal.until_shown("Question: BRIDGE", "Log: bridge")
        await terminal.press("escape")
        await terminal.until_shown("GATE asks", "GATE: no")


async def test_vehicles_are_shown_with_all_that_matters(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        await terminal.until_shown("● DRIVE", "○ scout     no telemetry yet")
        world.fake.say(scout(0.75, behavior="r1.b1"))
        uav = ResourceId("uav")
        place = GeoPosition(38.2, -77.4, 100.0)
        world.fake.say(VehicleState(uav, 0, place, 40.0, link=LinkState.DEGRADED))
        world.fake.say(PayloadState(ResourceId("uav/eye"), 0, behavior="r9.b1"))
        await terminal.until_shown("● scout      75%  5.0 m/s auto", "38.10750 -77.31920")
        await terminal.until_shown("◐ uav", "38.20000 -77.40000 +40 m", "eye: r9.b1")
        assert terminal.screen.count("drive_stop") == 3  # tree, log and vehicle


async def test_a_camera_is_shown_with_what_it_does_and_where_it_looks(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        uav, eye = ResourceId("uav"), ResourceId("uav/eye")
        world.fake.say(VehicleState(uav, 0, GeoPosition(38.2, -77.4, 100.0)))
        world.fake.say(PayloadState(eye, 0, 0.5, -0.25, 4.0, behavior="zoom"))
        await terminal.until_shown("eye: 29°→ 14°↓ x4 zoom")
        world.fake.say(PayloadState(eye, 0, link=LinkState.LOST))
        await terminal.until_shown("eye: no telemetry")


async def test_a_member_of_a_march_is_shown_with_its_place(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        member = TeamMemberState(ResourceId("scout"), -4.2, 0.3, 18.6)
        world.fake.say(scout(0.75, behavior="r1.b1"))
        world.fake.say(TeamState("r1.b1", "road_sweep", 0, (member,), 15.0))
        await terminal.until_shown("● scout", "4 m behind, gap 19 m")
        world.hand.now_s += 2.5
        world.fake.say(scout(0.74, behavior="r1.b1"))
        await terminal.until_shown("● scout      74%")
        assert "behind" not in terminal.screen


async def test_a_vehicle_that_falls_silent_is_greyed(world: World) -> None:
    async with world.terminal() as terminal:
        world.fake.say(scout(0.75))
        await terminal.until_shown("● scout")
        world.hand.now_s += 4
        world.fake.say(replace(scout(0.75), link=LinkState.LOST))
        await terminal.until_shown("✗ scout     silent for 4 s", "last at 38.10750")
        world.fake.say(scout(0.70))
        await terminal.until_shown("● scout      70%")


def test_silence_counts_by_the_clock_of_the_executive(world: World) -> None:
    vehicles = Vehicles(world.control.fleet(), speed=10)
    vehicles.update(scout(0.75), now=1.0)
    vehicles.update(replace(scout(0.75), link=LinkState.LOST), now=4.0)
    assert "silent for 40 s" in vehicles.table(5.0, 40, str, {}).plain


async def test_a_second_run_is_told_and_can_be_looked_at(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        await terminal.until_shown("RUNNING   patrol  r1")
        await world.control.start(MISSION.read_bytes().replace(b'"scout"', b'"uav"'))
        await terminal.until_shown("+1 more (r)", "r2 has begun", "Question 1 of 4")
        await terminal.press("r")
        await terminal.until_shown("─ Runs ─", "1 r2", "2 r1")
        await terminal.press("down", "enter")
        await terminal.until_gone("─ Runs ─")
        await terminal.press("r")
        await terminal.until_shown("─ Runs ─")
        await terminal.press("1")
        await terminal.until_shown("r2  +1 more (r)", "GATE (r1 p")


async def test_the_end_is_told_and_the_screen_stays(world: World) -> None:
    async with world.terminal() as terminal:
        run = await world.start()
        await terminal.until_shown("Question 1 of 2")
        await world.control.signal("sig-home", run=run)
        await world.clock.advance(300)
        await terminal.press("1")
        await terminal.until_shown("Question: BRIDGE")
        await terminal.press("1")
        await terminal.until_shown("COMPLETED", "completed after 5:00", "r1 completed", "3/4")
        assert terminal.app.is_running
        second = await world.control.start(MISSION, even_if_busy=True)
        await terminal.until_shown("RUNNING", second)


async def test_the_end_can_be_drawn_on_a_screen_without_width(world: World) -> None:
    async with world.terminal() as terminal:
        run = await world.start()
        await terminal.until_shown("RUNNING")
        await world.control.stop(run)
        await terminal.until_shown("STOPPED")
        assert terminal.app.view is not None
        assert mission_tree(terminal.app.view, (), 0.0, 0.0, 0).plain.startswith("s\nt\no")


async def test_quitting_while_a_mission_runs_is_asked_about(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        await terminal.until_shown("RUNNING")
        await terminal.press("q")
        await terminal.until_shown("r1 is running")
        await terminal.press("2")
        await terminal.until_gone("r1 is running")
        await terminal.press("q")
        await terminal.until_shown("r1 is running")
        await terminal.press("1")
        await terminal.until(lambda: not terminal.app.is_running)


async def test_nothing_is_cut_off_in_80_columns(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        world.fake.say(scout(1.0, behavior="r1.b1"))
        await terminal.until_shown("100%")
        lines = terminal.screen.splitlines()
        assert len(lines) == 24
        assert not terminal.shows("…")
        keys = " ".join(lines[-1].split())
        assert keys == "^X STOP p Pause s Signals t Take m Start r Runs g Map ? Help q Quit"
        await terminal.press("question_mark")
        await terminal.until_shown("answer the question", "done, given up, failed", "Esc: close")


async def test_the_executives_end_is_told(world: World) -> None:
    async with world.terminal() as terminal:
        await terminal.until_shown("no mission is running")
        world.executive.events.end()
        await terminal.until_shown("The executive has ended. q quits")


async def test_after_the_executives_end_no_vehicle_seems_lost(world: World) -> None:
    async with world.terminal() as terminal:
        world.fake.say(scout(0.75))
        await terminal.until_shown("● scout")
        world.executive.events.end()
        await terminal.until_shown("○ scout     not watched now", "last at 38.10750")
        world.hand.now_s += 60
        await terminal.until_gone("The executive has ended")
        assert "silent" not in terminal.screen


async def test_the_log_follows_unless_looked_back(world: World) -> None:
    async with world.terminal() as terminal:
        run = await world.start()
        await terminal.until_shown("BRIDGE asks")
        for number in range(8):
            await world.control.set_geometry(f"g{number}", POINT, run=run, by="anna")
        await terminal.until_shown("g7 received")
        await terminal.press("pageup")
        await terminal.until_gone("g7 received")
        await world.control.set_geometry("g8", POINT, run=run, by="anna")
        await terminal.until(lambda: len(terminal.app.logs[run].lines) == 13)
        assert not terminal.shows("g8 received")
        await terminal.press("pagedown", "pagedown")
        await terminal.until_shown("g8 received")
        await world.control.set_geometry("g9", POINT, run=run, by="anna")
        await terminal.until_shown("g9 received")
