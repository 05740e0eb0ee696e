"""A vehicle is lost, and another does the rest of its task; what comes back is held first."""

import asyncio
from typing import Any

import pytest

from m2pem.api.runs import Alert, RunStatus
from m2pem.api.telemetry import LinkState, VehicleState
from m2pem.bpmn import parse_mission
from m2pem.engine import inputs as i
from m2pem.engine.records import (
    BehaviorRequested,
    ErrorThrown,
    InputIgnored,
    ResourceReturned,
    ResourcesAllocated,
    RunEnded,
    WorkReassigned,
)
from m2pem.engine.run import MissionRun
from m2pem.fleet.fleet import dump, restore
from m2pem.journal import MemoryJournal
from m2pem.journal.base import Entry, RunHeader
from m2pem.journal.mission import mission_of
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.testing.fake_arbiter import Call

from .conftest import START_US, World, fleet, mission, sequence, task
from .test_allocator import one

RUNNING, SUCCEEDED = BehaviorState.RUNNING, BehaviorState.SUCCEEDED
LOST, REJECTED = BehaviorState.LOST, BehaviorState.REJECTED

TARGET = '<m2pem:property name="target" value="[0.0, 0.0, 0]"/>'
NEED = "requires='true' onLoss='reassign'"
REST = {"target": [0.001, 0.0, 0.0]}


def goto(role: str = NEED) -> bytes:
    return one(role, "goto", TARGET)


def says(
    world: World, vehicle: str, link: LinkState = LinkState.CONNECTED, battery: float = 1.0
) -> None:
    state = VehicleState(
        ResourceId(vehicle), world.clock.now_us(), link=link, battery_fraction=battery
    )
    world.fake.say(state)


async def begin(world: World, source: bytes, remaining: dict[str, Any] | None = None) -> str:
    """Start a run, and let the behavior of its first task be under way."""
    run = await world.executive.control.start(source)
    await world.fake.until_called("start", f"{run}.b1")
    world.fake.report(f"{run}.b1", RUNNING, remaining=remaining)
    await world.clock.sleep(0.1)
    return run


def commanded(world: World) -> list[tuple[str, ...]]:
    return [each.resources for each in world.seen if isinstance(each, BehaviorRequested)]


def seen(world: World, kind: type) -> list[Any]:
    return [each for each in world.seen if isinstance(each, kind)]


async def lose_link(world: World) -> None:
    says(world, "ugv1", LinkState.LOST)
    await world.clock.sleep(0.1)


async def empty_battery(world: World) -> None:
    says(world, "ugv1", battery=0.1)


async def take(world: World) -> None:
    await world.executive.control.take("ugv1", by="anna")


async def arbiter_loses(world: World) -> None:
    world.fake.report("r1.b1", LOST, "LINK_LOST", "no answer")


async def pilot_takes(world: World) -> None:
    world.fake.report("r1.b1", BehaviorState.FAILED, "TAKEN_OVER", "a pilot has it")


async def refuse(world: World) -> None:
    world.fake.report("r1.b1", REJECTED, "", "its airspace is refused")


@pytest.mark.parametrize(
    "lose", [lose_link, empty_battery, take, arbiter_loses, pilot_takes, refuse]
)
def test_another_does_what_is_left(play, lose):
    async def story(world: World):
        run = await begin(world, goto(), REST)
        await lose(world)
        await world.fake.until_called("start", f"{run}.b2")
        world.fake.report(f"{run}.b1", BehaviorState.CANCELLED)
        world.fake.report(f"{run}.b2", SUCCEEDED)
        status = (await world.executive.control.wait(run)).status
        return status, world.fake.requests[f"{run}.b2"], seen(world, WorkReassigned)

    status, request, (record,) = play(story, "ugv1", "ugv2", watch_links=True)
    assert status is RunStatus.COMPLETED
    assert request.resources == ("ugv2",)
    assert request.parameters["target"].position[:2] == (0.001, 0.0)
    assert record.excluded == ("ugv1",)


def test_the_choice_says_that_the_task_has_lost_a_vehicle(play):
    async def story(world: World):
        run = await begin(world, goto())
        await empty_battery(world)
        await world.fake.until_called("start", f"{run}.b2")
        for number in ("b1", "b2"):
            world.fake.report(f"{run}.{number}", SUCCEEDED)
        await world.executive.control.wait(run)
        return seen(world, ResourcesAllocated)[-1]

    record = play(story, "ugv1", "ugv2", watch_links=True)
    candidates = record.considered["roles"]["driver"]["candidates"]
    assert candidates[1] == {
        "resource": "ugv1",
        "excluded": "this task has lost it: BATTERY_LOW (battery at 10%, below 15%)",
    }


