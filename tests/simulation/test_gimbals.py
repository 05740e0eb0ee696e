import math

import pytest

from m2pem.api.telemetry import PayloadState
from m2pem.fleet.behaviors import SHARED
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.mission.geometry import Point, VehiclePosition
from m2pem.simulation.arbiters import SimArbiter
from m2pem.simulation.gimbals import GAZES, MAST_M
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness
from tests.simulation.conftest import START_US, Fleet, Simulate, area, place

S = 1_000_000
PTZ = "ugv/ptz"
FLEET: Fleet = {"ugv": ("ground", {}), PTZ: ("ground", {}), "other": ("ground", {})}
SLEW = math.radians(60)


def look(bench: ArbiterHarness) -> PayloadState:
    state = bench.latest(PTZ)
    assert isinstance(state, PayloadState)
    return state


async def do(bench: ArbiterHarness, behavior: str, **wishes: object) -> float:
    began_us = bench.clock.now_us()
    id_ = f"r1.b{began_us}{behavior}"
    await bench.start(id_, behavior, PTZ, **wishes)  # type: ignore[arg-type]
    end = await bench.ended(id_, 36_000)
    assert end.state is BehaviorState.SUCCEEDED, end
    return (bench.clock.now_us() - began_us) / S


def test_every_shared_payload_behavior_is_a_gaze() -> None:
    shared = {name for name, type_ in SHARED if type_ is BehaviorType.PAYLOAD}
    assert set(GAZES) == shared


