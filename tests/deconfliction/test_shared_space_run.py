"""Ground vehicles share a bridge, and a road: one goes, the other is refused or waits."""

import re
import shutil
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from m2pem.api.runs import Alert, RunStatus
from m2pem.engine.records import (
    AllocationDelayed,
    AllocationEnded,
    BehaviorEnded,
    BehaviorRequested,
    EventAwaited,
    ResourcesAllocated,
)
from m2pem.fleet.fleet import Domain, OnConflict, SharedSpace
from m2pem.journal import MemoryJournal

from .conftest import START_US, Play, World, task
from .sky import area, place, route

BRIDGE = area((40, -5), (60, -5), (60, 5), (40, 5))
HOMES = {"one": (0.0, 0.0), "two": (100.0, 30.0)}
"""One is west of the bridge, two east of it, beside the way of one."""


def at(east: float, north: float) -> str:
    return f"[{', '.join(map(str, place(east, north)[:2]))}]"


OVER = task("Over", "goto", "one", target=at(100, 0), speed="2 m/s")
BACK = task("Back", "single_vehicle_routing", "two", route="back", speed="2 m/s")
GEOMETRIES = {"bridge": BRIDGE, "back": route((100, 20), (65, 0), (0, 15))}


def policy(**space: Any) -> dict[str, Any]:
    return {
        "vertical_separation_m": None,
        "shared_space": {"bridge": replace(SharedSpace("bridge", 1), **space)},
    }


def rovers(play: Play, story: Any, **more: Any) -> Any:
    given = {"geometries": GEOMETRIES, "policy": policy(), "ground": ("one", "two", "three")}
    return play(story, **{"homes": HOMES, **given, **more})


def delays(world: World) -> list[AllocationDelayed]:
    return [each for each in world.seen if isinstance(each, AllocationDelayed)]


def on_bridge(world: World, name: str) -> bool:
    east, north, _ = world.place(name)
    return 40 <= east <= 60 and -5 <= north <= 5


async def waits(world: World, run: str) -> None:
    await world.until(lambda: any(each.allocation == f"{run}.a1" for each in delays(world)))


async def status(world: World, run: str) -> RunStatus:
    return (await world.executive.control.wait(run)).status


def test_who_comes_second_is_refused_with_who_and_where(play: Play) -> None:
    async def story(world: World) -> str:
        run = await world.begin(OVER)
        await world.under_way(run)
        said = await world.refused(BACK)
        await world.executive.control.wait(run)
        return said

    said = rovers(play, story, policy=policy(on_conflict=OnConflict.REFUSE))
    assert said.startswith("two would enter bridge (capacity 1) at enu [")
    assert said.endswith(
        "] (in 'bridge'), which is taken by one, which does r1.b1 (goto): start it after one has "
        "left it"
    )


def test_who_comes_second_waits_and_goes_when_the_other_has_left_the_bridge(play: Play) -> None:
    async def story(world: World) -> None:
        first = await world.begin(OVER)
        await world.under_way(first)
        second = await world.begin(BACK)
        await waits(world, second)
        (waiting,) = await world.executive.control.waiting()
        assert waiting.holders == {"bridge": "r1.b1"}
        assert "bridge (capacity 1)" in waiting.reason
        assert 0 < waiting.left_s <= 600
        (bridge,) = await world.executive.control.shared_space()
        (task,) = bridge.waiting
        assert (task.run, task.allocation) == (second, f"{second}.a1")
        taken = "bridge (1 of 1 taken): one (r1.b1)"
        assert str(bridge) == f"{taken}; {task.task} of {second} waits since {task.waited_s:.0f} s"
        over = False
        while not world.states(f"{second}.b1"):
            await world.clock.sleep(0.1)
            over = over or on_bridge(world, "one")
        # It need not wait until the other one's behavior has ended.
        assert over
        assert not world.ends(first)
        assert world.place("one")[0] < 75
        while not world.ends(second):
            assert not (on_bridge(world, "one") and on_bridge(world, "two"))
            await world.clock.sleep(0.1)
        assert [await status(world, run) for run in (first, second)] == [RunStatus.COMPLETED] * 2

    rovers(play, story)


