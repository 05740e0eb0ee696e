"""Pointing and tracking, from vehicles that drive and turn, with a head that turns no faster."""

import math
from types import SimpleNamespace

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from m2pem_plugin_ptz.behaviors.behavior import BehaviorContext, BehaviorFailedError
from m2pem_plugin_ptz.behaviors.pointing import PointAt
from ptz_fake_camera import ORIGIN, Gimbal, rad
from ptz_world import CAMERA, play, point

from m2pem.api import BehaviorParameters, BehaviorState, VehiclePosition
from tests.seeds import examples


def on_ground(target):
    return (*target.position[:2], ORIGIN[2])


def test_a_camera_points_at_a_place_and_then_it_has_succeeded():
    target = point(30, 40)

    async def main(world):
        end = await world.do("ptz_point_at", target=target)
        assert end.state is BehaviorState.SUCCEEDED, end
        assert world.off_target(on_ground(target)) < 0.5

    play(main)


def test_bearing_is_from_the_bow_and_elevation_from_the_horizon():
    async def main(world):
        end = await world.do("ptz_point_at", bearing=rad(45), elevation=rad(20))
        assert end.state is BehaviorState.SUCCEEDED, end
        assert (world.gimbal.pan, world.gimbal.tilt) == pytest.approx(
            (rad(45), rad(20)), abs=rad(0.5)
        )

    play(main, moves=lambda _: {"yaw": 0.7})


def test_a_vehicle_that_leans_has_its_camera_look_to_the_horizon_all_the_same():
    async def main(world):
        await world.do("ptz_point_at", bearing=rad(90), elevation=0.0)
        assert world.gimbal.tilt == pytest.approx(rad(10), abs=rad(0.5))

    play(main, moves=lambda _: {"roll_rad": rad(10)})


def test_without_a_vehicle_that_is_heard_directions_still_work_but_places_do_not():
    async def main(world):
        end = await world.do("ptz_point_at", bearing=rad(45), elevation=0.0)
        assert end.state is BehaviorState.SUCCEEDED
        end = await world.do("ptz_point_at", id_="r1.b2", target=point(30, 40))
        assert (end.state, end.reason) == (
            BehaviorState.REJECTED,
            "the position of ugv is not known",
        )

    play(main, moves=None)


@settings(max_examples=examples(3, 8), deadline=None)
@given(
    speed=st.floats(0, 8),
    turn_deg_s=st.floats(-30, 30),
    wave_deg=st.floats(0, 8),
    bearing=st.floats(-math.pi, math.pi),
    far=st.floats(40, 400),
    endless=st.booleans(),
)
def test_a_target_stays_within_a_degree_while_the_vehicle_drives_and_turns(
    speed, turn_deg_s, wave_deg, bearing, far, endless
):
    """A steady turn with a swaying of six seconds upon it; states five times a second."""
    sway = math.tau / 6.0

    def yaw(t):
        return rad(turn_deg_s) * t + rad(wave_deg) * math.sin(sway * t)

    steps = [(0.0, 0.0)]
    for index in range(1200):
        angle = yaw((index + 0.5) * 0.01)
        east, north = steps[-1]
        steps.append(
            (east + speed * 0.01 * math.cos(angle), north + speed * 0.01 * math.sin(angle))
        )

    def moves(t):
        east, north = steps[min(round(t * 100), 1200)]
        angle = yaw(t)
        velocity = (speed * math.cos(angle), speed * math.sin(angle), 0.0)
        return {"east": east, "north": north, "yaw": angle, "velocity": velocity}

    place = (far * math.cos(bearing), far * math.sin(bearing))
    # What it drives over cannot be followed by any camera.
    assume(min(math.dist(step, place) for step in steps) > 20.0)
    target = point(*place)
    gimbal = Gimbal(endless=True) if endless else Gimbal(pan_rad=(rad(-720), rad(720)))

    async def main(world):
        await world.bench.start("r1.b1", "ptz_track", CAMERA, target=target)
        await world.until(lambda: world.off_target(on_ground(target)) < 0.5, 10)
        await world.clock.sleep(1.0)
        worst = 0.0
        while world.seconds < 11:
            worst = max(worst, world.off_target(on_ground(target)))
            await world.clock.sleep(0.023)
        assert worst < 1.0

    reach = {"endless": True} if endless else {"pan": ["-720 deg", "720 deg"]}
    play(main, gimbal, moves, reach={**reach, "tilt": ["-90 deg", "90 deg"]})


