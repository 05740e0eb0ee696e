import math
import subprocess
import sys
from itertools import pairwise
from random import Random

import pymap3d
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from m2pem.api import Area
from m2pem.geo.fence import MARGIN_M, Fence
from m2pem.geo.local_frame import LocalFrame
from tests.seeds import examples

HOME = (38.1, -77.3)


def at(east: float, north: float) -> tuple[float, float]:
    """A place so far from home, in metres."""
    latitude, longitude, _ = pymap3d.enu2geodetic(east, north, 0.0, *HOME, 0.0)
    return float(latitude), float(longitude)


def ring(*corners: tuple[float, float]) -> tuple:
    return tuple((*at(*corner), None) for corner in (*corners, corners[0]))


HOLE = ring((40, 40), (60, 40), (60, 60), (40, 60))
FIELD = Area((ring((0, 0), (100, 0), (100, 100), (0, 100)), HOLE))
U_SHAPE = Area(
    (ring((0, 0), (100, 0), (100, 100), (70, 100), (70, 20), (30, 20), (30, 100), (0, 100)),)
)


@pytest.mark.parametrize(
    ("place", "by_m"),
    [((50, 10), 0), ((120, 50), 20), ((103, 104), 5), ((50, 45), 5), ((50, 50), 10)],
)
def test_a_place_outside_or_in_a_hole_is_as_far_out_as_the_way_back(place, by_m) -> None:
    assert Fence(FIELD).outside_m(at(*place)) == pytest.approx(by_m, abs=0.02)


def test_a_way_within_the_fence_is_no_breach() -> None:
    assert Fence(FIELD).breach([at(10, 10), at(90, 10), at(90, 90)], at(5, 5)) == ""


def test_a_way_along_the_fence_is_no_breach() -> None:
    assert Fence(FIELD).breach([at(0, 0), at(100, 0), at(100, 100)]) == ""


def test_a_point_outside_is_named_with_its_place_and_distance() -> None:
    said = Fence(FIELD).breach([at(10, 10), at(130, 10)])
    latitude, longitude = at(130, 10)
    assert said.startswith("waypoint 2, ")
    assert f"[{latitude:.6f}, {longitude:.6f}]" in said
    assert "30 m outside" in said


def test_a_way_that_cuts_a_corner_is_a_breach_where_it_is_farthest_out() -> None:
    said = Fence(U_SHAPE).breach([at(10, 90), at(90, 90)])
    assert "between waypoint 1 and waypoint 2" in said
    assert "by 20 m" in said


def test_a_way_through_a_hole_is_a_breach() -> None:
    said = Fence(FIELD).breach([at(10, 50), at(90, 50)])
    assert "by 10 m" in said


def test_a_way_to_the_first_point_is_checked_from_where_the_vehicle_is() -> None:
    assert "the way to waypoint 1" in Fence(FIELD).breach([at(90, 50)], at(10, 50))


def test_a_vehicle_that_is_outside_may_come_back() -> None:
    assert Fence(FIELD).breach([at(10, 10)], at(-50, 10)) == ""


# --- a vehicle that is outside, or in what is kept out ------------------------------------------


@pytest.mark.parametrize(
    ("start", "target", "said"),
    [
        ((-0.5, 50), (90, 50), "by 10 m"),  # straight across the hole
        ((-0.5, 50), (30, 50), ""),
        ((-20, 10), (10, 30), ""),
        ((-20, -20), (120, 120), "waypoint 1"),
        ((50, 59), (50, 90), ""),  # out of the hole by the near side
        ((50, 59), (50, 10), "by 10 m"),  # through it
        ((41, 50), (90, 50), "by 10 m"),
        ((50, 60), (50, 10), "by 10 m"),  # from its rim
        ((50, 60), (50, 90), ""),
        ((50, 60), (90, 60), ""),
    ],
)
def test_a_start_outside_is_left_only_by_a_way_that_leads_in(start, target, said) -> None:
    breach = Fence(FIELD).breach([at(*target)], at(*start))
    assert said in breach
    assert bool(breach) is bool(said)


def test_a_way_in_does_not_lead_farther_out_first() -> None:
    bay = Fence(U_SHAPE)
    assert bay.breach([at(10, 90)], at(33, 90)) == ""
    assert "by 20 m" in bay.breach([at(90, 90)], at(33, 90))  # across the bay
    assert "leaves" in bay.breach([at(90, 90)], at(-5, 90))  # in, and out again


def test_a_thin_wall_is_not_crossed() -> None:
    wall = ring((50, 20), (50.06, 20), (50.06, 80), (50, 80))
    fence = Fence(Area((*FIELD.rings[:1], wall)))
    assert "leaves" in fence.breach([at(10, 50), at(90, 50)])


def test_exclusions_are_kept_out_and_their_holes_are_not() -> None:
    fence = Fence(None, [FIELD])
    assert fence.outside_m(at(50, 50)) == 0
    assert fence.outside_m(at(50, 10)) == pytest.approx(10, abs=0.02)
    assert "by 20 m" in fence.breach([at(-10, 50), at(50, 50)])
    assert fence.breach([at(-10, -10), at(1e5, -10)]) == ""


def test_a_vehicle_needs_half_of_its_width_beside_the_way() -> None:
    fence = Fence(FIELD, clearance_m=3.0)
    assert fence.breach([at(4, 4), at(96, 4)]) == ""
    assert "2.0 m outside" in fence.breach([at(4, 1)])
    assert "leaves" in fence.breach([at(10, 38), at(90, 38)])


