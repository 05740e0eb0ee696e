"""Which conditions of an executive are alerts, and what operators do about them."""

import asyncio

import pytest

from m2pem.api.alerts import LINK_LOST, NOT_READY, QUESTION, RUN_FAILED, AlertSeverity
from m2pem.api.telemetry import LinkState, VehicleState
from m2pem.engine.inputs import StopRun
from m2pem.executive.alert_list import AlertList, Condition
from m2pem.mission.catalogue import BehaviorState, ResourceId

from .conftest import START_US, World, behavior, mission, sequence
from .test_incidents import failed
from .test_recovery import left_behind

ASKS = mission(
    '<process id="P" isExecutable="true"><startEvent id="S"/>'
    '<userTask id="Ask"><extensionElements><m2pem:prompt>Go?</m2pem:prompt>'
    '<m2pem:decision value="yes" label="Yes"/></extensionElements></userTask>'
    '<boundaryEvent id="Late" attachedToRef="Ask"><timerEventDefinition>'
    "<timeDuration>PT30S</timeDuration></timerEventDefinition></boundaryEvent>"
    '<endEvent id="E"/><endEvent id="L"/>'
    '<sequenceFlow id="f1" sourceRef="S" targetRef="Ask"/>'
    '<sequenceFlow id="f2" sourceRef="Ask" targetRef="E"/>'
    '<sequenceFlow id="f3" sourceRef="Late" targetRef="L"/></process>'
)
DRIVE = mission(sequence(("B", behavior("B", "drive_stop", "ugv1"))))
UGV1, UGV2 = ResourceId("ugv1"), ResourceId("ugv2")


async def listed(world: World):
    """The alerts, after a look at what is so now."""
    world.executive.look()
    return await world.executive.control.alerts()


async def asked(world: World):
    run = await world.executive.control.start(ASKS)
    while not world.executive.control.prompts():
        await world.clock.sleep(0.01)
    return run


def test_a_question_is_an_alert_with_its_deadline_until_it_is_answered(play):
    async def story(world: World):
        control = world.executive.control
        run = await asked(world)
        began_us = world.executive.runner(run).run.state.started_us
        await world.clock.sleep(3)
        (alert,) = await listed(world)
        assert (alert.code, alert.run, alert.text) == (QUESTION, run, "asks: Go?")
        assert alert.severity is AlertSeverity.WARNING
        assert 30 <= (alert.deadline_us - began_us) / 1e6 < 31
        await control.pause(run)
        assert (await listed(world))[0].deadline_us is None
        await control.resume(run)
        assert (await listed(world))[0].deadline_us >= alert.deadline_us
        await control.answer(run, alert.subject, "yes")
        assert await listed(world) == []

    play(story, "ugv1")


def test_an_incident_is_an_alert_until_an_operator_has_decided(play):
    async def story(world: World):
        run = await failed(world)
        (alert,) = await listed(world)
        assert (alert.code, alert.run, alert.resources) == ("INCIDENT", run, ("ugv1",))
        assert alert.text.startswith("Drive: ROUTE_BLOCKED")
        await world.executive.control.acknowledge_alert(alert.alert, by="anna")
        (alert,) = await listed(world)
        assert alert.acknowledged_by == "anna"
        await world.executive.control.resolve_incident(run, "i1", "skip", by="anna")
        assert await listed(world) == []

    play(story, "ugv1")


def test_lost_links_are_one_alert_and_are_said_once(play):
    async def story(world: World):
        for each in (UGV1, UGV2):
            world.fake.say(VehicleState(each, world.clock.now_us()))
        await world.clock.sleep(30)
        (alert,) = await listed(world)
        assert (alert.code, alert.resources) == (LINK_LOST, ("ugv1", "ugv2"))
        for _ in range(8):
            world.fake.say(VehicleState(UGV1, world.clock.now_us()))
            await world.clock.sleep(1)
        (alert,) = await listed(world)
        assert alert.text == "ugv2: the link is lost"

    play(story, "ugv1", "ugv2", watch_links=True)


def test_an_arbiter_that_says_that_a_link_is_lost_is_believed(play):
    async def story(world: World):
        world.fake.say(VehicleState(UGV1, world.clock.now_us(), link=LinkState.LOST))
        await world.clock.sleep(0.1)
        assert [each.code for each in await listed(world)] == [LINK_LOST]
        world.fake.say(VehicleState(UGV1, world.clock.now_us()))
        await world.clock.sleep(0.1)
        assert await listed(world) == []

    play(story, "ugv1")


def test_a_vehicle_that_says_for_a_while_that_it_is_not_ready_is_an_alert(play):
    async def story(world: World):
        world.fake.say(VehicleState(UGV1, world.clock.now_us(), ready=False))
        await world.clock.sleep(0.1)
        assert await listed(world) == []
        await world.clock.sleep(10)
        assert [each.code for each in await listed(world)] == [NOT_READY]
        world.fake.say(VehicleState(UGV1, world.clock.now_us(), ready=True))
        await world.clock.sleep(0.1)
        assert await listed(world) == []

    play(story, "ugv1")


def test_a_failed_run_is_an_alert_until_it_is_acknowledged(play):
    async def story(world: World):
        control = world.executive.control
        run = await control.start(DRIVE)
        await world.fake.until_called("start", f"{run}.b1")
        world.fake.report(f"{run}.b1", BehaviorState.FAILED, "ROUTE_BLOCKED")
        await control.wait(run)
        (alert,) = await listed(world)
        assert (alert.code, alert.run, alert.severity) == (RUN_FAILED, run, AlertSeverity.ERROR)
        await control.own_alert(alert.alert, by="otto")
        assert (await listed(world))[0].owner == "otto"
        await control.own_alert(alert.alert, owner="", by="otto")
        await control.acknowledge_alert(alert.alert, by="anna")
        assert await listed(world) == []
        (over,) = await control.alerts(over=True)
        assert (over.acknowledged_by, over.owner) == ("anna", "")

    play(story, "ugv1")


@pytest.mark.parametrize("by", ["anna", ""])
def test_a_question_of_a_run_that_is_taken_up_again_is_the_same_alert(play, by):
    journal = left_behind(ASKS)
    severity = AlertSeverity.WARNING

    async def before():
        alerts = AlertList("test", journal, lambda: START_US)
        question = Condition(QUESTION, severity, "asks: Go?", "r1", "p1")
        alerts.update([question], lambda alert: ())
        if by:
            await alerts.acknowledge("a1", by)
        await alerts.write()

    async def after(world: World):
        (kept,) = await listed(world)
        await world.executive.resume("r1")
        (alert,) = await listed(world)
        assert (kept.alert, alert.alert, alert.acknowledged_by) == ("a1", "a1", by)

    asyncio.run(before())
    play(after, "ugv1", journal=journal)


def test_questions_of_a_run_that_has_ended_meanwhile_are_over(play):
    async def before():
        alerts = AlertList("test", journal, lambda: START_US)
        question = Condition(QUESTION, AlertSeverity.WARNING, "asks: Go?", "r1", "p1")
        alerts.update([question], lambda alert: ())
        await alerts.write()

    async def after(world: World):
        assert await listed(world) == []

    journal = left_behind(ASKS, StopRun())
    asyncio.run(before())
    play(after, "ugv1", journal=journal)
