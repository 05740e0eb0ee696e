"""Trajectories and their retiming."""

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from m2pem.api.telemetry import VehicleState
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.mission.geometry import Point
from m2pem.simulation.arbiters import SimArbiter
from m2pem.simulation.course import Course, Craft
from m2pem.simulation.kinematics import DEFAULTS
from m2pem.simulation.segments import Curve, Pose, Stand, Steer, Travel, fit
from m2pem.simulation.trajectory import Plan, Track, Warp, retimed
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness
from tests.seeds import examples
from tests.simulation.conftest import Fleet, Simulate, area, local, place, route

S = 1_000_000
STRAIGHT = Travel(
    (0.0, 0.0, 0.0),
    (1.0, 0.0, 0.0),
    0.0,
    fit(100.0, 5.0, v_in=0.0, v_out=0.0, accel=1.0, decel=1.0),
)


def test_a_plan_stands_at_its_end() -> None:
    plan = Plan([STRAIGHT])
    assert plan.at(1e6) == Pose((100.0, 0.0, 0.0), 0.0)
    assert plan.at(10.0).speed == 5.0


def test_a_plan_that_repeats_comes_back_to_the_same_place() -> None:
    pause = Stand((0.0, 0.0, 0.0), 0.0, 7.0, 0.0)
    plan: Plan[Pose] = Plan([pause, STRAIGHT, pause], cycle_from=1)
    lap_s = STRAIGHT.duration_s + 7.0
    assert plan.duration_s == math.inf
    assert plan.at(17.0 + 3 * lap_s).place == pytest.approx(plan.at(17.0).place)
    assert plan.work(17.0 + 3 * lap_s) == pytest.approx(plan.work(17.0) + 3 * STRAIGHT.duration_s)


@pytest.mark.parametrize("cycle_from", [None, 0, 1])
@pytest.mark.parametrize("t_s", [0.0, 3.0, 12.0, 31.5, 60.0, 200.0])
def test_the_way_driven_is_the_integral_of_the_speed(cycle_from: int | None, t_s: float) -> None:
    pause = Stand((0.0, 0.0, 0.0), 0.0, 7.0, 0.0)
    climbing = fit(math.hypot(20.0, 4.0), 5.0, v_in=0.0, v_out=0.0, accel=1.0, decel=1.0)
    arc = Curve((0.0, 0.0), 20.0, 0.0, 1.0, 0.0, 4.0, climbing)
    steer = Steer((0.0, 0.0, 0.0), (3.0, 0.0, 0.0), (-1.0, 2.0, 0.0), 0.0, 0.0, 0.3)
    plan: Plan[Pose] = Plan([pause, STRAIGHT, arc, steer, pause], cycle_from)
    steps = 20_000
    speeds = [plan.at(t_s * (step + 0.5) / steps).speed for step in range(steps)]
    assert plan.driven_m(t_s) == pytest.approx(sum(speeds) * t_s / steps, abs=0.01)


def test_held_plan_time_stops_after_the_braking_and_never_ends() -> None:
    track = Track(Plan([STRAIGHT]), 0)
    track.hold(10 * S, 5.0)
    stopped = track.at(15 * S)
    assert stopped.speed == 0.0
    assert stopped.place[0] == pytest.approx(track.plan.at(10.0).place[0] + 12.5)
    assert track.at(1000 * S) == stopped
    assert track.end_us is None


def test_braking_is_no_harder_than_was_asked() -> None:
    track = Track(Plan([STRAIGHT]), 0)
    track.hold(10 * S, 5.0)
    assert track.at(12 * S).speed == pytest.approx(3.0)


@given(st.integers(6 * S, 15 * S), st.integers(6 * S, 5000 * S))
def test_a_pause_moves_the_end_by_exactly_the_pause(hold_us: int, pause_us: int) -> None:
    track = Track(Plan([STRAIGHT]), 0)
    end_us = track.end_us
    assert end_us is not None
    track.hold(hold_us, 5.0)
    track.go_on(hold_us + pause_us)
    assert track.end_us == pytest.approx(end_us + pause_us, abs=2)


@given(
    st.floats(0, 100),
    st.floats(0, 1),
    st.sampled_from([0.0, 1.0]),
    st.floats(0, 10),
    st.integers(0, 60 * S),
)
def test_when_is_the_inverse_of_at(
    tau: float, rate: float, target: float, ramp_s: float, now_us: int
) -> None:
    warp = Warp(0, tau, rate, target, ramp_s)
    reached, rate_now = warp.at(now_us)
    found = warp.when(reached)
    assert found is not None
    assert warp.at(found)[0] == pytest.approx(reached, abs=2e-6)
    assert 0 <= rate_now <= 1
    if rate_now > 0.01:
        assert found == pytest.approx(now_us, abs=200)


