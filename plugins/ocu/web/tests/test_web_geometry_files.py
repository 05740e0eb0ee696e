"""Files of geometries: what is read of them, and what is written."""

import json
from pathlib import Path

from rest_world import rest_world

LINE = {"type": "LineString", "coordinates": [[-77.319, 38.107, 20.0], [-77.318, 38.108, 25.0]]}


async def test_a_file_is_read_and_nothing_is_saved(tmp_path: Path) -> None:
    file = {
        "type": "FeatureCollection",
        "features": [
            {"type": "Feature", "properties": {"name": "north road"}, "geometry": LINE},
            {"type": "Feature", "properties": {"name": "bad"}, "geometry": {"type": "Point"}},
        ],
    }
    async with rest_world(tmp_path) as rest:
        before = await rest.get("/geometries")
        answer = await rest.http.post(
            "/api/geometry-files/read",
            params={"name": "places.geojson"},
            content=json.dumps(file).encode(),
            headers={"Content-Type": "application/octet-stream", "x-role": "viewer"},
        )
        assert answer.status_code == 200, answer.text
        found = answer.json()
        assert [(each["name"], each["kind"]) for each in found["geometries"]] == [
            ("north_road", "route")
        ]
        assert found["geometries"][0]["geojson"]["geometry"] == LINE
        (problem,) = found["problems"]
        assert (problem["severity"], problem["file"]) == ("error", "places.geojson")
        assert problem["feature"] == "features[1] 'bad'"
        assert await rest.get("/geometries") == before


async def test_geometries_and_drawings_are_exported(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        names = [each["name"] for each in await rest.get("/geometries")]
        whole = await rest.get("/geometry-files/export?format=geojson")
        assert [each["properties"]["name"] for each in whole["features"]] == names
        one = await rest.get(f"/geometry-files/export?format=geojson&names={names[0]}")
        assert one["features"] == whole["features"][:1]
        await rest.get("/geometry-files/export?format=geojson&names=nowhere", 404)
        await rest.get("/geometry-files/export?format=dwg", 422)
        drawn = {"format": "geojson", "geometries": [{"name": "a", "geojson": LINE}]}
        file = await rest.post("/geometry-files/export", drawn)
        assert file["features"][0]["geometry"] == LINE
        drawn["geometries"] = [{"name": "a", "geojson": {"type": "Point"}}]
        await rest.post("/geometry-files/export", drawn, 422)


async def test_a_route_of_different_altitude_frames_is_handed_over_and_shown(
    tmp_path: Path,
) -> None:
    rows = ["0 1 0 16 0 0 0 0 38 -77.3 9 1", "1 0 3 16 0 0 0 0 38.107 -77.319 20 1"]
    rows += ["2 0 0 16 0 0 0 0 38.108 -77.318 95 1", "3 0 2 20 0 0 0 0 0 0 0 1"]
    async with rest_world(tmp_path) as rest:
        answer = await rest.http.post(
            "/api/geometry-files/read",
            params={"name": "north.waypoints"},
            content="\n".join(["QGC WPL 110", *rows]).encode(),
            headers={"Content-Type": "application/octet-stream", "x-role": "viewer"},
        )
        found = answer.json()
        feature = found["geometries"][0]["geojson"]
        assert feature["properties"]["altitude_frames"] == ["relative", "amsl"]
        (problem,) = found["problems"]
        assert (problem["severity"], problem["feature"]) == ("warning", "item 3")
        await rest.put("/geometries/north", {"geometry": feature}, 204)
        known = {each["name"]: each for each in await rest.get("/geometries")}
        assert known["north"]["altitude_frame"] == "relative"
        assert known["north"]["altitude_frames"] == ["relative", "amsl"]
