"""`m2pem revise` on missions that simulated vehicles execute, and a crash right after it."""

import itertools
import json
from pathlib import Path

import pytest

from m2pem.mission.mission import version_of_files
from tests.command_line import CommandLine
from tests.faults import Faults

_FLEET = """
version: 1
name: revised
origin: {lat: 38.1, lon: -77.3, alt: 60.0}
vehicles:
  rover:
    domain: ground
    arbiter: sim
    connection: {home: [38.1, -77.3]}
"""


def _lane(latitude: float) -> str:
    text = {"type": "LineString", "coordinates": [[-77.3, 38.1], [-77.3, latitude]]}
    return f'<m2pem:geometry name="lane">{json.dumps(text)}</m2pem:geometry>'


def _task(element: str, behavior: str, properties: str = "") -> str:
    return f"""<scriptTask id="{element}"><extensionElements>
      <m2pem:behavior type="vehicle" name="{behavior}">
        <m2pem:properties>{properties}</m2pem:properties>
        <m2pem:resources><m2pem:role name="driver" vehicle="rover"/></m2pem:resources>
      </m2pem:behavior></extensionElements></scriptTask>"""


_FOLLOW = '<m2pem:property name="route" value="lane"/>'
_DRIVE = _task("Drive", "single_vehicle_routing", _FOLLOW)
_STOP = _task("Stop", "drive_stop")


def _mission(geometry: str, *tasks: tuple[str, str]) -> str:
    ids = ["S", *(name for name, _ in tasks), "E"]
    flows = "".join(
        f'<sequenceFlow id="to_{b}" sourceRef="{a}" targetRef="{b}"/>'
        for a, b in itertools.pairwise(ids)
    )
    return f"""<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
      xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="test">
      <process id="P" isExecutable="true"><extensionElements>{geometry}</extensionElements>
      <startEvent id="S"/>{"".join(xml for _, xml in tasks)}<endEvent id="E"/>{flows}
      </process></definitions>"""


def _files(folder: Path) -> tuple[Path, Path, Path]:
    """A fleet, a mission of one long drive, and a new version: a short lane, and a task behind."""
    files = folder / "fleet.yaml", folder / "long.bpmn", folder / "short.bpmn"
    files[0].write_text(_FLEET, encoding="utf-8")
    files[1].write_text(_mission(_lane(38.9), ("Drive", _DRIVE)), encoding="utf-8")
    both = ("Drive", _DRIVE), ("Stop", _STOP)
    files[2].write_text(_mission(_lane(38.1002), *both), encoding="utf-8")
    return files


