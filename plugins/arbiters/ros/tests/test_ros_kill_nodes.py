"""A vehicle's node is killed while it drives: the mission catches that, and uses it again after."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from ros_e2e_programs import Program, Programs, programs
from ros_e2e_watch import Watch, watching
from ros_e2e_world import convoy, fleet_file

SPEED = 4.0
LENGTH_M = 120.0
VEHICLES = {
    "soon": {},
    "late": {},
    "soon_by_action": {"via": "action"},
    "late_by_action": {"via": "action"},
}
SOON = ("soon", "soon_by_action")
"""Their nodes are back before they were silent for `lost_after`; those of the others are not."""

SAYS = {True: "the vehicle's node was restarted", False: "no message for"}


@pytest.fixture
def m2pem(tmp_path: Path, ros_domain: int) -> Iterator[Programs]:
    with programs(tmp_path, ros_domain) as started:
        yield started


@pytest.fixture
def watch(ros_domain: int) -> Iterator[Watch]:
    with watching(VEHICLES, ros_domain) as heard:
        yield heard


def ends(program: Program, vehicle: str) -> list[tuple[str, str]]:
    """How the behaviors of a vehicle have ended, in order."""
    asked = program.those("BehaviorRequested", resources=[vehicle])
    ids = [each["behavior"] for each in asked]
    return [
        (each["state"], each["code"])
        for each in program.those("BehaviorEnded")
        if each["behavior"] in ids
    ]


@pytest.mark.long
def test_a_killed_node_is_a_lost_link_and_the_vehicle_is_used_again_after(
    m2pem: Programs, watch: Watch
) -> None:
    fleet = fleet_file(m2pem.folder, VEHICLES, LENGTH_M, lost_after="16 s")
    simulated = m2pem.simulate(fleet, SPEED)
    watch.until_heard()
    mission = convoy(m2pem.folder, VEHICLES, again="PT50S")
    words = ("--speed", f"{SPEED:g}", "--ocu", "none", "--format", "json")
    program = m2pem.m2pem("run", mission, "--fleet", fleet, *words)
    program.until_record("BehaviorProgressed", count=len(VEHICLES), state="RUNNING")
    watch.until(lambda: all(watch[name].north_m > 5.0 for name in VEHICLES))
    for name in VEHICLES:
        simulated.type(f"{name}: kill node for {1 if name in SOON else 28} s")
    # Without a node nobody drives it: it stands until the mission has it drive again.
    watch.until(lambda: all(watch[name].stands for name in VEHICLES))
    assert all(watch[name].north_m < LENGTH_M - 5.0 for name in VEHICLES)
    assert program.until_record("RunEnded")["outcome"] == "completed", program.said
    assert program.rest() == 0
    for name, track in watch.items():
        assert ends(program, name) == [("LOST", "LINK_LOST"), ("SUCCEEDED", "")], name
        assert len(program.those("TokenEntered", element=f"Lost_{name}")) == 1
        assert track.north_m == pytest.approx(LENGTH_M, abs=1.0)
    for lost in program.those("BehaviorEnded", state="LOST"):
        (asked,) = program.those("BehaviorRequested", behavior=lost["behavior"])
        soon = asked["resources"][0] in SOON
        assert SAYS[soon] in lost["reason"], lost
    for name in ("soon", "late"):
        watch.until(lambda name=name: len(watch[name].accepted()) >= 2)
        assert len(watch[name].accepted()) == 2
