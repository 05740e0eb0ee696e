"""Teams that move along a route, on arbiters that know nothing of teams."""

import math
from typing import Any

import pytest

from m2pem.api.runs import RunStatus

from .carts import Yard
from .conftest import Play, World, one_task, route

ROAD = {"road": route((50, 0), (250, 0), (250, 150))}


@pytest.mark.parametrize("arbiter", ["carts", "willing"])
@pytest.mark.parametrize(
    ("behavior", "places"),
    [
        ("road_following_formation", [(250, 150), (250, 130), (250, 110)]),
        ("road_sweep", [(250, 150), (230, 150), (270, 150)]),
        ("formation", [(250, 150), (230, 130), (270, 130)]),
    ],
)
def test_a_team_arrives_in_its_shape(
    play: Play, arbiter: str, behavior: str, places: list[tuple[float, float]]
) -> None:
    async def story(world: World) -> Any:
        run = await world.executive.control.start(one_task(behavior, route="road", spacing="20 m"))
        return await world.executive.control.wait(run), world.seen

    yard = Yard(a=(0, 0), b=(-15, 0), c=(-30, 0))
    summary, seen = play(story, yard, arbiter=arbiter, geometries=ROAD)
    assert summary.status is RunStatus.COMPLETED, seen
    for name, place in zip("abc", places, strict=True):
        assert math.dist(yard[name].place, place) < 0.5, (name, yard[name].place)