def test_load_is_that_of_the_phases_and_of_standing() -> None:
    track = Track(Plan([STRAIGHT]), 0)
    after_us = round(STRAIGHT.duration_s * S) + 100 * S
    assert track.load_s(after_us, 0.1) == pytest.approx(STRAIGHT.duration_s + 10.0)
    track.count_from(10 * S)
    assert track.load_s(12 * S, 0.1) == pytest.approx(2.0)


UGV: Fleet = {"ugv": ("ground", {})}
FAR = Point(place(500, 0))
U = ResourceId("ugv")
AIR = DEFAULTS["air"]


def speed(bench: ArbiterHarness) -> float:
    state = bench.latest("ugv")
    assert isinstance(state, VehicleState)
    return math.hypot(*(state.velocity_enu_m_s or ()))


def east(bench: ArbiterHarness) -> float:
    state = bench.latest("ugv")
    assert isinstance(state, VehicleState)
    return local(state.position)[0]


@pytest.mark.parametrize("new", [2.0, 9.0])
def test_a_vehicle_goes_on_at_the_speed_that_it_is_told(simulate: Simulate, new: float) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", "goto", U, target=FAR, speed=5.0)
        await bench.clock.sleep(20)
        began_us, left_m = bench.clock.now_us(), 500.0 - east(bench)
        await arbiter.adjust("r1.b1", 1, {"speed": new})
        await bench.clock.sleep(10)
        assert speed(bench) == pytest.approx(new)
        end = await bench.ended("r1.b1", 1000)
        assert end.state is BehaviorState.SUCCEEDED
        assert east(bench) == pytest.approx(500.0)
        assert (bench.clock.now_us() - began_us) / 1e6 == pytest.approx(left_m / new, abs=5)

    simulate(UGV, main, telemetry_hz=5.0)


