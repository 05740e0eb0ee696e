"""`m2pem check` finds aircraft that would come too near to the ground."""

import re
import struct
from pathlib import Path

import numpy as np
import pytest
import rasterio
from rasterio.transform import from_origin

from m2pem.fleet.fleet_file import load_fleet
from m2pem.scripting.checking import check

SIDE = 1201
FLEET = """version: 1
origin: {{lat: 38.105, lon: -77.305, alt: 60}}
terrain: {{folder: elevation{clearance}}}
vehicles:
  rover: {{domain: ground, arbiter: sim}}
  uav: {{domain: air, arbiter: sim, connection: {{altitude: 30 m}}}}
"""
MISSION = """<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
 xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="t"><process id="p" isExecutable="true">
 <extensionElements><m2pem:geometry name="lane">{lane}</m2pem:geometry></extensionElements>
 <startEvent id="s"/><sequenceFlow id="f1" sourceRef="s" targetRef="fly"/>
 <scriptTask id="fly"><extensionElements>
  <m2pem:behavior type="vehicle" name="single_vehicle_routing">
   <m2pem:properties>{properties}</m2pem:properties>
   <m2pem:resources><m2pem:role name="pilot" vehicle="{vehicle}"/></m2pem:resources>
  </m2pem:behavior></extensionElements></scriptTask>
 <sequenceFlow id="f2" sourceRef="fly" targetRef="e"/><endEvent id="e"/></process></definitions>"""
ROUTE = '<m2pem:property name="route" value="lane"/>'


def lane(altitude_m: float, frame: str, longitude: float = -77.3) -> str:
    return (
        f'{{"type": "Feature", "properties": {{"altitude_frame": "{frame}"}}, "geometry": '
        f'{{"type": "LineString", "coordinates": [[{longitude}, 38.10, {altitude_m}], '
        f"[{longitude}, 38.11, {altitude_m}]]}}}}"
    )


def found(
    folder: Path, route: str, *, clearance: str = ", clearance: 20 m", more: str = "", who: str = ""
) -> list[tuple[str, str, str]]:
    elevation = folder / "elevation"
    if not elevation.exists():
        elevation.mkdir()
        row = struct.pack(f">{SIDE}h", *([75] * SIDE))
        (elevation / "N38W078.hgt").write_bytes(row * SIDE)
    (folder / "fleet.yaml").write_text(FLEET.format(clearance=clearance))
    mission = MISSION.format(lane=route, properties=ROUTE + more, vehicle=who or "uav")
    (folder / "m.bpmn").write_text(mission)
    findings = check(folder / "m.bpmn", folder / "fleet.yaml")
    return [(each.rule, each.element, str(each)) for each in findings]


@pytest.mark.parametrize(
    ("route", "says"),
    [
        (lane(90, "amsl"), "uav would be 15 m above it at [38.10"),
        (lane(60, "amsl"), "uav would be 15 m below the ground"),
        (lane(12, "terrain"), "12 m above it"),
        (lane(12, "relative"), "raise it by 8 m, or let the route follow the terrain"),
    ],
)
def test_a_route_below_the_clearance_is_found_at_its_task(
    tmp_path: Path, route: str, says: str
) -> None:
    [(rule, element, text)] = found(tmp_path, route)
    assert (rule, element) == ("low-over-ground", "fly")
    assert says in text
    assert load_fleet(tmp_path / "fleet.yaml").clearance_m == 20.0


@pytest.mark.parametrize("route", [lane(70, "amsl"), lane(36, "ellipsoid")])
def test_ground_and_route_are_compared_in_one_datum(tmp_path: Path, route: str) -> None:
    # 41 m above the ellipsoid are 75 m above mean sea level there.
    (tmp_path / "elevation").mkdir()
    with rasterio.open(
        tmp_path / "elevation" / "dem.tif",
        "w",
        width=10,
        height=10,
        count=1,
        dtype="float32",
        crs="EPSG:4979",
        transform=from_origin(-77.35, 38.15, 0.01, 0.01),
    ) as data:
        data.write(np.full((10, 10), 41.0, "float32"), 1)
    [(rule, element, text)] = found(tmp_path, route)
    assert (rule, element) == ("low-over-ground", "fly")
    assert re.search(r"uav would be 5(\.[01])? m below the ground", text)


def test_enough_height_other_vehicles_and_fleets_without_a_clearance_are_fine(
    tmp_path: Path,
) -> None:
    assert found(tmp_path, lane(96, "amsl")) == []
    assert found(tmp_path, lane(1, "relative"), clearance="") == []
    assert found(tmp_path, lane(1, "relative"), who="rover") == []
    higher = '<m2pem:property name="altitude" value="25 m"/>'
    assert found(tmp_path, lane(1, "relative"), more=higher) == []


