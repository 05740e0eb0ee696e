import pytest

from m2pem.api.runs import StampedRecord
from m2pem.bpmn import parse_mission
from m2pem.cli.line_formatter import LineFormatter
from m2pem.engine import records as r
from m2pem.engine.records import Record, RunOutcome, TokenOutcome
from m2pem.mission.catalogue import BehaviorState
from tests.command_line import MISSION

VIGNETTE = parse_mission(MISSION.read_bytes(), str(MISSION))
ON_ROUTE = (7, "DETECTION", "DriveRoute", 2)
REQUESTED = r.BehaviorRequested(
    *ON_ROUTE, "r1.b1", "single_vehicle_routing", "vehicle", ("evsg1",), {}, {}
)
STOP = "dc45ff2b-ef6b-45bd-96e6-c7ac8ef055c2"


def formatted(*records: Record, run: str = "r1") -> str | None:
    """The line about the last of these."""
    lines = LineFormatter(lambda _: VIGNETTE)
    said = [
        lines.format(StampedRecord(run, n, 12.34, record)) for n, record in enumerate(records, 1)
    ]
    return said[-1] if said[-1] is None else said[-1].removeprefix("     12.3 s  ")


@pytest.mark.parametrize(
    ("record", "said"),
    [
        (r.RunStarted("VIGNETTE1", 0, "ann"), "r1 of VIGNETTE1 started by ann"),
        (r.RunClaimed(2), "r1 taken up again"),
        (r.RunPaused(0, "ann"), "r1 paused by ann"),
        (r.RunResumed(0, "ann"), "r1 resumed by ann"),
        (r.RunEnded(RunOutcome.FAILED, "stuck"), "r1 failed: stuck"),
        (r.TokenEntered(*ON_ROUTE), "DRIVE ROUTE"),
        (r.TokenLeft(*ON_ROUTE, TokenOutcome.INTERRUPTED), "DRIVE ROUTE: interrupted"),
        (
            r.AllocationRequested(*ON_ROUTE, "r1.a1", "goto", "vehicle", {}, 0, 0),
            None,
        ),
        (r.AllocationEnded("r1.a1"), None),
        (
            r.ResourcesAllocated(*ON_ROUTE, "r1.a1", {"scout": ("evsg1",)}, {"roles": {}}),
            "DRIVE ROUTE: evsg1 for scout",
        ),
        (REQUESTED, "DRIVE ROUTE: evsg1 begins single_vehicle_routing"),
        (
            r.PromptAnswered(1, "VIGNETTE1", "UserSendRoute", 1, "p1", "abort", "ann"),
            "USER SEND ROUTE: abort, answered by ann",
        ),
        (
            r.PromptOpened(1, "VIGNETTE1", "UserSendRoute", 1, "p1", "Well?", ()),
            "USER SEND ROUTE asks: Well?",
        ),
        (
            r.ServiceRequested(1, "DETECTION", "Detector", 2, "s1", "Detector", {}, {}),
            "DETECTOR: runs Detector",
        ),
        (r.ServiceEnded(1, "DETECTION", "Detector", 2, "s1"), "DETECTOR: done"),
        (
            r.ServiceEnded(1, "DETECTION", "Detector", 2, "s1", "FAILED", "no power"),
            "DETECTOR: failed, FAILED (no power)",
        ),
        (
            r.CompensationTriggered(*ON_ROUTE, 1, 2, (3,)),
            "DRIVE ROUTE: undoes what was done",
        ),
        (r.CompensationTriggered(*ON_ROUTE, 1, 2), "DRIVE ROUTE: there is nothing to undo"),
        (
            r.CompensationBegan(8, "DETECTION", "Detector", 2, 1, 3, "DriveRoute"),
            "DRIVE ROUTE: is undone",
        ),
        (r.TransactionCancelled(*ON_ROUTE), "DRIVE ROUTE: the transaction is cancelled"),
        (r.SignalThrown(STOP, by="ann"), "ann: signal 'Stop driving'"),
        (r.SignalThrown(STOP, 1, "DETECTION", "ThrowStop", 2), "stop: signal 'Stop driving'"),
        (
            r.EscalationThrown(1, "DETECTION", "EndDetected", 2, "e", "H", "EscalationDetected"),
            "hazard detected: escalation H, caught by hazard detected",
        ),
        (
            r.ErrorThrown(*ON_ROUTE, "LINK_LOST", "silent"),
            "DRIVE ROUTE: error LINK_LOST (silent), not caught",
        ),
        (r.GeometryReceived("route_alpha", {}, "ann"), "route_alpha received by ann"),
    ],
)
def test_a_record_that_matters_is_a_line(record: Record, said: str) -> None:
    assert formatted(record) == said


