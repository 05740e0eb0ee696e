"""A running mission is revised while ROS vehicles execute it: whole programs, over DDS."""

import itertools
import json
from collections.abc import Iterable
from pathlib import Path

import pytest
from action_msgs.msg import GoalStatus
from m2pem_interfaces.msg import BehaviorStatus
from ros_e2e_programs import AMPLE_S, Program, Programs
from ros_e2e_watch import Watch
from ros_e2e_world import ALL_WAYS, APART_M, Lane, fleet_file

SPEED = 2.0
FAR_M = 4000.0
"""No vehicle comes to the end of such a route in a test."""

ALL = tuple(ALL_WAYS)
WATCHED = ALL_WAYS
ENDED = (GoalStatus.STATUS_CANCELED, GoalStatus.STATUS_ABORTED)
"""Nav2 aborts a goal that a new one preempts."""


def drives(element: str, vehicle: str, route: str = "", speed_m_s: float = 5.0) -> str:
    """A task: the vehicle drives the named route, or else its own route to the north."""
    return _task(
        element,
        vehicle,
        "single_vehicle_routing",
        f'<m2pem:property name="route" value="{route or f"route_{vehicle}"}"/>'
        f'<m2pem:property name="speed" value="{speed_m_s} m/s"/>',
    )


def stops(element: str, vehicle: str) -> str:
    return _task(element, vehicle, "drive_stop", "")


def _task(element: str, vehicle: str, behavior: str, properties: str) -> str:
    return (
        f'<scriptTask id="{element}"><extensionElements>'
        f'<m2pem:behavior type="vehicle" name="{behavior}">'
        f"<m2pem:properties>{properties}</m2pem:properties>"
        f'<m2pem:resources><m2pem:role name="driver" vehicle="{vehicle}"/></m2pem:resources>'
        "</m2pem:behavior></extensionElements></scriptTask>"
    )


def inside(element: str, task: str, name: str) -> str:
    """A subprocess with one task."""
    start, end = f"{element}_start", f"{element}_end"
    return (
        f'<subProcess id="{element}"><startEvent id="{start}"/>{task}<endEvent id="{end}"/>'
        f"{_flows([start, name, end])}</subProcess>"
    )


def _flows(elements: Iterable[str]) -> str:
    return "".join(
        f'<sequenceFlow id="{a}_{b}" sourceRef="{a}" targetRef="{b}"/>'
        for a, b in itertools.pairwise(elements)
    )


def back() -> str:
    """The route "back" of `nav`, in the file of the mission."""
    lane = Lane(APART_M * ALL.index("nav"), FAR_M)
    line = [lane.position(north_m)[::-1] for north_m in (0.0, -FAR_M)]
    text = json.dumps({"type": "LineString", "coordinates": line})
    route = f'<m2pem:geometry name="back">{text}</m2pem:geometry>'
    return f"<extensionElements>{route}</extensionElements>"


def version(folder: Path, name: str, *branches: dict[str, str]) -> Path:
    """A version of the mission: branches side by side, each of elements by their ids."""
    inner = "".join(xml for branch in branches for xml in branch.values())
    flows = "".join(_flows(["Fork", *branch, "Join"]) for branch in branches)
    file = folder / f"{name}.bpmn"
    file.write_text(
        '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"'
        ' xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="test">'
        f'<process id="P" isExecutable="true">{back()}<startEvent id="Start"/><endEvent id="End"/>'
        f'<parallelGateway id="Fork"/><parallelGateway id="Join"/>{inner}{flows}'
        f"{_flows(['Start', 'Fork'])}{_flows(['Join', 'End'])}</process></definitions>",
        encoding="utf-8",
    )
    return file


TOPICS, ACTION, BASE = (
    {f"Drive_{name}": drives(f"Drive_{name}", name)} for name in ("topics", "action", "base")
)
NAV = {"Sub": inside("Sub", drives("Drive_nav", "nav"), "Drive_nav")}
TURNED = {"Sub": inside("Sub", drives("Drive_nav", "nav", "back"), "Drive_nav")}
"""The same task, with a route to the south."""

OTHER = {"Sub": inside("Sub", stops("Stop_nav", "nav"), "Stop_nav")}


def revise(m2pem: Programs, file: Path, *words: str) -> Program:
    """Revise the run with `m2pem revise`; its exit status is 0 if it was done."""
    program = m2pem.m2pem("revise", "r1", file, *words)
    program.rest()
    return program


def begin(m2pem: Programs, watch: Watch) -> Program:
    """All vehicles drive north."""
    fleet = fleet_file(m2pem.folder, ALL_WAYS, FAR_M)
    m2pem.simulate(fleet, SPEED)
    watch.until_heard()
    first = version(m2pem.folder, "first", TOPICS, ACTION, NAV, BASE)
    program = m2pem.run(first, fleet, SPEED)
    program.until_record("BehaviorProgressed", count=len(ALL), state="RUNNING")
    watch.until(lambda: all(watch[name].north_m > 10.0 for name in ALL))
    return program


def drives_on(watch: Watch, *names: str) -> None:
    """These have one goal, and have not stopped since they began."""
    for name in names:
        track = watch[name]
        assert not track.stood_on_the_way(5.0, track.north_m), name
        assert len(track.begun_m) == 1, (name, track.begun_m)
    if "topics" in names:
        assert len(watch["topics"].accepted()) == 1
    for name in {"action", "nav"} & set(names):
        assert [goals[-1] for goals in watch[name].goals.values()] == [GoalStatus.STATUS_EXECUTING]