def test_a_fleet_whose_vehicles_pass_elsewhere_journals_no_wait(play: Play) -> None:
    async def story(world: World) -> None:
        await world.all_of(task("Aside", "goto", "one", target=at(0, 50)))
        assert not any(isinstance(each, EventAwaited | AllocationDelayed) for each in world.seen)

    rovers(play, story)


def test_who_stands_on_the_bridge_has_its_place_until_it_has_left(play: Play) -> None:
    async def story(world: World) -> str:
        await world.all_of(task("On", "goto", "one", target=at(50, 0)))
        second = await world.begin(BACK)
        await waits(world, second)
        await world.clock.sleep(60)
        assert not world.states(f"{second}.b1")
        await world.all_of(task("Off", "goto", "one", target=at(0, -40)))
        await world.executive.control.wait(second)
        return delays(world)[0].reason

    said = rovers(play, story)
    assert "taken by one, which is at rest there: start it after one has left it" in said


def test_a_wait_ends_when_its_time_is_up(play: Play) -> None:
    async def story(world: World) -> AllocationEnded:
        await world.all_of(task("On", "goto", "one", target=at(50, 0)))
        before_us = world.clock.now_us()
        run = await world.begin(BACK)
        assert await status(world, run) is RunStatus.FAILED
        assert (world.clock.now_us() - before_us) / 1e6 == pytest.approx(90, abs=1)
        (ended,) = [each for each in world.seen if isinstance(each, AllocationEnded)]
        return ended

    ended = rovers(play, story, policy=policy(wait_s=90.0))
    assert ended.code == "RESOURCE_UNAVAILABLE"
    assert "which is at rest there" in ended.reason


def test_a_lost_rover_keeps_its_place_and_the_other_times_out(play: Play) -> None:
    async def story(world: World) -> AllocationEnded:
        first = await world.begin(OVER)
        assert await status(world, first) is RunStatus.FAILED
        assert [end.code for end in world.ends(first)] == ["LINK_LOST"]
        second = await world.begin(BACK)
        assert await status(world, second) is RunStatus.FAILED
        (ended,) = [each for each in world.seen if isinstance(each, AllocationEnded)]
        return ended

    cut = {"one": {"faults": ["cut link at 25 s"]}}
    ended = rovers(play, story, policy=policy(wait_s=30.0), own=cut, watch_links=True)
    assert "which is taken by one, which is lost, and did r1.b1 (goto)" in ended.reason
    assert ended.reason.endswith("start it when the link to one is restored")


def test_stop_ends_a_wait_and_the_bridge_stays_free(play: Play) -> None:
    async def story(world: World) -> None:
        first = await world.begin(OVER)
        await world.under_way(first)
        second = await world.begin(BACK)
        await waits(world, second)
        await world.executive.control.stop(second)
        await world.executive.control.wait(second)
        await world.executive.control.wait(first)
        assert not world.states(f"{second}.b1")
        await world.all_of(BACK)

    rovers(play, story)


def test_a_paused_run_gets_no_place_and_its_wait_stands_still(play: Play) -> None:
    async def story(world: World) -> None:
        control = world.executive.control
        first = await world.begin(OVER)
        await world.under_way(first)
        second = await world.begin(BACK)
        await waits(world, second)
        await control.pause(second)
        await control.wait(first)
        await world.clock.sleep(300)
        assert not world.states(f"{second}.b1")
        await control.resume(second)
        assert await status(world, second) is RunStatus.COMPLETED

    rovers(play, story, policy=policy(wait_s=100.0))


