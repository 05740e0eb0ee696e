"""Survey patterns over REST."""

from pathlib import Path
from typing import Any

import pytest
from rest_world import rest_world

FIELD: dict[str, Any] = {
    "type": "Polygon",
    "coordinates": [[[7, 53], [7.003, 53], [7.003, 53.001], [7, 53.001], [7, 53]]],
}
CAMERA = {
    "sensor_width_mm": 13.2,
    "sensor_height_mm": 8.8,
    "focal_length_mm": 8.8,
    "image_width_px": 5472,
    "image_height_px": 3648,
    "front_overlap": 0.8,
    "side_overlap": 0.7,
}


async def test_a_camera_and_a_speed_give_a_route(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        wanted = {"area": FIELD, "camera": CAMERA, "altitude_m": 60, "speed_m_s": 8}
        found = await rest.post("/survey-patterns", wanted, headers={"x-role": "viewer"})
        assert found["spacing_m"] == pytest.approx(27.0)
        assert found["trigger_distance_m"] == pytest.approx(12.0)
        (route,) = found["routes"]
        assert route["passes"] == 5
        assert route["time_s"] == pytest.approx(route["length_m"] / 8)
        assert route["images"] == pytest.approx(route["surveyed_m"] / 12 + 5, abs=1)
        first, *_ = route["geojson"]["geometry"]["coordinates"]
        assert first[2] == 60
        assert found["problems"] == []
        assert found["best_heading_deg"] == pytest.approx(90.0, abs=0.1)  # the field is wide
        turned = await rest.post("/survey-patterns", {**wanted, "heading_deg": 10})
        assert turned["best_heading_deg"] == pytest.approx(90.0, abs=0.1)
        cameras = {each.pop("name"): each for each in await rest.get("/survey-cameras")}
        known = {name: value for name, value in CAMERA.items() if "overlap" not in name}
        assert cameras["DJI Phantom 4 Pro"] == known


async def test_vehicles_of_the_fleet_share_it(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        fleet = await rest.get("/fleet")
        names = [each["id"] for each in fleet["vehicles"]][:2]
        wanted = {"area": FIELD, "spacing_m": 10, "vehicles": names, "speed_m_s": 2}
        found = await rest.post("/survey-patterns", wanted)
        assert [each["vehicle"] for each in found["routes"]] == names
        slow = await rest.post("/survey-patterns", {**wanted, "speed_m_s": None})
        assert [each["time_s"] for each in slow["routes"]] == [None, None]  # no speed is stated
        assert slow["routes"][0]["passes"] == found["routes"][0]["passes"]
        unknown = await rest.post("/survey-patterns", {**wanted, "vehicles": ["nobody"]}, 404)
        assert "there is no vehicle 'nobody'" in unknown["detail"]


@pytest.mark.parametrize(
    ("wanted", "status", "says"),
    [
        ({}, 422, "send spacing_m, or a camera"),
        ({"camera": CAMERA}, 422, "a camera needs altitude_m"),
        ({"spacing_m": 5, "area": "nowhere"}, 404, "there is no area 'nowhere'"),
        ({"spacing_m": 5, "area": {"type": "Point", "coordinates": [1, 2]}}, 422, "an area is"),
        ({"spacing_m": 0.01}, 422, "more than 2000 passes"),
        ({"spacing_m": 5, "keep_out": [FIELD]}, 422, "nothing of the area is left"),
    ],
)
async def test_what_is_no_pattern_is_refused(
    wanted: dict[str, Any], status: int, says: str, tmp_path: Path
) -> None:
    async with rest_world(tmp_path) as rest:
        refused = await rest.post("/survey-patterns", {"area": FIELD, **wanted}, status)
        assert says in refused["detail"]
