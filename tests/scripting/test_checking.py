"""`m2pem.check`: the findings of the command line, with file and line."""

import re
from pathlib import Path

import pytest

import m2pem
from m2pem.findings import Severity
from tests.cli.conftest import Invoke
from tests.cli.test_check import DOUBTFUL
from tests.command_line import FLEET, MISSION


def test_a_mission_that_fits_its_fleet_has_no_finding() -> None:
    mission, fleet = m2pem.load_mission(MISSION), m2pem.load_fleet(FLEET)
    for found in (m2pem.check(mission, fleet), m2pem.check(MISSION, "sim"), m2pem.check(mission)):
        assert (found, found.ok, found.usable) == ((), True, True)
        assert str(found) == "nothing found"
        assert "nothing found" in found._repr_html_()


def test_findings_are_those_of_the_command_line(invoke: Invoke, tmp_path: Path) -> None:
    mission = tmp_path / "mission.bpmn"
    text = MISSION.read_text(encoding="utf-8")
    mission.write_text(text.replace('vehicle="evsg1"', 'vehicle="evsg9"'))
    found = m2pem.check(mission, FLEET)
    printed = invoke("check", mission, "--fleet", FLEET)[1].splitlines()
    assert str(found).splitlines() == printed[:-1]
    assert len(found.errors) == 3
    assert found.usable
    assert not found.ok
    assert all(each.file == str(mission) and each.line > 0 for each in found)


def test_a_mission_that_cannot_be_loaded_is_a_finding_and_not_an_exception(tmp_path: Path) -> None:
    found = m2pem.check(tmp_path / "nothing.bpmn", tmp_path / "nothing.yaml")
    assert [each.file for each in found] == [
        str(tmp_path / "nothing.bpmn"),
        str(tmp_path / "nothing.yaml"),
    ]
    assert not found.usable
    with pytest.raises(m2pem.MissionError, match=r"nothing\.bpmn: error: cannot be read"):
        m2pem.load_mission(tmp_path / "nothing.bpmn")


def test_warnings_leave_a_mission_ok_and_data_counts_as_written() -> None:
    source = DOUBTFUL.encode()
    found = m2pem.check(source)
    assert found.ok
    assert [each.severity for each in found.warnings] == [Severity.WARNING]
    assert m2pem.check(source, data={"mission.speed": 3}) == ()
    assert not m2pem.check(source, process="Q").usable


def test_html_shows_where_and_escapes_what_files_say(tmp_path: Path) -> None:
    evil = DOUBTFUL.replace("mission.speed", "mission.speed_x").replace(
        'id="Split"', 'id="Split" name="&lt;script&gt;"'
    )
    path = tmp_path / "a<b>.bpmn"
    path.write_text(evil, encoding="utf-8")
    html = m2pem.check(path)._repr_html_()
    assert re.search(r"a&lt;b&gt;\.bpmn:\d+<", html)
    assert "<b>" not in html
    assert "<script>" not in html
    assert "mission.speed_x" in html


def test_an_arbiter_that_no_plugin_has_is_refused_with_the_fleets_name(tmp_path: Path) -> None:
    fleet = tmp_path / "fleet.yaml"
    fleet.write_text("version: 1\nvehicles: {a: {domain: ground, arbiter: rso}}\n")
    with pytest.raises(m2pem.FleetError, match=r"fleet\.yaml: there is no arbiter 'rso'"):
        m2pem.check(MISSION, fleet)
