"""What a behavior's last report writes to the data store."""

import math

from m2pem.api.arbiter import BehaviorReport
from m2pem.api.clock import run_virtual
from m2pem.bpmn import parse_mission
from m2pem.engine.inputs import StartRun
from m2pem.engine.records import DataWritten
from m2pem.engine.run import MissionRun
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet import Domain, Fleet, Payload, Vehicle, dump
from m2pem.journal import MemoryJournal
from m2pem.journal.base import Entry, RunHeader
from m2pem.mission.catalogue import BehaviorState, ResourceId

from .conftest import START_US, FakePlugins, Fakes, World, mission, sequence

UGV, CAMERA = ResourceId("ugv1"), ResourceId("ugv1/camera")
FLEET = Fleet(
    "test",
    "test.yaml",
    {UGV: Vehicle(UGV, Domain.GROUND, "fake", {})},
    {CAMERA: Payload(CAMERA, UGV, "fake", {})},
)


def picture(element: str) -> str:
    return (
        f'<scriptTask id="{element}"><extensionElements>'
        '<m2pem:behavior type="payload" name="take_picture">'
        '<m2pem:resources><m2pem:role name="camera" payload="ugv1/camera"/></m2pem:resources>'
        "</m2pem:behavior></extensionElements></scriptTask>"
    )


SHOOT = mission(sequence(("Shoot", picture("Shoot"))))


def play(story):
    async def main(clock):
        fakes, seen, journal = Fakes(), [], MemoryJournal()
        plugins = FakePlugins(fakes, seen)
        async with Executive(FLEET, journal, plugins, clock, watch_links=False) as executive:
            return await story(World(clock, executive, fakes.made[0], journal, seen))

    return run_virtual(main, START_US)


def written(world):
    return {record.key: record.value for record in world.seen if isinstance(record, DataWritten)}


def end_with(outputs, state=BehaviorState.SUCCEEDED):
    async def story(world):
        run = await world.executive.control.start(SHOOT)
        await world.fake.until_called("start")
        world.fake.report("r1.b1", state, outputs=outputs)
        await world.executive.control.wait(run)
        return written(world)

    return play(story)


def test_the_mission_gets_what_a_behavior_declares_that_it_writes():
    files = ["a.jpg", "b.jpg"]
    assert end_with({"picture.files": files, "picture.file": "b.jpg"}) == {
        "picture.files": files,
        "picture.file": "b.jpg",
    }


def test_what_a_behavior_wrote_is_there_before_its_task_is_over():
    async def story(world):
        run = await world.executive.control.start(SHOOT)
        await world.fake.until_called("start")
        world.fake.report("r1.b1", BehaviorState.SUCCEEDED, outputs={"picture.file": "a.jpg"})
        await world.executive.control.wait(run)
        return world.names()

    names = play(story)
    assert names.index("BehaviorEnded") < names.index("DataWritten")
    assert names[names.index("DataWritten") :].count("FlowTaken") == 1


def test_a_behavior_that_failed_keeps_what_it_had_written():
    assert end_with({"picture.file": "a.jpg"}, BehaviorState.FAILED) == {"picture.file": "a.jpg"}


def test_what_is_not_declared_is_left_out_and_said(caplog):
    assert end_with({"picture.file": "a.jpg", "user.decision": "continue"}) == {
        "picture.file": "a.jpg"
    }
    assert "wrote user.decision, which its `writes` do not declare" in caplog.text


def test_what_a_journal_cannot_hold_is_left_out_and_said(caplog):
    bad = [math.nan, [math.inf], {"a": {1: 2}}, object(), "\ud800"]
    for value in bad:
        assert end_with({"picture.file": value, "picture.time": "now"}) == {"picture.time": "now"}
    assert caplog.text.count("which JSON cannot say") == len(bad)


def test_a_behavior_that_ended_while_nobody_drove_the_run_has_written_too():
    async def story(world):
        start_us = START_US - 1_000_000
        header = RunHeader("m.bpmn", SHOOT, "P", dump(FLEET))
        number = await world.journal.create(header)
        step = MissionRun(parse_mission(SHOOT, "m.bpmn"), FLEET, number).receive(
            StartRun("P"), start_us
        )
        entry = Entry(number, 1, step.seq, start_us, step.t_us, StartRun("P"), tuple(step.records))
        await world.journal.append([entry])
        await world.journal.release(number)
        world.fake.known["r1.b1"] = BehaviorReport(
            "r1.b1", 3, BehaviorState.SUCCEEDED, outputs={"picture.file": "a.jpg"}
        )
        await world.executive.resume("r1")
        await world.executive.control.wait("r1")
        return written(world)

    assert play(story) == {"picture.file": "a.jpg"}
