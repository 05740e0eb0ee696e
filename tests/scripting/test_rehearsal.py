"""`m2pem.rehearse`: a rehearsal as an object, also where an event loop runs."""

import asyncio
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

import m2pem
from m2pem.api.runs import RunStatus
from tests.command_line import FLEET, MISSION
from tests.console import REPOSITORY

ANSWERS = REPOSITORY / "missions" / "answers"
DETECTION = ANSWERS / "vignette1_detection.yaml"


def test_a_result_has_outcome_path_and_bars() -> None:
    mission, fleet = m2pem.load_mission(MISSION), m2pem.load_fleet(FLEET)
    result = m2pem.rehearse(mission, fleet, answers=DETECTION)
    assert result.outcome is RunStatus.TERMINATED
    assert result.ok
    assert result.took_s == pytest.approx(15.1, abs=1.0)
    assert result.path[:4] == [
        "StartVignette1",
        "UserSendRoute",
        "GatewayDecision",
        "CallDetection",
    ]
    assert result.path[-1] == "EndMission"
    bars = [(each["kind"], each["resource"], each["what"]) for each in result.gantt]
    assert ("prompt", "", "continue") in bars
    assert ("service", "", "Detector") in bars
    (drive,) = [each for each in result.gantt if each["what"] == "single_vehicle_routing"]
    assert (drive["resource"], drive["element"]) == ("evsg1", "DriveRoute")
    assert drive["outcome"] == "interrupted"
    assert 0 <= drive["start_s"] < drive["end_s"] < result.took_s
    starts = [each["start_s"] for each in result.gantt]
    assert starts == sorted(starts)


def test_the_diagram_shows_the_path_and_the_page_has_diagram_and_chart() -> None:
    result = m2pem.rehearse(MISSION, FLEET, answers=ANSWERS / "vignette1_abort.yaml")
    diagram, plain = result.diagram, m2pem.draw(MISSION)
    assert diagram._repr_svg_() == diagram
    assert "<title>step 1</title>" in diagram
    assert "the run, step by step" in diagram
    assert "<title>step" not in plain
    html = result.to_html()
    assert html.count("<svg") == 2
    assert result.gantt_svg in html
    assert diagram in html
    assert html.startswith("<!DOCTYPE html>")


def test_answers_may_be_a_dict_and_a_failed_run_marks_where() -> None:
    answers = {"behaviors": {"DriveRoute": [{"after": "3 s", "end": "failed", "error": "ROAD"}]}}
    result = m2pem.rehearse(MISSION, FLEET, answers=answers)
    assert result.outcome is RunStatus.FAILED
    assert not result.ok
    assert "ROAD" in result.detail
    assert "what is wrong, and where" in result.diagram
    assert result.detail in result._repr_html_()


def test_an_error_that_is_caught_marks_nothing() -> None:
    mission = REPOSITORY / "examples" / "t04_another_takes_over" / "mission.bpmn"
    failed = {"after": "9 s", "end": "failed", "error": "BATTERY_LOW"}
    result = m2pem.rehearse(mission, "sim", answers={"behaviors": {"Survey": [failed]}})
    assert "FlyHome" in result.path
    assert result.ok
    assert "what is wrong" not in result.diagram


def test_each_file_that_the_run_passes_is_drawn() -> None:
    folder = REPOSITORY / "examples" / "t21_processes_in_files"
    mission = folder / "mission.bpmn"
    result = m2pem.rehearse(mission, folder / "fleet.yaml")
    assert list(result.diagrams) == [str(mission), str(folder / "inspection.bpmn")]
    assert all("<title>step" in each for each in result.diagrams.values())
    assert result._repr_html_().count("<svg") == 3


def test_the_start_is_utc_without_a_zone() -> None:
    answers = ANSWERS / "vignette1_abort.yaml"
    start = datetime(2027, 3, 1, 12)
    naive = m2pem.rehearse(MISSION, FLEET, answers=answers, start=start)
    zoned = m2pem.rehearse(MISSION, FLEET, answers=answers, start=start.replace(tzinfo=UTC))
    assert naive.summary.started_us == zoned.summary.started_us
    assert naive.summary.started_us == round(start.replace(tzinfo=UTC).timestamp() * 1_000_000)


async def test_a_running_event_loop_gets_the_same_result_in_both_ways() -> None:
    options: dict[str, Any] = {"answers": DETECTION}
    at_once = m2pem.rehearse(MISSION, FLEET, **options)
    assert at_once.outcome is RunStatus.TERMINATED
    rehearsal = asyncio.create_task(m2pem.rehearse_async(MISSION, FLEET, **options))
    turns = 0
    while not rehearsal.done():
        turns += 1
        await asyncio.sleep(0)
    assert turns > 1
    assert (await rehearsal).records == at_once.records
    with pytest.raises(m2pem.MissionError):
        await m2pem.rehearse_async(b"nothing", FLEET, **options)


def test_what_is_wrong_is_raised_with_file_and_line(tmp_path: Path) -> None:
    with pytest.raises(m2pem.MissionError, match="needs a fleet"):
        m2pem.rehearse(MISSION)
    answers = tmp_path / "answers.yaml"
    answers.write_text("answers:\n  Nothing: [continue]\n")
    with pytest.raises(m2pem.AnswersError, match=r"answers\.yaml:2: answers\.Nothing: error"):
        m2pem.rehearse(MISSION, FLEET, answers=answers)
