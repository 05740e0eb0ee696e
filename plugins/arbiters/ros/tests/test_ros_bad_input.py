"""What others say wrongly, too often or not at all concerns nobody but them."""

import json
import random
import signal
from pathlib import Path
from typing import Any

import pytest
from ros_e2e_programs import Program, Programs, Record
from ros_e2e_watch import Watch
from ros_e2e_world import convoy, fleet_file

from m2pem.testing import scenarios

CLIENT = Path(__file__).parents[3] / "ocu" / "mocu" / "tests" / "mocu_client_peer.py"
SPEED = 2.0
LENGTH_M = 100.0
DRIVEN_WITHIN_S = 90.0
"""Mission time. It takes 25 s; a computer that does much else may take longer, but not for ever."""

GOOD = {"good": {}}
BAD = {"liar": {}, "blind": {"driver": "base"}, "frozen": {"driver": "nav2"}}
WATCHED = (*GOOD, *BAD)
MOST_MB = 150
"""More memory than before; the 50 MB that are refused are there several times for a moment."""

LINES = 40
UNKNOWN = "8d9f0c55-0000-4000-8000-000000000001"


class Operator:
    """A client in a process of its own."""

    def __init__(self, program: Program) -> None:
        self._program = program
        self._calls = 0

    def send(self, service: str, **fields: Any) -> int:
        self._calls += 1
        order = {"id": self._calls, "namespace": "/m2pem", "service": service, "fields": fields}
        self._program.type(json.dumps(order))
        return self._calls

    def answer(self, number: int) -> Record:
        def come() -> list[Record]:
            return [each for each in self._program.records if each.get("id") == number]

        response: Record = self._program.until(come)[0]["response"]
        return response

    def call(self, service: str, **fields: Any) -> Record:
        return self.answer(self.send(service, **fields))

    def refused(self, service: str, **fields: Any) -> str:
        response = self.call(service, **fields)
        assert not response["success"]
        message: str = response["message"]
        return message


def memory_mb(program: Program) -> int:
    status = Path(f"/proc/{program.process.pid}/status").read_text(encoding="ascii")
    (line,) = [each for each in status.splitlines() if each.startswith("VmRSS:")]
    return int(line.split()[1]) // 1024


def course(records: list[Record], run: str) -> list[str]:
    """What happened in a run, without when, and without what was left of a route meanwhile."""
    return [
        " ".join(
            str(each[key]) for key in ("record", "element", "outcome", "state") if each.get(key)
        )
        for each in records
        if each["run"] == run and not each.get("remaining")
    ]


UNDISTURBED = """
RunStarted
ScopeOpened CONVOY
TokenEntered Start
TokenLeft Start completed
FlowTaken Start
TokenEntered Fork
TokenLeft Fork completed
FlowTaken Fork
TokenEntered Drive_good
BehaviorRequested Drive_good
BehaviorProgressed ACCEPTED
BehaviorProgressed RUNNING
BehaviorEnded Drive_good SUCCEEDED
TokenLeft Drive_good completed
FlowTaken Drive_good
TokenEntered Merge_good
TokenLeft Merge_good completed
FlowTaken Merge_good
TokenEntered Join
TokenLeft Join completed
FlowTaken Join
TokenEntered End
TokenLeft End completed
ScopeClosed CONVOY completed
RunEnded completed
"""


@pytest.mark.long
def test_a_mission_goes_on_as_if_nothing_were_wrong(
    m2pem: Programs, watch: Watch, tmp_path: Path
) -> None:
    everyone = fleet_file(tmp_path, {**GOOD, **BAD}, LENGTH_M)
    m2pem.simulate(fleet_file(tmp_path, GOOD, LENGTH_M, "good"), SPEED)
    bad = m2pem.simulate(fleet_file(tmp_path, BAD, LENGTH_M, "bad", first=1), SPEED)
    watch.until_heard()
    words = ("--fleet", everyone, "--speed", f"{SPEED:g}", "--ocu", "mocu", "--format", "json")
    serving = m2pem.m2pem("serve", *words)
    operator = Operator(m2pem.python(CLIENT, "/m2pem"))

    # Another vehicle drives, too, and whatever can be wrong with vehicles is.
    lying = convoy(tmp_path, ["liar"], name="lying")
    assert operator.call("start_mission", url=str(lying))["run"] == "r1"
    serving.until_record("BehaviorProgressed", run="r1", state="RUNNING")
    before_mb = memory_mb(serving)
    assert operator.call("start_mission", url=str(convoy(tmp_path, GOOD)))["run"] == "r2"
    for fault in (
        *("liar: flood 5000", "liar: lie"),
        *("blind: odometry nan", "frozen: freeze odometry"),
    ):
        bad.type(fault)
    serving.until_record("BehaviorProgressed", run="r2", state="RUNNING")

    # And with what operators ask for.
    question, huge, garbage = (
        tmp_path / f"{name}.bpmn" for name in ("question", "huge", "garbage")
    )
    question.write_bytes(scenarios.question())
    huge.write_bytes(scenarios.question() + b" " * 50_000_000)
    garbage.write_bytes(random.Random(1).randbytes(1_000_000))
    assert operator.call("start_mission", url=str(question))["run"] == "r3"
    answer = {
        "run": "r3",
        "prompt": serving.until_record("PromptOpened", run="r3")["prompt"],
        "decision": "continue",
    }
    assert operator.call("answer_prompt", by="anna", **answer)["success"]
    refused = operator.refused
    assert "was answered by anna: continue" in refused("answer_prompt", by="bob", **answer)
    assert "r9" in refused("answer_prompt", run="r9", prompt="p1", decision="continue")
    assert "no run has a signal" in refused("send_signal", signal=UNKNOWN)
    assert "r9 is not driven" in refused("control_run", run="r9", verb=1)
    assert "did you mean 'good'?" in refused("take_vehicle", vehicle="nobody")
    assert "nothing.bpmn cannot be read" in refused("start_mission", url="nothing.bpmn")
    assert "no BPMN 2.0 file" in refused("start_mission", bpmn=str(garbage))
    assert "10,000,000 are the most" in refused("start_mission", bpmn=str(huge))

    assert serving.until_record("RunEnded", run="r2")["outcome"] == "completed"
    assert course(serving.records, "r2") == UNDISTURBED.strip().splitlines()
    (end,) = serving.those("BehaviorEnded", run="r2")
    assert end["t"] < DRIVEN_WITHIN_S
    assert not watch["good"].stood_on_the_way(5.0, LENGTH_M - 15.0)
    # The other one, too, has done what it was to do, whatever it said besides.
    end = serving.until_record("RunEnded", run="r1")
    assert end["outcome"] == "completed", end
    assert len(serving.those("BehaviorEnded", run="r1")) == 1
    watch.until(lambda: len(watch["liar"].statuses) > 1000)
    assert memory_mb(serving) < before_mb + MOST_MB
    serving.process.send_signal(signal.SIGTERM)
    assert serving.rest() == 0
    assert "Traceback" not in "\n".join(serving.errors)
    for cause in ("blind: odometry", "frozen: odometry"):
        assert any(cause in line for line in serving.errors), serving.said
    assert len(serving.errors) < LINES, serving.errors
