"""`m2pem test`, and the pytest plugin that collects scenarios."""

import json
import os
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

from m2pem.cli.group import run_command_line
from tests.command_line import REPOSITORY
from tests.coverage.conftest import GOOD, MISSION, write_scenarios


@pytest.fixture
def mission(tmp_path: Path) -> Path:
    file = tmp_path / "drive.bpmn"
    file.write_bytes(MISSION)
    return file


def m2pem(*words: object) -> int:
    return run_command_line(["--quiet", "test", *map(str, words)])


def test_it_passes(mission: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_scenarios(mission, GOOD)
    assert m2pem(mission) == 0
    out = capsys.readouterr().out
    assert "  passed  it stays (completed, 0 s)\n" in out
    assert "2 of 4 end events" in out
    assert "1 mission, 2 scenarios, 0 failed, 11 of 18 items seen, 7 neither seen nor named" in out


def test_a_scenario_that_fails_is_shown(mission: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_scenarios(mission, GOOD.replace("[stay]", "[go]"))
    assert m2pem(mission.parent) == 1
    out = capsys.readouterr().out
    assert "FAILED  it stays" in out
    assert "not_entered: a token entered Drive at 0 s" in out


def test_what_is_incomplete_fails_if_that_is_asked(
    mission: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_scenarios(mission, GOOD)
    assert m2pem(mission, "--complete") == 1
    assert "FAILED  never seen (a run reaches it" in capsys.readouterr().out


def test_a_mission_without_scenarios_gets_some(
    mission: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert m2pem(mission, "--complete") == 1
    assert "none of its 17 elements and flows is seen" in capsys.readouterr().out
    assert m2pem(mission, "--add") == 0
    assert "suggestion 5" in capsys.readouterr().out
    assert m2pem(mission, "--complete") == 0
    assert "18 of 18 items seen, 0 neither" in capsys.readouterr().out


def test_a_file_that_cannot_be_used_does_not_stop_the_others(
    mission: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_scenarios(mission, GOOD)
    other = mission.with_name("broken.bpmn")
    other.write_bytes(MISSION)
    write_scenarios(other, "scenario: []")
    assert m2pem(mission.parent) == 2
    out = capsys.readouterr().out
    assert "broken.bpmn: cannot be tested" in out
    assert "unknown key 'scenario'; did you mean 'scenarios'?" in out
    assert "passed  it stays" in out
    assert "1 mission cannot be tested" in out


def test_what_is_no_mission_is_refused(mission: Path, capsys: pytest.CaptureFixture[str]) -> None:
    fleet = mission.with_name("fleet.yaml")
    fleet.write_text("", encoding="utf-8")
    assert m2pem(fleet) == 2
    orphan = write_scenarios(mission.with_name("orphan.bpmn"), GOOD)
    assert m2pem(orphan) == 2
    assert "there is no such mission" in capsys.readouterr().err
    assert m2pem(mission.with_name("nothing.bpmn")) == 2


def test_json_and_junit(mission: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_scenarios(mission, GOOD.replace("[stay]", "[go]"))
    junit = mission.with_name("junit.xml")
    assert m2pem(mission, "--format", "json", "--suggest", "--junit", junit) == 1
    (said,) = json.loads(capsys.readouterr().out)["missions"]
    assert [each["passed"] for each in said["outcomes"]] == [True, False]
    assert said["coverage"]["end"] == {"seen": 1, "all": 4}
    assert said["suggestions"][0]["reaches"][0] == "Stayed"
    suite = ElementTree.parse(junit).getroot()[0]
    assert (suite.get("tests"), suite.get("failures"), suite.get("errors")) == ("3", "1", "0")
    failed = [case.get("name") for case in suite if case.find("failure") is not None]
    assert failed == ["it stays"]


def pytest_run(*words: object) -> subprocess.CompletedProcess[str]:
    """Run pytest with no plugin but that of scenarios, as where m2pem is installed."""
    return subprocess.run(
        [
            *(sys.executable, "-m", "pytest", "-p", "m2pem.coverage.pytest_plugin"),
            *("-c", os.devnull, "-p", "no:cacheprovider", "-v", *map(str, words)),
        ],
        capture_output=True,
        text=True,
        timeout=250,
        check=False,
        env={**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTHONPATH": str(REPOSITORY)},
    )


def test_pytest_collects_scenarios(mission: Path) -> None:
    write_scenarios(mission, f"complete: true\n{GOOD}".replace("ended: completed", "ended: failed"))
    (mission.parent / "foreign.test.yaml").write_text("of: another program", encoding="utf-8")
    done = pytest_run(mission.parent)
    assert "drive.test.yaml::the rover drives PASSED" in done.stdout
    assert "drive.test.yaml::it stays FAILED" in done.stdout
    assert "drive.test.yaml::coverage FAILED" in done.stdout
    assert "ended: expected failed, got completed" in done.stdout
    assert "never seen: end event NoAnswer: a run reaches it, and no scenario does" in done.stdout
    assert "Traceback" not in done.stdout
    assert done.returncode == 1
    assert "2 failed, 1 passed" in done.stdout


def test_pytest_says_what_is_wrong_with_a_file(mission: Path) -> None:
    write_scenarios(mission, "scenario: []")
    done = pytest_run(mission.parent)
    assert "unknown key 'scenario'" in done.stdout
    assert done.returncode == 2


def test_the_plugin_imports_no_more_of_m2pem_where_there_are_no_scenarios() -> None:
    code = (
        "import sys, m2pem.coverage.pytest_plugin\n"
        "print([m for m in sys.modules if m.startswith('m2pem.') and 'coverage' not in m])"
    )
    alone = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True
    )
    plain = subprocess.run(
        [sys.executable, "-c", code.replace(", m2pem.coverage.pytest_plugin", ", m2pem")],
        capture_output=True, text=True, timeout=60, check=True,
    )  # fmt: skip
    assert alone.stdout == plain.stdout


def test_the_plugin_is_an_entry_point() -> None:
    text = (REPOSITORY / "pyproject.toml").read_text(encoding="utf-8")
    assert 'm2pem_scenarios = "m2pem.coverage.pytest_plugin"' in text
