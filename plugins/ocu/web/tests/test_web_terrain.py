"""The ground along a route over REST, from a tile that the test writes."""

import struct
from pathlib import Path
from typing import Any

import httpx
import pytest
from fastapi import FastAPI
from m2pem_plugin_web.problems import handle_problems
from m2pem_plugin_web.rest import terrain
from rest_world import As, rest_world

SIDE = 1201
ROUTE: dict[str, Any] = {
    "type": "LineString",
    "coordinates": [[-77.319, 38.107, 30], [-77.318, 38.117, 30]],
}


async def test_the_ground_along_a_route_is_told(tmp_path: Path) -> None:
    row = struct.pack(f">{SIDE}h", *([75] * SIDE))
    (tmp_path / "N38W078.hgt").write_bytes(row * SIDE)
    async with rest_world(tmp_path / "missions") as rest:

        async def asked(
            folder: Path | None, body: dict[str, Any], what: str = "profile"
        ) -> httpx.Response:
            app = FastAPI(routes=terrain.router(rest.services.control, folder).routes)
            handle_problems(app)
            transport = httpx.ASGITransport(As(app))
            async with httpx.AsyncClient(transport=transport, base_url="http://test") as http:
                viewer = {"x-role": "viewer"}
                return await http.post(f"/api/terrain/{what}", json=body, headers=viewer)

        answer = await asked(tmp_path, {"route": ROUTE, "step_m": 100})
        assert answer.status_code == 200, answer.text
        points = answer.json()["points"]
        assert [each["waypoint"] for each in points if each["waypoint"] is not None] == [0, 1]
        assert [each["ground_m"] for each in points] == pytest.approx([75] * len(points))
        assert [each["above_ground_m"] for each in points] == pytest.approx([30] * len(points))
        answer = await asked(tmp_path, {"route": ROUTE, "home_m": 60})
        assert answer.json()["points"][0]["above_ground_m"] == pytest.approx(15)
        assert answer.json()["lowest"] is not None
        named = next(e["name"] for e in await rest.get("/geometries") if e["kind"] == "route")
        assert (await asked(tmp_path, {"route": named})).status_code == 200
        assert (await asked(tmp_path, {"route": "nowhere"})).status_code == 404
        assert (await asked(tmp_path, {"route": {"type": "Point"}})).status_code == 422
        refused = await asked(None, {"route": ROUTE})
        assert refused.status_code == 404
        assert "M2PEM_TERRAIN" in refused.json()["detail"]
        empty = await asked(tmp_path / "missions", {"route": ROUTE})
        assert empty.status_code == 503
        followed = await asked(tmp_path, {"route": ROUTE, "height_m": 40}, "follow")
        feature = followed.json()["geojson"]
        assert feature["properties"]["altitude_frame"] == "amsl"
        assert [place[2] for place in feature["geometry"]["coordinates"]] == [115, 115]
        east = {"type": "LineString", "coordinates": [[-76.5, 38.1, 30], [-76.4, 38.1, 30]]}
        for what, status in (("profile", 200), ("follow", 503)):
            answer = await asked(tmp_path, {"route": east}, what)
            assert answer.status_code == status
            assert "put N38W077.hgt" in answer.text
        level = {"type": "LineString", "coordinates": [[-77.5, 38.1], [-77.4, 38.1]]}
        answer = await asked(tmp_path, {"route": level}, "follow")
        assert answer.status_code == 422
        assert "has no altitude" in answer.json()["detail"]
        assert (await asked(None, {"route": ROUTE}, "follow")).status_code == 404
