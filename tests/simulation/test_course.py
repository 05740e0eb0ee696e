import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from m2pem.simulation.course import Course, Craft
from m2pem.simulation.kinematics import DEFAULTS
from m2pem.simulation.segments import Pose, Vector
from m2pem.simulation.trajectory import Plan
from tests.seeds import examples

GROUND, AIR = DEFAULTS["ground"], DEFAULTS["air"]


def craft(domain: str = "ground", pose: Pose | None = None) -> Craft:
    kinematics = DEFAULTS[domain]
    pose = pose or Pose((0.0, 0.0, 0.0), 0.0)
    return Craft("v", domain, kinematics, pose, kinematics.cruise_speed_m_s, (0.0, 0.0, 0.0))


def samples(plan: Plan[Pose], step_s: float = 0.05) -> list[Pose]:
    count = math.ceil(plan.duration_s / step_s)
    return [plan.at(min(index * step_s, plan.duration_s)) for index in range(count + 1)]


def test_arrival_is_distance_by_speed_and_half_of_each_ramp() -> None:
    plan = Course(craft()).through([(100.0, 0.0, 0.0)]).plan()
    speed = GROUND.cruise_speed_m_s
    ramps = speed / GROUND.acceleration_m_s2 + speed / GROUND.deceleration_m_s2
    assert plan.duration_s == pytest.approx(100 / speed + ramps / 2)


def test_a_vehicle_turns_on_the_spot_before_it_sets_off() -> None:
    plan = Course(craft()).through([(0.0, 100.0, 0.0)]).plan()
    turning_s = (math.pi / 2) / GROUND.turn_rate_rad_s
    assert plan.at(turning_s / 2).yaw == pytest.approx(math.pi / 4)
    assert plan.at(turning_s).place == (0.0, 0.0, 0.0)


def test_a_corner_is_rounded_without_a_stop() -> None:
    plan = Course(craft()).through([(100.0, 0.0, 0.0), (100.0, 100.0, 0.0)]).plan()
    middle = [pose for pose in samples(plan) if pose.place[0] > 30 and pose.place[1] < 70]
    bend_m_s = GROUND.turn_rate_rad_s * GROUND.turn_radius_m
    assert min(pose.speed for pose in middle) == pytest.approx(bend_m_s, abs=0.05)
    nearest = min(math.dist(pose.place, (100.0, 0.0, 0.0)) for pose in middle)
    assert nearest == pytest.approx(GROUND.turn_radius_m * (math.sqrt(2) - 1), abs=0.3)


def test_a_way_back_is_turned_on_the_spot() -> None:
    plan = Course(craft()).through([(100.0, 0.0, 0.0), (0.0, 0.0, 0.0)]).plan()
    assert max(pose.place[0] for pose in samples(plan)) == pytest.approx(100.0)
    assert plan.at(plan.duration_s).place == pytest.approx((0.0, 0.0, 0.0))


def test_climbing_is_no_faster_than_the_climb_rate() -> None:
    plan = Course(craft("air")).climb_to(30.0).through([(5.0, 0.0, 60.0)]).plan()
    climbing = max(pose.velocity[2] for pose in samples(plan))
    assert climbing == pytest.approx(AIR.climb_rate_m_s, abs=1e-6)


def test_what_moves_brakes_before_it_turns() -> None:
    moving = Pose((0.0, 0.0, 0.0), 0.0, (6.0, 0.0, 0.0))
    course = Course(craft(pose=moving))
    braking_m = 36 / (2 * GROUND.deceleration_m_s2)
    assert course.place == pytest.approx((braking_m, 0.0, 0.0))
    assert course.plan().at(0.0).velocity == (6.0, 0.0, 0.0)


def test_backing_up_keeps_the_bow_where_it_is() -> None:
    plan = Course(craft()).back_up(5.0).plan()
    assert plan.at(plan.duration_s).place == pytest.approx((-5.0, 0.0, 0.0))
    assert {pose.yaw for pose in samples(plan)} == {0.0}


def test_a_circle_keeps_its_radius_and_takes_its_time() -> None:
    course = Course(craft("air", Pose((30.0, 0.0, 20.0), 0.0)))
    before_s = course.turn_to(math.pi / 2).duration_s
    plan = course.circle((0.0, 0.0), seconds=100.0).plan()
    assert plan.duration_s == pytest.approx(before_s + 100.0)
    for pose in samples(plan):
        assert math.hypot(*pose.place[:2]) == pytest.approx(30.0)
        assert pose.place[2] == 20.0


def test_the_speed_of_a_circle_is_bounded_by_the_turn_rate() -> None:
    course = Course(craft("air", Pose((5.0, 0.0, 20.0), math.pi / 2)))
    plan = course.circle((0.0, 0.0), sweep_rad=math.tau).plan()
    assert max(pose.speed for pose in samples(plan)) <= 5.0 * AIR.turn_rate_rad_s + 1e-9


places = st.lists(
    st.tuples(st.floats(-300, 300), st.floats(-300, 300), st.floats(0, 80)),
    min_size=1,
    max_size=7,
)


@settings(max_examples=examples(15, 60), deadline=None)
@given(places, st.sampled_from(sorted(DEFAULTS)), st.floats(0.5, 40), st.floats(0, 15))
def test_random_routes_are_continuous_and_never_too_fast(
    route: list[Vector], domain: str, speed: float, moving: float
) -> None:
    if domain != "air":
        route = [(east, north, 0.0) for east, north, _ in route]
    kinematics = DEFAULTS[domain]
    start = Pose((0.0, 0.0, 0.0), 1.0, (0.0, min(moving, kinematics.max_speed_m_s), 0.0))
    plan = Course(craft(domain, start)).through(route, speed).plan()
    step_s = max(0.02, plan.duration_s / 4000)
    limit = kinematics.max_speed_m_s
    poses = samples(plan, step_s)
    for before, after in pairwise(poses):
        assert after.speed <= limit + 1e-6
        assert math.dist(before.place, after.place) <= limit * step_s + 1e-6
        turn = abs(math.remainder(after.yaw - before.yaw, math.tau))
        assert turn <= kinematics.turn_rate_rad_s * step_s + 1e-6
    assert poses[-1].place == pytest.approx(route[-1], abs=2e-3)
    assert poses[-1].speed == 0.0
