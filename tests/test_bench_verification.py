"""The bench of verification: its models, its programs, and what is shown of them."""

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from bench.engines import REPOSITORY, Engine
from bench.verification import checkers, measuring, models, page
from bench.verification.checkers import Found, look
from bench.verification.measuring import Verified
from bench.verification.works import CASES, OVERLAP, SHAPES, Case, subjects
from m2pem.executive.loading import load_source
from m2pem.fleet.default_fleet import fleet_for
from m2pem.verify.check import check
from m2pem.verify.properties.results import Verdict

PEER = REPOSITORY / "bench" / "peers" / "check_rust_bpmn_analyzer.py"


def found(search_s: float, states: int = 10, verdict: str = "holds", wrong: str = "") -> Found:
    if wrong:
        return Found(wrong=wrong)
    values = {"search_s": search_s, "all_s": 2 * search_s, "derive_s": 0.0, "wall_s": 3.0}
    return Found({**values, "states": states}, 1, "", verdict)


@pytest.mark.parametrize("shape", SHAPES)
def test_branches_of_every_shape_hold(shape: str) -> None:
    mission = load_source(models.branches(3, 2, shape).encode())
    report = check(mission, fleet_for(mission))
    assert report.verdict is Verdict.HOLDS
    assert report.found.complete


@pytest.mark.parametrize(("count", "tasks"), [(3, 2), (2, 4)])
def test_branches_have_the_states_that_are_published_of_such_models(count: int, tasks: int) -> None:
    mission = load_source(models.branches(count, tasks).encode())
    assert check(mission).states == (tasks + 1) ** count + 3


def test_every_mission_of_the_repository_is_measured_on_files_that_are_there() -> None:
    files = [Path(REPOSITORY, each.file) for each in subjects()]
    kinds = ("missions/*.bpmn", "examples/*/mission.bpmn", "docs/broken/*.bpmn")
    assert sorted(files) == sorted(file for kind in kinds for file in REPOSITORY.glob(kind))
    assert all(Path(REPOSITORY, each.fleet).exists() for each in subjects() if each.fleet)
    assert sum(each.bound_s is not None for each in subjects()) == 1


def test_a_target_stands_beside_each_number_of_branches_that_has_one() -> None:
    bounds = {(each.how, each.count): each.goal.bound for each in CASES}
    assert bounds["whole", 10] == 10
    assert bounds["reduced", 100] == 0.05
    assert bounds["reduced", 1_000] == 5
    assert {each.shape for each in CASES} == SHAPES.keys()
    assert (17, 1) in OVERLAP


@pytest.mark.parametrize("how", ["whole", "reduced"])
def test_the_program_tells_states_times_and_the_verdict(how: str) -> None:
    engine = Engine("m2pem", checkers.OWN, {"how": how})
    seen = look(engine, {"xml": models.branches(3, 3), "enough_s": 0.0}, 60.0, runs=1)
    assert (seen.verdict, seen.wrong) == ("holds", "")
    assert seen.values["states"] == {"whole": 67, "reduced": 13}[how]
    assert seen.values.keys() >= {"read_s", "derive_s", "search_s", "all_s", "wall_s", "peak_kb"}


def test_a_requirement_is_asked_of_branches() -> None:
    case = Case(2, "reduced", requirement="<> completed(t0_0)")
    assert measuring.search(case).verdict == "holds"
    never = Case(2, "reduced", requirement="[] !completed(t0_0)")
    assert measuring.search(never).wrong == "violated, and should be: holds"


def test_a_broken_mission_is_told_as_m2pem_verify_does(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measuring, "spin_is_here", lambda: False)
    subject = next(each for each in subjects() if each.file.endswith("dead_task.bpmn"))
    (seen,) = measuring.verify(subject).values()
    assert seen.verdict == "violated: no-dead-element; warning: failures-handled"


def test_a_search_that_is_cut_short_is_no_verdict() -> None:
    engine = Engine("m2pem", checkers.OWN, {"how": "whole"})
    seen = look(engine, {"xml": models.branches(9, 3)}, 0.001, expected="holds", runs=1)
    assert seen.wrong == "undecided: the limit of time, and should be: holds"


