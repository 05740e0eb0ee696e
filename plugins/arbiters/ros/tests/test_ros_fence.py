"""The fleet's fence: what would leave it is not begun, and a base that leaves it is stopped."""

import math

import pytest
from m2pem_plugin_ros.behaviors.monitors import STRAY_M
from m2pem_plugin_ros.pose import Pose, Twist
from ros_behaviors_bench import Dynamics as BaseBody
from ros_behaviors_bench import Road, point
from ros_double import Dynamics, at
from ros_play import A, B, play

from m2pem.api import Area, BehaviorState, Route, VehiclePosition, VehicleState

FAILED, REJECTED = BehaviorState.FAILED, BehaviorState.REJECTED
SUCCEEDED = BehaviorState.SUCCEEDED


def ring(*corners: tuple[float, float]) -> tuple:
    return tuple(at(*corner).position for corner in (*corners, corners[0]))


HOLE = ring((40, 40), (60, 40), (60, 60), (40, 60))
FIELD = Area((ring((0, 0), (100, 0), (100, 100), (0, 100)), HOLE))


def route(*places: tuple[float, float]) -> Route:
    return Route(tuple(at(*place).position for place in places))


def bodies(**other: float) -> dict:
    return {
        A: Dynamics(east=10.0, north=50.0),
        B: Dynamics(**{"east": 20.0, "north": 50.0, **other}),
    }


@pytest.mark.parametrize(
    ("behavior", "parameters", "said"),
    [
        ("goto", {"target": at(130, 10)}, ("the target, [", "30 m outside")),
        ("goto", {"target": at(90, 50)}, ("the way to the target leaves", "by 10 m")),
        (
            "single_vehicle_routing",
            {"route": route((20, 10), (20, 130))},
            ("waypoint 2 of the route, [", "30 m outside"),
        ),
        (
            "single_vehicle_routing",
            {"route": route((20, 10), (80, 90))},
            ("the way between waypoint 1 of the route and waypoint 2",),
        ),
        (
            "single_vehicle_routing",
            {"route": route((10, 70), (50, 70), (90, 30)), "loop": True},
            ("between waypoint 3 of the route and waypoint 1 of the route",),
        ),
        ("reverse", {"distance": 20.0}, ("the place behind it, [", "10 m outside")),
    ],
)
def test_what_would_leave_the_fence_is_rejected_with_where_and_nothing_is_begun(
    behavior, parameters, said
) -> None:
    async def main(world) -> None:
        async with world.connected() as bench:
            await bench.start("r1.b1", behavior, A, **parameters)
            end = await bench.ended("r1.b1", 10)
        assert end.state is REJECTED, end
        assert all(part in end.reason for part in (*said, "fleet's fence")), end.reason
        assert world.bodies[A].called("begin") == []

    play(main, bodies(), fence=FIELD)


def test_what_goes_to_or_follows_who_is_outside_is_rejected() -> None:
    async def main(world) -> None:
        async with world.connected() as bench:
            await bench.until(lambda: bench.latest(B), 10)
            world.context.bus.publish(bench.latest(B))
            target = VehiclePosition(B)
            await bench.start("r1.b1", "goto", A, target=target)
            await bench.start("r1.b2", "follow", A, target=target, offset=5.0, bearing=0.0)
            for behavior, name in (("r1.b1", "the target"), ("r1.b2", "its station at the target")):
                end = await bench.ended(behavior, 10)
                assert end.state is REJECTED, end
                assert end.reason.startswith(f"{name}, ["), end.reason
            await bench.start("r1.b3", "follow", A, target=target, offset=30.0)
            await bench.running("r1.b3", 10)

    play(main, bodies(east=110.0, north=20.0), fence=FIELD)


def test_within_the_fence_and_back_into_it_all_is_done() -> None:
    async def main(world) -> None:
        async with world.connected() as bench:
            await bench.start("r1.b1", "goto", A, target=at(10, 60))
            assert (await bench.ended("r1.b1", 60)).state is SUCCEEDED
            await bench.start("r1.b2", "goto", B, target=at(20, 50))
            assert (await bench.ended("r1.b2", 60)).state is SUCCEEDED

    play(main, bodies(east=-20.0), fence=FIELD)


# --- a base that is driven by m2pem ---------------------------------------------------------------


def fenced(body: BaseBody | None = None) -> Road:
    """A base that may not go more than 10 m to the east."""
    return Road(body=body, outside_m=lambda place: max(0.0, place[0] - 10.0))


def stick(forward_m_s: float, road: Road) -> Road:
    road.joystick = Twist(forward_m_s)
    road.begin("teleop")
    return road


def test_a_base_that_leaves_the_fence_is_stopped_and_has_failed() -> None:
    road = stick(2.0, fenced())
    ending = road.until_ended()
    assert ending.state is FAILED
    assert ending.reason.endswith("m outside the fleet's fence")
    braking_m = 2.0**2 / 2 / road.bounds.acceleration_m_s2
    assert 10.0 + STRAY_M < road.body.pose.east_m < 10.0 + STRAY_M + braking_m + 0.6
    assert abs(road.body.twist.forward_m_s) < 0.1


def test_a_base_that_is_outside_may_come_back_but_not_leave_again() -> None:
    road = stick(1.0, fenced(BaseBody(Pose(15.0, 0.0, math.pi))))
    road.until(lambda: road.body.pose.east_m < 9.0)
    assert road.ending is None
    road.joystick = Twist(-1.0)
    assert road.until_ended().state is FAILED
    assert road.body.pose.east_m < 15.0


def test_a_base_may_drive_along_the_fence() -> None:
    road = fenced(BaseBody(Pose(9.5, 0.0, 0.0)))
    road.begin("goto", target=point((10.0, 30.0)))
    assert road.until_ended().state is SUCCEEDED


def test_one_pose_outside_is_no_leaving() -> None:
    road = stick(1.0, fenced())
    road.drive(2.0)
    road.seen_pose = lambda pose: Pose(pose.east_m + 50.0, pose.north_m, pose.yaw_rad)
    road.step()
    road.seen_pose = lambda pose: pose
    road.drive(1.0)
    assert road.ending is None
    assert road.body.twist.forward_m_s > 0.5


def test_states_without_a_position_confine_nobody() -> None:
    async def main(world) -> None:
        async with world.connected() as bench:
            world.context.bus.publish(VehicleState(B, world.clock.now_us()))
            await bench.start("r1.b1", "follow", A, target=VehiclePosition(B))
            await bench.running("r1.b1", 10)

    play(main, bodies(), fence=FIELD)
