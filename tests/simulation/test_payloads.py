"""What a simulated payload sees of the ground."""

import math

import pytest

from m2pem.api.telemetry import PayloadState
from m2pem.simulation.arbiters import SimArbiter
from m2pem.simulation.frame import FlatFrame
from m2pem.simulation.gimbals import MAST_M
from m2pem.simulation.payloads import RANGE_M, around, seen
from m2pem.simulation.segments import Look, Pose
from m2pem.simulation.settings import Gimbal
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness
from tests.simulation.conftest import ORIGIN, Fleet, Simulate

NORTH = math.pi / 2
VIEW = Gimbal(view_rad=math.radians(30))
ALOFT = Pose((100.0, 200.0, 50.0 - MAST_M), NORTH)


def deg(angle: float) -> float:
    return math.radians(angle)


def test_straight_down_it_sees_a_square_below_it() -> None:
    half = 50.0 * math.tan(deg(15))
    corners = seen(VIEW, Look(tilt=-math.pi / 2), ALOFT, 0.0)
    expected = [(-half, half), (half, half), (half, -half), (-half, -half)]
    for (east, north, up), (aside, ahead) in zip(corners, expected, strict=True):
        assert (east, north, up) == pytest.approx((100.0 + aside, 200.0 + ahead, 0.0))


def test_to_starboard_it_sees_the_ground_to_the_east() -> None:
    corners = seen(VIEW, Look(pan=deg(90), tilt=-deg(45)), ALOFT, 0.0)
    far, near = 50.0 / math.tan(deg(30)), 50.0 / math.tan(deg(60))
    east = [corner[0] - 100.0 for corner in corners]
    assert east == pytest.approx([far, far, near, near])
    north = [corner[1] - 200.0 for corner in corners]
    assert north[0] == pytest.approx(-north[1])
    assert north[0] > 0, "the left of a view to the east is north"


def test_zoom_narrows_what_it_sees() -> None:
    wide = seen(VIEW, Look(tilt=-math.pi / 2), ALOFT, 0.0)
    narrow = seen(VIEW, Look(tilt=-math.pi / 2, zoom=2.0), ALOFT, 0.0)
    assert narrow[1][0] - 100.0 == pytest.approx(50.0 * math.tan(deg(7.5)))
    assert narrow[1][0] < wide[1][0]


def test_a_view_over_the_horizon_ends_far_away() -> None:
    corners = seen(VIEW, Look(), ALOFT, 0.0)
    assert len(corners) == 4
    distances = [math.hypot(corner[0] - 100.0, corner[1] - 200.0) for corner in corners]
    assert distances[:2] == pytest.approx([RANGE_M, RANGE_M], rel=1e-3)
    assert distances[2:] == pytest.approx(
        [50.0 / math.tan(deg(15)) / math.cos(deg(15))] * 2, rel=0.05
    )


@pytest.mark.parametrize("tilt", [deg(15.1), deg(90)])
def test_above_the_horizon_it_sees_nothing_of_the_ground(tilt: float) -> None:
    assert seen(VIEW, Look(tilt=tilt), ALOFT, 0.0) == ()


def test_below_the_ground_it_sees_nothing() -> None:
    assert seen(VIEW, Look(tilt=-1.0), Pose((0.0, 0.0, -10.0), NORTH), 0.0) == ()


def test_a_detector_sees_a_circle() -> None:
    corners = around(5.0, ALOFT, 0.0)
    assert all(math.dist(corner, (100.0, 200.0, 0.0)) == pytest.approx(5.0) for corner in corners)
    assert len(set(corners)) == len(corners) >= 12


def test_states_of_payloads_tell_what_they_see(simulate: Simulate) -> None:
    fleet: Fleet = {
        "uav": ("air", {}),
        "uav/ptz": ("air", {}),
        "uav/gpr": ("air", {"detector": True, "range": "8 m"}),
        "other/ptz": ("air", {}),
    }

    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await bench.start("r1.b1", "ptz_point_at", "uav/ptz", bearing=0.0, elevation=-1.0)
        await bench.ended("r1.b1", 60)
        frame = FlatFrame(ORIGIN)

        def places(resource: str) -> list[tuple[float, float]]:
            state = bench.latest(resource)
            assert isinstance(state, PayloadState)
            return [frame.to_place(c.latlon) for c in state.footprint]

        ahead = places("uav/ptz")
        assert len(ahead) == 4
        assert all(0.0 < north < 3.0 for _, north in ahead), "the mast is low"
        assert all(math.hypot(*each) == pytest.approx(8.0, abs=0.1) for each in places("uav/gpr"))
        assert places("other/ptz") == [], "nobody knows where it is"

    simulate(fleet, main)
