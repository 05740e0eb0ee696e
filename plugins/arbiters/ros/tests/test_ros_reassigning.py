"""A robot falls silent and drives on: another does its task, and when it returns it is stopped."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from ros_e2e_programs import Programs, programs
from ros_e2e_watch import Watch, watching
from ros_e2e_world import fleet_file

SPEED = 4.0
LENGTH_M = 300.0
SILENT_S = 26
"""Beyond `lost_after`; it drives some 130 m meanwhile."""

VEHICLES = {"first": {}, "second": {}}


@pytest.fixture
def m2pem(tmp_path: Path, ros_domain: int) -> Iterator[Programs]:
    with programs(tmp_path, ros_domain) as started:
        yield started


@pytest.fixture
def watch(ros_domain: int) -> Iterator[Watch]:
    with watching(VEHICLES, ros_domain) as heard:
        yield heard


def mission(folder: Path) -> Path:
    """One vehicle, the first if it is free, drives its route; another one if it is lost."""
    file = folder / "reassigned.bpmn"
    file.write_text(
        '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"'
        ' xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="https://m2pem.org/scenarios">'
        '<process id="P" isExecutable="true"><startEvent id="S"/><scriptTask id="Drive">'
        '<extensionElements><m2pem:behavior type="vehicle" name="single_vehicle_routing">'
        '<m2pem:properties><m2pem:property name="route" value="route_first"/>'
        '<m2pem:property name="speed" value="5 m/s"/></m2pem:properties><m2pem:resources>'
        '<m2pem:role name="driver" requires="true" onLoss="reassign"'
        " prefer=\"vehicle.name == 'first' ? 1000 : 0\"/></m2pem:resources></m2pem:behavior>"
        '</extensionElements></scriptTask><endEvent id="E"/>'
        '<sequenceFlow id="f" sourceRef="S" targetRef="Drive"/>'
        '<sequenceFlow id="g" sourceRef="Drive" targetRef="E"/></process></definitions>'
    )
    return file


@pytest.mark.long
def test_a_robot_that_drove_on_unseen_is_stopped_when_it_returns(
    m2pem: Programs, watch: Watch
) -> None:
    fleet = fleet_file(m2pem.folder, VEHICLES, LENGTH_M, lost_after="10 s")
    simulated = m2pem.simulate(fleet, SPEED)
    watch.until_heard()
    words = ("--speed", f"{SPEED:g}", "--ocu", "none", "--format", "json")
    program = m2pem.m2pem("run", mission(m2pem.folder), "--fleet", fleet, *words)
    program.until_record("BehaviorProgressed", state="RUNNING")
    watch.until(lambda: watch["first"].north_m > 5.0)
    simulated.type(f"first: silent for {SILENT_S} s")
    lost = program.until_record("WorkReassigned")
    assert (lost["code"], lost["excluded"]) == ("LINK_LOST", ["first"])
    returned = program.until_record("ResourceReturned")
    assert (returned["resource"], returned["code"]) == ("first", "LINK_LOST")
    watch.until(lambda: watch["first"].stands)
    assert 40.0 < watch["first"].north_m < LENGTH_M - 20.0, "it drove on, and was stopped"
    assert program.until_record("RunEnded")["outcome"] == "completed", program.said
    assert program.rest() == 0
    asked = [each["resources"] for each in program.those("BehaviorRequested")]
    assert asked == [["first"], ["second"]]
    assert watch["second"].north_m == pytest.approx(LENGTH_M, abs=2.0)
