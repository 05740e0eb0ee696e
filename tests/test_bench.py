"""A wrong result of an engine is seen, and said; `make bench-quick` runs the programs."""

import json
import sys
from typing import Any

import pytest

from bench.engines import Engine, FailedError, Figure, ask, check, graph, own, play, play_once
from bench.plots import plot
from bench.readme import BEGIN, END, rewritten
from bench.table import table, wrongs
from bench.targets import PROGRAMS, WORK, Goal

RIGHT = {"ended": "completed", "data": {"n": 100}, "tasks": 100}
FAST = Figure({"cpu_s": 0.001, "wall_s": 0.002, "peak_kb": 20_000}, 5)
SLOW = Figure({"cpu_s": 0.012, "peak_kb": 60_000}, 3)
FAILED = Figure(wrong="wrong: completed with n = 99 after 99 tasks")


def refusal(answer: dict[str, Any]) -> str:
    """What is wrong with an answer to 100 tasks in a row; empty if it is right."""
    try:
        check(answer, graph("row", 100))
    except FailedError as error:
        return str(error)
    return ""


def test_a_right_result_is_right() -> None:
    assert refusal({"instances": 1, "outcomes": [RIGHT]}) == ""


@pytest.mark.parametrize(
    "answer",
    [
        {"instances": 1, "outcomes": [{**RIGHT, "ended": "running"}]},
        {"instances": 1, "outcomes": [{**RIGHT, "data": {"n": 99}}]},
        {"instances": 1, "outcomes": [{**RIGHT, "tasks": 99}]},
        {"instances": 1, "outcomes": [RIGHT, {**RIGHT, "tasks": 101}]},
        {"instances": 0, "outcomes": []},
    ],
)
def test_a_wrong_result_is_a_failure(answer: dict[str, Any]) -> None:
    assert "wrong" in refusal(answer)


def test_a_hang_is_a_failure() -> None:
    with pytest.raises(FailedError, match=r"no answer in 0\.1 s"):
        ask([sys.executable, "-c", "import signal; signal.pause()"], [""], 0.1)


def test_a_crash_is_a_failure_in_its_own_words() -> None:
    crashing = Engine("peer", (sys.executable, "-c", "raise RecursionError('too deep')"))
    figure = play(crashing, "row", 100, 1)
    assert figure == Figure(wrong="RecursionError: too deep (exit status 1)")


def test_engines_play_all_graphs_in_one_process() -> None:
    smallest = [(work.name, work.sizes[0]) for work in WORK]
    assert play_once([own(), own("memory")], smallest) == ""


def test_a_wrong_result_among_several_is_a_failure() -> None:
    answer = json.dumps({"instances": 1, "outcomes": [RIGHT]})
    peer = Engine("peer", (sys.executable, "-c", f"print({answer!r}); print({answer!r})"))
    assert play_once([peer], [("row", 100), ("row", 100)]) == ""
    assert play_once([peer], [("row", 100), ("row", 99)]).startswith("row, 99: wrong: completed")


def test_an_engine_that_leaves_a_graph_out_is_a_failure() -> None:
    peer = Engine("peer", (sys.executable, "-c", "print('{}')"))
    assert "without an answer" in play_once([peer], [("row", 100), ("loop", 100)])


def test_the_table_has_ratios_and_what_failed() -> None:
    results = {"row": {1_000: {"m2pem": FAST, "A": SLOW, "B": FAILED}}}
    drawn = table(results, {}, ["A", "B", "A, stock"])
    assert (
        "| tasks in a row | 1,000 tasks | 1,002,000 elements/s | at least 100,000 elements/s |"
        in (drawn)
    )
    assert "| yes | 12x time, 3x memory | **wrong** |" in drawn
    assert wrongs(results, {}) == f"- B, row, 1,000: {FAILED.wrong}\n"


def test_a_target_that_is_missed_is_said() -> None:
    idle = next(program for program in PROGRAMS if program.quick[0] == "idle")
    drawn = table({}, {idle.name: Figure({"percent": 0.2}, 3)}, [])
    assert "| 0.2 % | at most 0.1 % | **no** |" in drawn


def test_goals_are_bounds_from_below_or_above() -> None:
    assert Goal("", "", "", 5, at_least=True).met(5)
    assert not Goal("", "", "", 5, at_least=True).met(4.9)
    assert Goal("", "", "", 5).met(5)
    assert not Goal("", "", "", 5).met(5.1)
    assert Goal("", "", "").met(5) is None


def test_a_plot_has_a_point_for_each_right_result() -> None:
    sizes = {100: {"m2pem": FAST, "A": SLOW}, 1_000: {"m2pem": FAST, "A": FAILED}}
    drawing = plot(WORK[0], sizes, ["m2pem", "A"])
    legend = 1
    assert drawing.count('fill="#0b6e4f"') == legend + 2 * 2
    assert drawing.count('fill="#c1440e"') == legend + 2 * 1


def test_the_readme_keeps_all_but_the_figures() -> None:
    results = {work.name: {100: {"m2pem": FAST, "A": SLOW}} for work in WORK}
    results["row"][1_000] = {"m2pem": FAST, "A": FAILED}
    page = rewritten(f"before\n{BEGIN}\nold\n{END}\nafter", results, ["A"])
    assert page.startswith("before\n") and page.endswith("\nafter")
    assert "old" not in page
    assert "| tasks in a row | 12x (100 tasks); fails at 1,000 |" in page
