import json
from pathlib import Path

import pytest

from tests.cli.conftest import Invoke
from tests.command_line import FLEET, MISSION, CommandLine, install_plugin
from tests.simulation.test_fence_findings import at, written

DOUBTFUL = """<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="x">
  <process id="P" isExecutable="true">
    <startEvent id="Start"/>
    <sequenceFlow id="F1" sourceRef="Start" targetRef="Split"/>
    <exclusiveGateway id="Split"/>
    <sequenceFlow id="F2" sourceRef="Split" targetRef="End">
      <conditionExpression>${mission.speed &gt; 2}</conditionExpression>
    </sequenceFlow>
    <sequenceFlow id="F3" sourceRef="Split" targetRef="End"/>
    <endEvent id="End"/>
  </process>
</definitions>
"""


@pytest.fixture
def doubtful(tmp_path: Path) -> Path:
    """A mission with one warning: nothing writes what it reads."""
    path = tmp_path / "doubtful.bpmn"
    path.write_text(DOUBTFUL, encoding="utf-8")
    return path


def test_a_mission_that_fits_its_fleet(invoke: Invoke) -> None:
    assert invoke("check", MISSION, "--fleet", FLEET) == (0, f"{MISSION}: nothing found\n", "")
    assert invoke("check", MISSION)[0] == 0
    assert invoke("check", MISSION, "--fleet", "sim")[0] == 0


def test_a_warning_is_printed_and_is_an_error_only_if_strict(
    invoke: Invoke, doubtful: Path
) -> None:
    status, out, _ = invoke("check", doubtful)
    assert status == 0
    assert "mission.speed" in out.splitlines()[0]
    assert out.splitlines()[-1] == f"{doubtful}: 1 warning"
    assert invoke("check", doubtful, "--strict")[0] == 1


def test_data_counts_as_written(invoke: Invoke, doubtful: Path) -> None:
    assert invoke("check", doubtful, "--strict", "--data", "mission.speed=3")[0] == 0


def test_errors_are_counted_and_end_with_1(invoke: Invoke, tmp_path: Path) -> None:
    mission = tmp_path / "mission.bpmn"
    text = MISSION.read_text(encoding="utf-8")
    mission.write_text(text.replace('vehicle="evsg1"', 'vehicle="evsg9"'))
    status, out, _ = invoke("check", mission, "--fleet", FLEET)
    assert status == 1
    assert out.splitlines()[-1] == f"{mission}: 3 errors"
    assert len(out.splitlines()) == 4
    assert invoke("check", mission)[0] == 0


def test_an_unknown_process_is_an_error(invoke: Invoke) -> None:
    status, out, _ = invoke("check", MISSION, "--process", "DETECTON")
    assert status == 2
    assert "there is no process 'DETECTON'; name one of: VIGNETTE1, DETECTION" in out


def test_what_cannot_be_executed_is_an_error(invoke: Invoke, doubtful: Path) -> None:
    doubtful.write_text(DOUBTFUL.replace('targetRef="End"/>', 'targetRef="Ende"/>'))
    status, out, _ = invoke("check", doubtful)
    assert status == 1
    assert f"{doubtful}:9: F3: error:" in out