@pytest.mark.parametrize(
    "hole",
    [
        ring((40, 40), (60, 40), (60, 60), (50, 60), (50, 75), (50, 60), (40, 60)),  # a spike
        ring((40, 40), (60, 40), (60, 40), (60, 60), (40, 60)),  # a corner twice
        ring((40, 40), (60, 60), (60, 40), (40, 60)),  # a figure 8
    ],
)
def test_a_hole_that_is_not_valid_is_kept_out(hole) -> None:
    fence = Fence(Area((*FIELD.rings[:1], hole)))
    assert "leaves" in fence.breach([at(42, 10), at(42, 90)])
    assert "leaves" in fence.breach([at(58, 10), at(58, 90)])
    assert fence.breach([at(38, 10), at(38, 90)]) == ""


# --- ways around --------------------------------------------------------------------------------


def test_the_way_between_places_stays_within_a_fence_that_is_not_convex() -> None:
    fence = Fence(U_SHAPE)
    a, b = (fence.frame.to_local(at(*place)) for place in ((10, 90), (90, 90)))
    way = fence.way(a, b)
    assert [fence.frame.to_latlon(place) for place in way] == [
        pytest.approx(at(30, 20), abs=1e-6),
        pytest.approx(at(70, 20), abs=1e-6),
    ]


def test_a_way_from_outside_enters_where_it_is_near_and_goes_around_the_hole() -> None:
    fence = Fence(FIELD)
    a, b = (fence.frame.to_local(at(*place)) for place in ((-0.5, 50), (90, 50)))
    way = [a, *fence.way(a, b), b]
    length = sum(math.dist(*leg) for leg in pairwise(way))
    assert length == pytest.approx(0.5 + math.hypot(40, 10) + 20 + math.hypot(30, 10), abs=1)


def test_there_is_no_way_into_what_is_closed_all_around() -> None:
    moat = Area((ring((30, 30), (70, 30), (70, 70), (30, 70)), HOLE))
    fence = Fence(Area(FIELD.rings[:1]), [moat])
    a, b = (fence.frame.to_local(at(*place)) for place in ((10, 10), (50, 50)))
    assert fence.way(a, b) is None


@pytest.mark.parametrize("seed", range(examples(12, 300)))
def test_random_ways_around_are_free_and_no_longer_than_need_be(seed) -> None:
    """Judged by shapely: no metre inside what is kept out, and not longer than around its hull."""
    random = Random(seed)
    frame = LocalFrame(HOME)
    rim = shapely.box(0, 0, 200, 200)
    if seed % 2:
        rim = rim.difference(shapely.box(80, 60, 120, 210))
    holes = [
        shapely.Point(random.uniform(20, 180), random.uniform(20, 180))
        .buffer(random.uniform(5, 25), quad_segs=random.choice((1, 2, 4)))
        .normalize()
        for _ in range(random.randint(1, 5))
    ]

    def as_area(polygon: shapely.Polygon) -> Area:
        corners = polygon.exterior.coords
        return Area((tuple((*frame.to_latlon((x, y)), None) for x, y in corners),))

    fence = Fence(as_area(rim), [as_area(hole) for hole in holes], frame=frame)
    free = rim.difference(shapely.union_all(holes))
    for _ in range(10):
        a, b = ((random.uniform(0, 200), random.uniform(0, 200)) for _ in "ab")
        way = fence.way(a, b)
        places = [shapely.Point(each) for each in (a, b)]
        if way is None:
            roomy = free.buffer(-0.2)
            parts = list(getattr(roomy, "geoms", [roomy]))
            held = [[part.covers(place) for part in parts] for place in places]
            assert not any(all(both) for both in zip(*held, strict=True))
            continue
        if not all(free.covers(place) for place in places):
            continue
        line = shapely.LineString([a, *way, b])
        assert line.difference(free.buffer(0.02)).length < 0.01
        if free.covers(shapely.LineString((a, b))):
            assert way == []


def test_shapely_is_not_imported_before_a_fence_is_built() -> None:
    code = "import sys, m2pem.cli, m2pem.geo.fence; assert 'shapely' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


@settings(max_examples=examples(37, 150), deadline=None)
@given(
    st.lists(st.floats(20, 100), min_size=3, max_size=8),
    st.tuples(st.floats(-110, 110), st.floats(-110, 110)),
    st.tuples(st.floats(-110, 110), st.floats(-110, 110)),
)
def test_a_way_is_a_breach_if_and_only_if_a_point_of_it_is_outside(radii, a, b) -> None:
    corners = [
        (radius * math.cos(math.tau * i / len(radii)), radius * math.sin(math.tau * i / len(radii)))
        for i, radius in enumerate(radii)
    ]
    fence = Fence(Area((ring(*corners),)))
    looks = [(a[0] + (b[0] - a[0]) * i / 60, a[1] + (b[1] - a[1]) * i / 60) for i in range(61)]
    farthest = max(fence.outside_m(at(*look)) for look in looks)
    breach = fence.breach([at(*a), at(*b)])
    if farthest > MARGIN_M:
        assert breach
    elif not breach:
        return
    else:  # what is farthest out lies between two looks
        assert math.dist(a, b) / 60 > MARGIN_M
