"""What the arbiter of cameras says, refuses, loses and finds again."""

import math

import pytest
from m2pem_plugin_ptz.arbiter import PtzArbiter
from ptz_fake_camera import Gimbal, HeadDriver, connection, rad, vehicle
from ptz_world import CAMERA, START_US, play, point

from m2pem.api import BehaviorState, LinkState, PayloadState, VehiclePosition
from m2pem.api.clock import run_virtual
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness, context


def test_a_camera_says_five_times_a_second_where_it_looks_and_what_it_sees():
    async def main(world):
        await world.bench.start("r1.b1", "ptz_point_at", CAMERA, bearing=rad(50), elevation=-0.6)
        await world.clock.sleep(2.0)
        await world.bench.start("r1.b2", "ptz_track", CAMERA, target=point(30, 40))
        began = len(world.bench.states)
        await world.clock.sleep(4.0)
        states = world.bench.states[began:]
        assert len(states) == pytest.approx(20, abs=1)
        last = states[-1]
        assert isinstance(last, PayloadState)
        assert (last.resource, last.behavior, last.link) == (CAMERA, "ptz_track", "connected")
        assert last.pan_rad == pytest.approx(math.atan2(30, 40), abs=rad(0.5))
        assert last.zoom == 1.0
        assert len(last.footprint) >= 4
        assert all(START_US < state.time_us <= world.clock.now_us() for state in states)

    play(main)


def test_pan_is_told_from_the_bow_whatever_the_mounting():
    async def main(world):
        await world.do("ptz_point_at", bearing=rad(-120), elevation=0.0)
        await world.clock.sleep(0.5)
        state = world.bench.latest(CAMERA)
        assert math.remainder(state.pan_rad - rad(-120), math.tau) == pytest.approx(0, abs=0.01)
        assert world.gimbal.pan == pytest.approx(rad(60), abs=0.01)

    play(main, mounting={"pan": "180 deg"})


def test_above_the_horizon_or_on_an_unknown_vehicle_there_is_no_footprint():
    async def main(world):
        await world.do("ptz_point_at", bearing=0.0, elevation=rad(40))
        await world.clock.sleep(0.5)
        assert world.bench.latest(CAMERA).footprint == ()

    play(main)

    async def unknown(world):
        await world.clock.sleep(1)
        assert world.bench.latest(CAMERA).pan_rad == 0.0
        assert world.bench.latest(CAMERA).footprint == ()

    play(unknown, moves=None)


def test_a_silent_camera_is_lost_with_what_it_does_and_can_be_used_when_it_is_back():
    async def main(world):
        await world.bench.start("r1.b1", "ptz_track", CAMERA, target=point(30, 40))
        await world.clock.sleep(2)
        world.gimbal.audible = False
        end = await world.bench.ended("r1.b1", 4.0)
        assert (end.state, end.code) == (BehaviorState.LOST, "LINK_LOST")
        await world.clock.sleep(1)
        assert world.bench.latest(CAMERA).link is LinkState.LOST
        assert world.bench.latest(CAMERA).pan_rad is None, "nobody knows where it looks"
        world.gimbal.audible = True
        await world.clock.sleep(0.5)
        end = await world.do("ptz_point_at", id_="r1.b2", bearing=0.0, elevation=0.0)
        assert end.state is BehaviorState.SUCCEEDED
        assert world.bench.latest(CAMERA).link is LinkState.CONNECTED

    play(main)


@pytest.mark.parametrize(
    ("behavior", "parameters", "reason"),
    [
        ("zoom", {"level": 40.0}, "parameter 'level': 40 is above 30"),
        ("record_video", {}, "the camera has no recorder"),
        (
            "ptz_track",
            {"target": VehiclePosition("nobody")},
            "the position of nobody is not known",
        ),
        ("ptz_scan_sector", {"heading": 0.0, "sector": 1.0, "speed": 99.0}, "speed"),
    ],
)
def test_what_a_camera_cannot_do_is_refused_with_the_reason(behavior, parameters, reason):
    gimbal = Gimbal(zoom_max=30.0)
    gimbal.refuses["record_video"] = "the camera has no recorder"

    async def main(world):
        end = await world.do(behavior, **parameters)
        assert end.state is BehaviorState.REJECTED
        assert reason in end.reason

    play(main, gimbal)


