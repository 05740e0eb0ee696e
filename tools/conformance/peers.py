"""The other engines: where they are, which version, and how one plays a case."""

import json
import re
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from tests.cases import Case
from tools.conformance.rewrite import (
    for_bpmn_elements,
    for_spiffworkflow,
    main_process,
    startable_processes,
)

REPOSITORY = Path(__file__).parents[2]
TIMEOUT_S = 20
_WORDS = 120  # characters of a problem that are kept
_MANY = 2000  # elements entered in a step: more is no result, but a loop without end

VERBS = ("start", "answer", "signal", "message", "advance")
"""The inputs that every engine can be given."""


@dataclass(frozen=True, slots=True)
class Played:
    """What an engine did. `steps`: the elements entered because of each input, in order.

    `ended`: completed, failed, running, hangs or crashes. `data` is None where the engine has no
    data of its own. `refused`: it would not take the model. `problem`: its words.
    """

    steps: tuple[tuple[str, ...], ...] = ()
    ended: str = "running"
    data: dict[str, Any] | None = field(default_factory=dict)
    problem: str = ""
    refused: bool = False


@dataclass(frozen=True, slots=True)
class Peer:
    """An engine that plays a case in a process of its own."""

    name: str
    version: str
    command: tuple[str, ...]
    rewrite: Callable[[Path, str], str]

    def play(self, case: Case) -> Played:
        main = main_process(case.file, case.process)
        order = {
            "xml": self.rewrite(case.file, main),
            "main": main,
            "startable": startable_processes(case.file, main),
            "given": case.given,
            "steps": [asdict(step.when) for step in case.steps],
        }
        try:
            done = subprocess.run(
                self.command,
                input=json.dumps(order),
                capture_output=True,
                text=True,
                check=False,
                timeout=TIMEOUT_S,
            )
        except subprocess.TimeoutExpired:
            return Played(ended="hangs", problem=f"no answer in {TIMEOUT_S} s")
        lines = done.stdout.strip().splitlines()
        if done.returncode or not lines:
            words = (done.stderr.strip().splitlines() or ["no word"])[-1]
            return Played(ended="crashes", problem=f"exit status {done.returncode}: {words}")
        return _read(json.loads(lines[-1]))


def _read(answer: dict[str, Any]) -> Played:
    steps = tuple(tuple(step) for step in answer["steps"])
    if any(len(step) > _MANY for step in steps):
        return Played(ended="hangs", problem="a loop without end")
    problem = _short(answer["problem"])
    return Played(steps, answer["ended"], answer["data"], problem, answer["refused"])


def _short(problem: str) -> str:
    """The engine's words without addresses and quoted XML, which differ from run to run."""
    words = re.sub(r" at 0x[0-9a-f]+|,? ?b'<.*", "", " ".join(problem.split())).rstrip(". ")
    return words if len(words) <= _WORDS else f"{words[:_WORDS]}..."


def spiffworkflow(python: Path) -> Peer:
    """SpiffWorkflow, installed for that interpreter."""
    script = REPOSITORY / "tools" / "conformance" / "play_spiffworkflow.py"
    ask = "from importlib.metadata import version; print(version('SpiffWorkflow'))"
    found = subprocess.run([python, "-c", ask], capture_output=True, text=True, check=True)
    return Peer(
        "SpiffWorkflow", found.stdout.strip(), (str(python), str(script)), for_spiffworkflow
    )


def bpmn_elements(modules: Path) -> Peer:
    """bpmn-elements, from that node_modules."""
    package = json.loads((modules / "bpmn-elements" / "package.json").read_text(encoding="utf-8"))
    node = shutil.which("node")
    assert node is not None, "bpmn-elements needs Node.js"
    script = REPOSITORY / "tests" / "js" / "play_bpmn_elements.mjs"
    return Peer("bpmn-elements", package["version"], (node, str(script)), for_bpmn_elements)
