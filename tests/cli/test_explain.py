"""`m2pem explain`: which vehicles a task got, and why; what it waits for."""

import json
import re
from pathlib import Path

import pytest

from tests.cli.conftest import Invoke
from tests.command_line import CommandLine, Program

FLEET = """
version: 1
origin: {lat: 38.1075, lon: -77.3192, alt: 60.0}
vehicles:
  uav1:
    domain: air
    arbiter: sim
    connection: {home: [38.1095, -77.3192], altitude: 30 m}
    cruise_speed: 5 m/s
  uav2:
    domain: air
    arbiter: sim
    connection: {home: [38.1076, -77.3192], altitude: 30 m}
    cruise_speed: 5 m/s
  rover: {domain: ground, arbiter: sim, connection: {home: [38.1075, -77.3180]}}
"""

AIR = "requires=\"vehicle.domain == 'air'\""


def task(id_: str, latitude_deg: float, role: str) -> str:
    return f"""
<scriptTask id="{id_}" name="{id_} it"><extensionElements>
  <m2pem:behavior type="vehicle" name="goto">
    <m2pem:properties>
      <m2pem:property name="target" value="[{latitude_deg}, -77.3192, 20]"/>
    </m2pem:properties>
    <m2pem:resources><m2pem:role name="scout" {role}/></m2pem:resources>
  </m2pem:behavior>
</extensionElements></scriptTask>"""


def mission(folder: Path, *parts: str) -> tuple[Path, Path]:
    """Write a mission and its fleet; returns their paths."""
    fleet, file = folder / "fleet.yaml", folder / "m.bpmn"
    fleet.write_text(FLEET)
    file.write_text(
        '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="urn:t"'
        ' xmlns:m2pem="https://m2pem.org/schema/1"><process id="P" isExecutable="true">'
        f"{''.join(parts)}</process></definitions>"
    )
    return file, fleet


def flow(source: str, target: str) -> str:
    return f'<sequenceFlow id="{source}-{target}" sourceRef="{source}" targetRef="{target}"/>'


@pytest.fixture
def journal(invoke: Invoke, tmp_path: Path) -> Path:
    """The journal of a run with a task that chose its vehicle, and one that names it."""
    file, fleet = mission(
        tmp_path,
        '<startEvent id="S"/>',
        flow("S", "Scout"),
        task("Scout", 38.1077, AIR),
        flow("Scout", "Return"),
        task("Return", 38.1094, 'vehicle="uav1"'),
        flow("Return", "Loop"),
        '<manualTask id="Loop"/>',
    )
    words = ("run", file, "--fleet", fleet, "--speed", "100", "--ocu", "none")
    journal = tmp_path / "journal.db"
    assert invoke(*words, "--journal", journal)[0] == 0
    return journal


def test_every_candidate_has_its_cost_or_why_it_is_out(invoke: Invoke, journal: Path) -> None:
    status, out, _ = invoke("explain", "r1", "Scout", "--journal", journal)
    assert status == 0
    assert out.startswith("Scout it (Scout) of r1\n")
    assert "role scout: uav2\nCANDIDATE  COST " in out
    chosen, farther, ground = out.splitlines()[-3:]
    assert chosen.startswith("uav2 ")
    assert chosen.endswith("  chosen")
    assert farther.startswith("uav1 ")
    assert "s more (travel +" in farther
    assert ground.startswith("rover ")
    assert "excluded, requires is false: vehicle.domain = " in ground


def test_an_element_is_found_by_its_name_and_a_fixed_vehicle_is_said(
    invoke: Invoke, journal: Path
) -> None:
    status, out, _ = invoke("explain", "r1", "Return it", "--journal", journal)
    assert status == 0
    assert "role scout: the mission names the vehicle uav1\n" in out
    assert out.endswith("s: begins with uav1\n")


def test_programs_get_every_candidate_with_the_reason(invoke: Invoke, journal: Path) -> None:
    _, out, _ = invoke("explain", "r1", "Scout", "--journal", journal, "--format", "json")
    found = json.loads(out)
    (request,) = found["requests"]
    assert found["roles"] == {"scout": {"kind": "vehicle", "resource": None}}
    assert request["chosen"]["roles"] == {"scout": ["uav2"]}
    candidates = request["chosen"]["considered"]["roles"]["scout"]["candidates"]
    assert [each["resource"] for each in candidates] == ["uav2", "uav1", "rover"]
    assert candidates[0]["why_not"] == ""
    assert candidates[1]["why_not"].startswith("costs ")
    assert candidates[2]["excluded"]


