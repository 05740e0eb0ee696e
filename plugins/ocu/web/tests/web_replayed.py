"""Runs that replays are tried with: rehearsed missions, and a loop that never waits.

Run as a program, it writes `FIXTURE`.
"""

import asyncio
import json
from functools import cache
from pathlib import Path
from typing import Any

import msgspec
from m2pem_plugin_web.replay.index import IndexBuilder, with_overview
from m2pem_plugin_web.replay.replay import Replay
from m2pem_plugin_web.replay.source import ListSource
from m2pem_plugin_web.rest.record_pages import new_view

import m2pem
from m2pem.api import MissionControl, SimulationResult

ROOT = Path(__file__).parents[4]
MISSIONS, FLEETS, EXAMPLES = ROOT / "missions", ROOT / "fleet_configs", ROOT / "examples"
ANSWERS = MISSIONS / "answers"
LOOPS, ERRORS = EXAMPLES / "t20_loops", EXAMPLES / "t09_escalation"

RUNS: dict[str, tuple[Path, Path | str, Path]] = {
    "detection": (
        MISSIONS / "vignette1.bpmn",
        FLEETS / "vignette1.yaml",
        ANSWERS / "vignette1_detection.yaml",
    ),
    "needs": (
        MISSIONS / "by_need" / "mehds_vignette_4.bpmn",
        FLEETS / "mehds.yaml",
        ANSWERS / "mehds_vignette_4_hazard.yaml",
    ),
    "loops": (LOOPS / "mission.bpmn", LOOPS / "fleet.yaml", LOOPS / "answers.yaml"),
    "errors": (ERRORS / "mission.bpmn", "sim", ERRORS / "answers_blocked.yaml"),
}


@cache
def rehearsed(name: str) -> SimulationResult:
    """Return one of `RUNS`, rehearsed once."""
    mission, fleet, answers = RUNS[name]
    return m2pem.rehearse(mission, fleet, answers=answers)


def looping(rounds: int) -> bytes:
    """A mission of two tasks that are passed so many times, in a few long inputs."""
    return f"""<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
  xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" targetNamespace="t" id="d">
  <process id="P" isExecutable="true">
    <startEvent id="Start"/><sequenceFlow id="f0" sourceRef="Start" targetRef="Around"/>
    <subProcess id="Around">
      <standardLoopCharacteristics loopMaximum="{rounds}"/>
      <startEvent id="Begin"/><sequenceFlow id="f1" sourceRef="Begin" targetRef="Work"/>
      <task id="Work"/><sequenceFlow id="f2" sourceRef="Work" targetRef="Done"/>
      <endEvent id="Done"/>
    </subProcess>
    <sequenceFlow id="f3" sourceRef="Around" targetRef="End"/><endEvent id="End"/>
  </process>
</definitions>""".encode()


async def run_of(control: MissionControl, mission: bytes) -> str:
    """Run a mission to its end, and return the run."""
    run = await control.start(mission, by="test")
    await control.wait(run)
    return run


FIXTURE = Path(__file__).parents[1] / "ui" / "src" / "records" / "replayed.json"
"""What the server sends of short runs in short pages: the page's own tests compare theirs to it."""

FIXTURE_PAGE = 7


async def fixture() -> str:
    """Return what `FIXTURE` has to be."""
    runs: dict[str, Any] = {}
    for name in ("detection", "errors"):
        result = rehearsed(name)
        view, builder = new_view(result.summary), IndexBuilder(result.summary.run, FIXTURE_PAGE)
        for stamped in result.records:
            view.apply(stamped)
            builder.add(view, stamped)
        index = with_overview(builder.index(view))
        source = ListSource(result.summary, result.records)
        replay = await Replay.open(source, index, lambda _: None)
        numbers = range(-(-index.seq // FIXTURE_PAGE))
        runs[name] = {
            "head": json.loads(msgspec.json.encode(replay.head())),
            "pages": [json.loads(await replay.page(number)) for number in numbers],
        }
    return _laid_out(runs) + "\n"


def _laid_out(value: Any, indent: str = "\n") -> str:
    """Write `value` as JSON: a line for each record, span and view."""
    if not _has_rows(value):
        return json.dumps(value, ensure_ascii=False)
    inner = indent + " "
    if isinstance(value, dict):
        parts = [f"{json.dumps(key)}: {_laid_out(part, inner)}" for key, part in value.items()]
        return "{" + inner + f",{inner}".join(parts) + indent + "}"
    return "[" + inner + f",{inner}".join(_laid_out(part, inner) for part in value) + indent + "]"


def _has_rows(value: Any) -> bool:
    """Tell whether `value` has lists of records or of spans in it."""
    if isinstance(value, dict):
        return "seq" not in value and any(_has_rows(part) for part in value.values())
    return isinstance(value, list) and any(isinstance(part, dict) for part in value)


if __name__ == "__main__":
    FIXTURE.write_text(asyncio.run(fixture()), encoding="utf-8")
