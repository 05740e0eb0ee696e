"""Checks, the editor's form, templates, and what the fleet can do."""

from pathlib import Path

import pytest
from m2pem_plugin_web.templates import templates
from rest_world import VIGNETTE, rest_world

from m2pem.executive.loading import findings_for, load_source
from m2pem.executive.verification import SearchEngine, search, search_request
from m2pem.fleet.default_fleet import fleet_for
from m2pem.plugins import PluginManager
from m2pem.rehearsal.rehearsal import rehearse
from m2pem.scripting.sources import arbiters_of
from m2pem.verify.search.explore import Limits
from tests.simulation.test_fence_findings import at, written

NAMES = ("escort", "patrol", "search", "survey", "sweep_and_detect")
ROUTE = {"type": "LineString", "coordinates": [[-77.319, 38.107], [-77.318, 38.107]]}


async def test_a_check_tells_findings_and_what_is_in_the_file(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        good = await rest.post("/checks", {"xml": VIGNETTE})
        assert good["findings"] == []
        assert [(p["id"], p["starts"]) for p in good["outline"]["processes"]] == [
            ("VIGNETTE1", True),
            ("DETECTION", False),
        ]
        assert {"name": "user.decision", "from": "UserSendRoute"} in good["outline"]["names"]
        assert good["outline"]["signals"][0]["name"] == "Stop driving"
        bad = await rest.post("/checks", {"xml": VIGNETTE.replace('"evsg1"', '"evsg9"')})
        finding = bad["findings"][0]
        assert (
            finding["severity"] == "error" and finding["element"] and "evsg9" in finding["message"]
        )
        none = await rest.post("/checks", {"xml": "<a/>"})
        assert none["outline"] is None and none["findings"]


async def test_a_finding_of_the_fence_has_its_place(tmp_path: Path) -> None:
    mission, fleet = written(tmp_path, [("goto", "target", at(250, 100))])
    async with rest_world(tmp_path, fleet) as rest:
        answer = await rest.post("/checks", {"xml": mission.read_text()})
        (place,) = [e["place"] for e in answer["findings"] if e["rule"] == "outside-fence"]
        assert f"[{place[0]}, {place[1]}]" == at(250, 100)


async def test_a_check_knows_what_is_beside_the_mission(tmp_path: Path) -> None:
    head = '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="t">'
    calls = (
        f'{head}<process id="P" isExecutable="true"><callActivity id="C" calledElement="Q"/>'
        "</process></definitions>"
    )
    called = f'{head}<process id="Q"><task id="T"/></process></definitions>'
    async with rest_world(tmp_path) as rest:
        alone = await rest.post("/checks", {"xml": calls})
        assert "dangling-reference" in [each["rule"] for each in alone["findings"]]
        await rest.put("/missions/caller", {"xml": calls, "base": None})
        assert not (await rest.get("/missions"))[0]["runnable"]
        await rest.put("/missions/called", {"xml": called, "base": None})
        assert (await rest.post("/checks", {"xml": calls}))["findings"] == []
        assert (await rest.post("/checks", {"mission": "caller"}))["findings"] == []
        assert [each["runnable"] for each in await rest.get("/missions")] == [True, True]


async def test_a_file_is_laid_out_for_the_editor(tmp_path: Path) -> None:
    bare = VIGNETTE[: VIGNETTE.index("<bpmndi:BPMNDiagram")] + "</bpmn:definitions>"
    async with rest_world(tmp_path) as rest:
        found = await rest.post("/editable", {"xml": bare})
        assert "BPMNPlane" in found["xml"] and any("Laid out" in n for n in found["notes"])
        anew = await rest.post("/editable", {"xml": VIGNETTE, "layout": True})
        assert anew["xml"] != (await rest.post("/editable", {"xml": VIGNETTE}))["xml"]


async def test_what_is_sent_wrongly_is_said(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        for body in ({}, {"xml": 1}, {"xml": "", "zzz": 1}, {"mission": "../x"}, [], None):
            await rest.post("/checks", body, 422)
        await rest.post("/checks", {"mission": "not there"}, 404)
        for half in ("/editable", "/checks"):
            response = await rest.http.post(
                f"/api{half}",
                content=b'{"xml": "\\ud800"}',
                headers={"content-type": "application/json"},
            )
            assert response.status_code == 422


# --- templates ----------------------------------------------------------------------------------


def test_there_are_templates_with_titles_and_texts() -> None:
    assert tuple(each.name for each in templates()) == NAMES
    assert all(each.title != each.name and each.doc.endswith(".") for each in templates())


@pytest.mark.parametrize("name", NAMES)
def test_a_template_is_sound_and_runs_to_its_end(name: str) -> None:
    xml = next(each.xml for each in templates() if each.name == name)
    mission = load_source(xml.encode())
    plugins = PluginManager()
    fleet = fleet_for(mission)
    arbiters = arbiters_of(fleet, plugins)
    assert findings_for(mission, arbiters, plugins) == []
    asked = search_request(mission, arbiters, plugins, None, {})
    found = search(asked, SearchEngine("builtin", "exact", Limits(tokens=3)), strict=True)
    assert found.verdict == "holds"
    assert rehearse(mission, fleet, plugins=plugins).exit_status == 0


async def test_templates_are_offered_as_the_editor_takes_them(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        assert [each["name"] for each in await rest.get("/templates")] == [*NAMES]
        for name in NAMES:
            xml = (await rest.get(f"/templates/{name}"))["xml"]
            assert await rest.post("/editable", {"xml": xml}) == {"xml": xml, "notes": []}
        await rest.get("/templates/..%2Fapp", 404)


# --- the fleet ----------------------------------------------------------------------------------


async def test_the_fleet_and_who_of_it_can_do_what(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        fleet = await rest.get("/fleet")
        assert [each["id"] for each in fleet["vehicles"]] == ["evsg1", "evsg2", "evsg3", "lead"]
        assert fleet["teams"][0]["lead"] == "evsg1" and fleet["fence"] is None
        found = {(b["type"], b["name"]): b for b in await rest.get("/behaviors")}
        routing = found["vehicle", "single_vehicle_routing"]
        assert "evsg1" in routing["resources"] and routing["teams"] == []
        speed = next(each for each in routing["parameters"] if each["name"] == "speed")
        assert (speed["kind"], speed["unit"], speed["required"]) == ("speed", "m/s", False)
        assert found["payload", "ptz_scan_polygon"]["resources"] == ["evsg2/ptz"]
        assert found["team", "road_sweep"]["teams"] == ["section"]
        assert ("vehicle", "takeoff") not in found
        detector = next(s for s in await rest.get("/services") if s["name"] == "Detector")
        assert "detection.type" in detector["writes"]


async def test_an_operators_route_is_listed_instead_of_the_fleets(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        before = {each["name"]: each for each in await rest.get("/geometries")}
        assert before["route_alpha"]["from"] == "fleet" and before["route_alpha"]["at_us"] is None
        assert {each["kind"] for each in before.values()} == {"route", "area"}
        await rest.put("/geometries/route_alpha", {"geometry": ROUTE}, 204)
        after = {each["name"]: each for each in await rest.get("/geometries")}
        given = after["route_alpha"]
        assert given["geometry"] == {"type": "LineString", "coordinates": ROUTE["coordinates"]}
        assert (given["from"], given["by"]) == ("operator", "a commander") and given["at_us"] > 0


@pytest.mark.parametrize(
    "geometry", [{}, {"type": "Point"}, {"type": "Point", "coordinates": [7, 95]}]
)
async def test_what_is_no_geometry_is_refused(geometry: object, tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        await rest.put("/geometries/gate", {"geometry": geometry}, 422)
        good = {"geometry": ROUTE}
        await rest.put("/geometries/gate", {**good, "run": "r9"}, 404)
        await rest.put("/geometries/..", good, 404)
        await rest.put("/geometries/ a", good, 422)


async def test_the_editor_knows_what_expressions_are_written_with(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        found = await rest.get("/expressions")
    assert sorted(found) == ["feel", "juel", "m2pem", "xpath"]
    substring = next(each for each in found["feel"]["functions"] if each["name"] == "substring")
    assert substring["signatures"] == ["substring(string, start position, length?)"]
    assert "a position" in substring["doc"]
    assert "satisfies" in found["feel"]["words"] and "&&" in found["juel"]["operators"]
