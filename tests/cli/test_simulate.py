import json
from pathlib import Path

import pytest

from tests.cli.conftest import Invoke
from tests.command_line import ANSWERS, FLEET, MISSION, CommandLine

DETECTION = (MISSION, "--fleet", FLEET, "--answers", ANSWERS / "vignette1_detection.yaml")

WAIT = """<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="x">
  <process id="P" isExecutable="true">
    <startEvent id="Start"/>
    <sequenceFlow id="F1" sourceRef="Start" targetRef="Wait"/>
    <intermediateCatchEvent id="Wait"><timerEventDefinition>
      <timeDate>2026-03-01T00:00:10Z</timeDate>
    </timerEventDefinition></intermediateCatchEvent>
    <sequenceFlow id="F2" sourceRef="Wait" targetRef="End"/>
    <endEvent id="End"/>
  </process>
</definitions>
"""

BACK = """
    <sequenceFlow id="F2" sourceRef="Wait" targetRef="Merge"/>
    <exclusiveGateway id="Merge"/>
    <sequenceFlow id="F5" sourceRef="Merge" targetRef="End">
      <conditionExpression>over</conditionExpression>
    </sequenceFlow>
    <endEvent id="End"/>
    <sequenceFlow id="F3" sourceRef="Merge" targetRef="Task"/>
    <task id="Task"/>
    <sequenceFlow id="F4" sourceRef="Task" targetRef="Merge"/>
  </process>
</definitions>
"""


@pytest.fixture
def wait(tmp_path: Path) -> Path:
    """A mission that commands nothing and ends at a date."""
    path = tmp_path / "wait.bpmn"
    path.write_text(WAIT, encoding="utf-8")
    return path


def visited(out: str) -> list[str]:
    records = [json.loads(line) for line in out.splitlines()]
    return [each["element"] for each in records if each["record"] == "TokenEntered"]


def test_the_paper_s_mission_goes_as_section_4_4_tells(invoke: Invoke) -> None:
    status, out, err = invoke("simulate", *DETECTION, "--format", "json")
    assert (status, err) == (0, "")
    assert visited(out) == [
        "StartVignette1", "UserSendRoute", "GatewayDecision", "CallDetection",
        "StartDetection", "ForkDetection", "DriveRoute", "Detector", "GatewayDetection",
        "Detector", "GatewayDetection", "ThrowStop", "SignalStop", "JoinDetection", "DriveStop",
        "JoinDetection", "EndDetected", "EscalationDetected", "Reverse", "UserSendRoute",
        "GatewayDecision", "EndMission",
    ]  # fmt: skip


def test_the_same_bytes_on_every_run(m2pem: CommandLine) -> None:
    first, second = (
        m2pem.run("simulate", *DETECTION, "--format", "json", PYTHONHASHSEED=seed)
        for seed in ("1", "2")
    )
    assert first == second
    assert first[0] == 0
    assert len(first[1].splitlines()) > 50


def test_lines_for_people_name_what_the_diagram_names(invoke: Invoke) -> None:
    status, out, _ = invoke("simulate", *DETECTION)
    assert status == 0
    assert "  USER SEND ROUTE asks: Send the route, then continue\n" in out
    assert "  DRIVE ROUTE: evsg1 begins single_vehicle_routing\n" in out
    assert out.endswith("r1 terminated: terminated by mission ended\n")
    assert "\x1b" not in out


def test_no_fleet_is_needed_by_a_mission_that_commands_nothing(invoke: Invoke, wait: Path) -> None:
    assert invoke("simulate", wait, "--start", "2026-03-01T00:00:00Z")[0] == 0


@pytest.mark.parametrize(
    "start", ["2026-03-01T00:00:00Z", "2026-03-01T01:00:00+01:00", "2026-03-01"]
)
def test_a_rehearsal_begins_at_a_date(invoke: Invoke, wait: Path, start: str) -> None:
    _, out, _ = invoke("simulate", wait, "--start", start, "--format", "json")
    assert json.loads(out.splitlines()[-1])["t"] == 10


def test_a_start_that_is_no_date_is_refused(invoke: Invoke, wait: Path) -> None:
    status, _, err = invoke("simulate", wait, "--start", "tomorrow")
    assert status == 2
    assert "'tomorrow' is no ISO 8601 date" in err


def test_a_mission_that_goes_in_circles_is_given_up(invoke: Invoke, wait: Path) -> None:
    text = WAIT[: WAIT.index('    <sequenceFlow id="F2"')] + BACK
    wait.write_text(text)
    status, out, _ = invoke("simulate", wait, "--max-steps", "50", "--format", "json")
    assert status == 1
    ended = json.loads(out.splitlines()[-1])
    assert ended["record"] == "RunEnded"
    assert ended["outcome"] == "failed"


def test_answers_that_do_not_fit_are_refused(invoke: Invoke, tmp_path: Path) -> None:
    answers = tmp_path / "answers.yaml"
    answers.write_text("answers: {UserSendRout: [continue]}\n")
    status, out, err = invoke("simulate", MISSION, "--fleet", FLEET, "--answers", answers)
    assert (status, out) == (2, "")
    assert f"{answers}:1" in err
    assert "UserSendRoute" in err


def test_a_gantt_chart_is_drawn(invoke: Invoke, tmp_path: Path) -> None:
    chart = tmp_path / "chart.svg"
    status, _, err = invoke("simulate", *DETECTION, "--gantt", chart)
    assert status == 0
    assert f"the chart is in {chart}\n" in err
    text = chart.read_text(encoding="utf-8")
    assert text.lstrip().startswith("<svg") or text.startswith("<?xml")
    assert "evsg1" in text


def test_a_chart_that_cannot_be_written_is_told(invoke: Invoke, tmp_path: Path) -> None:
    status, _, err = invoke("simulate", *DETECTION, "--gantt", tmp_path / "no" / "chart.svg")
    assert status == 2
    assert "chart.svg cannot be written" in err
