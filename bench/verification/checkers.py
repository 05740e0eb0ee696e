"""m2pem's ways to search, and other checkers, if they are installed.

Each gets a model as JSON on standard input, in a process of its own.
"""

import json
import os
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from bench.engines import REPOSITORY, Engine, FailedError, Figure, ask, medians

WHOLE, REDUCED, SPIN = "m2pem", "m2pem, reduced", "m2pem, Spin"
OWN = (sys.executable, "-m", "bench.programs.verifying")
RUNS = 3
SHORT_S = 2.0
"""Of wall time: what takes longer is done once."""
MORE_S = 20.0
"""For what a program does beside its search, until it is given up."""


@dataclass(frozen=True, slots=True)
class Found(Figure):
    """Seconds by step, and states (medians); and the verdict."""

    verdict: str = ""


def own() -> list[Engine]:
    """m2pem's own ways; Spin's if it is installed."""
    found = [Engine(WHOLE, OWN, {"how": "whole"}), Engine(REDUCED, OWN, {"how": "reduced"})]
    if spin_is_here():
        found.append(Engine(SPIN, OWN, {"how": "spin"}))
    return found


def spin_is_here() -> bool:
    """Whether Spin and a compiler are installed."""
    return bool(shutil.which("spin") and any(map(shutil.which, ("tcc", "gcc", "clang"))))


def peers() -> list[Engine]:
    """The others, by what the environment says of where they are."""
    found = []
    rust = os.environ.get("M2PEM_RUST_BPMN_ANALYZER") or shutil.which("rust_bpmn_analyzer_cli")
    if rust:
        command = (sys.executable, _script("rust_bpmn_analyzer"), rust)
        found.append(Engine("rust_bpmn_analyzer", command))
        found.append(Engine("rust_bpmn_analyzer, reduced", (*command, "--por")))
    for name, variable in (("SNAKES", "M2PEM_SNAKES_PYTHON"), ("pm4py", "M2PEM_PM4PY_PYTHON")):
        python = os.environ.get(variable)
        if python:
            found.append(Engine(name, (python, _script(name.lower()))))
    return found


def _script(name: str) -> str:
    return str(REPOSITORY / "bench" / "peers" / f"check_{name}.py")


def look(
    engine: Engine, order: dict[str, Any], limit_s: float, *, expected: str = "", runs: int = RUNS
) -> Found:
    """Have a model checked. `expected`: the verdict, if it is known."""
    text = json.dumps({**order, **engine.order, "limit_s": limit_s})
    answers: list[dict[str, Any]] = []
    try:
        while len(answers) < runs and (not answers or answers[-1]["wall_s"] < SHORT_S):
            answers += ask(engine.command, [text], limit_s + MORE_S)
    except FailedError as error:
        return Found(wrong=_in_short(str(error), limit_s))
    return _found(answers, expected)


def look_once(
    orders: Sequence[dict[str, Any]], limit_s: float, expected: Sequence[str]
) -> list[Found]:
    """Have m2pem do each order in one process; no time is looked at. `expected`: as of `look`."""
    texts = [json.dumps({**order, "enough_s": 0.0, "limit_s": limit_s}) for order in orders]
    try:
        answers = ask(OWN, texts, limit_s + MORE_S)
    except FailedError as error:
        return [Found(wrong=_in_short(str(error), limit_s)) for _ in orders]
    return [_found([answer], said) for answer, said in zip(answers, expected, strict=True)]


def _found(answers: Sequence[dict[str, Any]], expected: str) -> Found:
    verdict = answers[0]["verdict"]
    if expected and verdict != expected:
        return Found(wrong=f"{verdict}, and should be: {expected}")
    names = [name for name, value in answers[0].items() if isinstance(value, (int, float))]
    return Found(medians(answers, names), len(answers), "", verdict)


def _in_short(words: str, limit_s: float) -> str:
    if "TimeoutExpired" in words or "timed out after" in words or words.startswith("no answer"):
        return f"no answer in {limit_s:g} s"
    return words
