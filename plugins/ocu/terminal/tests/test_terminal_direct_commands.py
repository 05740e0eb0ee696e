"""Commanding a behavior outside of any mission."""

from m2pem_plugin_terminal.direct_commands import parameters
from terminal_world import Terminal, World

from m2pem.mission.catalogue import BehaviorState, ResourceId


async def choose(terminal: Terminal, resource: str, behavior: str) -> None:
    """Open the dialog, and choose by typing the names."""
    await terminal.press("d")
    await terminal.until_shown("Command a vehicle or payload")
    await terminal.press(*resource, "enter")
    await terminal.until_shown(f"What shall {resource} do?")
    await terminal.press(*behavior, "enter")


async def test_a_free_vehicle_is_sent_somewhere_after_y(world: World) -> None:
    async with world.terminal() as terminal:
        await choose(terminal, "uav", "goto")
        await terminal.until_shown("uav: goto", "target *", "latitude, longitude")
        await terminal.press("enter")  # nothing without a target
        await terminal.until_shown("target *")
        await terminal.press(*["3", "8", "full_stop", "1", "comma", "minus", "7", "7", "full_stop"])
        await terminal.press("3", "enter")
        await terminal.until_shown("Command uav?", "goto target=[38.1, -77.3]")
        await terminal.press("1", "enter", "space")
        assert world.fake.requests == {}
        await terminal.press("y")
        await world.fake.until_called("start", "r1.b1")
        (request,) = world.fake.requests.values()
        assert (request.behavior, request.resources) == ("goto", ("uav",))
        await terminal.until_shown("goto target=[38.1, -77.3] is commanded (r1)")


async def test_a_vehicle_of_a_mission_is_taken_first_and_what_that_ends_is_said(
    world: World,
) -> None:
    async with world.terminal() as terminal:
        await world.start()
        await world.fake.until_called("start", "r1.b1")
        await terminal.until_shown("● DRIVE")
        await choose(terminal, "scout", "drive_stop")
        await terminal.until_shown("Command scout?", "DRIVE ends with error", "You take scout")
        await terminal.until_shown("the mission will fail")
        await terminal.press("y")
        await world.fake.until_called("cancel", "r1.b1")
        world.fake.report("r1.b1", BehaviorState.CANCELLED)
        while "r2.b1" not in world.fake.requests:  # it waits until the vehicle was released
            await world.clock.advance(0.2)
            await terminal.pilot.pause()
        await terminal.until_shown("with anna@gcs1")


async def test_what_another_operator_has_is_refused(world: World) -> None:
    await world.control.take("uav", by="bob@gcs2")
    async with world.terminal() as terminal:
        await terminal.press("d", *"uav", "enter")
        await terminal.until_shown("uav is with bob@gcs2")


async def test_a_wrong_parameter_is_said_in_full_and_the_form_comes_again(world: World) -> None:
    async with world.terminal() as terminal:
        await choose(terminal, "uav", "takeoff")
        await terminal.until_shown("altitude *")
        await terminal.press(*"high", "enter")
        await terminal.until_shown("Command uav?")
        await terminal.press("y")
        await terminal.until_shown("takeoff of uav was not commanded", "'high'")
        await terminal.press("escape")
        await terminal.until_shown("altitude *", "high")
        await terminal.press(*["backspace"] * 4, "2", "0", "space", "m", "enter")
        await terminal.until_shown("takeoff altitude=20 m")
        await terminal.press("y")
        await world.fake.until_called("start", "r1.b1")
        holders = await world.control.holders()
        assert holders[ResourceId("uav")] == "r1.b1"


def test_coordinates_become_a_list_and_empty_fields_are_left_out() -> None:
    typed = {"target": "38.1 -77.3, 20", "speed": " ", "heading": "90 deg", "area": "field"}
    assert parameters(typed) == {
        "target": "[38.1, -77.3, 20]",
        "heading": "90 deg",
        "area": "field",
    }