def test_a_run_that_waits_for_what_it_has_lost_is_no_circle(play):
    async def story(world: World):
        alerts = []
        events = world.executive.control.subscribe()
        run = await begin(world, goto(NEED + " wait='unlimited'"))
        await empty_battery(world)
        await world.fake.until_called("cancel", f"{run}.b1")
        world.fake.report(f"{run}.b1", BehaviorState.CANCELLED)
        await world.clock.sleep(5)
        waiting = await world.executive.control.waiting()
        await world.executive.control.stop(run)
        async for event in events:
            alerts += [event.code] if isinstance(event, Alert) else []
            if isinstance(getattr(event, "record", None), RunEnded):
                return waiting, alerts

    waiting, alerts = play(story, "ugv1", watch_links=True)
    assert [each.task for each in waiting] == ["Go"]
    assert "WAITING_CIRCLE" not in alerts


@pytest.mark.parametrize("wait", ["", " wait='unlimited'"])
def test_the_error_of_the_loss_is_thrown_if_no_other_will_ever_do_the_rest(play, wait):
    """ugv1 refuses it, and a refusal does not pass: nothing is waited for."""

    async def story(world: World):
        run = await begin(world, goto(NEED + wait))
        await refuse(world)
        return (await world.executive.control.wait(run)).status, seen(world, ErrorThrown)

    status, (error,) = play(story, "ugv1")
    assert status is RunStatus.FAILED
    assert error.code == "REJECTED"
    assert error.reason.startswith("its airspace is refused; no other does what is left: role")


@pytest.mark.parametrize("lose", [pilot_takes, take])
def test_what_an_operator_took_is_waited_for_and_what_a_pilot_took_is_not(play, lose):
    async def story(world: World):
        run = await begin(world, goto(NEED + " wait='unlimited'"))
        await lose(world)
        await world.clock.sleep(60)
        world.fake.report(f"{run}.b1", BehaviorState.CANCELLED)
        if lose is take:
            assert not seen(world, ErrorThrown)
            await world.executive.control.give_back("ugv1", by="anna")
            await world.fake.until_called("start", f"{run}.b2")
            world.fake.report(f"{run}.b2", SUCCEEDED)
        return (await world.executive.control.wait(run)).status

    expected = RunStatus.COMPLETED if lose is take else RunStatus.FAILED
    assert play(story, "ugv1") is expected


def test_a_refusal_goes_through_all_vehicles_once(play):
    async def story(world: World):
        run = await begin(world, goto(NEED + " wait='unlimited'"))
        for number in (1, 2, 3):
            await world.fake.until_called("start", f"{run}.b{number}")
            world.fake.report(f"{run}.b{number}", REJECTED, "", "no")
        return (await world.executive.control.wait(run)).status, commanded(world)

    status, tried = play(story, "ugv1", "ugv2", "ugv3")
    assert status is RunStatus.FAILED
    assert tried == [("ugv1",), ("ugv2",), ("ugv3",)]


def test_a_vehicle_whose_battery_is_charged_does_the_rest(play):
    async def story(world: World):
        run = await begin(world, goto(NEED + " wait='unlimited'"))
        await empty_battery(world)
        await world.fake.until_called("cancel", f"{run}.b1")
        world.fake.report(f"{run}.b1", BehaviorState.CANCELLED)
        says(world, "ugv1", battery=0.5)
        await world.clock.sleep(5)
        assert not world.fake.count("start", f"{run}.b2")
        says(world, "ugv1", battery=0.9)
        await world.fake.until_called("start", f"{run}.b2")
        world.fake.report(f"{run}.b2", SUCCEEDED)
        return (await world.executive.control.wait(run)).status

    assert play(story, "ugv1", watch_links=True) is RunStatus.COMPLETED


@pytest.mark.parametrize("lose", [lose_link, arbiter_loses])
def test_what_returns_is_held_before_it_does_the_rest(play, lose):
    async def story(world: World):
        run = await begin(world, goto(NEED + " wait='unlimited'"))
        await lose(world)
        await world.clock.sleep(5)
        assert not world.fake.count("start", f"{run}.b2")
        calls = len(world.fake.calls)
        says(world, "ugv1")
        await world.fake.until_called("start", f"{run}.b2")
        world.fake.report(f"{run}.b2", SUCCEEDED)
        status = (await world.executive.control.wait(run)).status
        return status, world.fake.calls[calls:], seen(world, ResourceReturned)

    status, calls, (returned,) = play(story, "ugv1", watch_links=True)
    assert status is RunStatus.COMPLETED
    assert calls[:3] == [
        Call("cancel", "r1.b1"),
        Call("hold", "ugv1"),
        Call("start", "r1.b2"),
    ]
    assert (returned.resource, returned.code) == ("ugv1", "LINK_LOST")