def test_what_was_lost_and_who_did_the_rest_is_explained(invoke: Invoke, tmp_path: Path) -> None:
    file, fleet = mission(
        tmp_path,
        '<startEvent id="S"/>',
        flow("S", "Scout"),
        task("Scout", 38.1175, f"{AIR} onLoss='reassign'"),
    )
    text, where = fleet.read_text(), "connection: {home: [38.1095, -77.3192]"
    fleet.write_text(text.replace(where, f"{where}, faults: ['goto: cut link at 20 s']"))
    journal = tmp_path / "journal.db"
    words = ("run", file, "--fleet", fleet, "--speed", "50", "--ocu", "none")
    status, out, _ = invoke(*words, "--journal", journal)
    assert status == 0
    assert "Scout it: another is to do what uav1 left, LINK_LOST" in out
    _, out, _ = invoke("explain", "r1", "Scout", "--journal", journal)
    assert "to do what goto of Scout it (r1.b1) left, LINK_LOST: " in out
    assert re.search(r"^uav1 .*excluded, this task has lost it: LINK_LOST", out, re.M)
    _, out, _ = invoke("explain", "r1", "Scout", "--journal", journal, "--format", "json")
    first, second = json.loads(out)["requests"]
    assert first["rest_of"] is None
    assert second["rest_of"]["behavior"] == "r1.b1"
    assert second["chosen"]["roles"] == {"scout": ["uav2"]}


@pytest.mark.parametrize(
    ("element", "said"),
    [
        ("Scoot", "has no element 'Scoot'; did you mean 'Scout'"),
        ("Loop", "Loop of r1 has no roles: vehicles and payloads are given to tasks"),
    ],
)
def test_what_cannot_be_explained_is_an_error(
    invoke: Invoke, journal: Path, element: str, said: str
) -> None:
    status, out, err = invoke("explain", "r1", element, "--journal", journal)
    assert (status, out) == (2, "")
    assert said in err


@pytest.fixture
def waiting(m2pem: CommandLine, tmp_path: Path) -> Program:
    """A run with a task that waits for a vehicle which another task of it has."""
    file, fleet = mission(
        tmp_path,
        '<startEvent id="S"/><parallelGateway id="Fork"/>',
        flow("S", "Fork"),
        flow("Fork", "Far"),
        flow("Fork", "Wait"),
        task("Far", 38.2, 'vehicle="uav1"'),
        task("Wait", 38.1, 'vehicle="uav1" wait="PT10M" priority="2"'),
    )
    program = m2pem.start("run", file, "--fleet", fleet, "--ocu", "none", "--format", "json")
    program.until_record("AllocationDelayed")
    return program


def test_a_task_that_waits_says_for_what_and_who_has_it(
    m2pem: CommandLine, waiting: Program
) -> None:
    waiting.kill()
    status, out, _ = m2pem.run("explain", "r1", "Wait")
    assert status == 0
    assert ": waits for role 'scout': uav1 is held by Far it of r1 (r1.b1)\n" in out
    assert "the last record, and until 600.0 s at the latest\n" in out
    assert out.endswith("RESOURCE  HELD BY\nuav1      goto of Far it (r1.b1)\n")
    found = json.loads(m2pem.run("explain", "r1", "Wait", "--format", "json")[1])
    assert found["requests"][0]["waiting"]
    state = json.loads(m2pem.run("replay", "r1", "--state", "--format", "json")[1])
    assert [(each["element"], each["holders"]) for each in state["waiting"]] == [
        ("Wait", {"uav1": "r1.b1"})
    ]
    out = m2pem.run("replay", "r1", "--state")[1]
    waits = r"^Wait it +waits for role 'scout': uav1 is held by Far it of r1 \(r1.b1\)$"
    assert re.search(waits, out, re.M)


def test_the_fleet_of_a_running_executive_has_holders_and_the_tasks_that_wait(
    m2pem: CommandLine, waiting: Program
) -> None:
    status, out, _ = m2pem.run("fleet", "--running", "--format", "json")
    assert status == 0
    (executive,) = json.loads(out)["executives"]
    assert executive["executive"] == str(waiting.process.pid)
    assert executive["holders"] == {"uav1": "r1.b1", "uav2": "", "rover": ""}
    (task_,) = executive["waiting"]
    assert (task_["run"], task_["task"], task_["priority"]) == ("r1", "Wait it", 2)
    assert task_["holders"] == {"uav1": "r1.b1"}
    assert 0 < task_["left_s"] <= 600.0
    out = m2pem.run("fleet", "--running")[1]
    assert re.search(r"^uav1 +Far it of r1 \(r1\.b1\)$", out, re.M)
    assert re.search(r"^uav2 +free$", out, re.M)
    assert re.search(r"^r1 +Wait it +\d+ s +\d+ s +2 +role 'scout': uav1 is held by", out, re.M)
    waiting.kill()
