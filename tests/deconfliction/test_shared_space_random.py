"""Rovers with random tasks: no area ever has more of them than its capacity, and none waits for
ever while there is place."""

import random
from typing import Any

import pytest

from m2pem.api.runs import RunStatus
from m2pem.fleet.fleet import SharedSpace
from tests.seeds import named, seeds_for

from .conftest import Play, World, task
from .sky import area, place, route

CENTRES = ((30.0, 0.0), (60.0, 0.0), (45.0, 30.0))
HALF_M = 6.0
AREAS = {
    f"area{number}": area(
        (east - HALF_M, north - HALF_M),
        (east + HALF_M, north - HALF_M),
        (east + HALF_M, north + HALF_M),
        (east - HALF_M, north + HALF_M),
    )
    for number, (east, north) in enumerate(CENTRES)
}
HOMES = {f"rover{number}": (90.0 * (number % 2), -40.0 + 25.0 * number) for number in range(4)}
TASKS = 3
END_S = 900.0
"""No task waits longer than that in these stories."""


def inside(world: World, name: str) -> list[str]:
    """The vehicles in an area, by their simulated positions."""
    east, north = CENTRES[int(name.removeprefix("area"))]
    found = []
    for vehicle in HOMES:
        at = world.place(vehicle)
        if abs(at[0] - east) < HALF_M - 0.2 and abs(at[1] - north) < HALF_M - 0.2:
            found.append(vehicle)
    return found


def tasks_of(chance: random.Random, vehicle: str, routes: dict[str, Any]) -> list[tuple[str, str]]:
    """Tasks in a row; those in an area leave it again at the end of the mission."""
    found = []
    for number in range(TASKS):
        spots = [
            (east + chance.choice((-20.0, 0.0, 20.0)), north + chance.choice((-20.0, 0.0, 20.0)))
            for east, north in chance.choices(CENTRES, k=chance.randint(1, 3))
        ]
        name = f"{vehicle}_way{number}"
        routes[name] = route(*spots)
        if len(spots) > 1:
            given = {"route": name}
            found.append((f"T{number}", "single_vehicle_routing", given))
        else:
            at = f"[{', '.join(map(str, place(*spots[0])[:2]))}]"
            found.append((f"T{number}", "goto", {"target": at}))
    speed = f"{chance.choice((2, 4))} m/s"
    return [task(element, name, vehicle, speed=speed, **p) for element, name, p in found]


def play_one(play: Play, seed: int) -> None:
    chance = random.Random(seed)
    geometries: dict[str, Any] = dict(AREAS)
    missions = {vehicle: tasks_of(chance, vehicle, geometries) for vehicle in HOMES}
    capacity = {name: chance.randint(1, 2) for name in AREAS}

    async def story(world: World) -> None:
        runs = [await world.begin(*tasks) for tasks in missions.values()]
        control, clock = world.executive.control, world.clock
        ends_us = clock.now_us() + round(END_S * 1e6)
        while clock.now_us() < ends_us:
            for name, most in capacity.items():
                assert len(inside(world, name)) <= most, (seed, name, inside(world, name))
            if all(len(world.ends(run)) == TASKS for run in runs):
                break
            await clock.sleep(0.25)
        # What still waits, waits for vehicles that stand in an area which is full of them.
        waiting = await control.waiting()
        for each in waiting:
            (name,) = each.holders
            assert len(inside(world, name)) == capacity[name], (seed, each)
        stuck = {each.run for each in waiting}
        for run in set(runs) - stuck:
            assert (await control.wait(run)).status is RunStatus.COMPLETED, seed
        for run in stuck:
            await control.stop(run)

    spaces = {name: SharedSpace(name, most, wait_s=1e6) for name, most in capacity.items()}
    play(
        story,
        HOMES,
        geometries=geometries,
        policy={"vertical_separation_m": None, "shared_space": spaces},
        ground=tuple(HOMES),
    )


# In the last one a rover swerves at the border of an area, just when another one has got its place.
@pytest.mark.parametrize("seed", [1, 3, 171948708])
def test_no_area_has_too_many_and_none_waits_while_there_is_place(play: Play, seed: int) -> None:
    play_one(play, seed)


@pytest.mark.long
def test_the_same_with_other_stories(play: Play) -> None:
    for seed in seeds_for(60):
        with named(seed):
            play_one(play, seed)
