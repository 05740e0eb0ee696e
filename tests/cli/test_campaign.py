"""`m2pem campaign`."""

import json
import shlex
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from m2pem.campaign.variations_file import variations_schema
from tests.campaign.conftest import HEAD, TWO, sequence, task
from tests.command_line import REPOSITORY


def m2pem(*words: object, exit_status: int = 0) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "m2pem", *map(str, words)],
        capture_output=True,
        text=True,
        timeout=250,
        check=False,
        cwd=REPOSITORY,
    )
    assert done.returncode == exit_status, done.stderr
    return done.stdout + done.stderr


@pytest.fixture
def mission(tmp_path: Path) -> Path:
    file = tmp_path / "two.bpmn"
    file.write_bytes(sequence("A", "B"))
    return file


def test_a_campaign_writes_its_folder_and_goes_on(mission: Path, tmp_path: Path) -> None:
    faults = tmp_path / "faults.yaml"
    faults.write_text(TWO, encoding="utf-8")
    out = tmp_path / "out"
    words = ["campaign", mission, "--fleet", "sim", "--faults", faults, "--out", out]
    words += ["--workers", 1, "--vary", "uav1.battery=70%..80%"]
    assert "20 runs of 20" in m2pem(*words, "--runs", 20)
    assert "--resume goes on" in m2pem(*words, "--runs", 40, exit_status=1)
    text = m2pem(*words, "--runs", 40, "--resume")
    assert "40 runs of 40" in text
    assert "failed | BLOCKED" in text
    assert (out / "report.md").read_text(encoding="utf-8").startswith("# Campaign of ")
    assert "another campaign" in m2pem(*words, "--resume", "--seed", 1, exit_status=1)
    worst = next((out / "worst").iterdir())
    m2pem("simulate", mission, "--fleet", "sim", "--answers", worst, exit_status=1)