@pytest.mark.parametrize(
    "record",
    [
        r.TokenEntered(1, "DETECTION", "ForkDetection", 2),
        r.TokenLeft(*ON_ROUTE, TokenOutcome.COMPLETED),
        r.FlowTaken(1, "DETECTION", "ForkDetection", 2, "FlowToDetector"),
        r.InputIgnored("late"),
        r.ScopeOpened(1, "VIGNETTE1", "VIGNETTE1"),
    ],
)
def test_what_matters_to_programs_only_is_no_line(record: Record) -> None:
    assert formatted(record) is None


@pytest.mark.parametrize(
    ("state", "code", "reason", "how"),
    [
        (BehaviorState.SUCCEEDED, "", "", "succeeded"),
        (BehaviorState.CANCELLED, "FAILED", "", "cancelled"),
        (BehaviorState.FAILED, "ROUTE_BLOCKED", "a tree", "failed, ROUTE_BLOCKED (a tree)"),
    ],
)
def test_the_end_of_a_behavior_names_who_did_what(
    state: BehaviorState, code: str, reason: str, how: str
) -> None:
    ended = r.BehaviorEnded(*ON_ROUTE, "r1.b1", state, code, reason)
    assert formatted(REQUESTED, ended) == f"DRIVE ROUTE: evsg1 ends single_vehicle_routing: {how}"


def test_a_held_behavior_names_who_does_what() -> None:
    held = r.BehaviorUnsettled("r1.b1", BehaviorState.UNKNOWN, "not known any more")
    assert formatted(REQUESTED, held) == "evsg1: single_vehicle_routing: held, not known any more"


def test_a_second_run_is_named() -> None:
    lines = LineFormatter(lambda _: VIGNETTE)
    first = lines.format(StampedRecord("r1", 1, 0.0, r.RunPaused(0)))
    second = lines.format(StampedRecord("r2", 1, 0.0, r.RunPaused(0)))
    assert (first, second) == ("      0.0 s  r1 paused", "      0.0 s  r2   r2 paused")


def test_every_run_is_named_when_there_are_several() -> None:
    lines = LineFormatter(lambda _: VIGNETTE, one=False)
    assert (
        lines.format(StampedRecord("r1", 1, 0.0, r.RunPaused(0))) == "      0.0 s  r1   r1 paused"
    )


def test_a_run_whose_diagram_is_not_known_is_described_with_ids() -> None:
    lines = LineFormatter(lambda _: None)
    entered = r.TokenEntered(1, "P", "Unknown", 1)
    assert lines.format(StampedRecord("r1", 1, 0.0, entered)) == "      0.0 s  Unknown"


def test_after_a_revision_elements_have_the_names_of_the_new_version() -> None:
    missions = {"r1": VIGNETTE}
    lines = LineFormatter(missions.get)
    entered = r.TokenEntered(*ON_ROUTE)
    assert lines.format(StampedRecord("r1", 1, 0.0, entered)) == "      0.0 s  DRIVE ROUTE"
    source = VIGNETTE.source.decode().replace("DRIVE ROUTE", "DRIVE THE LANE")
    missions["r1"] = parse_mission(source.encode(), "vignette1.bpmn")
    revised = r.MissionRevised("0123456789abcdef", "0", "anna")
    line = lines.format(StampedRecord("r1", 2, 4.0, revised))
    assert line == "      4.0 s  r1 goes on with version 0123456789ab of its mission by anna"
    assert lines.format(StampedRecord("r1", 3, 4.0, entered)) == "      4.0 s  DRIVE THE LANE"


def test_an_instance_says_which_it_is() -> None:
    lines = LineFormatter(lambda _: None)
    entered = r.TokenEntered(2, "P", "Survey", 2, instance=0)
    told = lines.format(StampedRecord("r1", 1, 0.0, entered))
    assert told == "      0.0 s  Survey, instance 0"


def test_colour_is_for_terminals() -> None:
    lines = LineFormatter(lambda _: VIGNETTE, colour=True)
    line = lines.format(StampedRecord("r1", 1, 0.0, r.RunPaused(0)))
    assert line is not None
    assert line.startswith("\x1b[33m")
