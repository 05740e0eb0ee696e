"""Deciding about an error that stops a task."""

from m2pem_plugin_terminal.incidents import blocked_text
from terminal_world import MISSION, World

from m2pem.api import OpenIncident
from m2pem.api.allocation import WaitingTask
from m2pem.mission.catalogue import BehaviorState


async def stopped(world: World) -> None:
    """Start the patrol with incidents, and let its drive fail."""
    source = MISSION.read_bytes()
    marked = source.replace(b'isExecutable="true"', b'isExecutable="true" m2pem:onError="incident"')
    await world.control.start(marked)
    await world.fake.until_called("start", "r1.b1")
    world.fake.report("r1.b1", BehaviorState.FAILED, "ROUTE_BLOCKED")


async def test_the_task_is_marked_and_a_key_decides(world: World) -> None:
    async with world.terminal() as terminal:
        await stopped(world)
        await terminal.until_shown("! DRIVE", "stopped by ROUTE_BLOCKED", "incident r1.i1")
        await terminal.press("i")
        await terminal.until_shown("1 Retry: it starts again", "3 Skip: it counts as done")
        await terminal.press("1")
        await terminal.until_shown("retry r1.i1?")
        await terminal.press("1", "enter")
        await terminal.until_shown("retry r1.i1?")
        await terminal.press("y")
        await world.fake.until_called("start", "r1.b2")
        await terminal.until_shown("starts again", "● DRIVE")


async def test_a_vehicle_is_replaced_and_data_is_written(world: World) -> None:
    async with world.terminal() as terminal:
        await stopped(world)
        await terminal.until_shown("! DRIVE")
        await terminal.press("i", "4")
        await terminal.until_shown("name=value")
        await terminal.press(*"speed=3", "enter")
        await terminal.until_shown("set_data r1.i1?", "speed = 3")
        await terminal.press("y")
        await terminal.until_shown("data written for incident")
        await terminal.press("i", "2")
        await terminal.until_shown("1 scout", "2 uav")
        await terminal.press("2")
        await terminal.until_shown("retry_with r1.i1?")
        await terminal.press("y")
        await world.fake.until_called("start", "r1.b2")
        assert world.fake.calls[-1].subject == "r1.b2"


async def test_without_an_incident_there_is_nothing_to_decide(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        await terminal.press("i")
        await terminal.until_shown("No error stops a task here")


def test_what_an_incident_blocks_is_said() -> None:
    incident = OpenIncident("r1", "r1.i1", "Drive", "Drive", "FAILED", "", ("skip",), ("ugv1",))
    waits = [
        WaitingTask(run, "a1", "Fetch", "Fetch", "goto", 12.0, None, 0, "", {"ugv1": holder})
        for run, holder in (("r2", "r1.i1"), ("r3", "r1.i10"))
    ]
    assert blocked_text(incident, waits).splitlines()[1:] == [
        "blocked: Fetch of r2 waits since 12 s"
    ]
    assert "no other task waits for it" in blocked_text(incident, waits[1:])