def test_a_route_that_is_driven_is_changed_and_a_task_is_added(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    fleet, long, short = _files(tmp_path)
    program = m2pem.start("run", long, "--fleet", fleet, "--format", "json", "--ocu", "none")
    program.until_record("BehaviorProgressed", state="RUNNING")
    status, plan, _ = m2pem.run("revise", "r1", short, "--plan")
    assert status == 0
    assert "changed: 'lane', a route, area or point of the file" in plan
    assert "'lane' of script task Drive changes: behavior single_vehicle_routing of rover" in plan
    assert plan.endswith("after it, the mission completes on all paths from there\n")
    status, _, errors = m2pem.run("revise", "r1", short, "--yes", "--by", "anna@here")
    assert (status, errors.startswith("r1 goes on with version ")) == (0, True)
    program.until_record("MissionRevised", by="anna@here")
    first, last = json.loads(m2pem.run("runs", "r1", "--versions", "--format", "json")[1])
    assert (first["seq"], first["mission"], first["is_last"]) == (1, str(long), False)
    assert (last["by"], last["mission"], last["is_last"]) == ("anna@here", str(short), True)
    assert last["version"] == version_of_files(short.read_bytes(), ())
    assert last["at_us"] >= first["at_us"] > 0
    assert last["version"][:12] in m2pem.run("runs", "--versions")[1]
    program.until_record("TokenEntered", element="Stop")
    program.until_record("RunEnded", outcome="completed")
    status, replayed, _ = m2pem.run("replay", "r1", "--verify")
    assert status == 0, replayed
    assert f"version {last['version'][:12]} of {short}" in m2pem.run("replay", "r1")[1]
    exported = json.loads(m2pem.run("runs", "--export", "r1")[1].splitlines()[0])
    (revision,) = exported["revisions"]
    assert revision["mission"]["text"] == short.read_text("utf-8")


def test_what_follows_for_requirements_is_in_the_plan(m2pem: CommandLine, tmp_path: Path) -> None:
    fleet, long, _ = _files(tmp_path)
    stops = '<m2pem:requirement id="stops" ltl="&lt;&gt; completed(Stop)"/>'
    drives_on = '<m2pem:requirement id="drives_on" ltl="[] !active(Stop)"/>'
    new = tmp_path / "new.bpmn"
    tasks = ("Drive", _DRIVE), ("Stop", _STOP)
    new.write_text(_mission(_lane(38.1002) + stops + drives_on, *tasks), encoding="utf-8")
    program = m2pem.start("run", long, "--fleet", fleet, "--format", "json", "--ocu", "none")
    program.until_record("BehaviorProgressed", state="RUNNING")
    status, plan, _ = m2pem.run("revise", "r1", new, "--plan")
    assert status == 0
    assert "requirement stops holds on all paths from there" in plan
    violated = "requirement drives_on is violated on all paths from there: after Drive is cancelled"
    assert f"{violated}, Drive succeeds\n" in plan
    assert m2pem.run("revise", "r1", new, "--yes")[0] == 0
    decided = program.until_record("RequirementDecided", verdict="violated")
    assert decided["requirement"] == "drives_on"
    decided = program.until_record("RequirementDecided", verdict="satisfied")
    assert decided["requirement"] == "stops"


def test_a_branch_with_a_token_is_refused_and_the_token_is_named(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    fleet, long, _ = _files(tmp_path)
    other = tmp_path / "other.bpmn"
    other.write_text(_mission(_lane(38.9), ("Stop", _STOP)), encoding="utf-8")
    program = m2pem.start("run", long, "--fleet", fleet, "--format", "json", "--ocu", "none")
    program.until_record("BehaviorProgressed", state="RUNNING")
    status, plan, errors = m2pem.run("revise", "r1", other, "--yes")
    assert (status, errors) == (1, "m2pem: r1 is not revised\n")
    assert "refused: a token is on script task Drive, which the new version has not" in plan
    assert "it can go to E, Stop, or end" in plan
    assert m2pem.run("revise", "r1", other, "--move", "Drive=Stop", "--yes")[0] == 0
    program.until_record("RunEnded", outcome="completed")


def test_an_executive_that_is_killed_right_after_it_resumes_with_the_new_version(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    fleet, long, short = _files(tmp_path)
    program = m2pem.start("run", long, "--fleet", fleet, "--format", "json", "--ocu", "none")
    program.until_record("BehaviorProgressed", state="RUNNING")
    assert m2pem.run("revise", "r1", short, "--yes")[0] == 0
    program.kill()
    status, state, _ = m2pem.run("replay", "r1", "--state", "--format", "json")
    assert status == 0
    assert [each["element"] for each in json.loads(state)["tokens"]] == ["Drive"]
    resumed = m2pem.start("resume", "r1", "--format", "json", "--ocu", "none")
    resumed.until_record("RunClaimed")
    resumed.until_record("TokenEntered", element="Stop")
    resumed.until_record("RunEnded", outcome="completed")
    status, replayed, _ = m2pem.run("replay", "r1", "--verify")
    assert status == 0, replayed


def test_a_revision_is_acknowledged_when_it_is_on_the_disk(
    faulty: CommandLine, faults: Faults, tmp_path: Path
) -> None:
    fleet, long, short = _files(tmp_path)
    at = ("--journal", "journal.db")
    program = faulty.start("run", long, "--fleet", fleet, "--format", "json", "--ocu", "none", *at)
    program.until_record("BehaviorProgressed", state="RUNNING")
    faults.hang("sync", name="journal.db")
    revising = faulty.start("revise", "r1", short, "--yes", "--by", "anna", *at)
    program.until_said("the journal has not written for")
    assert revising.process.poll() is None
    faults.clear()
    assert revising.rest()[0] == 0
    program.until_record("MissionRevised", by="anna")


_MESSAGE = '<messageEventDefinition messageRef="M"/>'
_GOT = '<scriptTask id="Got"><script>got = 1</script></scriptTask>'
_TO_GOT = '<sequenceFlow id="on" sourceRef="B" targetRef="Got"/>'
_INSIDE = f'<startEvent id="B">{_MESSAGE}</startEvent>{_GOT}{_TO_GOT}'
_CATCHERS = {
    "boundary": f'<boundaryEvent id="B" attachedToRef="Drive">{_MESSAGE}</boundaryEvent>'
    f"{_GOT}{_TO_GOT}</process>",
    "subprocess": f'<subProcess id="Sub" triggeredByEvent="true">{_INSIDE}</subProcess></process>',
    "process": f'</process><process id="Q" isExecutable="true">{_INSIDE}</process>',
}
"""What catches a message, at the end of the process."""


@pytest.mark.parametrize("kind", _CATCHERS)
def test_a_message_that_was_kept_before_kill_9_reaches_what_a_revision_brings(
    m2pem: CommandLine, tmp_path: Path, kind: str
) -> None:
    fleet, old, new = _files(tmp_path)
    tell = f'<intermediateThrowEvent id="Tell">{_MESSAGE}</intermediateThrowEvent>'
    text = _mission(_lane(38.9), ("Tell", tell), ("Drive", _DRIVE))
    text = text.replace("<process", '<message id="M" name="m"/><process', 1)
    old.write_text(text, encoding="utf-8")
    new.write_text(text.replace("</process>", _CATCHERS[kind]), encoding="utf-8")
    program = m2pem.start("run", old, "--fleet", fleet, "--format", "json", "--ocu", "none")
    program.until_record("BehaviorProgressed", state="RUNNING")
    program.kill()
    resumed = m2pem.start("resume", "r1", "--format", "json", "--ocu", "none")
    resumed.until_record("RunClaimed")
    assert m2pem.run("revise", "r1", new, "--yes", "--even-if-stuck")[0] == 0
    resumed.until_record("TokenEntered", element="Got")
    resumed.kill()
    status, replayed, _ = m2pem.run("replay", "r1", "--verify")
    assert status == 0, replayed