def test_two_missions_are_compared_with_the_same_numbers(mission: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.bpmn"
    other.write_bytes(sequence("B", "A"))
    faults = tmp_path / "faults.yaml"
    faults.write_text(TWO, encoding="utf-8")
    words = ["campaign", mission, "--fleet", "sim", "--faults", faults, "--workers", 1]
    text = m2pem(*words, "--runs", 30, "--against", other)
    # The same tasks fail in both, in another order.
    assert "probability of failure | +0.0000 | +0.0000 to +0.0000" in text


def test_an_interrupt_keeps_what_is_done(mission: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = ["campaign", mission, "--fleet", "sim", "--out", out, "--runs", 1_000_000]
    with subprocess.Popen(
        [sys.executable, "-m", "m2pem", *map(str, words), "--workers", "2"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        while not list(out.glob("part-*.parquet")):
            assert process.poll() is None
        process.send_signal(signal.SIGINT)
        stdout, stderr = process.communicate(timeout=200)
    assert process.returncode == 130, stderr
    assert "runs of 1,000,000" in stdout
    assert "Traceback" not in stderr
    assert (out / "report.md").exists()


def test_the_schema_of_variations_files_is_printed_without_a_mission() -> None:
    assert json.loads(m2pem("campaign", "--schema")) == variations_schema()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--vary", "wind"], "LOW..HIGH"),
        (["--vary", "battery=5"], "LOW..HIGH"),
        (["--vary", "uav7.battery=5%..6%"], "no vehicle or payload 'uav7'"),
        (["--sprt", "0.2,0.1,0.05,0.05"], "0 < p0 < p1 < 1"),
        (["--resume"], "--out"),
    ],
)
def test_what_cannot_be_used_is_refused(mission: Path, words: list[str], message: str) -> None:
    assert message in m2pem("campaign", mission, "--fleet", "sim", *words, exit_status=2)


MISSION = f"""{HEAD}<signal id="Dusk" name="Dusk"/>
<process id="OTHER"><startEvent id="O"/></process>
<process id="P"><extensionElements>
  <m2pem:requirement id="soon" ltl="&lt;&gt;[0 s, 70 s] ended(completed)"/>
  <m2pem:requirement id="surveyed" ltl="&lt;&gt; completed(A)"/>
  <m2pem:requirement id="light" ltl="[] !completed(OnDusk)"/>
</extensionElements>
<startEvent id="S"/><userTask id="Ask"><extensionElements><m2pem:userTask store="user.decision">
  <m2pem:prompt>Go?</m2pem:prompt><m2pem:decision value="go"/><m2pem:decision value="stay"/>
</m2pem:userTask></extensionElements></userTask>
<exclusiveGateway id="Way" default="Way_E"/>{task("A")}
<boundaryEvent id="OnDusk" attachedToRef="A">
<signalEventDefinition signalRef="Dusk"/></boundaryEvent>
<endEvent id="Dark"/><sequenceFlow id="OnDusk_Dark" sourceRef="OnDusk" targetRef="Dark"/>
<callActivity id="Look" calledElement="LOOK"/>
<endEvent id="E"/>
<sequenceFlow id="S_Ask" sourceRef="S" targetRef="Ask"/>
<sequenceFlow id="Ask_Way" sourceRef="Ask" targetRef="Way"/>
<sequenceFlow id="Way_A" sourceRef="Way" targetRef="A"><conditionExpression
  >${{user.decision == 'go' and note == "it's 5 o'clock" and limits[1] == 2 and code == '5'}}
</conditionExpression></sequenceFlow>
<sequenceFlow id="Way_E" sourceRef="Way" targetRef="E"/>
<sequenceFlow id="A_Look" sourceRef="A" targetRef="Look"/>
<sequenceFlow id="Look_E" sourceRef="Look" targetRef="E"/></process></definitions>"""

CALLED = f"""{HEAD}<process id="LOOK"><startEvent id="LS"/>
<serviceTask id="Inspect"><extensionElements><m2pem:service class="Inspector"/></extensionElements>
</serviceTask>{task("B")}<endEvent id="LE"/>
<sequenceFlow id="LS_Inspect" sourceRef="LS" targetRef="Inspect"/>
<sequenceFlow id="Inspect_B" sourceRef="Inspect" targetRef="B"/>
<sequenceFlow id="B_LE" sourceRef="B" targetRef="LE"/></process></definitions>"""

FLEET = """\
version: 1
name: "two fields"
origin: {lat: 38.1, lon: -77.3, alt: 60.0}
vehicles:
  uav1: {domain: air, arbiter: sim}
"""

VARIED = """\
answers: {Ask: {go: 9, stay: 1}}
answer_times: {Ask: 0..20 s}
behaviors:
  A: {fails: {probability: 0.2, after: 1..5 s, error: BLOCKED}, duration: 10..30 s}
services:
  Inspector: {after: {exponential: 10 s}, fails: {probability: 0.1, error: BROKEN}}
signals: [{id: Dusk, at: 0..60 s, probability: 0.3}]
links: [{vehicle: uav1, at: 0..30 s, for: 2 s, probability: 0.3}]
vehicles: {uav1: {battery: 1 %..100 %}}
wind: {speed: 0..8 m/s}
"""


def replayed(command: str, folder: Path) -> list[dict[str, Any]]:
    """The records of a command of the report, as a shell runs it."""
    shell = f'm2pem() {{ {shlex.quote(sys.executable)} -m m2pem "$@"; }}; {command} --format json'
    done = subprocess.run(
        ["bash", "-c", shell], capture_output=True, text=True, timeout=100, check=False, cwd=folder
    )
    assert done.returncode in (0, 1), done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def test_the_commands_of_the_report_replay_the_worst_runs(tmp_path: Path) -> None:
    for name, text in {
        "my missions/field.bpmn": MISSION,
        "called/look.bpmn": CALLED,
        "fleet.yaml": FLEET,
        "faults.yaml": VARIED,
    }.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    words = ["my missions/field.bpmn", "--fleet", "fleet.yaml", "--path", "called"]
    words += ["--process", "P", "--data", "note=it's 5 o'clock", "--data", "limits=[1, 2]"]
    words += ["--data", 'code="5"']
    words += ["--faults", "faults.yaml", "--require", "soon", "--runs", "60", "--workers", "1"]
    done = subprocess.run(
        [sys.executable, "-m", "m2pem", "campaign", *words, "--out", "my campaign"],
        capture_output=True,
        text=True,
        timeout=250,
        check=False,
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    out = tmp_path / "my campaign"
    rows = {row["run"]: row for row in pq.read_table(out / "runs.parquet").to_pylist()}
    assert {row["outcome"] for row in rows.values()} == {"completed", "failed"}
    assert {row["end"] for row in rows.values()} >= {"E", "Dark", "BLOCKED", "BROKEN"}
    report = (out / "report.md").read_text(encoding="utf-8")
    commands = [line.strip() for line in report.splitlines() if "m2pem simulate" in line]
    assert len(commands) == 5
    for command in commands:
        answers = Path(shlex.split(command)[shlex.split(command).index("--answers") + 1])
        row = rows[int(answers.stem.removeprefix("run-"))]
        assert f"# {command}" in (tmp_path / answers).read_text(encoding="utf-8").splitlines()
        records = replayed(command, tmp_path)
        assert records[-1]["record"] in ("RunEnded", "RequirementDecided")
        ended = next(each for each in records if each["record"] == "RunEnded")
        assert (ended["outcome"], ended["t"]) == (row["outcome"], row["took_s"])
        assert row["end"] in ended["detail"] or row["end"] in {
            each.get("element") for each in records
        }
        verdicts = dict.fromkeys(("soon", "surveyed", "light"), "open")
        verdicts |= {
            each["requirement"]: each["verdict"]
            for each in records
            if each["record"] == "RequirementDecided"
        }
        assert verdicts == {name: row[f"requirement.{name}"] for name in verdicts}
