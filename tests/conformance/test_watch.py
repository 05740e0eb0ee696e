"""What a watch sees in the states of a vehicle: deviations, and the evidence of its end."""

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any

import pytest

from m2pem.api.arbiter import BehaviorRequest
from m2pem.api.commanded import Commanded, ExpectedEnd
from m2pem.api.telemetry import GeoPosition, LinkState, VehicleState
from m2pem.conformance.bounds import Bounds
from m2pem.conformance.derivation import commanded_by
from m2pem.conformance.watch import Deviation, Watch
from m2pem.geo.fence import Fence
from m2pem.geo.local_frame import LatLon, LocalFrame
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Area, Point, Route

HOME = (47.397742, 8.545594)
HOME_M = 488.0
FRAME = LocalFrame(HOME)
UAV = ResourceId("uav1")
SQUARE = [(0.0, 0.0), (0.0, 200.0), (200.0, 200.0), (200.0, 0.0), (0.0, 0.0)]
"""East and north of home, in metres."""


def place(east_m: float, north_m: float) -> LatLon:
    return FRAME.to_latlon((east_m, north_m))


def state(
    at_s: float, east_m: float, north_m: float, up_m: float = 25.0, **more: Any
) -> VehicleState:
    position = GeoPosition(*place(east_m, north_m), HOME_M + up_m)
    given: dict[str, Any] = {"armed": True, "velocity_enu_m_s": (5.0, 0.0, 0.0), **more}
    return VehicleState(UAV, round(at_s * 1e6), position, up_m, **given)


def flight(
    points: Sequence[tuple[float, float]], speed_m_s: float = 5.0, hz: float = 5.0, **more: Any
) -> list[VehicleState]:
    """A flight straight through points, at one speed."""
    states, at_s = [state(0.0, *points[0], **more)], 0.0
    for (ax, ay), (bx, by) in pairwise(points):
        length_m = math.hypot(bx - ax, by - ay)
        steps = max(1, round(length_m / speed_m_s * hz))
        velocity = (bx - ax) / length_m * speed_m_s, (by - ay) / length_m * speed_m_s, 0.0
        for step in range(1, steps + 1):
            at_s += 1 / hz
            part = step / steps
            x, y = ax + (bx - ax) * part, ay + (by - ay) * part
            states.append(state(at_s, x, y, **({"velocity_enu_m_s": velocity} | more)))
    return states


def route(points: Iterable[tuple[float, float]], up_m: float = 25.0, **more: Any) -> Commanded:
    waypoints = tuple((*place(*each), up_m) for each in points)
    parameters = {"route": Route(waypoints), **more}
    request = BehaviorRequest("r1.b1", 1, "single_vehicle_routing", parameters, (UAV,))
    return commanded_by(request, flies=True)


def seen_by(watch: Watch, states: Iterable[VehicleState]) -> Deviation | None:
    """The first deviation."""
    return next(filter(None, map(watch.observe, states)), None)


def test_a_flight_along_its_route_is_as_commanded() -> None:
    watch = Watch(route(SQUARE), Bounds(), flies=True)
    assert seen_by(watch, flight(SQUARE)) is None
    assert watch.missing() == ""
    seen = watch.evidence()
    assert seen["waypoints_passed"] == seen["waypoints"] == 5
    assert isinstance(seen["cross_track_m"], float)
    assert seen["cross_track_m"] < 0.5


def test_skipped_waypoints_are_a_deviation_and_named_at_the_end() -> None:
    skips = [SQUARE[0], SQUARE[1], SQUARE[4]]
    zigzag = [(0.0, 0.0), (0.0, 100.0), (150.0, 100.0), (150.0, 200.0), (0.0, 200.0), (0.0, 300.0)]
    watch = Watch(route(zigzag), Bounds(), flies=True)
    found = seen_by(watch, flight([(0.0, 0.0), (0.0, 100.0), (0.0, 200.0), (0.0, 300.0)]))
    assert found is not None
    assert found.what == "cross-track"
    assert "off the way to waypoint 3" in found.text
    watch = Watch(route(SQUARE), Bounds(), flies=True)
    for each in flight(skips):
        watch.observe(each)
    assert watch.missing().startswith("waypoints 3 to 5 of 5 were not passed")


