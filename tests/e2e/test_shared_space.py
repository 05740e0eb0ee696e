"""kill -9 while a rover waits for a bridge on which another one is, then resume."""

import json
import re
from collections import Counter
from pathlib import Path

from m2pem.simulation.executions import EffectKind
from m2pem.simulation.state_file import recorded_effects
from tests.command_line import CommandLine
from tests.deconfliction.test_clearance_simulate import both_ways, write_rovers


def test_who_waited_for_the_bridge_when_the_executive_was_killed_crosses_it_afterwards(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    fleet, state = write_rovers(tmp_path), tmp_path / "vehicles.state"
    text = fleet.read_text(encoding="utf-8")
    fleet.write_text(text.replace("connection: {", f"connection: {{state: {state}, "))
    mission = tmp_path / "mission.bpmn"
    mission.write_bytes(both_ways())
    words = ("--ocu", "none", "--format", "json")
    program = m2pem.start("run", mission, "--fleet", fleet, "--speed", "15", *words)
    waits = program.until_record("AllocationDelayed")
    # The other task has the bridge, whether or not its behavior was requested already.
    assert waits["holders"]["bridge"] in ("r1.a1", "r1.b1")
    status, running, _ = m2pem.run("fleet", "--running")
    assert status == 0
    assert "two would enter bridge (capacity 1)" in running
    assert re.search(
        r"^bridge +1 +one \(r1\.b1\) +\w+ of r1 waits since \d+ s$", running, re.MULTILINE
    )
    program.kill()
    again = m2pem.start("resume", "r1", *words)
    status, errors = again.rest()
    assert (status, errors) == (0, "")
    assert m2pem.run("replay", "r1", "--verify")[0] == 0
    status, journaled, _ = m2pem.run("replay", "r1", "--format", "json")
    records = [json.loads(line) for line in journaled.splitlines()]
    named = [(each["record"], each["behavior"]) for each in records if "behavior" in each]
    crossing = [each for each in named if each[0] in ("BehaviorRequested", "BehaviorEnded")]
    # The other one may go as soon as the first has left the bridge, or, if the outage was long, has
    # ended.
    first = [("BehaviorRequested", "r1.b1")]
    between = [("BehaviorRequested", "r1.b2"), ("BehaviorEnded", "r1.b1")]
    last = [("BehaviorEnded", "r1.b2")]
    assert crossing in ([*first, *between, *last], [*first, *reversed(between), *last])
    starts = [each.behavior for each in recorded_effects(state) if each.kind is EffectKind.START]
    assert Counter(starts) == {"r1.b1": 1, "r1.b2": 1}