def test_a_held_rover_on_the_bridge_keeps_it(play: Play) -> None:
    async def story(world: World) -> None:
        control = world.executive.control
        first = await world.begin(OVER)
        await world.until(lambda: on_bridge(world, "one"))
        await control.pause(first)
        second = await world.begin(BACK)
        await world.clock.sleep(120)
        assert not world.states(f"{second}.b1")
        await control.resume(first)
        assert [await status(world, run) for run in (first, second)] == [RunStatus.COMPLETED] * 2

    rovers(play, story)


def test_three_in_a_ring_wait_for_each_other_and_operators_are_warned(play: Play) -> None:
    spots = {"one": (0.0, 0.0), "two": (100.0, 0.0), "three": (50.0, 80.0)}
    geometries = {
        f"at_{name}": area((e - 5, n - 5), (e + 5, n - 5), (e + 5, n + 5), (e - 5, n + 5))
        for name, (e, n) in spots.items()
    }
    ring = {"shared_space": {name: SharedSpace(name, 1) for name in geometries}}

    async def story(world: World) -> list[str]:
        control = world.executive.control
        alerts: list[str] = []
        events = control.subscribe()
        runs = [
            await world.begin(task("Next", "goto", name, target=at(*spots[then])))
            for name, then in (("one", "two"), ("two", "three"), ("three", "one"))
        ]
        while len(alerts) < 3:
            event = await anext(events)
            if isinstance(event, Alert) and event.code == "WAITING_CIRCLE":
                alerts.append(event.text)
        await world.clock.sleep(60)
        assert not any(world.states(f"{run}.b1") for run in runs)
        # The way out that the warning names.
        await control.stop(runs[0])
        await control.wait(runs[0])
        await world.all_of(task("Aside", "goto", "one", target=at(0, -60)))
        assert [await status(world, run) for run in runs[1:]] == [RunStatus.COMPLETED] * 2
        return alerts

    alerts = play(
        story,
        spots,
        geometries=geometries,
        policy={"vertical_separation_m": None, **ring},
        ground=tuple(spots),
    )
    assert len(set(alerts)) == 1
    assert all(f"Next of {run} (" in alerts[0] for run in ("r1", "r2", "r3"))
    assert not re.search(r"\br\d\.\w", alerts[0])
    for name in spots:
        assert f"taken by {name}, which is at rest there" in alerts[0]
    assert "none of them can go on by itself" in alerts[0]


def test_after_a_crash_who_waited_waits_again_and_who_crosses_keeps_the_bridge(
    play: Play, tmp_path: Path
) -> None:
    journal = MemoryJournal()
    (tmp_path / "left").mkdir()

    def copy_files() -> None:
        for file in tmp_path.glob("world.db*"):
            shutil.copy(file, tmp_path / "left")

    async def before(world: World) -> MemoryJournal:
        first = await world.begin(OVER)
        await world.under_way(first)
        second = await world.begin(BACK)
        await waits(world, second)
        copy_files()
        left = deepcopy(journal)
        for run in (first, second):
            await left.release(run)
        return left

    async def after(world: World) -> list[str]:
        for run in ("r1", "r2"):
            await world.executive.resume(run)
        assert [await status(world, run) for run in ("r1", "r2")] == [RunStatus.COMPLETED] * 2
        moved = BehaviorRequested | BehaviorEnded
        return [each.behavior for each in world.seen if isinstance(each, moved)]

    left = rovers(play, before, journal=journal, settings={"state": str(tmp_path / "world.db")})
    settings = {"state": str(tmp_path / "left" / "world.db")}
    order = rovers(play, after, journal=left, settings=settings, start_us=START_US + 20_000_000)
    # r2 begins when r1 has left the bridge, before it has ended.
    assert order == ["r2.b1", "r1.b1", "r2.b1"]


def apart(metres: float, **more: Any) -> dict[str, Any]:
    return {
        "vertical_separation_m": None,
        "surface_separation_m": {Domain.GROUND: metres},
        **more,
    }


