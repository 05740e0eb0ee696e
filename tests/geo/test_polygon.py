"""Rings that bound no area, with the edges that are at fault."""

import json
from pathlib import Path
from typing import Any

import pytest

from m2pem.errors import FleetError
from m2pem.fleet.fleet_file import load_fleet
from m2pem.geo.files import read_geometry
from m2pem.geo.geojson import GeometryError, parse_geojson
from m2pem.geo.polygon import MAX_CORNERS, ring_problem
from m2pem.mission.geometry import Area

from ..fleet.fleets import write_fleet, write_json

SQUARE = [[0, 0], [10, 0], [10, 10], [0, 10], [0, 0]]
HOLE = [[2, 2], [4, 2], [4, 4], [2, 4], [2, 2]]


def polygon(*rings: Any) -> dict[str, Any]:
    return {"type": "Polygon", "coordinates": list(rings)}


def moved(ring: list[list[int]], by: int) -> list[list[int]]:
    return [[longitude + by, latitude] for longitude, latitude in ring]


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
