"""A vehicle's node is killed while it drives: the mission catches that, and uses it again after."""

import pytest
from ros_e2e_programs import Program, Programs
from ros_e2e_watch import Watch
from ros_e2e_world import convoy, fleet_file

SPEED = 4.0
LENGTH_M = 120.0
WATCHED = {
    "soon": {},
    "late": {},
    "soon_by_action": {"via": "action"},
    "late_by_action": {"via": "action"},
}
SOON = ("soon", "soon_by_action")
"""Their nodes are back before they were silent for `lost_after`; those of the others are not."""

SAYS = {True: "the vehicle's node was restarted", False: "no message for"}


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
    fleet = fleet_file(m2pem.folder, WATCHED, LENGTH_M, lost_after="16 s")
    simulated = m2pem.simulate(fleet, SPEED)
    watch.until_heard()
    mission = convoy(m2pem.folder, WATCHED, again="PT50S")
    program = m2pem.run(mission, fleet, SPEED)
    program.until_record("BehaviorProgressed", count=len(WATCHED), state="RUNNING")
    watch.until(lambda: all(watch[name].north_m > 5.0 for name in WATCHED))
    for name in WATCHED:
        simulated.type(f"{name}: kill node for {1 if name in SOON else 28} s")
    # Without a node nobody drives it: it stands until the mission has it drive again.
    watch.until(lambda: all(watch[name].stands for name in WATCHED))
    assert all(watch[name].north_m < LENGTH_M - 5.0 for name in WATCHED)
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
