"""`python -m bench --only` measures a part again, and keeps the rest."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from bench import __main__ as bench
from bench.engines import Engine, Figure
from bench.figures import Figures
from bench.targets import PROGRAMS

HERE = {"processor": "P", "Python": "3.11.7", "m2pem": "0.1.0", "load before": "0.5"}
OLD = Figure({"cpu_s": 0.002, "wall_s": 0.002, "peak_kb": 20_000}, 5)
NEW = Figure({"cpu_s": 0.001, "wall_s": 0.001, "peak_kb": 20_000}, 5)
PEER = Engine("bpmn-elements", ("node",))


@pytest.fixture(autouse=True)
def measured(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What is measured, by name; it always takes as long as `NEW` says."""
    asked: list[str] = []

    def play(engine: Engine, work: str, size: int, *_: int, **__: float) -> Figure:
        asked.append(f"{engine.name} {work} {size}")
        return NEW

    def play_once(engines: Sequence[Engine], works: Sequence[tuple[str, int]]) -> str:
        asked.extend(f"{engine.name} {work} {size}" for engine in engines for work, size in works)
        return ""

    def measure(command: tuple[str, ...], _: int, __: str) -> Figure:
        asked.append(" ".join(command))
        return NEW

    monkeypatch.setattr(bench, "play", play)
    monkeypatch.setattr(bench, "play_once", play_once)
    monkeypatch.setattr(bench, "measure", measure)
    monkeypatch.setattr(bench, "machine", lambda *_: HERE)
    monkeypatch.setattr(bench, "peers", lambda *_: [PEER])
    monkeypatch.setattr(bench, "ros_python", lambda **_: "python-with-ros")
    monkeypatch.setattr(bench, "measure_verification", lambda *_: 0)
    return asked


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """A folder with the results of a whole measurement."""
    engines = {"m2pem": OLD, "bpmn-elements": OLD, "SpiffWorkflow": OLD}
    graphs = {work: {100: engines, 1_000: engines} for work in ("row", "loop")}
    programs = {program.name: OLD for program in PROGRAMS}
    machine = {**HERE, "m2pem": "0.0.9", "load before": "1.5", "SpiffWorkflow": "3.2.0"}
    Figures(machine, graphs, programs).save(tmp_path / "figures.json")
    return tmp_path


def figures(results: Path) -> Any:
    return json.loads((results / "figures.json").read_text(encoding="utf-8"))


def cpu_s(engines: dict[str, Any]) -> dict[str, float]:
    return {name: figure["values"]["cpu_s"] for name, figure in engines.items()}


def test_what_is_named_is_measured_and_the_rest_is_kept(results: Path, measured: list[str]) -> None:
    words = ["--only", "row,answering", "--up-to", "100", "--results", str(results)]
    assert bench.main(words) == 0
    assert measured == [
        "m2pem row 100",
        "bpmn-elements row 100",
        "answering 100 100",
        "answering 1 500",
    ]
    now = figures(results)
    # SpiffWorkflow is not installed here: its figure is all there is of it.
    assert cpu_s(now["graphs"]["row"]["100"]) == {
        "SpiffWorkflow": 0.002,
        "m2pem": 0.001,
        "bpmn-elements": 0.001,
    }
    old = {"m2pem": 0.002, "bpmn-elements": 0.002, "SpiffWorkflow": 0.002}
    assert cpu_s(now["graphs"]["row"]["1000"]) == old
    assert cpu_s(now["graphs"]["loop"]["100"]) == old
    again = {name for name, took in cpu_s(now["programs"]).items() if took == 0.001}
    assert again == {"answering 100 100", "answering 1 500"}
    page = (results / "table.md").read_text(encoding="utf-8")
    assert "| bpmn-elements | SpiffWorkflow |" in page


def test_what_was_measured_again_and_under_which_load_is_said(results: Path) -> None:
    bench.main(["--only", "idle", "--results", str(results)])
    bench.main(["--only", "answering", "--results", str(results)])
    assert figures(results)["machine"] == {
        **HERE,
        "load before": "1.5",
        "SpiffWorkflow": "3.2.0",
        "measured again": "answering and idle",
    }
    bench.main(["--up-to", "100", "--results", str(results)])
    assert figures(results)["machine"] == HERE


def test_a_figure_that_was_not_taken_yet_is_no_failure(results: Path) -> None:
    bench.main(["--only", "idle", "--results", str(results)])
    page = (results / "table.md").read_text(encoding="utf-8")
    assert "failed" not in page


def test_without_older_figures_there_are_the_new_ones(tmp_path: Path) -> None:
    assert bench.main(["--only", "idle", "--results", str(tmp_path / "new")]) == 0
    (name,) = figures(tmp_path / "new")["programs"]
    assert name.startswith("idle")


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (('"P"', '"Q"'), "was measured with processor Q, and this is P: measure everything"),
        (('"machine"', '"engine"'), "cannot be read (KeyError('machine')): measure everything"),
        (("{", ""), "cannot be read (JSONDecodeError"),
    ],
)
def test_figures_that_do_not_go_together_are_refused(
    results: Path,
    measured: list[str],
    damage: tuple[str, str],
    words: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    file = results / "figures.json"
    file.write_text(file.read_text(encoding="utf-8").replace(*damage), encoding="utf-8")
    before = file.read_bytes()
    with pytest.raises(SystemExit):
        bench.main(["--only", "row", "--results", str(results)])
    assert words in capsys.readouterr().err
    assert (file.read_bytes(), measured) == (before, [])


def test_a_name_that_nothing_has_is_refused_with_those_that_there_are(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit):
        bench.main(["--only", "row,answers"])
    assert "there is no 'answers'; known: row, loop, branches" in capsys.readouterr().err


def test_a_quick_look_does_nothing_twice(measured: list[str]) -> None:
    assert bench.main(["--quick", "--only", "reading,row"]) == 0
    assert sorted(measured) == ["bpmn-elements row 100", *["m2pem row 100"] * 3, "reading 200"]


def test_programs_that_need_ros_are_run_by_a_python_that_has_it(
    results: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pythons: dict[str, str] = {}

    def measure(command: tuple[str, ...], _: int, python: str) -> Figure:
        pythons[command[0]] = python
        return NEW

    monkeypatch.setattr(bench, "measure", measure)
    bench.main(["--only", "idle,ros_fleet", "--results", str(results)])
    assert pythons == {"idle": sys.executable, "ros_fleet": "python-with-ros"}


@pytest.mark.parametrize("words", [["--quick"], ["--results", "."]])
def test_without_ros_its_programs_are_left_out_and_that_is_said(
    words: list[str],
    results: Path,
    measured: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(results)
    monkeypatch.setattr(bench, "ros_python", lambda **_: "")
    assert bench.main(["--only", "idle,ros_fleet", *words]) == 0
    assert [each.split()[0] for each in measured] == ["idle"]
    assert "ROS is not installed here" in capsys.readouterr().out