def test_two_whose_ways_meet_are_kept_apart_and_a_team_is_not_kept_from_itself(
    play: Play,
) -> None:
    async def story(world: World) -> str:
        first = await world.begin(OVER)
        await world.under_way(first)
        said = await world.refused(BACK)
        await world.executive.control.wait(first)
        await world.all_of(task("Away", "goto", "one", target=at(100, -60)), BACK)
        await world.all_of(
            task("March", "formation", "crew", route="march", spacing="10 m", shape="column")
        )
        return said

    geometries = {**GEOMETRIES, "march": route((0, 60), (100, 60))}
    said = rovers(play, story, geometries=geometries, policy=apart(5.0))
    assert said.startswith("two would come nearer than 5 m to one, which does r1.b1 (goto), at enu")
    assert said.endswith("start it after r1.b1 has ended")


def test_one_of_two_whose_ways_meet_waits_if_the_fleet_says_so(play: Play) -> None:
    async def story(world: World) -> None:
        first = await world.begin(OVER, task("Away", "goto", "one", target=at(100, -60)))
        await world.under_way(first)
        second = await world.begin(BACK)
        await waits(world, second)
        while not world.ends(second):
            assert world.apart_m("one", "two")[0] >= 5
            await world.clock.sleep(0.1)
        assert [await status(world, run) for run in (first, second)] == [RunStatus.COMPLETED] * 2

    rovers(play, story, policy=apart(5.0, on_conflict=OnConflict.WAIT))


def test_aircraft_wait_for_their_volumes_if_the_fleet_says_so(play: Play) -> None:
    async def story(world: World) -> None:
        await world.all_of(
            task("Up1", "takeoff", "one", altitude="20 m"),
            task("Up2", "takeoff", "two", altitude="20 m"),
        )
        first = await world.begin(
            task("Over", "goto", "one", target=at(60, -300)), task("Land", "land", "one")
        )
        second = await world.begin(task("Over2", "goto", "two", target=at(0, -300)))
        await waits(world, second)
        assert [await status(world, run) for run in (first, second)] == [RunStatus.COMPLETED] * 2

    play(story, HOMES, policy={"on_conflict": OnConflict.WAIT})


def by_need(element: str, target: str) -> tuple[str, str]:
    """A task for whatever vehicle is best for it and has space."""
    return element, task(element, "goto", "one", target=target, speed="2 m/s")[1].replace(
        'vehicle="one"', 'requires="true"'
    )


def test_a_role_by_need_gets_the_next_vehicle_that_has_space(play: Play) -> None:
    homes = {"one": (20.0, 0.0), "two": (140.0, 0.0)}

    async def story(world: World) -> tuple[str, ...]:
        await world.all_of(task("Hold", "hold", "one"))
        run = await world.begin(by_need("Go", at(65, 0)))
        await world.executive.control.wait(run)
        assert not delays(world)
        chosen = [each for each in world.seen if isinstance(each, ResourcesAllocated)][-1]
        (role,) = chosen.considered["roles"].values()
        excluded = {each["resource"]: each.get("excluded", "") for each in role["candidates"]}
        assert ("bridge (capacity 1)" in excluded.get("one", "")) is (role["chosen"] == ["two"])
        return chosen.roles["doer"]

    # One is nearer, but it would have to cross the bridge, where a vehicle stands that a person
    # drives.
    driven = {"three": (50.0, 0.0)}
    aside = {"three": (50.0, 90.0)}
    manned = ("three",)
    assert rovers(play, story, homes={**homes, **aside}, manned=manned) == ("one",)
    assert rovers(play, story, homes={**homes, **driven}, manned=manned) == ("two",)


def test_a_later_task_does_not_overtake_one_that_waits_for_space(play: Play) -> None:
    homes = {"one": (0.0, 0.0), "two": (100.0, 30.0), "three": (100.0, -30.0)}

    async def story(world: World) -> list[str]:
        first = await world.begin(OVER)
        await world.under_way(first)
        second = await world.begin(BACK)
        await waits(world, second)
        third = await world.begin(task("Too", "goto", "three", target=at(0, -20)))
        # It passes beside the bridge, and nothing that two needs.
        await world.under_way(third)
        await world.executive.control.wait(third)
        fourth = await world.begin(task("Four", "goto", "three", target=at(50, 0)))
        for run in (first, second):
            assert await status(world, run) is RunStatus.COMPLETED
        await world.executive.control.wait(fourth)
        return [each.behavior for each in world.seen if isinstance(each, BehaviorRequested)]

    assert rovers(play, story, homes=homes) == ["r1.b1", "r3.b1", "r2.b1", "r4.b1"]


