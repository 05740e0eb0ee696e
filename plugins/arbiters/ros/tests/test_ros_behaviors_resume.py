"""A route that was driven in part goes on where the base stands, if that can be told."""

import math

import pytest
from m2pem_plugin_ros.behaviors import make_motion
from m2pem_plugin_ros.behaviors.path import next_waypoint
from m2pem_plugin_ros.pose import Pose
from ros_behaviors_bench import GOAL, TURNS_ON_THE_SPOT, Dynamics, Place, Road, route

from m2pem.api import BehaviorState

L_SHAPED = [(0.0, 0.0), (0.0, 40.0), (40.0, 40.0)]
THERE_AND_BACK = [(0.0, 0.0), (0.0, 40.0), (0.0, 0.0)]
FIGURE_EIGHT = [(20.0, 20.0), (0.0, 0.0), (20.0, 0.0), (0.0, 20.0), (20.0, 20.0)]
WITHIN_M = 2.0


@pytest.mark.parametrize(
    ("places", "here", "number"),
    [
        (L_SHAPED, (0.5, 25.0), 1),
        (L_SHAPED, (25.0, 41.0), 2),
        (L_SHAPED, (1.8, 40.0), 2),
        (L_SHAPED, (0.1, 39.9), 1),
        (L_SHAPED, (20.0, 20.0), None),
        (THERE_AND_BACK, (0.0, 15.0), 1),
        (FIGURE_EIGHT, (10.0, 10.0), None),
        (FIGURE_EIGHT, (10.0, 0.0), 2),
        ([(0.0, 0.0), (0.0, 0.0), (0.0, 9.0)], (0.0, 5.0), 2),
        ([(0.0, 0.0)], (0.0, 0.0), None),
    ],
)
def test_the_next_waypoint_is_told_where_it_can_be(
    places: list[Place], here: Place, number: int | None
) -> None:
    assert next_waypoint(places, here, WITHIN_M) == number


def take_up(places: list[Place], here: Place, *, loop: bool = False) -> Road:
    """A base that stands there takes up a route."""
    road = Road(body=Dynamics(Pose(*here, math.pi / 2)))
    parameters = {"route": route(places), **({"loop": True} if loop else {})}
    motion = make_motion("single_vehicle_routing", road.local(parameters), TURNS_ON_THE_SPOT)
    motion.take_up()
    road.pilot.begin(GOAL, motion)
    return road


def nearest(road: Road, place: Place) -> float:
    return min(math.dist((pose.east_m, pose.north_m), place) for pose in road.driven)


def test_a_route_goes_on_without_going_back() -> None:
    road = take_up(L_SHAPED, (0.3, 25.0))
    assert road.until_ended().state is BehaviorState.SUCCEEDED
    assert min(pose.north_m for pose in road.driven) > 24.5
    assert nearest(road, (0.0, 40.0)) < 1.0
    assert road.away((40.0, 40.0)) < 0.5


def test_a_route_is_driven_from_its_beginning_where_nobody_can_tell() -> None:
    road = take_up(FIGURE_EIGHT, (10.0, 10.0))
    assert road.until_ended().state is BehaviorState.SUCCEEDED
    assert nearest(road, (0.0, 0.0)) < 1.0
    assert nearest(road, (20.0, 0.0)) < 1.0


def test_a_lap_that_is_taken_up_is_followed_by_whole_ones() -> None:
    triangle = [(0.0, 0.0), (0.0, 20.0), (20.0, 0.0)]
    road = take_up(triangle, (10.0, 0.0), loop=True)
    road.until(lambda: road.away((0.0, 0.0)) < 1.0)
    assert nearest(road, (0.0, 20.0)) > 15.0
    for place in (*triangle[1:], *triangle):
        road.until(lambda place=place: road.away(place) < 1.0)  # type: ignore[misc]
    assert road.ending is None
