"""Runs that are debugged: which fleets allow it, and what vehicles do at a breakpoint."""

from dataclasses import replace

import pytest

from m2pem.api.runs import RunStatus, ScopeData
from m2pem.errors import OperatorError
from tests.executive.conftest import World, behavior, fleet, flow, mission, question, sequence

DRIVES = mission(
    sequence(
        ("Ask", question("Ask")),
        ("Drive", behavior("Drive", "drive_stop", "ugv1")),
        ("Again", behavior("Again", "drive_stop", "ugv1")),
    )
)
BOTH = mission(
    '<process id="P" isExecutable="true"><startEvent id="S"/><parallelGateway id="F"/>'
    f'{behavior("Drive", "drive_stop", "ugv1")}{question("Ask")}<task id="T"/>'
    f"{flow('S', 'F')}{flow('F', 'Drive')}{flow('F', 'Ask')}{flow('Ask', 'T')}</process>"
)
DEBUGGED = replace(fleet("ugv1"), debugging=True)


async def asked(world: World, source: bytes = DRIVES) -> str:
    run = await world.executive.control.start(source)
    await world.clock.sleep(1.0)
    return run


def test_a_vehicle_is_not_commanded_before_its_breakpoint_is_left(play):
    async def story(world: World):
        control = world.executive.control
        run = await asked(world)
        await control.set_breakpoints(run, ["Drive"], by="anna")
        await control.answer(run, "p1", "yes")
        await world.clock.sleep(60.0)
        (summary,) = await control.runs()
        before = summary.status, world.fake.count("start")
        await control.resume(run, by="anna")
        await world.clock.sleep(1.0)
        return before, world.fake.count("start")

    assert play(story, fleet=DEBUGGED) == ((RunStatus.PAUSED, 0), 1)


def test_vehicles_at_work_are_held_at_a_breakpoint_and_go_on(play):
    async def story(world: World):
        control = world.executive.control
        run = await asked(world, BOTH)
        await control.set_breakpoints(run, ["T"])
        await control.answer(run, "p1", "yes")
        await world.clock.sleep(1.0)
        held = world.fake.count("hold", "ugv1"), world.fake.count("resume", "ugv1")
        await control.step(run)
        await world.clock.sleep(1.0)
        return held, (world.fake.count("hold", "ugv1"), world.fake.count("resume", "ugv1"))

    assert play(story, fleet=DEBUGGED) == ((1, 0), (1, 1))


def test_data_is_changed_and_noted_with_who_did_it(play):
    async def story(world: World):
        control = world.executive.control
        run = await asked(world)
        await control.pause(run)
        await control.set_data(run, {"a": {"b": 3}}, by="anna")
        with pytest.raises(OperatorError, match="scope 9 is not open"):
            await control.set_data(run, {"a": 1}, scope=9)
        await control.resume(run)
        return [str(each) for each in world.seen if "SetData" in type(each).__name__]

    (noted,) = play(story, fleet=DEBUGGED)
    assert "by='anna'" in noted


def test_a_fleet_with_real_vehicles_does_not_allow_it(play):
    async def story(world: World):
        control = world.executive.control
        run = await asked(world)
        for call in (
            control.set_breakpoints(run, ["Drive"]),
            control.step(run),
            control.set_data(run, {"a": 1}),
        ):
            with pytest.raises(OperatorError, match=r"debugging: true.*`m2pem debug`"):
                await call
        await control.set_breakpoints(run)

    play(story, "ugv1")


def test_what_cannot_be_done_is_said(play):
    async def story(world: World):
        control = world.executive.control
        run = await asked(world)
        with pytest.raises(OperatorError, match="no 'Driv': did you mean 'Drive'"):
            await control.set_breakpoints(run, ["Driv"])
        with pytest.raises(OperatorError, match="'n >' is no condition"):
            await control.set_breakpoints(run, [], ["n >"])
        with pytest.raises(OperatorError, match="it is not paused: pause it, or set a breakpoint"):
            await control.step(run)

    play(story, fleet=DEBUGGED)


