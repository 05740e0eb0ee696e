"""The executive lets no aircraft begin what would bring it too near to another one."""

import shutil
from copy import deepcopy
from pathlib import Path

import pytest

from m2pem.journal import MemoryJournal
from tests.executive.conftest import flow, mission

from .conftest import START_US, Play, World, task
from .sky import area, place, route

HOMES = {"one": (0.0, 0.0), "two": (100.0, 0.0)}
WEST = f"[{', '.join(map(str, place(-100, 0)[:2]))}]"
EAST = f"[{', '.join(map(str, place(200, 0)[:2]))}]"
SOUTH = f"[{', '.join(map(str, place(50, -300)[:2]))}]"


def up(name: str, altitude: str) -> tuple[str, str]:
    return task(f"Up{name}", "takeoff", name, altitude=altitude)


def to(name: str, target: str, **more: str) -> tuple[str, str]:
    return task(f"To{name}", "goto", name, target=target, **more)


def test_a_vehicle_in_the_way_is_named_with_what_it_does_and_what_would_be_right(
    play: Play,
) -> None:
    async def story(world: World) -> str:
        run = await world.begin(
            up("one", "20 m"), task("Round", "orbit", "one", target=WEST, duration="900 s")
        )
        await world.under_way(run, 2)
        await world.all_of(up("two", "24 m"))
        return await world.refused(to("two", WEST, altitude="24 m"))

    said = play(story, HOMES)
    assert said == (
        "two would come nearer than 20 m and 10 m in height to one, which does r1.b2 (orbit) at "
        "20 m, at enu [0, 0]: climb to 30 m or more first, or descend to 10 m or less first, or "
        "after r1.b2 has ended"
    )


def test_a_vehicle_that_is_sent_elsewhere_on_its_way_sets_out_from_where_it_is(play: Play) -> None:
    far = f"[{', '.join(map(str, place(1000, 0)[:2]))}]"
    aside = f"[{', '.join(map(str, place(500, 300)[:2]))}]"
    body = (
        '<process id="P" isExecutable="true"><startEvent id="S"/>'
        + to("one", far, speed="10 m/s")[1]
        + '<boundaryEvent id="After" attachedToRef="Toone"><timerEventDefinition>'
        "<timeDuration>PT50S</timeDuration></timerEventDefinition></boundaryEvent>"
        + task("Aside", "goto", "one", target=aside)[1]
        + '<endEvent id="E"/><endEvent id="F"/>'
        + flow("S", "Toone")
        + flow("Toone", "E")
        + flow("After", "Aside")
        + flow("Aside", "F")
        + "</process>"
    )

    async def story(world: World) -> None:
        await world.all_of(up("one", "20 m"), up("two", "20 m"))
        run = await world.executive.control.start(mission(body))
        await world.executive.control.wait(run)
        ends = [(end.state.value, end.reason) for end in world.ends(run)]
        assert ends == [("CANCELLED", ""), ("SUCCEEDED", "")]

    # It would pass where two hovers, had it not gone on before it was sent elsewhere. A vehicle
    # of a rehearsal says where it is only when something changes.
    homes = {"one": (0.0, 0.0), "two": (250.0, 150.0)}
    play(story, homes, settings={"telemetry_hz": 0})


def test_what_the_refusal_says_is_right_and_nobody_comes_too_near(play: Play) -> None:
    async def story(world: World) -> None:
        run = await world.begin(
            up("one", "20 m"), task("Round", "orbit", "one", target=WEST, duration="900 s")
        )
        await world.under_way(run, 2)
        mine = await world.begin(up("two", "30 m"), to("two", WEST, altitude="30 m"))
        while not world.ends(mine) or len(world.ends(mine)) < 2:
            await world.clock.sleep(0.2)
            on_map_m, in_height_m = world.apart_m("one", "two")
            assert on_map_m >= 20.0 or in_height_m >= 9.99
        assert [end.state.value for end in world.ends(mine)] == ["SUCCEEDED"] * 2

    play(story, HOMES)


def test_who_hovers_after_its_behavior_keeps_its_place_until_it_has_landed(play: Play) -> None:
    async def story(world: World) -> str:
        await world.all_of(up("one", "20 m"), up("two", "20 m"))
        crossing = to("two", WEST, altitude="20 m")
        said = await world.refused(crossing)
        await world.all_of(task("Down", "land", "one"))
        await world.all_of(crossing)
        return said

    said = play(story, HOMES)
    assert "one, which flies at 20 m, at enu [0, 0]: climb to 30 m or more first, or de" in said
    assert said.endswith("or after one has landed or gone elsewhere")


