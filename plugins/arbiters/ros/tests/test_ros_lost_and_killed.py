"""Robots that drive by themselves are cut off, their executive is killed, and they are back and
drive on: over DDS, by the topics and the action of an m2pem node, and by Nav2.

Their process is stopped by a signal meanwhile: it neither receives nor sends. When it goes on, they
do what they did before, and know no new executive.
"""

import signal
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from ros_e2e_programs import Program, Programs, programs
from ros_e2e_watch import Watch, watching
from ros_e2e_world import ALL_WAYS, fleet_file

SPEED = 4.0
LENGTH_M = 400.0
ON_BOARD: Mapping[str, Mapping[str, Any]] = {
    name: way for name, way in ALL_WAYS.items() if name != "base"
}
"""A base stands without its executive."""


@pytest.fixture
def m2pem(tmp_path: Path, ros_domain: int) -> Iterator[Programs]:
    with programs(tmp_path, ros_domain) as started:
        yield started


@pytest.fixture
def watch(ros_domain: int) -> Iterator[Watch]:
    with watching(ON_BOARD, ros_domain) as heard:
        yield heard


def mission(folder: Path) -> Path:
    """Each vehicle drives its route; when it is lost, it is to do the rest itself."""
    parts = "".join(
        f'<scriptTask id="Drive_{name}"><extensionElements>'
        '<m2pem:behavior type="vehicle" name="single_vehicle_routing"><m2pem:properties>'
        f'<m2pem:property name="route" value="route_{name}"/>'
        '<m2pem:property name="speed" value="5 m/s"/></m2pem:properties><m2pem:resources>'
        f'<m2pem:role name="driver" requires="vehicle.name == \'{name}\'" onLoss="reassign"'
        ' wait="unlimited"/></m2pem:resources></m2pem:behavior></extensionElements></scriptTask>'
        f'<sequenceFlow id="to_{name}" sourceRef="Fork" targetRef="Drive_{name}"/>'
        for name in ON_BOARD
    )
    file = folder / "lost.bpmn"
    file.write_text(
        '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"'
        ' xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="https://m2pem.org/scenarios">'
        '<process id="P" isExecutable="true"><startEvent id="S"/><parallelGateway id="Fork"/>'
        f'<sequenceFlow id="f" sourceRef="S" targetRef="Fork"/>{parts}</process></definitions>'
    )
    return file


def cut_off_and_killed(
    m2pem: Programs, watch: Watch, lost_after: str, *, noticed: bool
) -> tuple[Program, Program]:
    """The vehicles are cut off on their ways, and the executive killed, before or after it has
    noticed that. Returns the vehicles, which are silent, and the next executive."""
    fleet = fleet_file(m2pem.folder, ON_BOARD, LENGTH_M, lost_after=lost_after)
    simulated = m2pem.simulate(fleet, SPEED)
    watch.until_heard()
    words = ("--speed", f"{SPEED:g}", "--ocu", "none", "--format", "json")
    first = m2pem.m2pem("run", mission(m2pem.folder), "--fleet", fleet, *words)
    first.until_record("BehaviorProgressed", len(ON_BOARD), state="RUNNING")
    watch.until(lambda: all(track.north_m > 5.0 for _, track in watch.items()))
    simulated.process.send_signal(signal.SIGSTOP)
    if noticed:
        first.until_record("WorkReassigned", len(ON_BOARD))
    first.kill()
    again = m2pem.m2pem("resume", "r1", "--ocu", "none", "--format", "json")
    again.until_record("RunClaimed")
    return simulated, again


@pytest.mark.long
def test_robots_whose_loss_was_journaled_are_stopped_before_anything_else(
    m2pem: Programs, watch: Watch
) -> None:
    simulated, again = cut_off_and_killed(m2pem, watch, "10 s", noticed=True)
    assert not again.those("ResourceReturned")
    simulated.process.send_signal(signal.SIGCONT)
    for name in ON_BOARD:
        again.until_record("ResourceReturned", resource=name, code="LINK_LOST")
    again.until_record("BehaviorRequested", len(ON_BOARD))
    for name in ON_BOARD:
        (returned,) = again.those("ResourceReturned", resource=name)
        (asked,) = again.those("BehaviorRequested", element=f"Drive_{name}")
        assert again.records.index(returned) < again.records.index(asked)
        assert any(track.forward_m_s < 0.01 for track in watch[name].odometry[-400:])


@pytest.mark.long
def test_robots_whose_loss_nothing_had_noticed_are_held_until_an_operator_decides(
    m2pem: Programs, watch: Watch
) -> None:
    simulated, again = cut_off_and_killed(m2pem, watch, "1000 s", noticed=False)
    again.until_record("BehaviorUnsettled", len(ON_BOARD))
    simulated.process.send_signal(signal.SIGCONT)
    watch.until(lambda: all(track.stands for _, track in watch.items()))
    where = {name: track.north_m for name, track in watch.items()}
    assert all(5.0 < north_m < LENGTH_M - 20.0 for north_m in where.values()), where
    assert not again.those("BehaviorRequested")
