"""Rings that bound no area, with the edges that are at fault."""

import json
import math
from pathlib import Path
from random import Random
from typing import Any

import pytest
import shapely

from m2pem.errors import FleetError
from m2pem.fleet.fleet_file import load_fleet
from m2pem.geo.files import read_geometry
from m2pem.geo.geojson import GeometryError, as_geojson, parse_geojson
from m2pem.geo.geometry_files import FileProblem
from m2pem.geo.local_frame import LocalFrame
from m2pem.geo.polygon import MAX_CORNERS, circle_ring, ring_problem
from m2pem.mission.geometry import Area

from ..fleet.fleets import write_fleet, write_json

SQUARE = [[0, 0], [10, 0], [10, 10], [0, 10], [0, 0]]
HOLE = [[2, 2], [4, 2], [4, 4], [2, 4], [2, 2]]


def polygon(*rings: Any) -> dict[str, Any]:
    return {"type": "Polygon", "coordinates": list(rings)}


def moved(ring: list[list[int]], by: int) -> list[list[int]]:
    return [[longitude + by, latitude] for longitude, latitude in ring]


@pytest.mark.parametrize("radius_m", [0.1, 30.0, 90_000.0])
@pytest.mark.parametrize("is_around", [True, False])
def test_a_ring_of_a_circle_lies_around_it_or_within_it(radius_m: float, is_around: bool) -> None:
    center = 47.3, 8.5
    frame = LocalFrame(center)
    corners = circle_ring(center, radius_m, is_around=is_around)
    ring = shapely.Polygon([frame.to_local(corner) for corner in corners])
    circle = shapely.Point(0.0, 0.0).buffer(radius_m, quad_segs=1024)
    assert ring.buffer(1e-5 * radius_m).contains(circle) is is_around
    assert circle.buffer(1e-5 * radius_m).contains(ring) is not is_around
    assert abs(math.sqrt(ring.area / circle.area) - 1) < 0.002


@pytest.mark.parametrize(
    "rings",
    [
        [SQUARE],
        [SQUARE, HOLE],
        [SQUARE, HOLE, moved(HOLE, 3)],
        [SQUARE[::-1]],
        [[[0, 0], [0, 0], [10, 0], [10, 10], [0, 0]]],
        [[[0, 0], [5, 5], [10, 0], [10, 10], [5, 5], [0, 10], [0, 0]]],
        [SQUARE, [[0, 0], [2, 1], [1, 2], [0, 0]]],
        [moved(SQUARE, 170)],
    ],
)
def test_areas_that_are_right(rings: list[Any]) -> None:
    area = parse_geojson(polygon(*rings))
    assert isinstance(area, Area)
    assert len(area.rings) == len(rings)


@pytest.mark.parametrize(
    ("rings", "problem"),
    [
        (
            [[[0, 0], [10, 10], [10, 0], [0, 10], [0, 0]]],
            "from [0, 0] to [10, 10] (latitude, longitude) crosses its edge",
        ),
        ([[[0, 0], [10, 0], [10, 10], [5, 0], [0, 10], [0, 0]]], "crosses its edge"),
        (
            [[[175, 0], [-175, 0], [-175, 5], [175, 5], [175, 0]]],
            "from [0, 175] to [0, -175] (latitude, longitude) crosses the antimeridian",
        ),
        ([SQUARE, moved(HOLE, 7)], "crosses its edge"),
        ([SQUARE, moved(HOLE, 20)], "its hole 1 lies outside of its outer ring"),
        ([SQUARE, [[1, 1], [9, 1], [9, 9], [1, 9], [1, 1]], HOLE], "hole 2 lies in its hole 1"),
    ],
)
def test_areas_that_are_wrong(rings: list[Any], problem: str) -> None:
    with pytest.raises(GeometryError) as caught:
        parse_geojson(polygon(*rings))
    assert problem in str(caught.value)


def test_a_fence_that_crosses_itself_is_refused_by_name_when_the_fleet_is_loaded(
    tmp_path: Path,
) -> None:
    text = "version: 1\nvehicles: {}\nareas: {field: field.geojson}\nfence: field\n"
    path = write_fleet(tmp_path, text)
    assert load_fleet(path).fence == "field"
    write_json(tmp_path / "field.geojson", polygon([[0, 0], [1, 1], [1, 0], [0, 1], [0, 0]]))
    with pytest.raises(FleetError, match="crosses its edge") as caught:
        load_fleet(path)
    assert [(each.line, each.element) for each in caught.value.findings] == [(3, "areas.field")]