def test_who_is_held_stands_on_and_then_goes_at_the_new_speed(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", "goto", U, target=FAR, speed=5.0)
        await bench.clock.sleep(20)
        await arbiter.hold(U)
        await bench.clock.sleep(0.5)  # it brakes yet
        await arbiter.adjust("r1.b1", 1, {"speed": 2.0})
        await bench.clock.sleep(10)
        stood = east(bench)
        assert speed(bench) == 0.0
        await arbiter.adjust("r1.b1", 1, {"speed": 3.0})
        await bench.clock.sleep(10)
        assert (east(bench), speed(bench)) == (stood, 0.0)
        await arbiter.resume(U)
        await bench.clock.sleep(10)
        assert speed(bench) == pytest.approx(3.0)
        assert (await bench.ended("r1.b1", 1000)).state is BehaviorState.SUCCEEDED

    simulate(UGV, main, telemetry_hz=5.0)


def test_a_loop_is_driven_at_the_new_speed_for_ever(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        way = route((0, 0), (100, 0), (100, 100))
        await bench.start("r1.b1", "single_vehicle_routing", U, route=way, loop=True, speed=5.0)
        await bench.clock.sleep(10)
        assert speed(bench) > 4.0
        await arbiter.adjust("r1.b1", 1, {"speed": 2.0})
        await bench.clock.sleep(2)
        fastest = 0.0
        for _ in range(1000):
            await bench.clock.sleep(1)
            fastest = max(fastest, speed(bench))
        assert fastest == pytest.approx(2.0)
        assert bench.states_of("r1.b1")[-1] is BehaviorState.RUNNING

    simulate(UGV, main, telemetry_hz=1.0)


@pytest.mark.parametrize(
    ("behavior", "parameters", "adjust"),
    [
        ("orbit", {"target": Point(place(60, 0)), "duration": 60.0}, {"speed": 1.0}),
        ("goto", {"target": Point(place(100, 0))}, {"tolerance": 1.0}),
        ("goto", {"target": Point(place(100, 0))}, {"speed": 0.0}),
    ],
)
def test_what_cannot_be_adjusted_is_left_as_it_is(
    simulate: Simulate, behavior: str, parameters: dict[str, object], adjust: dict[str, float]
) -> None:
    ends: list[int] = []

    def told(really: bool) -> None:
        async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
            await bench.start("r1.b1", behavior, U, **parameters)  # type: ignore[arg-type]
            await bench.clock.sleep(5)
            if really:
                await arbiter.adjust("r1.b1", 1, adjust)
            await bench.ended("r1.b1", 1000)
            ends.append(bench.clock.now_us())

        simulate(UGV, main)

    told(False)
    told(True)
    assert ends[0] == ends[1]


def test_an_adjustment_of_what_has_ended_is_ignored(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", "goto", U, target=Point(place(20, 0)))
        await bench.ended("r1.b1", 100)
        await arbiter.adjust("r1.b1", 1, {"speed": 1.0})
        assert not arbiter.expects

    simulate(UGV, main)


def test_all_members_of_a_survey_are_adjusted(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        field = area((0, 0), (200, 0), (200, 100), (0, 100))
        await bench.start("r1.b1", "area_survey", "one", "two", area=field, speed=5.0)
        await bench.clock.sleep(30)
        await arbiter.adjust("r1.b1", 1, {"speed": 1.0})
        await bench.clock.sleep(20)
        for name in ("one", "two"):
            state = bench.latest(name)
            assert isinstance(state, VehicleState)
            assert math.hypot(*(state.velocity_enu_m_s or ())) <= 1.0 + 1e-6

    simulate({"one": ("ground", {}), "two": ("ground", {})}, main, telemetry_hz=2.0)


metres = st.integers(-200, 200).map(float)


@settings(deadline=None, max_examples=examples(50, 200))
@given(
    st.lists(st.tuples(metres, metres, st.sampled_from([30.0, 60.0])), min_size=1, max_size=5),
    st.floats(0.0, 1.0),
    st.floats(0.5, 25.0),
    st.floats(0.5, 25.0),
)
def test_whenever_it_is_changed_the_way_is_the_same_and_nothing_jumps(
    places: list[tuple[float, float, float]], share: float, before: float, after: float
) -> None:
    craft = Craft("uav", "air", AIR, Pose((0.0, 0.0, 30.0), 0.0), AIR.cruise_speed_m_s, (0, 0, 0))
    plan = Course(craft).through(places, before).plan()
    tau = share * plan.duration_s
    now = plan.at(tau)
    changed = retimed(plan, tau, now.speed, after, AIR)
    if changed is None:
        assert math.dist(now.place, plan.at(plan.duration_s).place) < 1e-6
        return
    begin = changed.at(0.0)
    assert math.dist(begin.place, now.place) < 1e-6
    assert abs(math.remainder(begin.yaw - now.yaw, math.tau)) < 1e-6
    assert begin.speed == pytest.approx(now.speed, abs=1e-6)
    end = plan.at(plan.duration_s).place
    assert math.dist(changed.at(changed.duration_s).place, end) < 1e-6
    assert changed.at(changed.duration_s).speed == pytest.approx(0.0, abs=1e-4)
    steps = [changed.duration_s * step / 400 for step in range(401)]
    poses = [changed.at(step) for step in steps]
    on_the_way = [plan.at(tau + (plan.duration_s - tau) * step / 800).place for step in range(801)]
    for (t, a), (u, b) in pairwise(zip(steps, poses, strict=True)):
        assert b.speed - a.speed <= AIR.acceleration_m_s2 * (u - t) + 1e-3
        assert a.speed - b.speed <= AIR.deceleration_m_s2 * (u - t) + 1e-3
        slowest_s = max(0.0, now.speed - after) / AIR.deceleration_m_s2
        if t > slowest_s + 1e-3:
            assert a.speed <= min(after, AIR.max_speed_m_s) + 1e-3
    step_m = max(math.dist(a, b) for a, b in pairwise(on_the_way)) if on_the_way else 0.0
    for pose in poses[::20]:
        assert min(math.dist(pose.place, each) for each in on_the_way) <= step_m + 1e-3


def test_what_repeats_without_a_stop_is_left_as_it_is() -> None:
    craft = Craft("uav", "air", AIR, Pose((30.0, 0.0, 30.0), 0.0), 10.0, (0, 0, 0))
    course = Course(craft).circle((0.0, 0.0))
    plan: Plan[Pose] = course.plan(course.steps - 1)
    assert retimed(plan, 5.0, plan.at(5.0).speed, 2.0, AIR) is None


@given(
    st.lists(
        st.tuples(st.floats(0.5, 400), st.sampled_from([0.0, 0.7, 1.0]), st.booleans()),
        min_size=1,
        max_size=6,
    ),
    st.floats(-1, 1.1),
)
def test_the_time_at_which_so_much_is_left_is_that_of_a_search_by_halves(
    ways: list[tuple[float, float, bool]], share: float
) -> None:
    phases: list[Travel | Stand] = []
    for length, level, waits in ways:
        profile = fit(length, 5.0, v_in=0.0, v_out=0.0, accel=1.0, decel=2.0)
        direction = (level, 0.0, math.sqrt(1 - level * level))
        phases.append(Travel((0.0, 0.0, 0.0), direction, 0.0, profile))
        if waits:
            phases.append(Stand((0.0, 0.0, 0.0), 0.0, 7.0, 0.0))
    plan: Plan[Pose] = Plan(phases)
    level_m = share * plan.level_m_left(0.0)
    low, high = 0.0, plan.duration_s
    while high - low > 0.01:
        middle = (low + high) / 2
        low, high = (middle, high) if plan.level_m_left(middle) > level_m else (low, middle)
    assert plan.when_level_m_left(level_m) == high