def for_two(element: str, north: float) -> tuple[str, str]:
    """A task beside the bridge, for a vehicle that must be two."""
    _, text = task(element, "goto", "two", target=at(100, north), speed="2 m/s")
    need = 'requires="vehicle.name == \'two\'" wait="PT1H"'
    return element, text.replace('vehicle="two"', need)


def test_a_task_that_waits_for_space_keeps_its_vehicle_from_later_tasks(play: Play) -> None:
    """Else later tasks get the vehicle, others the space meanwhile, and so on for ever."""
    homes = {"one": (0.0, 0.0), "two": (100.0, 30.0), "three": (120.0, 0.0)}

    async def story(world: World) -> list[str]:
        first = await world.begin(OVER)
        await world.under_way(first)
        named = await world.begin(BACK)
        await waits(world, named)
        across = [task(f"To{e}", "goto", "three", target=at(e, 0), speed="2 m/s") for e in (0, 120)]
        later = [
            await world.begin(for_two("Aside", 90)),
            await world.begin(*across),
            await world.begin(for_two("Far", 150)),
        ]
        await waits(world, later[0])
        for run in (first, named, *later):
            assert await status(world, run) is RunStatus.COMPLETED
        kept = next(e.reason for e in delays(world) if e.allocation == f"{later[0]}.a1")
        assert kept == "what is free is kept for tasks that asked before"
        return [each.behavior for each in world.seen if isinstance(each, BehaviorRequested)]

    order = rovers(play, story, homes=homes, policy=policy(wait_s=3600.0))
    assert order[:2] == ["r1.b1", "r2.b1"]


def test_a_vehicle_may_be_brought_back_by_name_while_a_task_waits_with_it_for_space(
    play: Play,
) -> None:
    async def story(world: World) -> None:
        first = await world.begin(OVER)
        await world.under_way(first)
        second = await world.begin(BACK)
        await waits(world, second)
        await world.all_of(task("Aside", "goto", "two", target=at(100, 35)))
        assert [await status(world, run) for run in (first, second)] == [RunStatus.COMPLETED] * 2

    rovers(play, story)


def test_a_task_that_waits_for_who_stands_in_its_way_leaves_its_vehicle_to_others(
    play: Play,
) -> None:
    async def story(world: World) -> None:
        first = await world.begin(BACK)
        await waits(world, first)
        await world.all_of(task("Aside", "goto", "two", target=at(100, 90)))
        await world.all_of(task("Leave", "goto", "one", target=at(50, -60)))
        assert await status(world, first) is RunStatus.COMPLETED

    rovers(play, story, homes={**HOMES, "one": (50.0, 0.0)})


def test_a_team_crosses_a_bridge_for_one_vehicle_one_by_one(play: Play) -> None:
    homes = {"one": (0.0, 0.0), "two": (-12.0, 0.0)}

    async def story(world: World) -> None:
        cross = {"route": "over", "spacing": "10 m", "speed": "3 m/s"}
        run = await world.begin(task("Cross", "bridge_crossing", "crew", **cross))
        crossed = set()
        while not world.ends(run):
            on_it = [name for name in homes if on_bridge(world, name)]
            assert len(on_it) < 2
            crossed.update(on_it)
            await world.clock.sleep(0.2)
        assert crossed == {"one", "two"}
        assert await status(world, run) is RunStatus.COMPLETED

    rovers(play, story, homes=homes, geometries={**GEOMETRIES, "over": route((0, 0), (120, 0))})
