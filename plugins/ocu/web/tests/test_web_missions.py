"""The folder of missions: names, versions, and never over what somebody else has changed."""

import asyncio
import os
from pathlib import Path

import pytest
from m2pem_plugin_web.missions.folder import (
    BadNameError,
    ChangedError,
    MissionFolder,
    NoMissionError,
)
from m2pem_plugin_web.missions.names import why_not
from m2pem_plugin_web.missions.versions import version_of, write
from rest_world import VIGNETTE, rest_world

BROKEN = VIGNETTE.replace('targetRef="EndMission"', 'targetRef="Nowhere"')
BOMB = """<!DOCTYPE a [<!ENTITY b "ha"><!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;">]>
<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" id="&c;"/>"""
XXE = BOMB.replace('"ha"', 'SYSTEM "file:///etc/passwd"')


# --- names --------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["vignette1", "Sweep 2", "a-b_c.d", "Übung", "2", "-x", "a" * 100])
def test_names_of_files_are_names(name: str) -> None:
    assert why_not(name) == ""


@pytest.mark.parametrize(
    "name",
    [
        *("", ".", "..", "../x", "a/b", "a\\b", ".hidden", " a", "a ", "a.", "a\nb", "a\0b", "a\n"),
        *("x.bpmn", "X.BPMN", "con", "NUL.x", "a" * 101, "ü" * 101, "a:b", "a*", "\udc80"),
    ],
)
def test_what_leads_elsewhere_is_no_name(name: str, tmp_path: Path) -> None:
    assert why_not(name)
    with pytest.raises(BadNameError):
        MissionFolder(tmp_path).read(name)


# --- the folder ---------------------------------------------------------------------------------


def test_a_mission_is_saved_whole_with_who_and_when(tmp_path: Path) -> None:
    folder = MissionFolder(tmp_path / "new" / "missions")
    assert folder.names() == ()
    saved = folder.save("one", b"<a/>", None, "anna")
    assert folder.read("one") == saved
    assert (saved.by, saved.version) == ("anna", version_of(b"<a/>"))
    again = folder.save("one", b"<b/>", saved.version, "bert")
    assert [(each.number, each.by) for each in folder.versions("one")] == [(1, "anna"), (2, "bert")]
    assert folder.version("one", 1)[1] == b"<a/>"
    assert folder.source("one", saved.version) == b"<a/>"
    assert folder.source("one", None) == folder.source("one", again.version) == b"<b/>"
    assert sorted(each.name for each in folder.path.iterdir()) == [".versions", "one.bpmn"]


def test_what_changed_on_the_disk_is_not_overwritten(tmp_path: Path) -> None:
    folder = MissionFolder(tmp_path)
    saved = folder.save("one", b"<a/>", None, "anna")
    (tmp_path / "one.bpmn").write_bytes(b"<by another program/>")
    with pytest.raises(ChangedError) as refused:
        folder.save("one", b"<mine/>", saved.version, "anna")
    current = refused.value.current
    assert current is not None and current.source == b"<by another program/>" and current.by == ""
    folder.save("one", b"<mine/>", current.version, "anna")
    kept = [folder.version("one", each.number)[1] for each in folder.versions("one")]
    assert kept == [b"<a/>", b"<by another program/>", b"<mine/>"]


def test_a_new_mission_is_not_saved_over_one_that_is_there(tmp_path: Path) -> None:
    folder = MissionFolder(tmp_path)
    (tmp_path / "one.bpmn").write_bytes(b"<there/>")
    with pytest.raises(ChangedError):
        folder.save("one", b"<mine/>", None, "anna")
    (tmp_path / "one.bpmn").unlink()
    with pytest.raises(ChangedError) as refused:
        folder.save("one", b"<mine/>", version_of(b"<there/>"), "anna")
    assert refused.value.current is None


def test_what_is_deleted_is_kept_and_can_be_saved_again(tmp_path: Path) -> None:
    folder = MissionFolder(tmp_path)
    folder.save("one", b"<a/>", None, "anna")
    folder.delete("one", "bert")
    with pytest.raises(NoMissionError):
        folder.read("one")
    last = folder.versions("one")[-1]
    assert (last.by, last.deleted) == ("bert", True)
    folder.save("one", folder.version("one", last.number)[1], None, "anna")
    assert folder.read("one").by == "anna"


def test_what_is_not_a_mission_is_not_listed(tmp_path: Path) -> None:
    for name in ("one.bpmn", "Two.bpmn", ".hidden.bpmn", "notes.txt", "bad:name.bpmn"):
        (tmp_path / name).write_bytes(b"")
    (tmp_path / "folder.bpmn").mkdir()
    assert MissionFolder(tmp_path).names() == ["one", "Two"]


def test_a_write_that_fails_leaves_what_was_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "one.bpmn"
    path.write_bytes(b"<whole/>")
    path.chmod(0o640)

    def fail(_: int) -> None:
        raise OSError("no room")

    with monkeypatch.context() as broken:
        broken.setattr(os, "fsync", fail)
        with pytest.raises(OSError, match="no room"):
            write(path, b"<half")
    assert path.read_bytes() == b"<whole/>" and [*tmp_path.iterdir()] == [path]
    write(path, b"<new/>")
    assert path.read_bytes() == b"<new/>" and path.stat().st_mode & 0o777 == 0o640