@pytest.mark.parametrize("content", [b"", b"not xml", b"<html/>", b"\xff\xfe\x00"])
def test_what_is_no_bpmn_ends_with_2(invoke: Invoke, tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "mission.bpmn"
    path.write_bytes(content)
    assert invoke("check", path)[0] == 2


def test_a_file_that_is_missing_ends_with_2(invoke: Invoke) -> None:
    status, out, _ = invoke("check", "nothing.bpmn", "--fleet", "nothing.yaml")
    assert status == 2
    assert "nothing.bpmn: error: cannot be read" in out
    assert "nothing.yaml: error: cannot be read" in out


def test_a_fleet_that_cannot_be_used_ends_with_2_after_the_missions_findings(
    invoke: Invoke, doubtful: Path, tmp_path: Path
) -> None:
    fleet = tmp_path / "fleet.yaml"
    fleet.write_text("version: 1\nvehicles: {a: {domain: groud, arbiter: sim}}\n")
    status, out, _ = invoke("check", doubtful, "--fleet", fleet)
    assert status == 2
    assert "mission.speed" in out
    assert "groud" in out


def test_an_arbiter_that_no_plugin_has_ends_with_2(invoke: Invoke, tmp_path: Path) -> None:
    fleet = tmp_path / "fleet.yaml"
    fleet.write_text("version: 1\nvehicles: {a: {domain: ground, arbiter: rso}}\n")
    status, _, err = invoke("check", MISSION, "--fleet", fleet)
    assert status == 2
    assert f"{fleet}: there is no arbiter 'rso'" in err


def test_findings_as_json(invoke: Invoke, doubtful: Path) -> None:
    status, out, _ = invoke("check", doubtful, "--format", "json")
    assert status == 0
    (finding,) = json.loads(out)
    assert finding["file"] == str(doubtful)
    assert finding["severity"] == "warning"
    assert finding["rule"] == "unwritten-name"
    assert finding["number"] == "M307"
    assert set(finding) == {
        "severity",
        "file",
        "line",
        "element",
        "rule",
        "message",
        "place",
        "remedy",
        "number",
    }
    assert json.loads(invoke("check", MISSION, "--format", "json")[1]) == []


def test_findings_of_the_fence_have_their_place_as_json(invoke: Invoke, tmp_path: Path) -> None:
    mission, fleet = written(
        tmp_path, [("goto", "target", at(60, 180)), ("goto", "target", at(180, 180))]
    )
    status, out, _ = invoke("check", mission, "--fleet", fleet, "--format", "json")
    found = {each["rule"]: each for each in json.loads(out)}
    assert (status, [*found]) == (0, ["return-leaves-fence"])
    place = found["return-leaves-fence"]["place"]
    assert f"[{place[0]:.6f}, {place[1]:.6f}]" in found["return-leaves-fence"]["message"]
    mission, fleet = written(tmp_path, [("goto", "target", at(250, 100))])
    status, out, _ = invoke("check", mission, "--fleet", fleet, "--format", "json")
    (finding,) = json.loads(out)
    assert (status, finding["rule"]) == (1, "outside-fence")
    assert str(finding["place"]) == at(250, 100)


def test_a_plugins_findings_are_printed_too(m2pem: CommandLine, tmp_path: Path) -> None:
    code = """
from m2pem.findings import Finding, Severity

@hookimpl
def m2pem_check_mission(mission, fleet):
    return [Finding(Severity.ERROR, mission.file, 3, "", "tide", "low tide")]
"""
    status, out, _ = m2pem.run("check", MISSION, **install_plugin(tmp_path, "tide", code))
    assert status == 1
    assert f"{MISSION}:3: error: low tide [tide]" in out


@pytest.mark.parametrize("fleet", [(), ("--fleet", FLEET)], ids=["alone", "fleet"])
def test_a_requirement_in_the_file_that_cannot_be_read_is_an_error(
    invoke: Invoke, tmp_path: Path, fleet: tuple[object, ...]
) -> None:
    mission = tmp_path / "mission.bpmn"
    mission.write_text(
        DOUBTFUL.replace(
            "<startEvent",
            '<extensionElements><r:requirement xmlns:r="https://m2pem.org/schema/1" id="ends"'
            ' ltl="&lt;> endd"/></extensionElements>\n    <startEvent',
        )
    )
    status, out, _ = invoke("check", mission, *fleet, "--data", "mission.speed=3")
    assert status == 1
    first, formula, caret, last = out.splitlines()
    assert "ends: error: " in first
    assert first.endswith("at column 4 [requirement]")
    assert (formula, caret) == ("    <> endd", "       ^")
    assert last == f"{mission}: 1 error"


def test_an_unknown_process_is_a_usage_error_of_every_command(
    invoke: Invoke, tmp_path: Path
) -> None:
    fleet = ("--fleet", FLEET, "--process", "Nothing")
    for command in ("check", "simulate", "verify"):
        status, out, err = invoke(command, MISSION, *fleet)
        assert (command, status) == (command, 2)
        assert "there is no process 'Nothing'" in out + err
    run = invoke("run", MISSION, *fleet, "--simulate", "--journal", tmp_path / "journal.db")
    assert run[0] == 2


def test_a_payload_of_an_unknown_kind_is_found_in_the_fleet(invoke: Invoke, tmp_path: Path) -> None:
    fleet = tmp_path / "fleet.yaml"
    fleet.write_text(
        "version: 1\nvehicles:\n  v.1:\n    domain: ground\n    arbiter: sim\n"
        "    payloads:\n      eye: {connection: {kind: microscope}}\n"
    )
    status, out, _ = invoke("check", MISSION, "--fleet", fleet)
    assert status == 2
    assert f"{fleet}:7: v.1/eye.connection.kind: error: 'microscope' is not one of" in out


def test_what_is_no_file_is_refused_with_what_to_do(invoke: Invoke, tmp_path: Path) -> None:
    for arguments in ((tmp_path,), (MISSION, "--fleet", tmp_path)):
        status, out, _ = invoke("check", *arguments)
        assert status == 2
        assert "Is a directory; this is a folder: name a file in it" in out
    assert "check the path" in invoke("check", tmp_path / "no.bpmn")[1]


def test_the_help_of_data_says_what_gets_it(invoke: Invoke) -> None:
    assert "the mission starts with" in " ".join(invoke("run", "--help")[1].split())
    assert "the signal brings" in " ".join(invoke("signal", "--help")[1].split())