def test_pointing_takes_the_slew_and_looks_at_the_target(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        seconds = await do(bench, "ptz_point_at", target=Point(place(100, 0)))
        assert look(bench).pan_rad == pytest.approx(math.pi / 2)
        assert look(bench).tilt_rad == pytest.approx(-math.atan2(MAST_M, 100))
        assert seconds == pytest.approx(1.5, abs=1e-3)
        await do(bench, "ptz_point_at", bearing=math.radians(-30), elevation=math.radians(10))
        assert look(bench).pan_rad == pytest.approx(math.radians(-30))
        assert look(bench).tilt_rad == pytest.approx(math.radians(10))

    simulate(FLEET, main)


@pytest.mark.parametrize(
    ("wishes", "said"),
    [
        ({"bearing": math.radians(120), "elevation": 0.0}, "pan limit"),
        ({"bearing": 0.0, "elevation": math.radians(60)}, "tilt limit"),
    ],
)
def test_what_is_beyond_the_limits_is_refused(
    simulate: Simulate, wishes: dict[str, float], said: str
) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await bench.start("r1.b1", "ptz_point_at", PTZ, **wishes)  # type: ignore[arg-type]
        end = await bench.ended("r1.b1", 1)
        assert end.state is BehaviorState.REJECTED
        assert said in end.reason

    simulate(
        {"ugv": ("ground", {}), PTZ: ("ground", {"pan_limit": "90 deg", "tilt_high": "30 deg"})},
        main,
    )


def test_a_sector_is_scanned_around_a_true_heading_at_its_speed(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        seconds = await do(
            bench,
            "ptz_scan_sector",
            heading=math.pi,
            sector=math.radians(80),
            elevation=0.0,
            speed=math.radians(10),
        )
        # The vehicle heads east: south is to its right.
        assert look(bench).pan_rad == pytest.approx(math.radians(90 + 40))
        assert seconds == pytest.approx(50 / 60 + 80 / 10, abs=1e-3)

    simulate({**FLEET, "ugv": ("ground", {"heading": "90 deg"})}, main)


def test_a_polygon_takes_more_rows_the_narrower_the_view(simulate: Simulate) -> None:
    field = area((-20, 5), (20, 5), (20, 60), (-20, 60))

    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        wide_s = await do(bench, "ptz_scan_polygon", area=field, speed=0.2)
        await do(bench, "zoom", level=10.0)
        narrow_s = await do(bench, "ptz_scan_polygon", area=field, speed=0.2)
        assert narrow_s > 4 * wide_s

    simulate(FLEET, main)


def test_tracking_keeps_a_moving_vehicle_in_view_for_its_duration(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await bench.start("r1.b0", "goto", "other", target=Point(place(300, -20)))
        await bench.start("r1.b1", "ptz_track", PTZ, target=VehiclePosition("other"), duration=90.0)
        await bench.clock.sleep(60)
        other = bench.latest("other")
        assert other is not None
        assert look(bench).pan_rad == pytest.approx(math.radians(100), abs=math.radians(12))
        end = await bench.ended("r1.b1", 40)
        assert end.state is BehaviorState.SUCCEEDED
        assert bench.clock.now_us() == START_US + 90 * S

    simulate(FLEET, main)


def test_tracking_without_a_duration_lasts_until_cancelled(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", "ptz_track", PTZ, target=Point(place(0, 50)))
        await bench.clock.sleep(3600)
        await arbiter.cancel("r1.b1", 1)
        assert (await bench.ended("r1.b1", 0.001)).state is BehaviorState.CANCELLED

    simulate(FLEET, main)


def test_pictures_take_their_interval_and_the_shutter(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        assert await do(bench, "take_picture") == pytest.approx(0.5)
        assert await do(bench, "take_picture", count=4, interval=3.0) == pytest.approx(9.5)
        assert await do(bench, "record_video", duration=20.0) == pytest.approx(20)

    simulate(FLEET, main)


def test_pictures_and_videos_have_names_that_missions_can_read(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", "take_picture", PTZ, count=3, interval=2.0)
        taken = await bench.ended("r1.b1", 10)
        latitude, longitude = place(0, 0)[:2]
        files = ["sim:r1/b1_1.jpg", "sim:r1/b1_2.jpg", "sim:r1/b1_3.jpg"]
        assert taken.outputs == {
            "picture.file": files[-1],
            "picture.files": files,
            "picture.position": pytest.approx([latitude, longitude, 60.0 + MAST_M]),
            "picture.time": "2026-01-01T00:00:04.500000Z",
        }
        found = await arbiter.query("r1.b1", "r1.b1")
        assert found.outputs == taken.outputs
        await bench.start("r1.b2", "record_video", PTZ)
        await bench.clock.sleep(5)
        await arbiter.cancel("r1.b2", 1)
        filmed = await bench.ended("r1.b2", 1)
        assert filmed.outputs == {
            "video.file": "sim:r1/b2.mp4",
            "video.time": "2026-01-01T00:00:04.500000Z",
        }

    simulate(FLEET, main)


def test_cancelled_pictures_are_those_that_were_taken_without_the_time_in_a_hold(
    simulate: Simulate,
) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", "take_picture", PTZ, count=100, interval=2.0)
        await bench.clock.sleep(3)
        await arbiter.hold(ResourceId(PTZ))
        await bench.clock.sleep(60)
        await arbiter.resume(ResourceId(PTZ))
        await bench.clock.sleep(1)
        await arbiter.cancel("r1.b1", 1)
        end = await bench.ended("r1.b1", 1)
        assert end.outputs["picture.files"] == ["sim:r1/b1_1.jpg", "sim:r1/b1_2.jpg"]
        await bench.start("r1.b2", "take_picture", PTZ)
        await arbiter.cancel("r1.b2", 1)
        assert (await bench.ended("r1.b2", 1)).outputs == {}

    simulate(FLEET, main)


def test_a_zoom_beyond_the_lens_is_refused(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await do(bench, "zoom", level=8.0)
        assert look(bench).zoom == 8.0
        await bench.start("r1.b1", "zoom", PTZ, level=99.0)
        assert "'level'" in (await bench.ended("r1.b1", 1)).reason

    simulate(FLEET, main)


def test_a_kind_of_payload_has_its_own_behaviors(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        def names(resource: str) -> set[str]:
            return {spec.name for spec in arbiter.catalogue(ResourceId(resource))}

        assert "ptz_track" in names("ugv/ptz")
        assert names("ugv/cam") == {"zoom", "take_picture", "record_video"}
        assert names("ugv/gpr") == set()
        await bench.start("r1.b1", "ptz_track", "ugv/cam", target=Point(place(0, 1)))
        assert "ugv/cam has no behavior 'ptz_track'" in (await bench.ended("r1.b1", 1)).reason

    simulate(
        {
            **FLEET,
            "ugv/cam": ("ground", {"kind": "camera"}),
            "ugv/gpr": ("ground", {"kind": "gpr"}),
        },
        main,
    )


def test_a_held_scan_goes_on_where_it_was(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start(
            "r1.b1", "ptz_scan_sector", PTZ, heading=0.0, sector=math.pi / 2, speed=0.1
        )
        await bench.clock.sleep(5)
        await arbiter.hold(ResourceId(PTZ))
        await bench.clock.sleep(1)
        stopped = look(bench).pan_rad
        await bench.clock.sleep(99)
        assert look(bench).pan_rad == stopped
        await arbiter.resume(ResourceId(PTZ))
        await bench.ended("r1.b1", 100)
        expected_s = 100 + (math.pi / 4) / SLEW + (math.pi / 2) / 0.1
        assert (bench.clock.now_us() - START_US) / S == pytest.approx(expected_s, abs=1e-3)

    simulate(FLEET, main)