def test_of_many_who_save_at_once_one_wins(tmp_path: Path) -> None:
    folders = [MissionFolder(tmp_path) for _ in range(8)]

    async def story() -> list[object]:
        return await asyncio.gather(
            *(
                asyncio.to_thread(folder.save, "one", f"<by n='{n}'/>".encode(), None, f"p{n}")
                for n, folder in enumerate(folders)
            ),
            return_exceptions=True,
        )

    outcomes = asyncio.run(story())
    assert sum(isinstance(each, ChangedError) for each in outcomes) == 7
    assert len(folders[0].versions("one")) == 1


# --- over HTTP ----------------------------------------------------------------------------------


async def test_a_mission_is_drawn_saved_listed_and_read_again(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        saved = await rest.put("/missions/Sweep 1", {"xml": VIGNETTE, "base": None})
        assert saved["by"] == "a commander"
        assert await rest.get("/missions") == [
            {**saved, "title": "VIGNETTE1", "runnable": True, "name": "Sweep 1"}
        ]
        read = await rest.get("/missions/Sweep 1")
        assert "m2pem:behavior" in read["xml"] and read["version"] == saved["version"]
        assert any("comment" in note for note in read["notes"])
        file = await rest.http.get("/api/missions/Sweep 1/file")
        assert file.text == VIGNETTE and "Sweep 1.bpmn" in file.headers["content-disposition"]


async def test_drafts_with_errors_are_saved_but_cannot_run(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        await rest.put("/missions/one", {"xml": BROKEN, "base": None})
        (tmp_path / "noxml.bpmn").write_text("nothing", encoding="utf-8")
        lines = await rest.get("/missions")
        assert [(each["name"], each["runnable"]) for each in lines] == [
            ("noxml", False),
            ("one", False),
        ]
        refused = await rest.post("/runs", {"mission": "one"}, 422)
        assert any("Nowhere" in each["message"] for each in refused["findings"])
        assert (await rest.get("/missions/noxml", 422))["findings"]


async def test_what_is_no_bpmn_is_not_saved(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        for xml in (BOMB, XXE, "<a", "", "<html/>", "\u0000"):
            refused = await rest.put("/missions/one", {"xml": xml, "base": None}, 422)
            assert refused["findings"], xml
            assert await rest.get("/missions") == [], xml
            for path in ("/checks", "/editable"):
                response = await rest.http.post(f"/api{path}", json={"xml": xml})
                assert "root:" not in response.text and "hahahaha" not in response.text, xml


async def test_who_comes_second_is_told_what_is_there(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        saved = await rest.put("/missions/one", {"xml": VIGNETTE, "base": None})
        refused = await rest.put("/missions/one", {"xml": BROKEN, "base": None}, 409)
        assert refused["current"] == {k: saved[k] for k in ("version", "by", "saved_at_us")}
        await rest.put("/missions/one", {"xml": BROKEN, "base": saved["version"]})
        versions = await rest.get("/missions/one/versions")
        assert [each["number"] for each in versions] == [1, 2]
        old = await rest.get("/missions/one/versions/1")
        assert old["version"] == saved["version"] and "EndMission" in old["xml"]
        await rest.get("/missions/one/versions/3", 404)
        await rest.delete("/missions/one")
        await rest.get("/missions/one", 404)
        assert (await rest.get("/missions/one/versions"))[-1]["deleted"]


async def test_an_older_version_can_be_started(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        saved = await rest.put("/missions/one", {"xml": VIGNETTE, "base": None})
        await rest.put("/missions/one", {"xml": BROKEN, "base": saved["version"]})
        await rest.post("/runs", {"mission": "one"}, 422)
        run = await rest.post("/runs", {"mission": "one", "version": saved["version"]}, 201)
        mission = await rest.get(f"/runs/{run['run']}/mission")
        assert [each["qualifier"] for each in mission["files"]] == [""]
        assert "m2pem:behavior" in mission["files"][0]["xml"]
        await rest.post("/runs", {"mission": "one", "version": "0" * 16}, 404)
        await rest.post("/runs", {"mission": "two"}, 404)


async def test_names_that_are_none_are_refused(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        for name in ("..%2Fx", "%2e%2e", ".versions", "a%2Fb", "con", "x.bpmn", "%00"):
            for method in ("GET", "PUT", "DELETE"):
                body = {"xml": VIGNETTE, "base": None} if method == "PUT" else None
                response = await rest.http.request(method, f"/api/missions/{name}", json=body)
                assert response.status_code in (404, 405, 422), (name, method, response.text)
            assert not rest.services.folder.names(), name


async def test_roles_are_what_they_may_do(tmp_path: Path) -> None:
    async with rest_world(tmp_path) as rest:
        saved = await rest.put("/missions/one", {"xml": VIGNETTE, "base": None})
        viewer, operator = {"x-role": "viewer"}, {"x-role": "operator"}
        body = {"xml": VIGNETTE, "base": saved["version"]}
        for headers in (viewer, operator):
            await rest.put("/missions/one", body, 403, headers=headers)
            await rest.delete("/missions/one", 403, headers=headers)
            await rest.get("/missions", headers=headers)
        point = {"geometry": {"type": "Point", "coordinates": [-77.319, 38.107]}}
        await rest.put("/geometries/gate", point, 403, headers=viewer)
        await rest.put("/geometries/gate", point, 204, headers=operator)
        for path in ("/verifications", "/rehearsals"):
            await rest.post(path, {"xml": VIGNETTE}, 403, headers=viewer)
            await rest.post(path, {"xml": VIGNETTE}, 202, headers=operator)
        response = await rest.http.get("/api/missions", headers={"x-role": ""})
        assert response.status_code == 401