def test_ground_that_is_not_known_is_a_warning(tmp_path: Path) -> None:
    [(rule, _, text)] = found(tmp_path, lane(90, "amsl", longitude=-76.5))
    assert rule == "ground-unknown"
    assert "put N38W077.hgt" in text
    (tmp_path / "elevation" / "N38W078.hgt").unlink()
    (tmp_path / "elevation").rmdir()
    findings = check(tmp_path / "m.bpmn", tmp_path / "fleet.yaml")
    assert [each.rule for each in findings] == ["ground-unknown"]
    assert "elevation: cannot be read" in str(findings[0])


# --- what one look each 30 m does not see -------------------------------------------------------

CELL = 1e-5
"""Of a GeoTIFF: 1.1 m to the north, 0.9 m to the east."""


def write_fine(folder: Path, *raised: tuple[float, float, float, float, float]) -> None:
    """A GeoTIFF around `lane`, at 60 m; `raised`: metres north and east of its beginning, how far
    on, and the height."""
    rows, columns = 1200, 120
    heights = np.full((rows, columns), 60.0, "float32")
    north, east = 1.112, 0.877
    for from_north, to_north, from_east, to_east, height in raised:
        row = [rows - 51 - round(each / north) for each in (to_north, from_north)]
        column = [60 + round(each / east) for each in (from_east, to_east)]
        heights[row[0] : row[1] + 1, column[0] : column[1] + 1] = height
    (folder / "elevation").mkdir()
    with rasterio.open(
        folder / "elevation" / "dem.tif",
        "w",
        width=columns,
        height=rows,
        count=1,
        dtype="float32",
        crs="EPSG:4326",
        transform=from_origin(-77.3 - 60.5 * CELL, 38.1 + (rows - 50.5) * CELL, CELL, CELL),
    ) as data:
        data.write(heights, 1)


def test_a_dam_of_twelve_metres_is_found_with_its_place_and_raising_is_enough(
    tmp_path: Path,
) -> None:
    write_fine(tmp_path, (444, 456, -40, 40, 110))
    [(rule, _, text)] = found(tmp_path, lane(100, "amsl"))
    assert rule == "low-over-ground"
    place, along = re.search(r"\[(38\.\d+), -77\.\d+\], (\d+) m along", text).groups()  # type: ignore[union-attr]
    assert float(place) == pytest.approx(38.1 + 450 / 111_200, abs=0.0001)
    assert 430 < int(along) < 460
    assert "10 m below the ground" in text
    assert "raise it by 30 m" in text
    assert len(found(tmp_path, lane(129.9, "amsl"))) == 1
    assert found(tmp_path, lane(130, "amsl")) == []


@pytest.mark.parametrize(("north_m", "east_m"), [(500, 3), (500, -3), (-3, 0)])
def test_a_mast_beside_the_way_counts_as_far_as_the_vehicle_may_drift(
    tmp_path: Path, north_m: float, east_m: float
) -> None:
    write_fine(tmp_path, (north_m, north_m, east_m, east_m, 110))
    assert [rule for rule, *_ in found(tmp_path, lane(100, "amsl"))] == ["low-over-ground"]


def test_a_mast_out_of_reach_is_not_found(tmp_path: Path) -> None:
    write_fine(tmp_path, (500, 500, 6, 6, 110), (-20, -20, 0, 0, 110))
    assert found(tmp_path, lane(100, "amsl")) == []


def test_ground_that_is_not_known_hides_no_low_place(tmp_path: Path) -> None:
    write_fine(tmp_path, (300, 301, 0, 0, -9999), (700, 702, 0, 0, 110))
    rules = [rule for rule, *_ in found(tmp_path, lane(100, "amsl"))]
    assert rules == ["ground-unknown", "low-over-ground"]


def test_the_way_back_of_a_loop_is_looked_at(tmp_path: Path) -> None:
    write_fine(tmp_path, (495, 505, 15, 25, 110))
    corners = "[[-77.3, 38.1, 100], [-77.3, 38.109, 100], [-77.29954, 38.109, 100]]"
    route = lane(100, "amsl").partition("[[")[0] + corners + "}}"
    assert found(tmp_path, route) == []
    loop = '<m2pem:property name="loop" value="true"/>'
    assert [rule for rule, *_ in found(tmp_path, route, more=loop)] == ["low-over-ground"]
