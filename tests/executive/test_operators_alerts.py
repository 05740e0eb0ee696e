"""What operators are told beside the records: what is logged, and what a run leaves armed."""

import asyncio
import logging

from m2pem.api.alerts import AlertSeverity
from m2pem.api.runs import LOGGED, Alert
from m2pem.api.telemetry import LinkState, VehicleState
from m2pem.journal import MemoryJournal
from m2pem.mission.catalogue import BehaviorState, ResourceId

from .conftest import World, behavior, mission, sequence

DRIVE = mission(sequence(("B", behavior("B", "drive_stop", "ugv1"))))
UAV1 = ResourceId("uav1")
UGV1, UGV2, UGV3 = (ResourceId(f"ugv{number}") for number in (1, 2, 3))


async def alerts(world: World, until: str) -> list[Alert]:
    """Those up to the one that has the code `until`; the story begins after this has subscribed."""
    got: list[Alert] = []
    async for notice in world.executive.control.subscribe():
        if isinstance(notice, Alert):
            got.append(notice)
            if notice.code == until:
                break
    return got


def test_what_an_arbiter_warns_of_is_an_alert_from_whatever_thread(play):
    async def story(world: World):
        told = asyncio.create_task(alerts(world, LOGGED))
        await world.clock.sleep(0.1)
        logger = logging.getLogger("m2pem.arbiter")
        logger.info("uav1 moves")
        await asyncio.to_thread(logger.warning, "%s says: %s", "uav1", "Battery 1 is low")
        return await asyncio.wait_for(told, 10)

    (alert,) = play(story, "ugv1")
    assert alert.text == "uav1 says: Battery 1 is low"


def test_after_the_executive_nothing_is_told(play):
    async def story(world: World):
        return None

    play(story, "ugv1")
    handlers = logging.getLogger("m2pem.arbiter").handlers
    assert not [each for each in handlers if type(each).__name__ == "LoggedAlerts"]


def test_a_run_that_ends_says_what_stays_armed_and_what_may_be_done(play):
    async def story(world: World):
        told = asyncio.create_task(alerts(world, "LEFT_ARMED"))
        control, now_us = world.executive.control, world.clock.now_us()
        fly = mission(sequence(("B", behavior("B", "drive_stop", "uav1"))))
        run = await control.start(fly)
        await world.fake.until_called("start", f"{run}.b1")
        world.fake.say(
            VehicleState(UAV1, now_us, armed=True, mode="BRAKE", altitude_above_home_m=20.4)
        )
        world.fake.say(
            VehicleState(UGV1, now_us, armed=True, mode="HOLD", altitude_above_home_m=60.0)
        )
        world.fake.say(VehicleState(UGV2, now_us, armed=False, mode="HOLD"))
        world.fake.say(VehicleState(UGV3, now_us, armed=True, link=LinkState.LOST))
        await world.clock.sleep(0.1)
        stopping = asyncio.create_task(control.stop(run, by="anna"))
        await world.fake.until_called("cancel", f"{run}.b1")
        world.fake.report(f"{run}.b1", BehaviorState.CANCELLED)
        await stopping
        return (await asyncio.wait_for(told, 10))[-1]

    alert = play(story, "uav1", "ugv1", "ugv2", "ugv3")
    assert alert.run == "r1"
    assert alert.text == (
        "uav1 stays armed in BRAKE, 20 m above its home; ugv1 stays armed in HOLD; ugv3 was armed "
        "when its link was lost; what it does now is not known, its own failsafe may move or stop "
        "it. Nothing commands them now: land, return to launch or disarm by another mission, or "
        "by the vehicle's own ground station or remote control"
    )


def test_a_run_that_a_lost_link_ends_says_what_the_vehicle_did_then(play):
    async def story(world: World):
        told = asyncio.create_task(alerts(world, "LEFT_ARMED"))
        run = await world.executive.control.start(
            mission(sequence(("B", behavior("B", "drive_stop", "uav1"))))
        )
        await world.fake.until_called("start", f"{run}.b1")
        world.fake.say(
            VehicleState(
                UAV1,
                world.clock.now_us(),
                armed=True,
                mode="GUIDED",
                altitude_above_home_m=40.0,
                link=LinkState.LOST,
            )
        )
        world.fake.report(f"{run}.b1", BehaviorState.LOST, "LINK_LOST")
        return (await asyncio.wait_for(told, 10))[-1]

    alert = play(story, "uav1")
    assert alert.text.startswith(
        "uav1 was armed in GUIDED, 40 m above its home, when its link was lost; what it does now"
    )


def test_a_run_that_ends_does_not_speak_of_the_vehicles_of_another_run(play):
    async def story(world: World):
        control, now_us = world.executive.control, world.clock.now_us()
        first = await control.start(DRIVE)
        await world.fake.until_called("start", f"{first}.b1")
        other = mission(sequence(("B", behavior("B", "drive_stop", "ugv2"))))
        second = await control.start(other)
        await world.fake.until_called("start", f"{second}.b1")
        for vehicle in (UGV1, UGV2):
            world.fake.say(VehicleState(vehicle, now_us, armed=True, mode="GUIDED"))
        await world.clock.sleep(0.1)
        told = asyncio.create_task(alerts(world, "LEFT_ARMED"))
        await world.clock.sleep(0.1)
        world.fake.report(f"{second}.b1", BehaviorState.SUCCEEDED)
        return (await asyncio.wait_for(told, 10))[-1]

    alert = play(story, "ugv1", "ugv2")
    assert alert.run == "r2"
    assert alert.text.startswith("ugv2 stays armed in GUIDED. Nothing commands it now: disarm by")


def test_a_single_behavior_that_ends_speaks_of_its_own_vehicle_alone(play):
    async def story(world: World):
        control, now_us = world.executive.control, world.clock.now_us()
        for vehicle in (UGV1, UGV2):
            world.fake.say(VehicleState(vehicle, now_us, armed=True, mode="GUIDED"))
        await world.clock.sleep(0.1)
        said = asyncio.create_task(alerts(world, "LEFT_ARMED"))
        await world.clock.sleep(0.1)
        run = await control.execute_behavior("ugv2", "drive_stop", by="anna")
        await world.fake.until_called("start", f"{run}.b1")
        world.fake.report(f"{run}.b1", BehaviorState.SUCCEEDED)
        return (await asyncio.wait_for(said, 10))[-1]

    assert play(story, "ugv1", "ugv2").text.startswith("ugv2 stays armed in GUIDED. Nothing")


def test_an_executive_that_was_replaced_does_not_write_over_the_alerts_of_the_next(play):
    async def story(world: World):
        world.executive.alerts.add(Alert("", "SCHEDULE", "late", AlertSeverity.WARNING))
        world.executive.superseded.set()
        return world.executive.fleet.kept_as

    journal = MemoryJournal()
    kept_as = play(story, "ugv1", journal=journal)
    assert asyncio.run(journal.alerts(kept_as)) == {}


def test_what_was_said_last_is_written_at_the_end(play):
    async def story(world: World):
        world.executive.alerts.add(Alert("", "SCHEDULE", "late", AlertSeverity.WARNING))
        return world.executive.fleet.kept_as

    journal = MemoryJournal()
    kept_as = play(story, "ugv1", journal=journal)
    assert list(asyncio.run(journal.alerts(kept_as))) == [1]
