"""Running a program in a process of its own, and what it answered."""

import json
import shutil
import statistics
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from bench.graphs import GRAPHS, Graph

REPOSITORY = Path(__file__).parents[1]
PEER_LIMIT_S = 60
OWN_LIMIT_S = 900
LONG_S = 10
"""A program that takes longer is run once."""

M2PEM = "m2pem"


@dataclass(frozen=True, slots=True)
class Engine:
    """`command` plays a graph: an order on standard input, an answer on standard output."""

    name: str
    command: tuple[str, ...]
    order: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Figure:
    """What a program took: medians of `runs` processes, or what went wrong instead (`wrong`)."""

    values: dict[str, float] = field(default_factory=dict)
    runs: int = 0
    wrong: str = ""


class FailedError(Exception):
    """A program did not do its work: a crash, a hang, a wrong result."""


def own(journal: str = "none") -> Engine:
    """m2pem, with the journal that `play_m2pem` is to use."""
    command = (sys.executable, "-m", "bench.play_m2pem")
    return Engine(M2PEM, command, {"journal": journal})


def peers(python: Path, modules: Path) -> list[Engine]:
    """The other engines that are installed: SpiffWorkflow there, the others in `node_modules`."""
    found = []
    if python.exists():
        script = str(REPOSITORY / "bench" / "peers" / "play_spiffworkflow.py")
        found.append(Engine("SpiffWorkflow", (str(python), script)))
        found.append(Engine("SpiffWorkflow, stock", (str(python), script), {"stock": True}))
    node = shutil.which("node")
    script = str(REPOSITORY / "tests" / "js" / "bench_bpmn.mjs")
    for name in ("bpmn-elements", "bpmn-engine"):
        if node and (modules / name).is_dir():
            found.append(Engine(name, (node, script, name)))
    return found


@cache
def graph(work: str, size: int) -> Graph:
    """A graph by the name of its work."""
    return GRAPHS[work](size)


def play(engine: Engine, work: str, size: int, runs: int) -> Figure:
    """An engine on a graph."""
    limit_s = OWN_LIMIT_S if engine.name == M2PEM else PEER_LIMIT_S
    made = graph(work, size)
    text = _order(engine, made)
    answers = []
    try:
        for _ in range(runs):
            (answer,) = ask(engine.command, [text], limit_s)
            check(answer, made)
            answers.append(answer)
            if answer["cpu_s"] > LONG_S:
                break
    except FailedError as failure:
        return Figure(wrong=str(failure))
    return Figure(medians(answers, ("cpu_s", "wall_s", "parse_s", "peak_kb")), len(answers))


def play_once(engines: Sequence[Engine], works: Sequence[tuple[str, int]]) -> str:
    """Engines of the same command on graphs (work, size), all in one process; what went wrong.

    No time is looked at. "": all is right.
    """
    (command,) = {engine.command for engine in engines}
    jobs = [(engine, work) for engine in engines for work in works]
    orders = [_order(engine, graph(*work), enough_s=0.0) for engine, work in jobs]
    try:
        answers = ask(command, orders, OWN_LIMIT_S)
    except FailedError as failure:
        return str(failure)
    for (_, (work, size)), answer in zip(jobs, answers, strict=True):
        try:
            check(answer, graph(work, size))
        except FailedError as failure:
            return f"{work}, {size}: {failure}"
    return ""


def _order(engine: Engine, made: Graph, **more: float) -> str:
    order = {"xml": made.xml.decode(), "given": made.given, "instances": made.instances}
    return json.dumps({**order, **engine.order, **more})


def measure(command: Sequence[str], runs: int, python: str = sys.executable) -> Figure:
    """One of m2pem's own programs, by that Python."""
    answers = []
    try:
        for _ in range(runs):
            program = [python, "-m", f"bench.programs.{command[0]}", *command[1:]]
            answers += ask(program, [""], OWN_LIMIT_S)
    except FailedError as failure:
        return Figure(wrong=str(failure))
    return Figure(medians(answers, tuple(answers[0])), len(answers))


def medians(answers: Sequence[dict[str, Any]], names: Sequence[str]) -> dict[str, float]:
    """Of each figure."""
    return {
        name: statistics.median(answer[name] for answer in answers)
        for name in names
        if name in answers[0]
    }


def ask(command: Sequence[str], orders: Sequence[str], limit_s: float) -> list[dict[str, Any]]:
    """Run a program, which has one line for each order; its answers, in order.

    Raises:
        FailedError: it took too long, or crashed.
    """
    try:
        done = subprocess.run(
            command,
            input="".join(f"{order}\n" for order in orders),
            capture_output=True,
            text=True,
            check=False,
            timeout=limit_s,
            cwd=REPOSITORY,
        )
    except subprocess.TimeoutExpired:
        raise FailedError(f"no answer in {limit_s:g} s") from None
    lines = done.stdout.strip().splitlines()
    if done.returncode or len(lines) < len(orders):
        words = done.stderr.strip().splitlines() or ["it ended without an answer or a word"]
        said = next((line for line in reversed(words) if "Error" in line), words[-1])
        raise FailedError(f"{said.strip()[:160]} (exit status {done.returncode})")
    return [json.loads(line) for line in lines[-len(orders) :]]


def check(answer: dict[str, Any], made: Graph) -> None:
    """Whether every instance ended with the right data, and entered each task as often as it must.

    Raises:
        FailedError: with what was wrong.
    """
    right = {"ended": "completed", "data": made.expected, "tasks": made.tasks}
    if answer["instances"] != made.instances:
        raise FailedError(f"wrong: {answer['instances']} instances of {made.instances}")
    for outcome in answer["outcomes"]:
        if outcome != right:
            raise FailedError(f"wrong: {said(outcome)} instead of {said(right)}")


def said(outcome: dict[str, Any]) -> str:
    """An outcome in words."""
    data = ", ".join(f"{name} = {value}" for name, value in sorted(outcome["data"].items()))
    return f"{outcome['ended']} with {data} after {outcome['tasks']} tasks"