def said(text: str, tmp_path: Path) -> Found:
    """What is made of a peer that prints this."""
    program = tmp_path / "peer"
    program.write_text(f"#!{sys.executable}\nprint({text!r})\n", encoding="utf-8")
    program.chmod(0o755)
    command = (sys.executable, str(PEER), str(program))
    return look(Engine("peer", command), {"xml": models.branches(2, 1)}, 60.0, runs=1)


def test_what_a_peer_prints_is_read(tmp_path: Path) -> None:
    text = (
        "State space generation \x1b[1;32msuccessful\x1b[0m in 1.5µs!\nStates: 7, Transitions: 6\n"
        "\n\x1b[1;34mSafeness\x1b[0m is {}fulfilled."
    )
    seen = said(text.format(""), tmp_path)
    assert (seen.values["states"], seen.values["search_s"]) == (7, 1.5e-6)
    assert seen.verdict == "holds"
    assert said(text.format("not "), tmp_path).verdict == "violated"


def test_a_peer_that_prints_something_else_is_not_believed(tmp_path: Path) -> None:
    assert "something else than expected" in said("all is well", tmp_path).wrong


def test_peers_are_those_that_the_environment_names(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("RUST_BPMN_ANALYZER", "SNAKES_PYTHON", "PM4PY_PYTHON"):
        monkeypatch.delenv(f"M2PEM_{name}", raising=False)
    monkeypatch.setenv("PATH", "")
    assert checkers.peers() == []
    monkeypatch.setenv("M2PEM_PM4PY_PYTHON", "/there/python")
    (peer,) = checkers.peers()
    assert peer.command == ("/there/python", str(PEER.with_name("check_pm4py.py")))


def test_a_checker_that_gives_up_is_not_asked_for_more(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[str, int]] = []

    def answer(engine: Engine, order: dict[str, Any], *_: float, **__: str) -> Found:
        count = order["xml"].count("userTask id=") // 3
        asked.append((engine.name, count))
        return found(0.1, wrong="no answer in 60 s" if engine.name == "A" and count > 1 else "")

    monkeypatch.setattr(measuring, "look", answer)
    monkeypatch.setattr(measuring, "SIZES", (1, 2, 4))
    sizes = list(measuring.growing([Engine("A", ()), Engine("B", ())]))
    assert asked == [("A", 1), ("B", 1), ("A", 2), ("B", 2), ("B", 4)]
    assert [sorted(by_name) for _, by_name in sizes] == [["A", "B"], ["A", "B"], ["B"]]


def verified() -> Verified:
    mission = "missions/vignette1.bpmn"
    return Verified(
        {"processor": "P"},
        {mission: {"builtin": found(0.03), "spin": found(0.2)}},
        {Case(100, "reduced").name: found(0.06), Case(10, "whole").name: found(0.0, wrong="late")},
        {1: {"m2pem": found(0.001), "A": found(0.002)}, 10: {"m2pem": found(0.01)}},
        {"17x1": {"m2pem": found(0.5, 131_075), "A": found(0.0, wrong="no answer in 60 s")}},
    )


def test_the_page_says_which_targets_are_met(tmp_path: Path) -> None:
    text = page.write(tmp_path, verified())
    assert "| 100 branches, reduced | 10 | 0.06 | at most 0.05 | **no** | 0.12 | 3 |" in text
    assert "| 10 branches, nothing left out |  | late | at most 10 | **no** |  |  |" in text
    assert "| 17x1 | 131,075, 500 ms | no answer in 60 s | 790; reduced 1.3 |" in text
    assert "| missions/vignette1.bpmn | 10 | 0 | 30 | 60 | at most 100 | yes | holds |" in text
    assert "| 10 | 200 | 400 | the same |" in text
    assert "- 10 branches, nothing left out: late\n" in text
    drawing = (tmp_path / "branches.svg").read_text(encoding="utf-8")
    legend, panels = 1, 2
    assert drawing.count('fill="#0b6e4f"') == legend + panels * 2
    assert drawing.count('fill="#c1440e"') == legend + panels * 1
    kept = json.loads((tmp_path / "figures.json").read_text(encoding="utf-8"))
    assert kept["overlap"]["17x1"]["m2pem"]["values"]["states"] == 131_075


def test_engines_that_differ_are_a_failure() -> None:
    differing = verified()
    differing.missions["m"] = {"builtin": found(0.1), "spin": found(0.1, verdict="violated: a")}
    assert "m: the engines differ: holds / violated: a" in differing.wrongs()
