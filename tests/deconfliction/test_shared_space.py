"""Places in shared space, seen by what another vehicle may do beside it."""

from dataclasses import replace
from typing import Any

import pytest

from m2pem.api.telemetry import LinkState
from m2pem.deconfliction.reservations import Reservations
from m2pem.fleet.fleet import Domain, SharedSpace, Vehicle
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import VehiclePosition

from .sky import FRAME, GROUND_M, area, claim, fleet, point, request, route, state

YARD = area((-10, -10), (10, -10), (10, 10), (-10, 10))
LANE = route((-50, 100), (0, 100), (50, 150))
U_SHAPE = area(
    (-30, 200), (30, 200), (30, 260), (20, 260), (20, 210), (-20, 210), (-20, 260), (-30, 260)
)
NAMES = ("one", "two", "three")


def ground(*spaces: SharedSpace, aircraft: tuple[str, ...] = ()) -> Reservations:
    """Rovers, far from all spaces, which are seen."""
    made = replace(
        fleet(*aircraft, ground=NAMES),
        geometries={"yard": YARD, "lane": LANE, "u": U_SHAPE},
        shared_space={space.name: space for space in spaces},
        origin=(*FRAME.to_latlon((0.0, 0.0)), GROUND_M),
    )
    found = Reservations(made)
    for number, name in enumerate(NAMES):
        found.received(state(name, 300 + 20 * number, 0, 0))
    return found


def goes(space: Reservations, name: str, *places: tuple[float, float], **more: Any) -> str:
    """Whether it may go there; it does, if so."""
    way = request("single_vehicle_routing", name, route=route(*places), **more)
    return claim(space, way)


def test_as_many_as_the_capacity_may_enter() -> None:
    space = ground(SharedSpace("yard", 2))
    assert not goes(space, "one", (100, 0), (0, 0))
    assert not goes(space, "two", (0, 100), (0, 0))
    said = goes(space, "three", (0, -100), (0, 0))
    assert "three would enter yard (capacity 2)" in said
    assert "which is taken by one, which does" in said
    assert "and two, which does" in said


@pytest.mark.parametrize(
    ("places", "enters"),
    [
        (((-60, 104), (60, 104)), True),
        (((-60, 107), (-10, 107)), False),
        (((0, 60), (60, 160)), True),
    ],
)
def test_a_corridor_is_as_wide_as_it_says(places: Any, enters: bool) -> None:
    space = ground(SharedSpace("lane", 1, width_m=6.0))
    space.received(state("one", 0, 100, 0))
    space.received(state("two", *places[0], 0))
    assert bool(goes(space, "two", *places)) is enters


def test_an_area_need_not_be_convex() -> None:
    space = ground(SharedSpace("u", 1))
    space.received(state("one", 25, 250, 0))
    space.received(state("two", 0, 300, 0))
    assert not goes(space, "two", (0, 220))
    assert goes(space, "two", (0, 205))


def test_a_place_is_free_when_the_vehicle_has_left_and_does_not_come_back() -> None:
    for back, free in ((False, True), (True, False)):
        space = ground(SharedSpace("yard", 1))
        space.received(state("one", -50, 0, 0))
        ways = [(50.0, 0.0), (100.0, 0.0), *([(0.0, 0.0)] if back else [])]
        assert not goes(space, "one", *ways)
        for east in range(-50, 50, 5):
            space.received(state("one", east, 0, 0))
            if -10 <= east <= 10:
                assert goes(space, "two", (0, 0)), east
        space.received(state("one", 52, 0, 0))
        assert (not goes(space, "two", (0, 0))) is free


def test_who_is_in_it_already_may_leave_it_however_full_it_is() -> None:
    space = ground(SharedSpace("yard", 1))
    space.received(state("one", 0, 0, 0))
    space.received(state("two", 5, 0, 0))
    assert not goes(space, "two", (50, 0))
    assert goes(space, "three", (0, 0))