def test_a_success_far_from_the_target_has_no_evidence() -> None:
    target = Point((*place(0.0, 500.0), 25.0))
    request = BehaviorRequest("r1.b1", 1, "goto", {"target": target}, (UAV,))
    watch = Watch(commanded_by(request, flies=True), Bounds(), flies=True)
    assert seen_by(watch, flight([(0.0, 0.0), (0.0, 100.0)])) is None
    assert watch.missing() == "it is 400 m from its target"
    near = [(0.0, 100.0), (0.0, 495.0)]
    for at, each in enumerate(flight(near)):
        later = VehicleState(UAV, 60_000_000 + at * 200_000, each.position, 25.0)
        watch.observe(later)
    assert watch.missing() == ""


def test_drift_off_the_route_is_found_within_seconds() -> None:
    watch = Watch(route(SQUARE), Bounds(), flies=True)
    drifting = flight([(0.0, 0.0), (0.0, 50.0), (30.0, 90.0), (30.0, 200.0)])
    found = seen_by(watch, drifting)
    assert found is not None
    assert (found.what, found.ends) == ("cross-track", True)
    assert 15 < found.measured < 31
    assert found.since_us < 25_000_000


def test_a_gust_is_no_deviation() -> None:
    watch = Watch(route(SQUARE), Bounds(), flies=True)
    gust = flight([(0.0, 0.0), (0.0, 50.0), (17.0, 60.0), (17.0, 66.0), (0.0, 76.0), (0.0, 200.0)])
    assert seen_by(watch, gust) is None


def test_a_plane_turns_wide() -> None:
    """At 22 m/s, a turn with 45 degrees of bank leads 99 m off the way."""
    legs = [(0.0, 0.0), (0.0, 1000.0), (1000.0, 1000.0)]
    watch = Watch(route(legs), Bounds(), flies=True)
    wide = [(0.0, 0.0), (0.0, 1040.0), (40.0, 1090.0), (100.0, 1080.0), (300.0, 1000.0)]
    assert seen_by(watch, flight([*wide, legs[-1]], 22.0)) is None
    assert watch.missing() == ""


def test_disarmed_in_the_air_is_found_at_once() -> None:
    watch = Watch(route(SQUARE), Bounds(), flies=True)
    assert watch.observe(state(0.0, 0.0, 0.0)) is None
    found = watch.observe(state(0.2, 0.0, 1.0, armed=False))
    assert found is not None
    assert found.text == "disarmed 25 m above home"


@pytest.mark.parametrize(("behavior", "up_m"), [("land", 12.0), ("takeoff", 12.0)])
def test_a_hill_is_no_fall(behavior: str, up_m: float) -> None:
    """Landed on a hill above home, and disarmed; or still disarmed there before the take-off."""
    request = BehaviorRequest("r1.b1", 1, behavior, {"altitude": 30.0}, (UAV,))
    watch = Watch(commanded_by(request, flies=True), Bounds(), flies=True)
    armed = behavior == "land"
    still = {"velocity_enu_m_s": (0.0, 0.0, 0.0)}
    states = [state(at, 0.0, 0.0, up_m, armed=armed and at < 2, **still) for at in range(5)]
    assert seen_by(watch, states) is None


def test_a_fall_is_found() -> None:
    watch = Watch(Commanded(), Bounds(), flies=True)
    falls = [state(at / 5, 0.0, 0.0, 25.0 - at, velocity_enu_m_s=(0, 0, -12.0)) for at in range(3)]
    found = seen_by(watch, falls)
    assert found is not None
    assert found.text == "falls at 12 m/s (bound: 8 m/s)"


def test_height_0_against_25_m_is_found() -> None:
    watch = Watch(route(SQUARE), Bounds(), flies=True)
    states = flight(SQUARE)
    low = [
        state(each.time_us / 1e6, 0.0, each.time_us / 2e5, 0.2)
        for each in states[:200]
        if each.time_us > 0
    ]
    found = seen_by(watch, [states[0], *low])
    assert found is not None
    assert found.what == "height"
    assert found.text.startswith("at 0 m instead of 25 m")


def test_outside_of_the_fence_is_found_by_the_reported_position() -> None:
    ring = [(-50.0, -50.0), (50.0, -50.0), (50.0, 120.0), (-50.0, 120.0), (-50.0, -50.0)]
    fence = Fence(Area((tuple((*place(*corner), None) for corner in ring),)))
    watch = Watch(Commanded(), Bounds(), flies=True, fences=[fence])
    found = seen_by(watch, flight([(0.0, 0.0), (0.0, 200.0)]))
    assert found is not None
    assert found.what == "fence"
    assert "outside of its fence (bound: 10 m)" in found.text
    begins_outside = Watch(Commanded(), Bounds(), flies=True, fences=[fence])
    assert seen_by(begins_outside, flight([(0.0, 200.0), (0.0, 300.0)])) is None


