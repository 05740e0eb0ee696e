"""What others say wrongly, too often or not at all concerns nobody but them."""

import json
import random
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from ros_e2e_programs import Program, Programs, Record, programs
from ros_e2e_watch import Watch, watching
from ros_e2e_world import convoy, fleet_file

from m2pem.testing import scenarios

CLIENT = Path(__file__).parents[3] / "ocu" / "mocu" / "tests" / "mocu_client_peer.py"
SPEED = 2.0
LENGTH_M = 100.0
DRIVEN_WITHIN_S = 90.0
"""Mission time. It takes 25 s; a computer that does much else may take longer, but not for ever."""

GOOD = {"good": {}}
BAD = {"liar": {}, "blind": {"driver": "base"}, "frozen": {"driver": "nav2"}}
MOST_MB = 250
"""More memory than before; the 50 MB that are refused are there several times for a moment."""

LINES = 40


@pytest.fixture
def m2pem(tmp_path: Path, ros_domain: int) -> Iterator[Programs]:
    with programs(tmp_path, ros_domain) as started:
        yield started


@pytest.fixture
def watch(ros_domain: int) -> Iterator[Watch]:
    with watching([*GOOD, *BAD], ros_domain) as heard:
        yield heard


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


def course(records: list[Record], run: str) -> list[tuple[str, str, str]]:
    """What happened in a run, without when."""
    return [
        (each["record"], each.get("element", ""), each.get("outcome", each.get("state", "")))
        for each in records
        if each["run"] == run
    ]


def test_a_mission_goes_on_undisturbed(m2pem: Programs, watch: Watch, tmp_path: Path) -> None:
    everyone = fleet_file(tmp_path, {**GOOD, **BAD}, LENGTH_M)
    m2pem.simulate(fleet_file(tmp_path, GOOD, LENGTH_M, "good"), SPEED)
    bad = m2pem.simulate(fleet_file(tmp_path, BAD, LENGTH_M, "bad", first=1), SPEED)
    watch.until_heard()
    words = ("--fleet", everyone, "--speed", f"{SPEED:g}", "--ocu", "mocu", "--format", "json")
    serving = m2pem.m2pem("serve", *words)
    operator = Operator(m2pem.python(CLIENT, "/m2pem"))
    rehearsal = m2pem.m2pem(
        *("simulate", convoy(tmp_path, GOOD), "--fleet", everyone, "--format", "json")
    )

    # Another vehicle drives, too, and whatever can be wrong with vehicles is.
    lying = operator.call("start_mission", url=str(convoy(tmp_path, ["liar"], name="lying")))
    assert lying["success"]
    serving.until_record("BehaviorProgressed", run="r1", state="RUNNING")
    before_mb = memory_mb(serving)
    good = operator.call("start_mission", url=str(tmp_path / "convoy.bpmn"))
    assert good["run"] == "r2"
    for fault in ("flood 5000", "lie"):
        bad.type(f"liar: {fault}")
    bad.type("blind: odometry nan")
    bad.type("frozen: freeze odometry")
    serving.until_record("BehaviorProgressed", run="r2", state="RUNNING")

    # And with what operators ask for.
    huge, garbage = tmp_path / "huge.bpmn", tmp_path / "garbage.bpmn"
    huge.write_bytes(scenarios.question() + b" " * 50_000_000)
    garbage.write_bytes(random.Random(1).randbytes(1_000_000))
    too_large = operator.send("start_mission", bpmn=str(huge))
    print(operator.refused("start_mission", bpmn=str(garbage)))
    (tmp_path / "question.bpmn").write_bytes(scenarios.question())
    asking = operator.call("start_mission", url=str(tmp_path / "question.bpmn"))["run"]
    prompt = serving.until_record("PromptOpened", run=asking)["prompt"]
    answer = {"run": asking, "prompt": prompt, "decision": "continue"}
    assert operator.call("answer_prompt", by="anna", **answer)["success"]
    print(operator.refused("answer_prompt", by="bob", **answer))
    print(operator.refused("answer_prompt", run=good["run"], prompt="p7", decision="x"))
    print(operator.refused("send_signal", signal="8d9f0c55-0000-4000-8000-000000000001"))
    print(operator.refused("control_run", run="r99", verb=1))
    print(operator.refused("take_vehicle", vehicle="nobody"))
    print(operator.refused("start_mission", url=str(tmp_path / "nothing.bpmn")))
    response = operator.answer(too_large)
    print(response)

    ended = serving.until_record("RunEnded", run="r2")
    assert ended["outcome"] == "completed"
    print(rehearsal.rest(), rehearsal.said)
    print(course(serving.records, "r2"), course(rehearsal.records, "r1"))
    (end,) = serving.those("BehaviorEnded", run="r2")
    print(end, serving.until_record("RunEnded", run="r1"))
    print(memory_mb(serving), before_mb)
    print(len(watch["liar"].statuses))
    serving.process.send_signal(signal.SIGTERM)
    print(serving.rest())
    print("\n".join(serving.errors))
