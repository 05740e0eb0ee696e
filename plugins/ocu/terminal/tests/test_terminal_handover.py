"""Taking vehicles from the missions, and giving them back."""

import pytest
from m2pem_plugin_terminal.handover import choices, taken
from terminal_world import World, fleet, scout

from m2pem.mission.catalogue import BehaviorState, ResourceId


async def holder(world: World, resource: str = "scout") -> str:
    return {str(each): who for each, who in (await world.control.holders()).items()}[resource]


async def test_taking_a_vehicle_ends_what_it_did_and_says_who_has_it(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        world.fake.say(scout(0.75))
        await terminal.until_shown("● DRIVE", "● scout")
        await world.fake.until_called("start", "r1.b1")
        await terminal.press("t")
        await terminal.until_shown("1 scout  DRIVE", "2 uav  free", "3 uav/eye  free")
        await terminal.press("enter")
        await terminal.until_shown("Take scout?", "r1: DRIVE ends with error TAKEN_OVER")
        await terminal.until_shown("TAKEN_OVER is not", "handled: the mission will fail")
        await terminal.press("y")
        await world.fake.until_called("cancel", "r1.b1")
        assert await holder(world) == "anna@gcs1"
        await terminal.until_shown("  with anna@gcs1", "DRIVE: error TAKEN_OVER", "FAILED")
        world.fake.report("r1.b1", BehaviorState.CANCELLED)
        await world.control.give_back("scout", by="anna@gcs1")  # the ended run has no record of it
        await terminal.until_gone("  with anna@gcs1")


async def test_no_digit_nor_enter_takes_a_vehicle_from_a_mission(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        await terminal.until_shown("● DRIVE", "Is the gate open?")
        await terminal.press("t")
        await terminal.until_shown("1 scout  DRIVE")
        await terminal.press("1")
        await terminal.until_shown(
            "Take scout?", "TAKEN_OVER is not", "handled: the mission will fail"
        )
        await terminal.press("1", "2", "9", "enter", "space", "t", "p")
        await terminal.until_shown("Take scout?")
        await terminal.press("escape")
        await terminal.until_gone("Take scout?")
        await terminal.until_shown("Is the gate open?", "RUNNING")
        assert await holder(world) == "r1.b1"


async def test_a_vehicle_whose_work_changed_while_it_was_asked_is_asked_again(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        await world.fake.until_called("start", "r1.b1")
        await terminal.until_shown("● DRIVE")
        await terminal.press("t", "1")
        await terminal.until_shown("the mission will fail")
        world.fake.report("r1.b1", BehaviorState.SUCCEEDED)
        await terminal.until_shown("✓ DRIVE")
        await terminal.press("y")
        await terminal.until_shown("No mission is commanding scout")
        assert await holder(world) == ""
        await terminal.press("y")
        await terminal.until_shown("with anna@gcs1")


async def test_choosing_what_one_has_gives_it_back(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        await terminal.until_shown("RUNNING")
        await terminal.press("t")
        await terminal.until_shown("3 uav/eye  free")
        await terminal.press("3")
        await terminal.until_shown("No mission is commanding uav/eye")
        await terminal.press("y")
        await terminal.until_shown("eye: with anna@gcs1")
        await terminal.press("t")
        await terminal.until_shown("3 uav/eye  anna@gcs1 (you)")
        await terminal.press("3")
        await terminal.until_shown("Give back uav/eye?", "Missions may command it again")
        await terminal.press("y")
        await terminal.until_shown("uav/eye given back by anna@gcs1")
        await terminal.until_gone("with anna@gcs1")
        assert await holder(world, "uav/eye") == ""


async def test_another_operator_is_asked_for_what_they_have(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        await terminal.until_shown("RUNNING")
        await world.control.take("uav", by="bob@gcs2")
        await terminal.until_shown("with bob@gcs2", "uav taken by bob@gcs2")
        await terminal.press("t")
        await terminal.until_shown("2 uav  bob@gcs2")
        await terminal.press("2")
        await terminal.until_shown("uav is with bob@gcs2", "1 Ask bob@gcs2 for uav")
        await terminal.press("1")
        await terminal.until_shown("anna@gcs1 asks bob@gcs2")
        (request,) = await world.control.control_requests()
        assert (request.resource, request.by) == ("uav", "anna@gcs1")
        await terminal.press("o")
        await terminal.until_shown("1 anna@gcs1 asks bob@gcs2 for uav")
        await terminal.press("1")
        await terminal.until_shown("1 Ask no longer")
        await terminal.press("1")
        await terminal.until_gone("1 Ask no longer")
        assert await holder(world, "uav") == "bob@gcs2"
        assert not await world.control.control_requests()


async def test_the_one_who_is_asked_gives_it(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        await terminal.until_shown("RUNNING")
        await world.control.take("uav", by="anna@gcs1")
        await world.control.request_control("uav", by="bob@gcs2")
        await terminal.until_shown("bob@gcs2 asks anna@gcs1")
        await terminal.press("o")
        await terminal.until_shown("1 bob@gcs2 asks you for uav")
        await terminal.press("1")
        await terminal.until_shown("1 Give uav to bob@gcs2", "2 Keep uav")
        await terminal.press("1")
        await terminal.until_shown("with bob@gcs2")
        assert await holder(world, "uav") == "bob@gcs2"


async def test_what_one_has_who_is_there_is_not_given_back(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        await terminal.until_shown("RUNNING")
        await world.control.take("uav", by="bob@gcs2")
        await terminal.press("t")
        await terminal.until_shown("2 uav  bob@gcs2")
        await terminal.press("2")
        await terminal.until_shown("2 Give it back to the missions")
        await terminal.press("2")
        await terminal.until_shown("Give back uav for bob@gcs2?", "All operators see it")
        await terminal.press("x", "enter")
        await terminal.until_shown("uav is with bob@gcs2, who gives it back")
        assert await holder(world, "uav") == "bob@gcs2"


async def test_a_note_is_written_into_the_log(world: World) -> None:
    async with world.terminal() as terminal:
        await world.start()
        await terminal.until_shown("RUNNING")
        await terminal.press("n")
        await terminal.until_shown("Note for the log of r1")
        await terminal.press(*"windy", "enter")
        await terminal.until_shown("anna@gcs1: windy")


@pytest.mark.long
async def test_what_became_anothers_while_the_list_was_shown_is_left(world: World) -> None:
    async with world.terminal() as terminal:
        await world.control.take("scout", by="anna@gcs1")
        await terminal.press("t")
        await terminal.until_shown("1 scout  anna@gcs1 (you)", "2 uav  free")
        await world.control.give_back("scout", by="anna@gcs1")
        await world.control.take("scout", by="bob@gcs2")
        await world.control.take("uav", by="bob@gcs2")
        await terminal.press("1")
        await terminal.until_shown("Give back scout?")
        await terminal.press("y")
        await terminal.until_shown("Give back: scout is with bob@gcs2")
        assert await holder(world) == "bob@gcs2"


@pytest.mark.long
async def test_taking_what_another_took_meanwhile_is_refused(world: World) -> None:
    async with world.terminal() as terminal:
        await terminal.press("t")
        await terminal.until_shown("1 scout  free")
        await world.control.take("scout", by="bob@gcs2")
        await terminal.press("1")
        await terminal.until_shown("Take scout?")
        await terminal.press("y")
        await terminal.until_shown("Take: scout is with bob@gcs2")


async def test_who_attaches_late_sees_what_is_taken(world: World) -> None:
    await world.control.take("scout", by="bob@gcs2")
    async with world.terminal() as terminal:
        await terminal.until_shown("○ scout     no telemetry yet", "with bob@gcs2")
        await world.control.give_back("scout", by="bob@gcs2")
        await terminal.until_gone("with bob@gcs2")


async def test_escape_takes_nothing(world: World) -> None:
    async with world.terminal() as terminal:
        await terminal.press("t")
        await terminal.until_shown("1 scout  free")
        await terminal.press("escape")
        await terminal.until_gone("1 scout  free")
        assert taken(await world.control.holders()) == {}


def test_a_behavior_of_a_run_not_known_here_is_listed_by_its_id() -> None:
    who = {"scout": "r7.b2", "uav": "x" * 90, "uav/eye": ""}
    of_runs = {ResourceId("scout"): "r7.k1", ResourceId("uav"): "r7.i2", ResourceId("eye"): "r7.a3"}
    assert taken(of_runs) == {}
    holders = {ResourceId(resource): holder for resource, holder in who.items()}
    listed = choices(fleet(), holders, "anna", lambda behavior: behavior)
    assert [each.remark for each in listed] == ["r7.b2", "x" * 33 + "…", "free"]
    assert taken(holders) == {"uav": "x" * 90}