def test_a_jump_of_the_estimate_is_found_and_a_gap_is_none() -> None:
    watch = Watch(route(SQUARE), Bounds(), flies=True)
    assert watch.observe(state(0.0, 0.0, 0.0)) is None
    found = watch.observe(state(0.5, 50.0, 2.0))
    assert found is not None
    assert found.text == "its position has jumped by 50 m in 0.5 s"
    watch = Watch(Commanded(), Bounds(), flies=True)
    assert seen_by(watch, [state(0.0, 0.0, 0.0), state(20.0, 100.0, 0.0)]) is None


def survey(width_m: float = 100.0) -> Commanded:
    ring = [(0.0, 0.0), (width_m, 0.0), (width_m, 100.0), (0.0, 100.0), (0.0, 0.0)]
    area = Area((tuple((*place(*corner), None) for corner in ring),))
    request = BehaviorRequest("r1.b1", 1, "area_survey", {"area": area, "spacing": 20.0}, (UAV,))
    return commanded_by(request, flies=True)


def passes(count: int, along: int = 0) -> list[tuple[float, float]]:
    """Passes over the area, along its north or its east."""
    ways: list[tuple[float, float]] = []
    for number in range(count):
        aside_m = 10.0 + 20.0 * number
        ends = [(aside_m, 0.0), (aside_m, 100.0)][:: -1 if number % 2 else 1]
        ways += ends if along == 0 else [(y, x) for x, y in ends]
    return ways


@pytest.mark.parametrize("along", [0, 1])
def test_a_survey_is_covered_in_any_order_and_direction(along: int) -> None:
    watch = Watch(survey(), Bounds(), flies=True)
    assert seen_by(watch, flight(passes(5, along))) is None
    assert watch.missing() == ""
    assert watch.evidence()["covered"] == 1.0


def test_half_a_survey_is_not_covered() -> None:
    watch = Watch(survey(), Bounds(), flies=True)
    for each in flight(passes(2)):
        watch.observe(each)
    assert watch.missing().startswith("only ")
    assert "of its lines were covered (bound: 90%)" in watch.missing()


def test_what_was_not_seen_is_not_missed() -> None:
    watch = Watch(route(SQUARE), Bounds(), flies=True)
    states = flight(SQUARE)
    assert seen_by(watch, [*states[:100], *states[-20:]]) is None
    assert watch.missing() == ""
    assert watch.evidence()["waypoints_unseen"] == 3
    assert Watch(route(SQUARE), Bounds()).missing() == ""
    assert Watch(route(SQUARE), Bounds()).evidence() == {"seen": False}


def test_states_of_a_degraded_link_are_left_out() -> None:
    watch = Watch(route(SQUARE), Bounds(), flies=True)
    watch.observe(state(0.0, 0.0, 0.0))
    assert watch.observe(state(0.5, 0.0, 1.0, armed=False, link=LinkState.DEGRADED)) is None


def test_after_a_restart_the_way_is_found_where_the_vehicle_is() -> None:
    watch = Watch(route(SQUARE), Bounds(), flies=True, adopted=True)
    assert seen_by(watch, flight([(200.0, 150.0), (200.0, 0.0), (0.0, 0.0)])) is None
    assert watch.missing() == ""
    assert watch.evidence()["waypoints_unseen"] == 3


def test_a_vehicle_that_is_to_stay_and_goes_on_drifts() -> None:
    watch = Watch(Commanded(end=ExpectedEnd.REST), Bounds())
    assert seen_by(watch, flight([(0.0, 0.0), (0.0, 25.0)])) is None
    found = seen_by(Watch(Commanded(end=ExpectedEnd.REST), Bounds()), flight([(0, 0), (0, 300)]))
    assert found is not None
    assert found.what == "drift"


def test_a_vehicle_that_makes_no_progress_is_said_only() -> None:
    still: dict[str, Any] = {"velocity_enu_m_s": (0.0, 0.0, 0.0)}
    watch = Watch(route(SQUARE), Bounds(), flies=True)
    found = seen_by(watch, [state(at, 0.0, 50.0, **still) for at in range(200)])
    assert found is not None
    assert (found.what, found.ends) == ("stuck", False)


def test_a_speed_far_above_the_commanded_one_is_said_once() -> None:
    watch = Watch(route(SQUARE, speed=2.0), Bounds(), flies=True)
    found = [each for each in map(watch.observe, flight(SQUARE, 8.0)) if each is not None]
    assert [(each.what, each.ends) for each in found] == [("speed", False)]
    assert found[0].text == "moves at 8.0 m/s (bound: 5.0 m/s)"