def test_areas_in_csv_and_plan_files_are_looked_at_too(tmp_path: Path) -> None:
    corners = [(0, 0), (1, 1), (0, 1), (1, 0)]
    csv = tmp_path / "bow.csv"
    csv.write_text("lat_deg,lon_deg\n" + "".join(f"{lat},{lon}\n" for lat, lon in corners))
    plan = tmp_path / "bow.plan"
    plan.write_text(
        json.dumps(
            {
                "fileType": "Plan",
                "mission": {"items": []},
                "geoFence": {"polygons": [{"polygon": corners}]},
            }
        )
    )
    for file in (csv, plan):
        with pytest.raises(GeometryError, match="crosses its edge"):
            read_geometry(file, "area")


def test_rings_of_too_many_corners_are_refused() -> None:
    ring = [(0.0, 0.0, None)] * (MAX_CORNERS + 1)
    assert "simplify" in ring_problem([ring])


# --- what has no area is left out ---------------------------------------------------------------

SPIKES = {
    "of the rim": [[[0, 0], [10, 0], [10, 10], [10, 25], [10, 10], [0, 10], [0, 0]]],
    "into the area": [[[0, 0], [10, 0], [10, 10], [5, 10], [5, 5], [5, 10], [0, 10], [0, 0]]],
    "with corners between": [
        [[0, 0], [5, 0], [5, -2], [5, -5], [5, -2], [5, 0], [10, 0], [10, 10], [0, 10], [0, 0]]
    ],
    "with other corners on the way back": [
        [[0, 0], [10, 0], [10, 10], [10, 15], [10, 20], [10, 12], [10, 10], [0, 10], [0, 0]]
    ],
    "of 5 cm": [[[0, 0], [10, 0], [10, 10], [10, 10.0000005], [10, 10], [0, 10], [0, 0]]],
    "of a hole": [SQUARE, [[2, 2], [4, 2], [4, 4], [4, 8], [4, 4], [2, 4], [2, 2]]],
    "of a hole, out of the area": [
        SQUARE,
        [[2, 2], [4, 2], [4, 4], [14, 4], [4, 4], [2, 4], [2, 2]],
    ],
    "to a hole, as a cut": [
        [[0, 0], [10, 0], [10, 10], [0, 10], [0, 0], [2, 2], [2, 4], [4, 4], [4, 2], [2, 2], [0, 0]]
    ],
    "between two holes": [SQUARE, HOLE, moved(HOLE, 2)],
    "that is a whole hole": [SQUARE, [[2, 2], [4, 2], [5, 2], [2, 2]]],
}


@pytest.mark.parametrize("rings", SPIKES.values(), ids=SPIKES)
def test_edges_that_go_out_and_back_are_left_out_and_said(rings: list[Any]) -> None:
    drawn = shapely.Polygon(rings[0], rings[1:])
    assert not drawn.is_valid
    said: list[str] = []
    high = [[[*corner, 30] for corner in ring] for ring in rings]
    area = parse_geojson(polygon(*high), said.append)
    assert isinstance(area, Area)
    assert {corner[2] for ring in area.rings for corner in ring} == {30}
    read = shapely.Polygon(*_corners(area))
    assert read.is_valid
    assert read.area == pytest.approx(drawn.area, rel=1e-9)
    assert read.equals(drawn.buffer(0))
    (text,) = said
    assert "goes along its edge" in text
    assert "(latitude, longitude)" in text
    assert parse_geojson(polygon(*high)) == area
    read_again: list[str] = []
    assert parse_geojson(as_geojson(area), read_again.append) == area
    assert read_again == []


def _corners(area: Area) -> tuple[list[Any], list[Any]]:
    outer, *holes = ([(lon, lat) for lat, lon, _ in ring] for ring in area.rings)
    return outer, holes


@pytest.mark.parametrize(
    "rings",
    [
        [[[0, 0], [5, 5], [10, 10], [10, 0], [5, 5], [0, 10], [0, 0]]],
        [[[0, 0], [10, 10], [10, 0], [0, 10], [5, 20], [0, 10], [0, 0]]],
        [[[0, 0], [5, 0], [10, 0], [0, 0]]],
        [SQUARE, HOLE, HOLE],
    ],
    ids=["figure 8 with its middle", "figure 8 with a spike", "no area", "a hole twice"],
)
def test_what_loses_area_is_refused_with_the_place(rings: list[Any]) -> None:
    with pytest.raises(GeometryError, match=r"\[\d+, \d+\]|lies in"):
        parse_geojson(polygon(*rings))