def test_zoom_ends_when_the_lens_is_there():
    async def main(world):
        end = await world.do("zoom", level=20.0)
        assert end.state is BehaviorState.SUCCEEDED
        assert world.gimbal.zoom == pytest.approx(20, rel=0.02)

    play(main, Gimbal(zoom_max=30.0))


def test_a_lens_that_is_stuck_is_a_failure():
    async def main(world):
        world.gimbal.stuck = True
        end = await world.do("zoom", within_s=30, level=20.0)
        assert (end.state, end.reason) == (
            BehaviorState.FAILED,
            "the camera does not zoom to 20 within 20 s",
        )

    play(main, Gimbal(zoom_max=30.0))


def test_cancel_stops_the_camera_where_it_is():
    async def main(world):
        await world.bench.start("r1.b1", "ptz_point_at", CAMERA, bearing=3.0, elevation=0.0)
        await world.clock.sleep(1)
        await world.bench.arbiter.cancel("r1.b1", 1)
        assert (await world.bench.ended("r1.b1", 5)).state is BehaviorState.CANCELLED
        world.gimbal.move()
        pan = world.gimbal.pan
        await world.clock.sleep(3)
        world.gimbal.move()
        assert 0.5 < world.gimbal.pan == pan

    play(main)


# --- after a restart ----------------------------------------------------------------------------


def restarted(behavior, gap_s=1.0, change=lambda gimbal: None, folder="unused", **parameters):
    """Start a behavior, restart the arbiter, and ask; returns the answer and the end, if any."""
    gimbal = Gimbal(zoom_max=30.0)
    made = {CAMERA: connection(CAMERA, pictures=str(folder))}

    async def run(clock):
        lent = context(clock)
        lent.bus.publish(vehicle("ugv", clock.now_us()))

        def make():
            return PtzArbiter(made, lent, lambda setup: HeadDriver(setup, gimbal))

        async with ArbiterHarness(make(), clock) as bench:
            await bench.start("r1.b1", behavior, CAMERA, **parameters)
            await bench.running("r1.b1")
            reference = bench.of("r1.b1")[-1].native_ref
            await clock.sleep(gap_s)
        change(gimbal)
        async with ArbiterHarness(make(), clock) as bench:
            found = await bench.arbiter.query("r1.b1", reference)
            if found.state is not BehaviorState.RUNNING:
                return found, None
            began_us = clock.now_us()
            end = await bench.ended("r1.b1", 60)
            return found, (end.state, (clock.now_us() - began_us) / 1e6)

    return run_virtual(run, START_US)


def test_pointing_goes_on_or_has_succeeded():
    found, end = restarted("ptz_point_at", bearing=3.0, elevation=0.0)
    assert found.state is BehaviorState.RUNNING
    assert end[0] is BehaviorState.SUCCEEDED
    found, _ = restarted("ptz_point_at", gap_s=5, bearing=0.1, elevation=0.0)
    assert found.state is BehaviorState.SUCCEEDED


def test_tracking_goes_on_for_the_rest_of_its_duration():
    found, end = restarted("ptz_track", gap_s=5, target=point(0, 50), duration=20.0)
    assert found.state is BehaviorState.RUNNING
    assert end == (BehaviorState.SUCCEEDED, pytest.approx(15, abs=0.5))


def test_a_camera_that_looks_elsewhere_does_not_track():
    def turn(gimbal):
        gimbal.pan, gimbal.told = 2.0, None

    found, _ = restarted("ptz_track", 5, turn, target=point(0, 50))
    assert found.state is BehaviorState.UNKNOWN


@pytest.mark.parametrize(
    ("behavior", "parameters"),
    [
        ("ptz_scan_sector", {"heading": 0.0, "sector": 2.0, "speed": 0.1}),
        ("record_video", {}),
        ("take_picture", {"count": 100, "interval": 1.0}),
    ],
)
def test_whether_scans_and_pictures_were_done_cannot_be_seen(behavior, parameters, tmp_path):
    found, _ = restarted(behavior, folder=tmp_path, **parameters)
    assert found.state is BehaviorState.UNKNOWN