def test_another_vehicle_is_tracked_where_it_drives():
    def lead(t):
        return {"east": 60.0, "north": -40 + 6 * t, "velocity": (0, 6, 0)}

    async def main(world):
        await world.bench.start("r1.b1", "ptz_track", CAMERA, target=VehiclePosition("lead"))
        await world.clock.sleep(4)
        for _ in range(200):
            there = world.truth("lead").position
            place = (there.latitude_deg, there.longitude_deg, there.altitude_m)
            assert world.off_target(place) < 1.0
            await world.clock.sleep(0.037)
        assert world.bench.states_of("r1.b1")[-1] is BehaviorState.RUNNING

    play(main, moves=lambda t: {"east": 2 * t, "velocity": (2, 0, 0)}, others={"lead": lead})


def test_tracking_lasts_for_its_duration_without_the_time_in_a_hold():
    async def main(world):
        await world.bench.start("r1.b1", "ptz_track", CAMERA, target=point(0, 50), duration=10.0)
        await world.clock.sleep(4)
        await world.bench.arbiter.hold(CAMERA)
        await world.clock.sleep(20)
        assert world.bench.states_of("r1.b1")[-1] is BehaviorState.RUNNING
        await world.bench.arbiter.resume(CAMERA)
        resumed = world.seconds
        assert (await world.bench.ended("r1.b1", 20)).state is BehaviorState.SUCCEEDED
        assert world.seconds - resumed == pytest.approx(6, abs=0.2)

    play(main)


def test_a_held_camera_does_not_turn_while_its_vehicle_does():
    async def main(world):
        await world.bench.start("r1.b1", "ptz_track", CAMERA, target=point(0, 50))
        await world.clock.sleep(3)
        await world.bench.arbiter.hold(CAMERA)
        world.gimbal.move()
        pan = world.gimbal.pan
        await world.clock.sleep(5)
        world.gimbal.move()
        assert world.gimbal.pan == pan
        await world.bench.arbiter.resume(CAMERA)
        await world.until(lambda: world.off_target(on_ground(point(0, 50))) < 0.5, 10)

    play(main, moves=lambda t: {"yaw": 0.1 * t})


# --- reach --------------------------------------------------------------------------------------

STOPPED = {"reach": {"pan": ["-90 deg", "90 deg"], "tilt": ["-30 deg", "30 deg"]}}


def narrow():
    return Gimbal(pan_rad=(rad(-90), rad(90)), tilt_rad=(rad(-30), rad(30)))


@pytest.mark.parametrize(
    ("parameters", "reason"),
    [
        ({"target": point(0, -50)}, "pan 180 deg is beyond its stops, -90 to 90 deg"),
        ({"target": point(0, 1)}, "tilt -63 deg is beyond its limits, -30 to 30 deg"),
        (
            {"bearing": rad(120), "elevation": 0.0},
            "pan 120 deg is beyond its stops, -90 to 90 deg",
        ),
    ],
)
def test_what_is_out_of_reach_at_the_start_is_rejected_with_the_reason(parameters, reason):
    async def main(world):
        end = await world.do("ptz_point_at", **parameters)
        assert (end.state, end.code, end.reason) == (BehaviorState.REJECTED, "REJECTED", reason)
        assert world.gimbal.told is None, "nothing has turned"

    play(main, narrow(), **STOPPED)


