"""The verdicts on a run's requirements, made of its records."""

from m2pem.api import RequirementStates, worst_first
from m2pem.api import records as r
from m2pem.api.requirement_states import in_short

LOW, FAR = "battery(uav1) > 20 %", "distance(uav1, uav2) > 5 m"


def states() -> RequirementStates:
    found = RequirementStates()
    found.take(r.RequirementMonitored("home", "<>ended", "At some point the mission is over."), 0.0)
    monitored = r.RequirementMonitored(
        "safe", f"[]({LOW} && {FAR})", "Always safe.", conditions=(LOW, FAR)
    )
    found.take(monitored, 0.0)
    return found


def test_an_open_requirement_says_of_what_nothing_is_known() -> None:
    found = states()
    assert str(found["home"]) == "home is open: At some point the mission is over"
    both = "nothing is known of uav1's battery, the distance of uav1 and uav2"
    assert str(found["safe"]) == f"safe is open: Always safe ({both})"
    assert found.take(r.TelemetryConditionChanged(LOW, True), 1.0) == ["safe"]
    assert found["safe"].reason == "nothing is known of the distance of uav1 and uav2"
    found.take(r.TelemetryConditionChanged(FAR, False), 2.0)
    assert found["safe"].reason == ""


def test_after_a_restart_nothing_is_known_until_telemetry_comes() -> None:
    found = states()
    for text in (LOW, FAR):
        found.take(r.TelemetryConditionChanged(text, True), 1.0)
    assert set(found.take(r.RunClaimed(2), 2.0)) == {"safe"}
    assert "uav1's battery" in found["safe"].reason


def test_a_requirement_of_a_new_version_knows_what_was_known_of_the_same_condition() -> None:
    found = states()
    found.take(r.TelemetryConditionChanged(LOW, True), 1.0)
    new = r.RequirementMonitored("charged", f"[]{LOW}", "Always charged.", conditions=(LOW,))
    found.take(new, 2.0)
    assert found["charged"].conditions == {LOW: True}
    found.take(r.RequirementDropped("safe"), 3.0)
    assert list(found) == ["home", "charged"]


def test_what_is_violated_comes_first_and_is_counted() -> None:
    found = states()
    found.take(
        r.RequirementDecided("safe", r.RequirementVerdict.VIOLATED, "", 1_500_000, "low"), 2.0
    )
    assert [each.id for each in worst_first(found.values())] == ["safe", "home"]
    assert in_short(found.values()) == "1 violated, 1 open"
    assert str(found["safe"]) == "safe is violated since 1.5 s: Always safe (low)"
    assert (found["safe"].since_s, found["safe"].recorded_s) == (1.5, 2.0)
    found.take(r.RequirementLeftOpen("home", "", "the run was stopped"), 3.0)
    assert str(found["home"]).endswith("(the run was stopped)")
    assert in_short(found.values()) == "1 violated, 1 open"