def test_a_lost_vehicle_keeps_its_place_until_it_is_received_again() -> None:
    space = ground(SharedSpace("yard", 1))
    wished = request("goto", "one", target=point(-100, 0))
    space.received(state("one", 100, 0, 0))
    assert not claim(space, wished)
    space.lost(ResourceId("one"))
    space.release(wished.id)
    space.received(state("one", 60, 0, 0, link=LinkState.LOST))
    assert "one, which is lost, and did" in goes(space, "two", (0, 0))
    space.received(state("one", 60, 0, 0))
    assert not goes(space, "two", (0, 0))


def test_aircraft_count_only_where_they_are_named() -> None:
    for domains, counts in (((Domain.GROUND,), False), ((Domain.GROUND, Domain.AIR), True)):
        space = ground(SharedSpace("yard", 1, domains=domains), aircraft=("uav",))
        space.received(state("uav", 0, 0, 30))
        assert bool(goes(space, "one", (0, 0))) is counts


def test_who_goes_anywhere_needs_a_place_everywhere_and_stopping_needs_none() -> None:
    space = ground(SharedSpace("yard", 1), SharedSpace("lane", 1, width_m=4.0))
    space.received(state("one", 0, 100, 0))
    follow = request("follow", "two", target=VehiclePosition("three"))
    assert claim(space, follow).startswith("two would enter lane (capacity 1), which is taken by")
    assert not claim(space, request("hold", "two"))


def test_a_team_needs_a_place_for_each_member_but_one_where_they_cross_one_by_one() -> None:
    over = {"route": route((-100, 0), (100, 0)), "spacing": 5.0}
    for behavior, capacity, refused in (
        ("road_following_formation", 1, "its vehicles would need 2 places at a time in yard"),
        ("road_following_formation", 2, ""),
        ("bridge_crossing", 1, ""),
    ):
        space = ground(SharedSpace("yard", capacity))
        space.received(state("one", -100, 0, 0))
        space.received(state("two", -110, 0, 0))
        said = claim(space, request(behavior, "one", "two", **over), BehaviorType.TEAM)
        assert said.startswith(refused)
        assert bool(said) is bool(refused)


def test_a_vehicle_whose_position_is_not_known_is_refused_and_counts_nowhere() -> None:
    made = replace(
        fleet(ground=NAMES),
        geometries={"yard": YARD},
        shared_space={"yard": SharedSpace("yard", 1)},
        origin=(*FRAME.to_latlon((0.0, 0.0)), GROUND_M),
    )
    space = Reservations(made)
    space.received(state("one", 50, 0, 0))
    assert "position of two is not known" in goes(space, "two", (0, 0))
    assert not goes(space, "one", (0, 0))


def test_vehicles_of_each_domain_are_kept_apart_from_their_like() -> None:
    boat = ResourceId("boat")
    made = fleet(ground=NAMES)
    made = replace(
        made,
        vehicles={**made.vehicles, boat: Vehicle(boat, Domain.SURFACE, "sim", {})},
        surface_separation_m={Domain.GROUND: 5.0, Domain.SURFACE: 20.0},
    )
    space = Reservations(made)
    for number, name in enumerate(NAMES):
        space.received(state(name, 100 * number, 0, 0))
    space.received(state("boat", 0, 3, 0))
    assert goes(space, "one", (250, 0)).startswith("one would come nearer than 5 m to two, which")
    assert not goes(space, "one", (0, 90))
    # What it has passed is free again.
    said = goes(space, "two", (10, 50), (-40, 50))
    assert "start it after" in said
    space.received(state("one", 0, 80, 0))
    assert not goes(space, "two", (10, 50), (-40, 50))


def test_after_a_restart_a_vehicle_has_its_places_as_soon_as_it_has_said_where_it_is() -> None:
    made = replace(
        fleet(ground=NAMES),
        geometries={"yard": YARD},
        shared_space={"yard": SharedSpace("yard", 1)},
        origin=(*FRAME.to_latlon((0.0, 0.0)), GROUND_M),
    )
    space = Reservations(made)
    space.adopt(request("goto", "one", target=point(-100, 0)), BehaviorType.VEHICLE)
    space.received(state("two", 0, 100, 0))
    assert not claim(space, request("goto", "two", target=point(0, 90)))
    space.received(state("one", 100, 0, 0))
    assert "taken by one, which does" in goes(space, "two", (0, 0))
