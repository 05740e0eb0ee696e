"""No two members of a team come nearer to each other than their spacing less a fifth, unless the
team says so before: on random routes with turns of any angle, judged by where the vehicles are."""

import math
from dataclasses import dataclass, field
from itertools import combinations, pairwise
from pathlib import Path
from random import Random
from typing import Any

import pytest

from m2pem.engine.records import BehaviorEnded
from m2pem.fleet.fleet import Domain, Fleet, LostMemberPolicy
from m2pem.mission.catalogue import BehaviorState
from m2pem.simulation.faults import Fault
from tests.seeds import named

from .conftest import one_task, route
from .rehearsed import Rehearsed, rehearsed, sim_fleet

NAMES = "abcde"
SHAPES = ("column", "line", "wedge", "vee", "echelon_left", "echelon_right", "diamond")
SLOTS = {
    "line": [(0, 0), (0, 1), (0, -1), (0, 2), (0, -2)],
    "wedge": [(0, 0), (1, 1), (1, -1), (2, 2), (2, -2)],
    "vee": [(0, 0), (-1, 1), (-1, -1), (-2, 2), (-2, -2)],
    "echelon_left": [(k, k) for k in range(5)],
    "echelon_right": [(k, -k) for k in range(5)],
    "diamond": [(0, 0), (1, 1), (1, -1), (2, 0), (3, 0)],
    "column": [(k, 0) for k in range(5)],
}


@dataclass
class Case:
    """A team, its spacing in metres, and its route as places in metres."""

    names: str
    shape: str
    spacing_m: float
    places: list[tuple[float, float]]
    domain: Domain
    behavior: str = "road_following_formation"
    speeds_m_s: list[float] = field(default_factory=list)

    @classmethod
    def of(cls, seed: int) -> "Case":
        """A random one: legs short and long, turns from 0 to 180 degrees."""
        random = Random(seed)
        spacing_m = random.uniform(5, 40)
        places, yaw = [(0.0, 0.0)], 0.0
        for _ in range(random.randint(1, 5)):
            length_m = random.choice([random.uniform(0.3, 2), random.uniform(2, 12)]) * spacing_m
            east, north = places[-1]
            places.append((east + length_m * math.cos(yaw), north + length_m * math.sin(yaw)))
            yaw += random.choice([-1, 1]) * random.choice(
                [random.uniform(0, math.pi), random.uniform(2, math.pi), math.pi / 2]
            )
        shape = random.choice(["column", *SHAPES])
        count = random.randint(2, 5)
        speeds = [random.choice([15.0, random.uniform(1.5, 15)]) for _ in range(count)]
        behavior = "bridge_crossing" if shape == "column" and random.random() < 0.2 else ""
        return cls(
            NAMES[:count],
            shape,
            spacing_m,
            places,
            random.choice([Domain.GROUND, Domain.GROUND, Domain.AIR, Domain.SURFACE]),
            behavior or random.choice(["formation", "road_following_formation"]),
            speeds,
        )

    def fleet(self, policy: LostMemberPolicy = LostMemberPolicy.STOP) -> Fleet:
        """The members in their places behind the beginning of the route."""
        slots = dict(zip(self.names, SLOTS[self.shape], strict=False))
        first = min(back for back, _ in slots.values())
        starts = {
            name: ((first - back - 0.5) * self.spacing_m, left * self.spacing_m)
            for name, (back, left) in slots.items()
        }
        speeds = self.speeds_m_s or [15.0] * len(self.names)
        return sim_fleet(
            starts,
            {"way": route(*self.places)},
            policy=policy,
            domains=dict.fromkeys(self.names, self.domain),
            settings={
                name: {"max_speed": f"{speed} m/s"}
                for name, speed in zip(self.names, speeds, strict=True)
            },
        )

    @property
    def mission(self) -> bytes:
        given = {} if self.behavior == "bridge_crossing" else {"shape": self.shape}
        return one_task(self.behavior, route="way", spacing=f"{self.spacing_m} m", **given)


@dataclass
class Judged:
    """`nearest_m`: by the two vehicles, whatever their links. `begun_m`: where they began."""

    ended: BehaviorEnded
    nearest_m: dict[tuple[str, str], float]
    begun_m: dict[tuple[str, str], float]
    when_s: dict[tuple[str, str], float]
    seconds: float
    least_m: float


def places_of(world: Rehearsed) -> dict[str, tuple[float, float]]:
    now_us = world.clock.now_us()
    return {str(each.id): each.pose(now_us).place[:2] for each in world.sim.vehicles}


def judged(fleet: Fleet, mission: bytes, *faults: tuple[str, Fault]) -> Judged:
    """Rehearse it, and measure each 0.1 s."""

    async def story(world: Rehearsed) -> Judged:
        for victim, fault in faults:
            world.sim.inject(victim, fault)  # type: ignore[arg-type]
        start_us = world.clock.now_us()
        begun = {
            (a, b): math.dist(one, other)
            for (a, one), (b, other) in combinations(places_of(world).items(), 2)
        }
        nearest, when = dict(begun), dict.fromkeys(begun, 0.0)
        await world.executive.control.start(mission)
        for _ in range(10 * 7200):
            places = places_of(world)
            for a, b in nearest:
                if (apart_m := math.dist(places[a], places[b])) < nearest[a, b]:
                    nearest[a, b] = apart_m
                    when[a, b] = (world.clock.now_us() - start_us) / 1e6
            if world.ended():
                seconds = (world.clock.now_us() - start_us) / 1e6
                return Judged(
                    world.ended()[0], nearest, begun, when, seconds, min(nearest.values())
                )
            await world.clock.sleep(0.1)
        raise AssertionError(f"it had not ended in two hours; {places_of(world)}")

    found: Judged = rehearsed(fleet, story)
    return found


def refused(case: Case, found: Judged) -> bool:
    """Whether the team has said that it cannot, before anybody moved."""
    if found.ended.state is BehaviorState.SUCCEEDED:
        return False
    assert found.ended.code == "REJECTED", found.ended
    assert "it turns by" in found.ended.reason or "come within" in found.ended.reason, found.ended
    return True


def check(seed: int) -> str:
    case = Case.of(seed)
    with named(seed):
        found = judged(case.fleet(), case.mission)
        if refused(case, found):
            return "refused"
        assert found.least_m >= 0.8 * case.spacing_m, (case, found)
        return "kept"
