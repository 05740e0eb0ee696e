"""Whose geometry of a name a task gets: the run's, the mission's, an operator's, or the fleet's."""

import asyncio
from dataclasses import replace

import pytest

from m2pem.api import BehaviorState, shown_geometries
from m2pem.mission.geometry import Point, Route
from tests.executive.conftest import World, behavior, fleet, flow, mission, question, sequence

GATE = '{"type": "Point", "coordinates": [7.002, 50]}'
OWN = f'<extensionElements><m2pem:geometry name="gate">{GATE}</m2pem:geometry></extensionElements>'
TO_GATE = '<m2pem:property name="target" value="gate"/>'
GO = sequence(("Go", behavior("Go", "goto", "ugv1", parameters=TO_GATE)))
PLAIN = mission(GO)
DRAWN = mission(GO.replace("<startEvent", f"{OWN}<startEvent", 1))
FLEET = replace(fleet("ugv1"), geometries={"gate": Point((50.0, 7.001, None))})


def given(longitude: float) -> dict[str, object]:
    return {"type": "Point", "coordinates": [longitude, 50]}


async def target_of(world: World, source: bytes) -> float:
    """The longitude to which a run goes at once, in degrees."""
    run = await world.executive.control.start(source)
    await world.fake.until_called("start", f"{run}.b1")
    world.fake.report(f"{run}.b1", BehaviorState.SUCCEEDED)
    await world.executive.control.wait(run)
    target = world.fake.requests[f"{run}.b1"].parameters["target"]
    assert isinstance(target, Point)
    return target.position[1]


def test_the_missions_own_stands_in_place_of_the_fleets_and_the_operators(play):
    async def story(world: World):
        before = await target_of(world, PLAIN), await target_of(world, DRAWN)
        await world.executive.control.set_geometry("gate", given(7.003), by="anna")
        return before, (await target_of(world, PLAIN), await target_of(world, DRAWN))

    before, after = play(story, fleet=FLEET)
    assert before == (7.001, 7.002)
    assert after == (7.003, 7.002)


@pytest.mark.parametrize(("to_the_run", "longitude"), [(True, 7.003), (False, 7.002)])
def test_one_that_is_handed_over_to_the_run_itself_replaces_it(play, to_the_run, longitude):
    first = '<m2pem:property name="target" value="[50, 7]"/>'
    there = behavior("There", "goto", "ugv1", parameters=first)
    inside = sequence(("There", there), ("Go", behavior("Go", "goto", "ugv1", parameters=TO_GATE)))
    source = mission(inside.replace("<startEvent", f"{OWN}<startEvent", 1))

    async def story(world: World):
        control = world.executive.control
        run = await control.start(source)
        await world.fake.until_called("start", f"{run}.b1")
        whose = run if to_the_run else None
        await control.set_geometry("gate", given(7.003), run=whose, by="anna")
        world.fake.report(f"{run}.b1", BehaviorState.SUCCEEDED)
        await world.fake.until_called("start", f"{run}.b2")
        world.fake.report(f"{run}.b2", BehaviorState.SUCCEEDED)
        await control.wait(run)
        return world.fake.requests[f"{run}.b2"].parameters["target"]

    assert play(story, fleet=FLEET).position == (50.0, longitude, None)


def test_what_a_run_has_alone_is_shown_with_its_id_until_it_ends(play):
    async def story(world: World):
        control = world.executive.control
        shown = {}

        def look(when: str) -> None:
            shown[when] = {
                name: each.position[1] for name, each in shown_geometries(control).items()
            }

        look("before")
        asks = mission(sequence(("Ask", question("Ask"))))
        drawn = await control.start(asks.replace(b"<startEvent", OWN.encode() + b"<startEvent", 1))
        plain = await control.start(asks)
        look("both")
        await control.set_geometry("gate", given(7.003), run=plain, by="anna")
        await control.stop(drawn)
        await control.wait(drawn)
        look("one, which has another one")
        await control.set_geometry("gate", given(7.004), by="anna")
        await control.set_geometry("gate", given(7.005), by="ben")
        await control.delete_geometry("gate", by="ben")
        runner = world.executive.runner(plain)
        async with asyncio.timeout(10):
            while runner.run.state.geometries.get("gate") != given(7.005):  # noqa: ASYNC110
                await asyncio.sleep(0)
        look("one, which keeps what was deleted")
        await control.stop(plain)
        await control.wait(plain)
        look("none")
        return shown

    assert play(story, fleet=FLEET) == {
        "before": {"gate": 7.001},
        "both": {"gate": 7.001, "r1/gate": 7.002},
        "one, which has another one": {"gate": 7.001, "r2/gate": 7.003},
        "one, which keeps what was deleted": {"gate": 7.001, "r2/gate": 7.005},
        "none": {"gate": 7.001},
    }


def test_what_is_left_of_a_task_that_another_one_names_is_shown(play):
    left = {"type": "LineString", "coordinates": [[7.001, 50], [7.002, 50]]}
    lane = '<m2pem:property name="route" value="{}"/>'
    fly = behavior("Fly", "single_vehicle_routing", "ugv1", parameters=lane.format("lane"))
    rest = lane.format("${Fly.remaining}")
    tasks = sequence(
        ("Fly", fly),
        ("Rest", behavior("Rest", "single_vehicle_routing", "ugv1", parameters=rest)),
    )
    caught = (
        '<boundaryEvent id="B" attachedToRef="Fly"><errorEventDefinition/></boundaryEvent>'
        f"{question('Ask')}{flow('B', 'Ask')}{flow('Ask', 'Rest')}"
    )
    source = mission(tasks.replace("</process>", f"{caught}</process>"))
    line = Route(((50.0, 7.0, None), (50.0, 7.002, None)))

    async def story(world: World):
        control = world.executive.control
        run = await control.start(source)
        await world.fake.until_called("start", f"{run}.b1")
        world.fake.report(f"{run}.b1", BehaviorState.RUNNING, remaining={"route": left})
        world.fake.report(f"{run}.b1", BehaviorState.FAILED)
        runner = world.executive.runner(run)
        async with asyncio.timeout(10):
            while not runner.run.state.prompts:  # noqa: ASYNC110
                await asyncio.sleep(0)
        shown = shown_geometries(control)
        await control.answer(run, "p1", "yes", by="anna")
        await world.fake.until_called("start", f"{run}.b2")
        await control.stop(run)
        await control.wait(run)
        return shown[f"{run}/Fly.remaining"], world.fake.requests[f"{run}.b2"].parameters["route"]

    shown, given_ = play(story, fleet=replace(fleet("ugv1"), geometries={"lane": line}))
    assert shown == given_
    assert [place[:2] for place in shown.waypoints] == [(50.0, 7.001), (50.0, 7.002)]
