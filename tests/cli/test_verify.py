import json
import re
import shutil
from contextlib import nullcontext
from pathlib import Path

import pytest

from m2pem.verify.search.explore import Progress
from tests.cli.conftest import Invoke
from tests.command_line import FLEET, MISSION, REPOSITORY, CommandLine
from tests.engine.notation import xml
from tests.verify.test_all_pools import STUCK
from tests.verify.test_all_pools import mission as mission_of_pools
from tests.verify.test_fairness import AGREE
from tests.verify.test_timers import WARNED_FIRST

BROKEN = REPOSITORY / "docs" / "broken"


def test_a_mission_that_holds_ends_with_0(invoke: Invoke) -> None:
    status, out, _ = invoke("verify", MISSION, "--fleet", FLEET)
    assert status == 0
    assert "holds      no-deadlock" in out
    assert "everything holds" in out


def test_strict_makes_violations_of_warnings(invoke: Invoke) -> None:
    assert invoke("verify", MISSION, "--fleet", FLEET, "--strict")[0] == 1


def wide(branches: int) -> str:
    """A mission that asks many operators at once: 3^branches states."""
    tasks = "".join(
        f'<userTask id="Ask{n}"><extensionElements><m2pem:prompt>Go?</m2pem:prompt>'
        f'<m2pem:decision value="go"/></extensionElements></userTask>'
        f'<sequenceFlow id="in{n}" sourceRef="Fork" targetRef="Ask{n}"/>'
        f'<sequenceFlow id="out{n}" sourceRef="Ask{n}" targetRef="Join"/>'
        for n in range(branches)
    )
    return f"""<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
      xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="wide"><process id="Wide">
      <startEvent id="Start"/><parallelGateway id="Fork"/><parallelGateway id="Join"/>
      <endEvent id="End"/><sequenceFlow id="begin" sourceRef="Start" targetRef="Fork"/>{tasks}
      <sequenceFlow id="over" sourceRef="Join" targetRef="End"/></process></definitions>"""


def test_a_search_that_is_cut_short_ends_with_3_and_says_what_it_saw(
    invoke: Invoke, tmp_path: Path
) -> None:
    mission = tmp_path / "wide.bpmn"
    mission.write_text(wide(12), encoding="utf-8")
    status, out, _ = invoke("verify", mission, "--max-states", "1500")
    assert status == 3
    assert "undecided  no-deadlock" in out
    assert "then the limit of states ended the search" in out


