"""Drawings over REST: who replaces one that runs use is asked; versions come back."""

from pathlib import Path
from typing import Any

from rest_world import Rest, rest_world

POINT = {"type": "Point", "coordinates": [-77.319, 38.107]}
OTHER = {"type": "Point", "coordinates": [-77.318, 38.108]}
ROUTE = {"type": "LineString", "coordinates": [[-77.319, 38.107], [-77.318, 38.108]]}


async def kinds(rest: Rest, name: str) -> list[Any]:
    return [each["kind"] for each in await rest.get(f"/geometries/{name}/versions")]


async def test_a_drawing_is_deleted_and_an_old_version_comes_back(tmp_path: Path) -> None:
    viewer, operator = {"x-role": "viewer"}, {"x-role": "operator"}
    async with rest_world(tmp_path) as rest:
        await rest.delete("/geometries/gate", 404)
        await rest.put("/geometries/gate", {"geometry": POINT}, 204)
        await rest.put("/geometries/gate", {"geometry": ROUTE}, 204)
        await rest.delete("/geometries/gate", 403, headers=viewer)
        await rest.delete("/geometries/gate", headers=operator)
        assert "gate" not in [each["name"] for each in await rest.get("/geometries")]
        assert await kinds(rest, "gate") == ["point", "route", None]
        first, _, deleted = await rest.get("/geometries/gate/versions", headers=viewer)
        assert (first["geometry"], first["by"]) == (POINT, "a commander")
        path = f"/geometries/gate/versions/{first['number']}/restore"
        await rest.post(path, {}, 403, headers=viewer)
        await rest.post(path, {}, 204)
        assert await kinds(rest, "gate") == ["point", "route", None, "point"]
        path = f"/geometries/gate/versions/{deleted['number']}/restore"
        await rest.post(path, {}, 404)


async def test_who_replaces_a_route_of_a_run_is_asked(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        source = (Path(__file__).parents[4] / "missions" / "vignette1.bpmn").read_text()
        await rest.put("/missions/one", {"xml": source, "base": None})
        started = await rest.post("/runs", {"mission": "one"}, 201)
        name = next(
            each["name"]
            for each in await rest.get("/geometries")
            if each["kind"] == "route" and each["name"] in source
        )
        refused = await rest.put(f"/geometries/{name}", {"geometry": ROUTE}, 409)
        assert refused["runs"] == [started["run"]]
        await rest.put(f"/geometries/{name}", {"geometry": ROUTE, "force": True}, 204)
        await rest.put(f"/geometries/{name}", {"geometry": ROUTE}, 204)
        number = (await rest.get(f"/geometries/{name}/versions"))[0]["number"]
        await rest.put(f"/geometries/{name}", {"geometry": OTHER, "force": True}, 204)
        path = f"/geometries/{name}/versions/{number}/restore"
        assert (await rest.post(path, {}, 409))["runs"] == [started["run"]]
        await rest.post(path, {"force": True}, 204)
        await rest.post("/stop-all", {}, 404)
        await rest.services.control.stop_all(by="test")
        await rest.put(f"/geometries/{name}", {"geometry": OTHER}, 204)