def test_a_step_that_waits_for_a_token_says_what_it_waits_for(play):
    async def story(world: World):
        control = world.executive.control
        run = await asked(world)
        await control.pause(run)
        await control.step(run)
        with pytest.raises(
            OperatorError, match=r"a step already.*wait for Ask \(an answer\).*pause it"
        ):
            await control.step(run)
        await control.pause(run)
        await control.step(run)
        await control.answer(run, "p1", "yes")
        await world.clock.sleep(1.0)
        (summary,) = await control.runs()
        await control.stop(run)
        with pytest.raises(OperatorError, match=r"r1 has ended.*there is no step to make"):
            await control.step(run)
        return summary.status

    assert play(story, fleet=DEBUGGED) is RunStatus.PAUSED


FIELDS = (
    '<ioSpecification><dataInput id="{0}in" name="fields"/>'
    "<inputSet><dataInputRefs>{0}in</dataInputRefs></inputSet><outputSet/></ioSpecification>"
    "<multiInstanceLoopCharacteristics><loopDataInputRef>{0}in</loopDataInputRef>"
    '<inputDataItem id="{0}item" name="field"/></multiInstanceLoopCharacteristics>'
)
"""Of an activity that is done for each field."""
STORES = mission(
    '<process id="P" isExecutable="true"><startEvent id="S"/>'
    '<scriptTask id="Write" scriptFormat="m2pem">'
    '<script>speed = 2\nfields = ["north", "south"]</script></scriptTask>'
    f'<subProcess id="Each">{FIELDS.format("a")}{question("Ask")}</subProcess>'
    f'<task id="Wait">{FIELDS.format("b")}</task>'
    f"{flow('S', 'Write')}{flow('Write', 'Each')}{flow('Each', 'Wait')}</process>"
)


def test_the_data_of_each_scope_is_read_and_changed_where_it_is(play):
    async def story(world: World):
        control = world.executive.control
        run = await asked(world, STORES)
        before = await control.data(run)
        await control.pause(run)
        await control.set_data(run, {"speed": 5}, scope=1)
        await control.set_data(run, {"field": "west"}, scope=4)
        after = await control.data(run)
        await control.stop(run)
        with pytest.raises(OperatorError, match=r"r1 has ended.*none of its processes is active"):
            await control.data(run)
        return before, after

    before, after = play(story, fleet=DEBUGGED)
    fields = ["north", "south"]
    assert before == [
        ScopeData("P", "P", {"speed": 2, "fields": fields}, scope=1),
        ScopeData("P", "Each", {"field": "north"}, scope=3, instance=0, token=2),
        ScopeData("P", "Each", {"field": "south"}, scope=4, instance=1, token=3),
    ]
    assert [each.data for each in after] == [
        {"speed": 5, "fields": fields},
        {"field": "north"},
        {"field": "west"},
    ]


def test_an_expression_is_evaluated_where_its_data_is_seen(play):
    async def story(world: World):
        control = world.executive.control
        run = await asked(world, STORES)
        seen = [
            await control.evaluate(run, "speed * 2"),
            await control.evaluate(run, "= field"),
            await control.evaluate(run, "field", token=3),
            await control.evaluate(run, "${field}", token=2),
            await control.evaluate(run, "= now() - now()"),
        ]
        for more, why in (
            ({"token": 9}, "r1: token 9 is not there"),
            ({}, "in 'speed' at column 1|'-' takes two numbers, not the number 2"),
        ):
            with pytest.raises(OperatorError, match=why):
                await control.evaluate(run, "speed - 'x'", **more)
        before = len(world.seen)
        await control.stop(run)
        with pytest.raises(OperatorError, match=r"r1 has ended.*its data is gone"):
            await control.evaluate(run, "speed")
        return seen, before

    seen, _ = play(story, fleet=DEBUGGED)
    assert [str(each) for each in seen] == [
        "4 (number)",
        "null: field is not set",
        '"south" (text)',
        '"north" (text)',
        '"PT0S" (days and time duration)',
    ]


def test_the_data_of_a_task_is_read_and_cannot_be_changed(play):
    async def story(world: World):
        control = world.executive.control
        run = await asked(world, STORES)
        await control.set_breakpoints(run, ["Wait"])
        for prompt in ("p1", "p2"):
            await control.answer(run, prompt, "yes")
        await control.step(run)
        return await control.data(run)

    own = [each for each in play(story, fleet=DEBUGGED) if each.element == "Wait"]
    assert [(each.data["field"], each.scope, each.instance) for each in own] == [("north", None, 0)]