@pytest.mark.timeout(5 * AMPLE_S)
def test_routes_branches_and_a_subprocess_change_while_other_vehicles_drive_on(
    m2pem: Programs, watch: Watch
) -> None:
    program = begin(m2pem, watch)

    # A route that is driven, and a task behind another one.
    behind = {**ACTION, "Stop_action": stops("Stop_action", "action")}
    turned = version(m2pem.folder, "turned", TOPICS, behind, TURNED, BASE)
    said = revise(m2pem, turned, "--yes")
    assert said.process.returncode == 0, said.said
    assert "  new: script task Stop_action" in said.lines
    assert sum(line.startswith("  restarts: ") for line in said.lines) == 1
    nav = watch["nav"]
    watch.until(lambda: len(nav.goals) == 2)
    before, now = nav.goals.values()
    watch.until(lambda: before[-1] in ENDED)
    watch.until(lambda: now[-1] == GoalStatus.STATUS_EXECUTING)
    drives_on(watch, "topics", "action", "base")

    # A branch with a token.
    without = version(m2pem.folder, "without", TOPICS, TURNED, BASE)
    said = revise(m2pem, without, "--yes")
    assert said.process.returncode == 1
    assert any(
        line.startswith("refused: a token is on script task Drive_action") for line in said.lines
    ), said.lines
    drives_on(watch, "topics", "action", "base")
    said = revise(m2pem, without, "--end", "Drive_action", "--yes")
    assert said.process.returncode == 0, said.said
    (goal,) = watch["action"].goals.values()
    watch.until(lambda: goal[-1] == GoalStatus.STATUS_CANCELED)
    watch.until(lambda: watch["action"].stands)
    drives_on(watch, "topics", "base")

    # The inside of a subprocess with a token in it.
    other = version(m2pem.folder, "other", TOPICS, OTHER, BASE)
    said = revise(m2pem, other, "--yes")
    assert said.process.returncode == 1
    assert any(
        line.startswith("refused: a token is on script task Drive_nav") for line in said.lines
    )
    said = revise(m2pem, other, "--move", "Drive_nav=Stop_nav", "--yes")
    assert said.process.returncode == 0, said.said
    watch.until(lambda: now[-1] == GoalStatus.STATUS_CANCELED)
    program.until_record("TokenLeft", element="Sub", outcome="completed")
    watch.until(lambda: nav.stands)
    drives_on(watch, "topics", "base")

    # Everything that drives.
    last = version(m2pem.folder, "last", {"Stop": stops("Stop", "topics")})
    words = ("--end", "Drive_topics", "--end", "Drive_base")
    said = revise(m2pem, last, *words, "--yes")
    assert said.process.returncode == 0, said.said
    assert program.until_record("RunEnded")["outcome"] == "completed"
    assert program.rest() == 0
    states = [state for _, _, state in watch["topics"].statuses]
    assert BehaviorStatus.CANCELLED in states
    assert m2pem.m2pem("replay", "r1", "--verify").rest() == 0


@pytest.mark.timeout(5 * AMPLE_S)
def test_vehicles_drive_on_at_another_speed(m2pem: Programs, watch: Watch) -> None:
    program = begin(m2pem, watch)
    watch.until(lambda: all(each.odometry[-1].forward_m_s > 4.0 for _, each in watch.items()))
    slow = [{f"Drive_{name}": drives(f"Drive_{name}", name, speed_m_s=2.0)} for name in ALL]
    branches = [
        {"Sub": inside("Sub", each["Drive_nav"], "Drive_nav")} if "Drive_nav" in each else each
        for each in slow
    ]
    said = revise(m2pem, version(m2pem.folder, "slow", *branches), "--yes")
    assert said.process.returncode == 0, said.said
    assert sum(line.startswith("  adjusts: the speed of") for line in said.lines) == len(ALL)
    watch.until(lambda: all(each.odometry[-1].forward_m_s < 2.5 for _, each in watch.items()))
    far_m = {name: each.north_m + 20.0 for name, each in watch.items()}
    watch.until(lambda: all(watch[name].north_m > far_m[name] for name in ALL))
    drives_on(watch, *ALL)
    program.process.terminate()


@pytest.mark.timeout(5 * AMPLE_S)
def test_an_executive_that_is_killed_right_after_a_revision_resumes_with_the_new_version(
    m2pem: Programs, watch: Watch
) -> None:
    program = begin(m2pem, watch)
    behind = {**ACTION, "Stop_action": stops("Stop_action", "action")}
    turned = version(m2pem.folder, "turned", TOPICS, behind, TURNED)
    said = revise(m2pem, turned, "--end", "Drive_base", "--yes")
    assert said.process.returncode == 0, said.said
    program.kill()
    resumed = m2pem.m2pem("resume", "r1", "--ocu", "none", "--format", "json")
    resumed.until_record("RunClaimed")
    nav = watch["nav"]
    watch.until(
        lambda: [goals[-1] for goals in nav.goals.values()][1:] == [GoalStatus.STATUS_EXECUTING]
    )
    first, _ = nav.goals.values()
    assert first[-1] in ENDED
    watch.until(lambda: watch["base"].stands)
    drives_on(watch, "topics", "action")
    last = version(m2pem.folder, "last", {"Stop": stops("Stop", "topics")})
    ends = ("--end", "Drive_topics", "--end", "Drive_action", "--end", "Sub")
    said = revise(m2pem, last, *ends, "--yes")
    assert said.process.returncode == 0, said.said
    assert resumed.until_record("RunEnded")["outcome"] == "completed"
    assert resumed.rest() == 0
    assert m2pem.m2pem("replay", "r1", "--verify").rest() == 0
