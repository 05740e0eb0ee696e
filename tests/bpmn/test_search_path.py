"""The folders in which missions find other files."""

from pathlib import Path

import pytest

from m2pem import load_mission
from m2pem.bpmn.search_path import SearchPath
from m2pem.errors import MissionError
from m2pem.mission.library import LibraryError

NAMESPACE = "http://www.omg.org/spec/BPMN/20100524/MODEL"
FILE = (
    '<definitions xmlns="{model}" targetNamespace="{of}"><process id="{process}">{inside}'
    "</process>{more}</definitions>"
)


def write(path: Path, process: str, inside: str = '<task id="T"/>', **how: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    of, more = how.get("of", "urn:t"), how.get("more", "")
    text = FILE.format(model=NAMESPACE, of=of, process=process, inside=inside, more=more)
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture(autouse=True)
def no_variable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("M2PEM_PATH", raising=False)


def found(path: SearchPath, element: str, namespace: str = "") -> str:
    source = path.called(element, namespace)
    return "" if source is None else source.name


def test_the_missions_own_folder_comes_first_then_those_given_then_the_variables(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mission = write(tmp_path / "own" / "mission.bpmn", "M")
    for name in ("given", "named"):
        write(tmp_path / name / f"{name}.bpmn", name.upper())
    variable = f"{tmp_path / 'gone'}:{tmp_path / 'named'}::{tmp_path / 'given'}"
    monkeypatch.setenv("M2PEM_PATH", variable)
    path = SearchPath(mission, [tmp_path / "given"])
    assert path.places == [str(tmp_path / name) for name in ("own", "given", "named")]
    assert found(path, "GIVEN") == str(tmp_path / "given" / "given.bpmn")
    assert found(path, "NAMED") == str(tmp_path / "named" / "named.bpmn")
    assert found(path, "M") == str(mission)


def test_only_bpmn_files_directly_in_a_folder_count(tmp_path: Path) -> None:
    for name in ("a.bpmn", "b.BPMN2", "c.bpmn20.xml", "d.xml", "e.txt", "deep/f.bpmn"):
        write(tmp_path / name, name.rpartition("/")[2][0].upper())
    (tmp_path / "folder.bpmn").mkdir()
    path = SearchPath(None, [tmp_path])
    assert [bool(found(path, name)) for name in "ABCDEF"] == [True] * 3 + [False] * 3


def test_what_is_no_bpmn_is_passed_over(tmp_path: Path) -> None:
    (tmp_path / "broken.bpmn").write_text("<definitions", encoding="utf-8")
    (tmp_path / "other.bpmn").write_text('<x><process id="X"/></x>', encoding="utf-8")
    (tmp_path / "doctype.bpmn").write_text("<!DOCTYPE x><x/>", encoding="utf-8")
    write(tmp_path / "good.bpmn", "GOOD")
    path = SearchPath(None, [tmp_path])
    assert (found(path, "GOOD"), found(path, "X")) == (str(tmp_path / "good.bpmn"), "")


def test_global_tasks_are_found_and_other_elements_are_not(tmp_path: Path) -> None:
    write(tmp_path / "a.bpmn", "P", more='<globalUserTask id="ASK"/><signal id="S"/>')
    path = SearchPath(None, [tmp_path])
    assert found(path, "ASK")
    assert not found(path, "S")
    assert not found(path, "T")


def test_a_process_in_two_files_is_an_error_that_names_both(tmp_path: Path) -> None:
    one = write(tmp_path / "one" / "a.bpmn", "P", of="urn:one")
    two = write(tmp_path / "two" / "b.bpmn", "P", of="urn:two")
    path = SearchPath(None, [tmp_path / "one", tmp_path / "two"])
    with pytest.raises(LibraryError, match=f"{one}, {two}"):
        path.called("P", "")
    assert found(path, "P", "urn:two") == str(two)
    assert not found(path, "P", "urn:three")


def test_a_file_that_is_found_twice_is_one(tmp_path: Path) -> None:
    write(tmp_path / "a.bpmn", "P")
    (tmp_path / "b.bpmn").symlink_to(tmp_path / "a.bpmn")
    path = SearchPath(tmp_path / "mission.bpmn", [tmp_path, tmp_path / "." / "x" / ".."])
    assert found(path, "P")


def test_folders_are_looked_into_when_something_is_asked_for(tmp_path: Path) -> None:
    path = SearchPath(None, [tmp_path])
    write(tmp_path / "late.bpmn", "LATE")
    assert found(path, "LATE")


def test_an_import_is_relative_to_the_file_that_has_it(tmp_path: Path) -> None:
    mission = write(tmp_path / "m.bpmn", "M")
    write(tmp_path / "lib" / "a b.bpmn", "A")
    write(tmp_path / "lib" / "c.bpmn", "C")
    path = SearchPath(mission)
    first = path.imported("lib/a%20b.bpmn", str(mission))
    assert first.name == str(tmp_path / "lib" / "a b.bpmn")
    assert path.imported("c.bpmn", first.name).name == str(tmp_path / "lib" / "c.bpmn")
    assert path.imported("../m.bpmn", first.name).name == str(mission)
    absolute = (tmp_path / "lib" / "c.bpmn").as_uri()
    assert path.imported(absolute, str(mission)).name == str(tmp_path / "lib" / "c.bpmn")


@pytest.mark.parametrize("location", ["http://example.org/a.bpmn", "file://host/a.bpmn", "x:y"])
def test_an_import_that_is_no_local_file_is_refused(tmp_path: Path, location: str) -> None:
    with pytest.raises(LibraryError, match="no local file"):
        SearchPath(tmp_path / "m.bpmn").imported(location, "m.bpmn")


def test_an_import_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LibraryError, match="cannot be read: No such file"):
        SearchPath(tmp_path / "m.bpmn").imported("gone.bpmn", "m.bpmn")


def test_a_mission_without_a_file_imports_from_the_folders_and_from_nowhere_else(
    tmp_path: Path,
) -> None:
    write(tmp_path / "lib" / "a.bpmn", "A")
    secret = write(tmp_path / "secret.bpmn", "SECRET")
    path = SearchPath(None, [tmp_path / "lib"])
    assert path.imported("a.bpmn", "mission.bpmn").name == str(tmp_path / "lib" / "a.bpmn")
    for location in ("../secret.bpmn", str(secret), secret.as_uri(), "b.bpmn"):
        with pytest.raises(LibraryError, match="in no folder of the search path"):
            path.imported(location, "mission.bpmn")


def test_a_loaded_mission_has_what_its_own_folder_and_the_path_have(tmp_path: Path) -> None:
    calls = '<callActivity id="X" calledElement="NEAR"/><callActivity id="Y" calledElement="FAR"/>'
    mission = write(tmp_path / "m.bpmn", "M", calls)
    write(tmp_path / "near.bpmn", "NEAR")
    write(tmp_path / "lib" / "far.bpmn", "FAR")
    loaded = load_mission(mission, [tmp_path / "lib"])
    assert [each.id for each in loaded.processes] == ["M", "near:NEAR", "far:FAR"]
    with pytest.raises(MissionError, match="'FAR', which is no process or global task"):
        load_mission(mission)