@pytest.mark.parametrize("seed", range(40))
def test_random_spikes_leave_the_area_as_it_is(seed: int) -> None:
    """An edge out and back at a random corner of a random star, judged by shapely."""
    random = Random(seed)
    count = random.randint(3, 9)
    star = [
        (r * math.cos(math.tau * i / count), r * math.sin(math.tau * i / count))
        for i, r in enumerate(random.uniform(1, 5) for _ in range(count))
    ]
    at = random.randrange(count)
    out = (random.uniform(-8, 8), random.uniform(-8, 8))
    ring = [*star[: at + 1], out, *star[at:], star[0]]
    said: list[str] = []
    area = parse_geojson(polygon(ring), said.append)
    assert isinstance(area, Area)
    assert said
    assert (
        shapely.Polygon(_corners(area)[0]).symmetric_difference(shapely.Polygon(star)).area < 1e-9
    )


def test_every_kind_of_file_says_what_was_mended(tmp_path: Path) -> None:
    spike = [(0, 0), (0, 1), (1, 1), (1.5, 1), (1, 1), (1, 0)]
    (tmp_path / "a.csv").write_text(
        "lat_deg,lon_deg\n" + "".join(f"{lat},{lon}\n" for lat, lon in spike)
    )
    fence = {"polygons": [{"polygon": spike}]}
    write_json(tmp_path / "a.plan", {"fileType": "Plan", "mission": {}, "geoFence": fence})
    items = "".join(
        f"{number}\t0\t3\t5001\t{len(spike)}\t0\t0\t0\t{lat}\t{lon}\t0\t1\n"
        for number, (lat, lon) in enumerate(spike)
    )
    (tmp_path / "a.waypoints").write_text(f"QGC WPL 110\n{items}")
    places = " ".join(f"{lon},{lat}" for lat, lon in (*spike, spike[0]))
    (tmp_path / "a.kml").write_text(
        '<kml xmlns="http://www.opengis.net/kml/2.2"><Placemark><Polygon><outerBoundaryIs>'
        f"<LinearRing><coordinates>{places}</coordinates></LinearRing></outerBoundaryIs>"
        "</Polygon></Placemark></kml>"
    )
    ring = polygon([[lon, lat] for lat, lon in (*spike, spike[0])])
    write_json(tmp_path / "a.geojson", ring)
    write_json(tmp_path / "a.json", {"crs": "EPSG:4326", **ring})
    for file in sorted(tmp_path.iterdir()):
        problems: list[FileProblem] = []
        area = read_geometry(file, "area", problems.append)
        assert isinstance(area, Area)
        assert shapely.Polygon(_corners(area)[0]).equals(shapely.box(0, 0, 1, 1)), file
        assert any("goes along its edge" in str(each) for each in problems), file


def test_a_fleet_file_warns_of_what_was_mended(tmp_path: Path) -> None:
    text = "version: 1\nvehicles: {}\nareas: {field: field.geojson}\nfence: field\n"
    path = write_fleet(tmp_path, text)
    spike = [[0, 0], [1, 0], [1, 1], [1, 1.5], [1, 1], [0, 1], [0, 0]]
    write_json(tmp_path / "field.geojson", polygon(spike))
    (warning,) = load_fleet(path).warnings
    assert (warning.line, warning.element) == (3, "areas.field")
    assert "mended" in warning.message


def test_rings_that_turn_to_one_side_once_around_are_as_valid_as_shapely_says() -> None:
    convex = 0
    for seed in range(2_000):
        draw = Random(seed)
        corners, rounds = draw.randint(3, 7), draw.choice([1, 1, 2, 3])
        turn = rounds * math.tau / corners
        ring = [
            (math.sin(turn * at) + draw.gauss(0, 0.1), math.cos(turn * at) + draw.gauss(0, 0.1))
            for at in range(corners)
        ]
        shape = shapely.Polygon(ring)
        problem = ring_problem([[(*corner, None) for corner in [*ring, ring[0]]]])
        assert bool(problem) is not shape.is_valid, ring
        convex += shape.is_valid and shape.area == pytest.approx(shape.convex_hull.area)
    assert convex > 200