def test_room_is_free_when_the_behavior_has_ended_elsewhere(play: Play) -> None:
    async def story(world: World) -> None:
        await world.all_of(up("one", "20 m"), up("two", "20 m"))
        run = await world.begin(to("one", SOUTH))
        await world.under_way(run)
        assert "r2.b1 (goto)" in await world.refused(to("two", WEST))
        await world.executive.control.wait(run)
        await world.all_of(to("two", WEST))

    play(story, HOMES)


def test_without_a_policy_nothing_is_checked(play: Play) -> None:
    async def story(world: World) -> None:
        await world.all_of(up("one", "20 m"), up("two", "20 m"), to("two", WEST))

    play(story, HOMES, policy={"vertical_separation_m": None})


def test_what_drives_is_in_nobodys_way(play: Play) -> None:
    async def story(world: World) -> None:
        await world.all_of(up("two", "5 m"), to("two", WEST, altitude="1 m"), to("one", EAST))

    play(story, HOMES, ground=("one",))


@pytest.mark.parametrize("horizontal", [20.0, 120.0])
def test_taking_off_side_by_side_needs_the_horizontal_distance(
    play: Play, horizontal: float
) -> None:
    async def story(world: World) -> None:
        await world.all_of(up("one", "20 m"))
        if horizontal > 100:
            assert "nearer than 120 m" in await world.refused(up("two", "40 m"))
        else:
            await world.all_of(up("two", "20 m"))

    play(story, HOMES, policy={"horizontal_separation_m": horizontal})


def test_members_of_a_team_are_kept_from_others_not_from_each_other(play: Play) -> None:
    homes = {"one": (0.0, 0.0), "two": (0.0, 12.0), "three": (300.0, 0.0)}
    field = area((100, -50), (200, -50), (200, 50), (100, 50))

    async def story(world: World) -> str:
        await world.all_of(up("three", "40 m"))
        run = await world.begin(task("All", "area_survey", "crew", area="field", altitude="20 m"))
        await world.under_way(run)
        await world.refused(task("Mine", "goto", "three", target=WEST, altitude="25 m"))
        said = await world.refused(
            task("Mine", "single_vehicle_routing", "three", route="over", altitude="25 m")
        )
        await world.all_of(to("three", WEST, altitude="40 m"))
        return said

    geometries = {"field": field, "over": route((300, 0), (0, 0))}
    settings = {"altitude": "20 m"}
    said = play(story, homes, geometries=geometries, others=("three",), settings=settings)
    assert "r2.b1 (area_survey)" in said


def test_after_a_crash_the_room_of_what_goes_on_is_still_taken(play: Play, tmp_path: Path) -> None:
    journal = MemoryJournal()
    (tmp_path / "left").mkdir()

    def copy_files() -> None:
        for file in tmp_path.glob("world.db*"):
            shutil.copy(file, tmp_path / "left")

    async def before(world: World) -> MemoryJournal:
        await world.all_of(up("one", "20 m"), up("two", "24 m"))
        run = await world.begin(task("Round", "orbit", "one", target=WEST, duration="900 s"))
        await world.under_way(run)
        await world.clock.sleep(30)
        copy_files()
        left = deepcopy(journal)
        await left.release(run)
        return left

    async def after(world: World) -> str:
        await world.executive.resume("r2")
        return await world.refused(to("two", WEST, altitude="24 m"))

    left = play(before, HOMES, journal=journal, settings={"state": str(tmp_path / "world.db")})
    settings = {"state": str(tmp_path / "left" / "world.db")}
    said = play(after, HOMES, journal=left, settings=settings, start_us=START_US + 120_000_000)
    assert "r2.b1 (orbit)" in said


def test_two_that_stand_too_near_after_a_march_may_part(play: Play) -> None:
    homes = {"one": (0.0, 0.0), "two": (0.0, 40.0)}

    async def story(world: World) -> None:
        await world.all_of(
            up("one", "20 m"),
            up("two", "20 m"),
            task("March", "formation", "crew", route="over", spacing="8 m", shape="line"),
        )
        assert world.apart_m("one", "two")[0] < 10
        await world.refused(task("Nearer", "single_vehicle_routing", "two", route="across"))
        away = task("Away", "goto", "two", target=f"[{', '.join(map(str, place(300, 300)[:2]))}]")
        await world.all_of(away, task("Home", "return_to_launch", "one"))

    across = route((200, -50), (200, 50))
    play(story, homes, geometries={"over": route((50, 0), (200, 0)), "across": across})
