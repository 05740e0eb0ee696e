"""Which room a behavior takes up, seen by what another aircraft may do beside it."""

from typing import Any

import pytest

from m2pem.api.telemetry import LinkState
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Route, VehiclePosition

from .sky import GROUND_M, NOW_US, airspace, area, claim, point, request, route, state

S = 1_000_000


def over(sky: Any, name: str, altitude: float, **more: Any) -> str:
    """Whether it may fly to (0, 0) from (0, -200)."""
    sky.received(state(name, 0, -200, altitude))
    return claim(sky, request("goto", name, target=point(0, 0), altitude=altitude, **more))


def test_an_advice_for_one_on_the_ground_is_an_altitude_to_fly_at() -> None:
    sky = airspace("one", "two")
    sky.received(state("one", 0, 0, 20))
    sky.received(state("two", 0, -200, 0))
    said = claim(sky, request("goto", "two", target=point(0, 0), altitude=22.0))
    assert "one, which flies at 20 m, at [38.000000, -77.000000]: fly at 30 m or more" in said
    assert "or fly at 10 m or less" in said


def test_an_advice_regards_everybody() -> None:
    sky = airspace("one", "two", "three")
    sky.received(state("one", 0, 0, 20))
    sky.received(state("three", 5, 0, 35))
    sky.received(state("two", 0, -200, 0))
    said = claim(sky, request("goto", "two", target=point(0, 0), altitude=22.0))
    assert "fly at 45 m or more, or fly at 10 m or less" in said


def test_homes_at_different_heights_are_compared_above_the_sea() -> None:
    sky = airspace("one", "two")
    sky.received(state("one", 0, 0, 20))  # 80 m above the sea, as its home is at 60 m
    up_there = state("two", 0, -200, 0)
    position = up_there.position
    assert position is not None
    higher = type(position)(position.latitude_deg, position.longitude_deg, GROUND_M + 40)
    sky.received(type(up_there)(ResourceId("two"), NOW_US, higher, 0.0, armed=False))
    goto = {"target": point(0, 0)}
    assert claim(sky, request("goto", "two", altitude=-25.0, **goto))
    assert claim(sky, request("goto", "two", altitude=82.0, altitude_frame="amsl", **goto))
    assert not claim(sky, request("goto", "two", altitude=2.0, **goto))


def test_each_waypoint_is_compared_in_its_own_frame() -> None:
    sky = airspace("one", "two")
    sky.received(state("one", 0, 0, 20))  # 80 m above the sea
    sky.received(state("two", 0, -200, 60))
    places = route((0, -200, 60), (0, 100, 140)).waypoints
    low = Route.of((places[0], (*places[1][:2], 20.0)), ("relative", "relative"))
    assert claim(sky, request("single_vehicle_routing", "two", route=low))
    high = Route.of(places, ("relative", "amsl"))  # 120 m above the sea, then 140 m
    assert not claim(sky, request("single_vehicle_routing", "two", route=high))


@pytest.mark.parametrize(
    ("behavior", "parameters", "why"),
    [
        ("goto", {"altitude": 90.0, "altitude_frame": "terrain"}, "terrain"),
        ("follow", {"altitude": 25.0, "target": VehiclePosition("cart")}, "wherever cart goes"),
        ("run_onboard_mission", {}, "where it flies is not known"),
    ],
)
def test_what_cannot_be_compared_conflicts_and_says_why(
    behavior: str, parameters: dict[str, Any], why: str
) -> None:
    sky = airspace("one", "two", ground=("cart",))
    sky.received(state("one", 5000, 0, 20))
    sky.received(state("cart", 0, 0, 0))
    sky.received(state("two", 0, -200, 0))
    given = {"target": point(5000, 0), **parameters}
    said = claim(sky, request(behavior, "two", **given))
    assert "; two: " in said
    assert why in said


def test_who_takes_off_without_an_altitude_is_asked_for_one() -> None:
    sky = airspace("one", "two")
    sky.received(state("one", 0, 0, 20))
    sky.received(state("two", 0, -200, 0))
    said = claim(sky, request("goto", "two", target=point(0, 0)))
    assert "two: how high it is to fly is not known: give it an altitude: fly at 30 m" in said


def test_a_return_comes_down_where_it_leads_to() -> None:
    sky = airspace("one", "two")
    sky.received(state("one", 0, 0, 0))
    sky.received(state("one", 300, 0, 45))
    sky.received(state("two", 0, 10, 12))
    assert "two, which flies at 12 m" in claim(sky, request("return_to_launch", "one"))
    sky.received(state("two", 150, 0, 12))
    assert not claim(sky, request("return_to_launch", "one"))


def test_a_follower_needs_a_height_of_its_own_wherever_it_goes() -> None:
    sky = airspace("one", "two", ground=("cart",))
    sky.received(state("one", 0, 0, 40))
    sky.received(state("two", 9000, 0, 40))
    follow = request("follow", "one", target=VehiclePosition("cart"), altitude=40.0)
    assert "two, which flies at 40 m" in claim(sky, follow)
    sky.received(state("two", 9000, 0, 20))
    assert not claim(sky, follow)
    assert "follow" in claim(sky, request("change_altitude", "two", altitude=35.0))
    sky.release(follow.id)
    assert not claim(sky, request("change_altitude", "two", altitude=35.0))


def test_who_stands_on_the_ground_is_in_nobodys_way() -> None:
    sky = airspace("one", "two")
    sky.received(state("one", 0, 0, 0.4, armed=False))
    assert not over(sky, "two", 3.0)
    sky.received(state("one", 0, 0, 0.4, armed=True))
    assert over(sky, "two", 3.0)