def test_what_returns_and_cannot_be_held_is_not_chosen(play):
    async def story(world: World):
        run = await begin(world, goto(NEED + " wait='unlimited'"))
        await lose_link(world)
        world.fake.raises["hold"] = RuntimeError("the radio is broken")
        says(world, "ugv1")
        await world.fake.until_called("hold", "ugv1", 3)
        unavailable = await world.executive.control.unavailable()
        assert not world.fake.count("start", f"{run}.b2")
        del world.fake.raises["hold"]
        await world.fake.until_called("start", f"{run}.b2")
        world.fake.report(f"{run}.b2", SUCCEEDED)
        await world.executive.control.wait(run)
        return unavailable

    unavailable = play(story, "ugv1", watch_links=True)
    assert "the radio is broken" in unavailable["ugv1"]


def test_what_has_returned_is_shown_as_held_until_it_is_commanded_again(play):
    async def story(world: World):
        control = world.executive.control
        run = await begin(world, goto())
        await lose_link(world)
        await world.fake.until_called("start", f"{run}.b2")
        lost = await control.unavailable()
        says(world, "ugv1")
        await world.fake.until_called("hold", "ugv1")
        says(world, "ugv1")
        await world.clock.sleep(0.1)
        held, state = await control.unavailable(), world.executive.bus.latest(ResourceId("ugv1"))
        world.fake.report(f"{run}.b2", SUCCEEDED)
        await control.wait(run)
        again = await begin(world, goto("vehicle='ugv1'"))
        commanded_again = await control.unavailable()
        world.fake.report(f"{again}.b1", SUCCEEDED)
        await control.wait(again)
        return lost, held, state, commanded_again

    lost, held, state, commanded_again = play(story, "ugv1", "ugv2", watch_links=True)
    assert lost == {"ugv1": "lost: its arbiter lost the link"}
    assert held == {"ugv1": "returned: held"}
    assert state.not_ready_reasons == ("returned: held",)
    assert commanded_again == {}


def test_the_same_vehicle_as_before_is_not_replaced(play):
    text = mission(
        sequence(
            ("A", task("A", "requires='true' store='who'", "goto", TARGET)),
            ("B", task("B", "same='who' wait='unlimited' onLoss='reassign'", "goto", TARGET)),
        )
    )

    async def story(world: World):
        run = await begin(world, text)
        world.fake.report(f"{run}.b1", SUCCEEDED)
        await world.fake.until_called("start", f"{run}.b2")
        await lose_link(world)
        return (await world.executive.control.wait(run)).status, seen(world, ErrorThrown)

    status, (error,) = play(story, "ugv1", "ugv2", watch_links=True)
    assert status is RunStatus.FAILED
    assert error.code == "LINK_LOST"


def test_a_stored_name_is_that_of_the_new_vehicle(play):
    text = mission(
        sequence(
            ("A", task("A", NEED + " store='who'", "goto", TARGET)),
            ("B", task("B", "same='who'", "goto", TARGET)),
        )
    )

    async def story(world: World):
        run = await begin(world, text)
        await lose_link(world)
        for number in ("b2", "b3"):
            await world.fake.until_called("start", f"{run}.{number}")
            world.fake.report(f"{run}.{number}", SUCCEEDED)
        await world.executive.control.wait(run)
        return commanded(world)

    assert play(story, "ugv1", "ugv2", watch_links=True) == [("ugv1",), ("ugv2",), ("ugv2",)]


def test_a_run_that_is_stopped_while_another_is_looked_for_ends(play):
    async def story(world: World):
        run = await begin(world, goto(NEED + " wait='unlimited'"))
        await lose_link(world)
        await world.clock.sleep(1)
        await world.executive.control.stop(run)
        return (await world.executive.control.wait(run)).status

    assert play(story, "ugv1", watch_links=True) is RunStatus.STOPPED


# --- after a restart ------------------------------------------------------------------------------


def left_after(source: bytes, *inputs: i.Input) -> MemoryJournal:
    """A journal whose executive died after these inputs of run r1, a second apart."""

    async def write() -> MemoryJournal:
        journal, vehicles = MemoryJournal(), fleet("ugv1", "ugv2")
        number = await journal.create(RunHeader("m.bpmn", source, "P", dump(vehicles)))
        run = MissionRun(parse_mission(source, "m.bpmn", accepted=True), vehicles, number)
        for place, item in enumerate((i.StartRun("P"), *inputs)):
            at_us = START_US + place * 1_000_000
            step = run.receive(item, at_us)
            entry = Entry(number, 1, step.seq, at_us, step.t_us, item, tuple(step.records))
            await journal.append([entry])
        await journal.release(number)
        return journal

    return asyncio.run(write())