def test_a_target_that_leaves_reach_is_looked_after_and_then_given_up():
    async def main(world):
        await world.bench.start("r1.b1", "ptz_track", CAMERA, target=point(0, 50))
        end = await world.bench.ended("r1.b1", 60)
        assert end.state is BehaviorState.FAILED
        assert end.reason.startswith("out of reach for 10 s: pan ")
        assert world.gimbal.pan == pytest.approx(rad(90)), "as near as it goes"

    play(main, narrow(), moves=lambda t: {"yaw": math.pi / 2 + min(0.2 * t, 2.6)}, **STOPPED)


def test_a_target_that_comes_back_in_time_is_tracked_on():
    def moves(t):
        return {"yaw": math.pi / 2 + (2.3 if 3 <= t < 9 else 0.0)}

    async def main(world):
        await world.bench.start("r1.b1", "ptz_track", CAMERA, target=point(0, 50))
        await world.clock.sleep(20)
        assert world.bench.states_of("r1.b1")[-1] is BehaviorState.RUNNING
        assert world.off_target(on_ground(point(0, 50))) < 1

    play(main, narrow(), moves=moves, **STOPPED)


def test_a_motor_that_is_stuck_is_a_failure_that_says_so():
    async def main(world):
        world.gimbal.stuck = True
        end = await world.do("ptz_point_at", within_s=30, bearing=rad(50), elevation=0.0)
        assert end.state is BehaviorState.FAILED
        assert "does not turn to its target: 50.0 deg are left" in end.reason

    play(main)


def test_a_coarse_camera_that_rests_within_its_resolution_looks_there():
    async def main(world):
        await world.bench.start("r1.b1", "ptz_point_at", CAMERA, bearing=rad(30), elevation=0.0)
        await world.until(lambda: world.gimbal.pan > rad(28.5))
        world.gimbal.stuck = True
        assert (await world.bench.ended("r1.b1", 10)).state is BehaviorState.SUCCEEDED

    play(main)


def test_a_late_camera_is_told_ahead():
    """With a delay that the fleet tells, a steady turn of the vehicle is made up for."""
    delay_s, turn = 0.2, rad(20)

    class Late(Gimbal):
        queue = ()

        def move(self):
            super().move()
            now_us = self.clock.now_us()
            due = [each for each in self.queue if each[0] <= now_us]
            self.queue = [each for each in self.queue if each[0] > now_us]
            if due:
                self._told, self.rate = due[-1][1], None

        _told = None

        @property
        def told(self):
            return self._told

        @told.setter
        def told(self, value):
            if value is not None and self.clock is not None:
                due_us = self.clock.now_us() + round(delay_s * 1e6)
                self.queue = [*self.queue, (due_us, value)]

    def worst_of(delay):
        async def main(world):
            await world.bench.start("r1.b1", "ptz_track", CAMERA, target=point(300, 0))
            await world.clock.sleep(5)
            worst = 0.0
            for _ in range(300):
                worst = max(worst, world.off_target(on_ground(point(300, 0))))
                await world.clock.sleep(0.01)
            return worst

        reach = {"endless": True}
        gimbal = Late(endless=True, rate_rad_s=rad(200))
        return play(main, gimbal, lambda t: {"yaw": turn * t}, reach=reach, delay=delay)

    assert worst_of("200 ms") < 1.5
    assert worst_of("0 s") > 3.0


def test_a_moment_in_which_nobody_looked_does_not_count_as_a_stuck_motor():
    behavior = PointAt(
        BehaviorContext("r1.b1", BehaviorParameters({}), SimpleNamespace(driver=None))
    )
    behavior.check_progress(1.0, 0.05, 0.01)
    behavior.check_progress(1.0, 30.0, 0.01)
    with pytest.raises(BehaviorFailedError, match="no nearer for 10 s"):
        for step in range(1, 240):
            behavior.check_progress(1.0, 30.0 + step * 0.05, 0.01)