def test_ctrl_c_ends_the_search_and_what_was_seen_is_told(
    invoke: Invoke, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def pressed(searched: Progress) -> None:
        if searched.states > 1_000:
            raise KeyboardInterrupt

    monkeypatch.setattr("m2pem.cli.verify.progress", lambda: nullcontext(pressed))
    mission = tmp_path / "wide.bpmn"
    mission.write_text(wide(12), encoding="utf-8")
    status, out, _ = invoke("verify", mission)
    assert status == 3
    assert "then an interruption by hand ended the search" in out


def test_a_mission_with_errors_is_unusable(invoke: Invoke) -> None:
    mission = REPOSITORY / "missions" / "mehds_vignette_1.bpmn"
    status, _, err = invoke("verify", mission, "--fleet", FLEET)
    assert status == 2
    assert "`m2pem check` finds errors" in err


def test_an_unknown_process_is_unusable(invoke: Invoke) -> None:
    status, _, err = invoke("verify", MISSION, "--process", "NOPE")
    assert status == 2
    assert "NOPE" in err


def test_a_report_of_an_unknown_kind_is_refused_before_anything_is_done(invoke: Invoke) -> None:
    status, _, err = invoke("verify", MISSION, "--report", "report.pdf")
    assert status == 2
    assert ".md, .json, .sarif, .svg" in err


def test_json_on_standard_output_is_the_report(invoke: Invoke) -> None:
    status, out, _ = invoke("verify", BROKEN / "dead_task.bpmn", "--format", "json")
    assert status == 1
    assert json.loads(out)["verdict"] == "violated"


def test_a_markdown_report_has_a_picture_beside_it_for_each_violation(
    invoke: Invoke, tmp_path: Path
) -> None:
    invoke("verify", BROKEN / "unanswered_decision.bpmn", "--report", tmp_path / "found.md")
    text = (tmp_path / "found.md").read_text(encoding="utf-8")
    assert "![decisions-handled](found-" in text
    assert (tmp_path / "found-1.svg").read_text(encoding="utf-8").startswith("<svg")
    assert "3. WHAT TO DO? (AskOperator): the operator answers 'nothing'" in text


def test_names_cannot_steer_a_terminal_or_a_page(invoke: Invoke, tmp_path: Path) -> None:
    source = (BROKEN / "dead_task.bpmn").read_text(encoding="utf-8")
    nasty = source.replace('name="SURVEY FIELD"', 'name="&lt;b&gt;*x*&#x85;[y](z)"')
    file = tmp_path / "nasty.bpmn"
    file.write_text(nasty, encoding="utf-8")
    _, out, _ = invoke("verify", file, "--report", tmp_path / "nasty.md")
    assert "\x85" not in out
    text = (tmp_path / "nasty.md").read_text(encoding="utf-8")
    assert "<b>" not in text
    assert "&lt;b&gt;\\*x\\*" in text


def test_a_report_that_cannot_be_written_is_told(invoke: Invoke, tmp_path: Path) -> None:
    status, _, err = invoke("verify", MISSION, "--report", tmp_path / "none" / "x.json")
    assert status == 2
    assert "cannot be written" in err


@pytest.fixture
def report(invoke: Invoke, tmp_path: Path) -> Path:
    file = tmp_path / "report.json"
    mission = tmp_path / "mission.bpmn"
    shutil.copy(BROKEN / "join_fed_by_one_branch.bpmn", mission)
    invoke("verify", mission, "--report", file)
    return file


def test_a_counterexample_is_played_as_records(invoke: Invoke, report: Path) -> None:
    status, out, _ = invoke("replay", "--counterexample", report, "--format", "json")
    assert status == 0
    records = [json.loads(line) for line in out.splitlines()]
    assert records[-1]["record"] == "RunEnded"
    assert records[-1]["outcome"] == "failed"
    assert "JoinDetection" in records[-1]["detail"]


def test_a_counterexample_of_a_mission_that_was_changed_is_refused(
    invoke: Invoke, report: Path
) -> None:
    mission = report.with_name("mission.bpmn")
    mission.write_bytes(mission.read_bytes() + b"\n")
    status, _, err = invoke("replay", "--counterexample", report)
    assert status == 2
    assert "verify it again" in err


def test_a_run_that_the_engine_does_not_follow_ends_with_1(invoke: Invoke, report: Path) -> None:
    told = json.loads(report.read_bytes())
    steps = told["violations"][0]["steps"]
    answer = next(step for step in steps if step["trigger"] == "answer")
    answer["detail"] = "abort"
    report.write_text(json.dumps(told), encoding="utf-8")
    status, _, err = invoke("replay", "--counterexample", report)
    assert status == 1
    assert "the engine does not follow" in err


def test_a_run_in_which_all_pools_begin_is_played(invoke: Invoke, tmp_path: Path) -> None:
    file, report = tmp_path / "pools.bpmn", tmp_path / "pools.json"
    file.write_bytes(mission_of_pools(STUCK).source)
    assert invoke("verify", file, "--all-pools", "--report", report)[0] == 1
    assert json.loads(report.read_bytes())["together"] == ["B"]
    status, out, _ = invoke("replay", "--counterexample", report)
    assert status == 0
    assert "tokens are at reply" in out


@pytest.mark.parametrize(("text", "why"), [("[]", "no report"), ("{", "no JSON")])
def test_a_file_that_is_no_report_is_refused(
    invoke: Invoke, tmp_path: Path, text: str, why: str
) -> None:
    file = tmp_path / "x.json"
    file.write_text(text, encoding="utf-8")
    status, _, err = invoke("replay", "--counterexample", file)
    assert status == 2
    assert why in err


def test_a_report_and_a_run_do_not_go_together(invoke: Invoke, report: Path) -> None:
    assert invoke("replay", "r1", "--counterexample", report)[0] == 2
    assert invoke("replay")[0] == 2


def test_starting_it_loads_no_more_than_it_needs(m2pem: CommandLine) -> None:
    status, out, _ = m2pem.run("verify", "--help")
    assert status == 0
    assert "Ctrl-C" in out


def test_timers_may_be_taken_to_come_in_the_order_of_their_times(
    invoke: Invoke, tmp_path: Path
) -> None:
    mission = tmp_path / "late.bpmn"
    mission.write_text(xml(WARNED_FIRST), encoding="utf-8")
    assert invoke("verify", mission)[0] == 4
    status, out, _ = invoke("verify", mission, "--timers", "in-order")
    assert status == 0
    assert "note: timers that begin to run together come in the order of their times" in out
    assert invoke("verify", mission, "--timers", "in-order", "--engine", "spin")[0] == 0


def test_a_round_that_is_fair_is_told_in_every_kind_of_report(
    invoke: Invoke, tmp_path: Path
) -> None:
    mission = tmp_path / "agree.bpmn"
    mission.write_text(xml(AGREE), encoding="utf-8")
    files = [tmp_path / f"agree.{kind}" for kind in ("md", "json", "svg")]
    status, out, _ = invoke("verify", mission, *(f"--report={file}" for file in files))
    assert status == 1
    assert "holds      can-complete" in out
    assert "violated   completes-if-fair" in out
    assert "and then, again and again:" in out
    markdown, data, picture = (file.read_text(encoding="utf-8") for file in files)
    assert "And then, again and again:" in markdown
    (violation,) = json.loads(data)["violations"]
    assert violation["property"] == "completes-if-fair"
    begins = violation["loop"][0]["step"]
    assert {step["element"] for step in violation["loop"]} >= {"first", "second", "x"}
    assert re.search(rf">\s*(\d+, )*{begins}\b", picture)
    assert invoke("replay", "--counterexample", files[1])[0] == 0
