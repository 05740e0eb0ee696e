"""`m2pem campaign`."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from m2pem.campaign.variations_file import variations_schema
from tests.campaign.conftest import TWO, sequence
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