CHOSEN = i.ResourcesChosen("r1.a1", {"driver": ("ugv1",)}, {"roles": {}})
UNDER_WAY = i.BehaviorReported("r1.b1", 2, RUNNING, native_ref="ref", remaining=REST)
LINK_LOST = i.ResourceFault("ugv1", "LINK_LOST", "no telemetry", reachable=False)
LATER_US = START_US + 60_000_000


def test_the_choice_that_was_not_made_before_a_crash_is_made_after_it(play):
    """The executive is killed between the loss and the new choice."""

    async def story(world: World):
        await world.executive.resume("r1")
        await world.fake.until_called("start", "r1.b2")
        world.fake.report("r1.b2", SUCCEEDED)
        return (await world.executive.control.wait("r1")).status, world.fake.requests["r1.b2"]

    journal = left_after(goto(NEED + " wait='unlimited'"), CHOSEN, UNDER_WAY, LINK_LOST)
    status, request = play(story, "ugv1", "ugv2", journal=journal, start_us=LATER_US)
    assert status is RunStatus.COMPLETED
    assert request.resources == ("ugv2",)
    assert request.parameters["target"].position[:2] == (0.001, 0.0)
    asyncio.run(decided_again(journal))


async def decided_again(journal: MemoryJournal) -> None:
    (line,) = await journal.runs()
    run = MissionRun(mission_of(line.header), restore(line.header.fleet), line.run, 1_000)
    async for entry in journal.read(line.run):
        assert tuple(run.receive(entry.input, entry.at_us).records) == tuple(entry.records)


@pytest.mark.parametrize("goes_on", [True, False])
def test_what_returns_after_a_restart_is_ended_before_it_is_free(play, goes_on):
    """Its arbiter is asked what it still does of before, and that is cancelled; else it is held."""

    async def story(world: World):
        if goes_on:
            world.fake.known["r1.b1"] = i_report(RUNNING)
        await world.executive.resume("r1")
        await world.clock.sleep(5)
        lost = await world.executive.control.unavailable()
        assert not world.fake.calls
        says(world, "ugv1")
        if goes_on:
            await world.fake.until_called("cancel", "r1.b1", 2)
            assert not world.fake.count("start")
            world.fake.known["r1.b1"] = i_report(BehaviorState.CANCELLED, 3)
        await world.fake.until_called("start", "r1.b2")
        world.fake.report("r1.b2", SUCCEEDED)
        return lost, world.fake.calls, (await world.executive.control.wait("r1")).status

    journal = left_after(goto(NEED + " wait='unlimited'"), CHOSEN, UNDER_WAY, LINK_LOST)
    played = play(story, "ugv1", journal=journal, start_us=LATER_US)
    lost, calls, status = played
    assert lost["ugv1"].startswith("lost: the link was lost before a restart")
    assert calls[0] == Call("query", "r1.b1")
    assert Call("hold", "ugv1") in calls
    assert calls[-1] == Call("start", "r1.b2")
    assert status is RunStatus.COMPLETED


def i_report(state: BehaviorState, number: int = 2) -> Any:
    from m2pem.api.arbiter import BehaviorReport

    return BehaviorReport("r1.b1", number, state)


def test_a_run_that_lost_a_vehicle_by_a_caught_error_has_it_held_after_a_restart_too(play):
    """Nothing is reassigned: the vehicle may drive on all the same."""
    boundary = (
        '<boundaryEvent id="Lost" attachedToRef="Go"><errorEventDefinition/></boundaryEvent>'
        '<scriptTask id="Again"><extensionElements>'
        '<m2pem:behavior type="vehicle" name="drive_stop"><m2pem:resources>'
        "<m2pem:role name='driver' vehicle='ugv1' wait='unlimited'/>"
        "</m2pem:resources></m2pem:behavior></extensionElements></scriptTask>"
        '<sequenceFlow id="f" sourceRef="Lost" targetRef="Again"/>'
    )
    source = goto("requires='true'").replace(b"</process>", boundary.encode() + b"</process>")

    async def story(world: World):
        await world.executive.resume("r1")
        says(world, "ugv1")
        await world.fake.until_called("start", "r1.b2")
        world.fake.report("r1.b2", SUCCEEDED)
        await world.executive.control.wait("r1")
        return world.fake.calls, seen(world, InputIgnored)

    journal = left_after(source, CHOSEN, UNDER_WAY, LINK_LOST)
    calls, ignored = play(story, "ugv1", journal=journal, start_us=LATER_US)
    assert calls[0] == Call("query", "r1.b1")
    assert [Call("hold", "ugv1"), Call("start", "r1.b2")] == calls[-2:]
    assert ignored == []