def test_a_stop_is_never_refused() -> None:
    sky = airspace("one", "two")
    sky.received(state("one", 0, 0, 20))
    sky.received(state("two", 5, 0, 20))
    assert not claim(sky, request("hold", "two"))
    assert not claim(sky, request("drive_stop", "one"))


def test_who_is_under_way_is_reckoned_with_its_way_to_a_stop() -> None:
    sky = airspace("one", "two")
    sky.received(state("one", -60, -100, 20, velocity_enu_m_s=(12.0, 0.0, 0.0)))
    assert over(sky, "two", 20.0)
    sky.received(state("one", -60, -100, 20))
    assert not over(sky, "two", 20.0)


def test_who_hovers_somewhat_beside_its_height_is_taken_to_be_there() -> None:
    sky = airspace("one", "two")
    sky.received(state("one", 0, 0, 0))
    rise = request("takeoff", "one", altitude=20.0)
    assert not claim(sky, rise)
    sky.release(rise.id)
    sky.received(state("one", 0, 0, 20.8))
    assert not over(sky, "two", 30.0)
    sky.received(state("one", 0, 0, 23.0))
    assert over(sky, "two", 30.0)


def test_a_vehicle_whose_position_is_not_known_may_not_begin() -> None:
    sky = airspace("one", "two")
    assert "the position of one is not known" in claim(sky, request("takeoff", "one", altitude=5.0))


def test_a_lost_aircraft_keeps_its_volume_until_its_link_is_restored() -> None:
    sky = airspace("one", "two")
    sky.received(state("one", -300, 0, 20))
    going = request("goto", "one", target=point(300, 0))
    assert not claim(sky, going)
    sky.lost(ResourceId("one"))
    sky.release(going.id)
    sky.received(state("one", -300, 0, 20, link=LinkState.LOST))
    said = over(sky, "two", 20.0)
    assert f"one, which is lost, and did {going.id} (goto) at 20 m" in said
    assert said.endswith("or when the link to one is restored")
    sky.received(state("one", 200, 0, 20))
    assert not over(sky, "two", 20.0)


def test_vehicles_that_do_the_same_are_kept_from_each_other() -> None:
    sky = airspace("one", "two")
    sky.received(state("one", 0, 0, 20))
    sky.received(state("two", 200, 0, 20))
    both = request("goto", "one", "two", target=point(100, 100), altitude=20.0)
    assert "two" in claim(sky, both)
    assert not claim(sky, request("change_altitude", "one", "two", altitude=30.0))


def test_a_vehicle_that_takes_its_own_behavior_over_is_not_in_its_own_way() -> None:
    sky = airspace("one", "two")
    sky.received(state("one", 0, 0, 20))
    assert not claim(sky, request("orbit", "one", target=point(0, 0)))
    assert not claim(sky, request("goto", "one", target=point(50, 0)))


@pytest.mark.parametrize("behavior", ["formation", "road_following_formation", "road_sweep"])
def test_a_march_takes_up_every_members_lane(behavior: str) -> None:
    sky = airspace("one", "two", "three")
    sky.received(state("one", 0, 0, 20))
    sky.received(state("two", 0, 40, 20))
    march = request(behavior, "one", "two", route=route((50, 0), (400, 0)), spacing=60.0)
    beside = {"formation": 60.0, "road_following_formation": 0.0, "road_sweep": 60.0}[behavior]
    assert not claim(sky, march, BehaviorType.TEAM)
    sky.received(state("three", 250, beside + 300, 20))
    assert claim(sky, request("goto", "three", target=point(250, beside + 18)))
    assert not claim(sky, request("goto", "three", target=point(250, beside + 40)))


def test_a_survey_goes_beyond_its_area_by_its_overshoot() -> None:
    field = area((0, 0), (100, 0), (100, 100), (0, 100))
    for overshoot, free in ((0.0, True), (50.0, False)):
        sky = airspace("one", "two")
        sky.received(state("one", 50, 50, 20))
        sky.received(state("two", 160, 50, 20))
        survey = request("area_survey", "one", area=field, altitude=20.0, overshoot=overshoot)
        assert (not claim(sky, survey)) is free


def scheduled(sky: Any, name: str, way: Any, now_s: float) -> str:
    """Start on a route at 10 m/s, so many seconds later."""
    wished = request("single_vehicle_routing", name, route=way, speed=10.0)
    return claim(sky, wished, now_us=NOW_US + round(now_s * S))


@pytest.mark.parametrize("what", ["kept", "held", "strayed", "late"])
def test_a_time_counts_only_as_long_as_it_is_kept(what: str) -> None:
    sky = airspace("one", "two", time=20.0)
    sky.received(state("one", -100, 0, 30))
    sky.received(state("two", 0, -600, 30))
    assert not scheduled(sky, "one", route((-100, 0), (400, 0)), 0.0)  # passes 0, 0 after 10 s
    sky.received(state("one", -50, 0, 30, NOW_US + 5 * S))
    if what == "held":
        sky.delay(ResourceId("one"))
    elif what == "strayed":
        sky.received(state("one", -50, 60, 30, NOW_US + 5 * S))
    seconds = 75.0 if what == "late" else 6.0  # it arrives after 50 s
    said = scheduled(sky, "two", route((0, -600), (0, 600)), seconds)
    assert bool(said) is (what != "kept"), said
