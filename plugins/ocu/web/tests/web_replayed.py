"""Runs that replays are tried with: rehearsed missions, and a loop that never waits."""

from functools import cache
from pathlib import Path

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
