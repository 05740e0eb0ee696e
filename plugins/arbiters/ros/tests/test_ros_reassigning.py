"""A robot falls silent and drives on: another does its task, and when it returns it is stopped."""

import pytest
from ros_e2e_programs import Programs
from ros_e2e_watch import Watch
from ros_e2e_world import convoy, fleet_file

SPEED = 4.0
LENGTH_M = 300.0
SILENT_S = 26
"""Beyond `lost_after`; it drives some 130 m meanwhile."""

WATCHED = {"first": {}, "second": {}}

ROLE = "requires='true' onLoss='reassign' prefer=\"vehicle.name == 'NAME' ? 1000 : 0\""
"""The first vehicle if it is free, another one if it is lost."""


@pytest.mark.long
def test_a_robot_that_drove_on_unseen_is_stopped_when_it_returns(
    m2pem: Programs, watch: Watch
) -> None:
    fleet = fleet_file(m2pem.folder, WATCHED, LENGTH_M, lost_after="10 s")
    simulated = m2pem.simulate(fleet, SPEED)
    watch.until_heard()
    program = m2pem.run(convoy(m2pem.folder, ["first"], role=ROLE), fleet, SPEED)
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
