"""Records as sentences, in the words of the diagram."""

import pytest

from m2pem.api import Importance, Kind, RunStatus, RunSummary, RunView, StampedRecord, describe
from m2pem.api import records as r
from m2pem.api.description import printable
from m2pem.bpmn import parse_mission
from m2pem.mission.catalogue import BehaviorState
from tests.command_line import MISSION

VIGNETTE = parse_mission(MISSION.read_bytes(), str(MISSION))
ON_ROUTE = (7, "DETECTION", "DriveRoute", 2)
REQUESTED = r.BehaviorRequested(
    *ON_ROUTE, "r1.b1", "single_vehicle_routing", "vehicle", ("evsg1",), {}, {}
)
ASKED = r.PromptOpened(1, "VIGNETTE1", "UserSendRoute", 1, "p1", "Well?", ())

WANTED = r.AllocationRequested(*ON_ROUTE, "r1.a1", "goto", "vehicle", {}, 0, 0)
HELD = "role 'scout': uav1 is held by r2.b1"


def sentence(*records: r.Record) -> str:
    """The sentence about the last of these."""
    view = RunView(RunSummary("r1", "m.bpmn", "", RunStatus.RUNNING, 0), VIGNETTE)
    for seq, record in enumerate(records, 1):
        stamped = StampedRecord("r1", seq, 0.0, record)
        view.apply(stamped)
    return describe(stamped, view).text


@pytest.mark.parametrize(
    ("records", "expected"),
    [
        ([r.OperatorTookControl("evsg1", "ann")], "evsg1 taken by ann"),
        ([r.OperatorGaveControlBack("evsg1", "ann")], "evsg1 given back by ann"),
        ([r.InputIgnored("late")], "ignored: late"),
        ([r.TokenLeft(*ON_ROUTE, r.TokenOutcome.COMPLETED)], "DRIVE ROUTE: completed"),
        ([ASKED, r.PromptWithdrawn("p1")], "USER SEND ROUTE: no longer asked"),
        ([r.DataWritten(*ON_ROUTE, "speed", 2.5, 1)], "speed = 2.5"),
        (
            [REQUESTED, r.BehaviorProgressed("r1.b1", 1, BehaviorState.RUNNING)],
            "evsg1: single_vehicle_routing: running",
        ),
        (
            [r.BehaviorEnded(*ON_ROUTE, "r1.b1", BehaviorState.SUCCEEDED, "")],
            "DRIVE ROUTE: r1.b1: succeeded",
        ),
        (
            [
                r.EventAwaited(*ON_ROUTE, 3, r.Trigger.TIMER, due_us=5_000_000),
                r.EventTriggered(3),
            ],
            "DRIVE ROUTE: timer occurred",
        ),
        ([WANTED], "DRIVE ROUTE: asks for resources for goto"),
        (
            [WANTED, r.AllocationDelayed("r1.a1", HELD, {"uav1": "r2.b1"})],
            "DRIVE ROUTE: waits for role 'scout': uav1 is held by r2.b1",
        ),
        (
            [WANTED, r.AllocationDelayed("r1.a1", "what is free is kept", {})],
            "DRIVE ROUTE: waits: what is free is kept",
        ),
        (
            [WANTED, r.AllocationDelayed("r1.a1", "uav1 is with ann", {}, again=True)],
            "DRIVE ROUTE: asks again, as uav1 is with ann",
        ),
        (
            [WANTED, r.AllocationEnded("r1.a1", "RESOURCE_UNAVAILABLE", HELD)],
            f"DRIVE ROUTE: gets no resources, RESOURCE_UNAVAILABLE ({HELD})",
        ),
        ([WANTED, r.AllocationEnded("r1.a1")], "DRIVE ROUTE: no longer asks for resources"),
        ([r.AllocationEnded("r1.a1")], "r1.a1: no longer asks for resources"),
        ([r.RunYielded(())], "RunYielded"),
        ([r.TokensGathered(*ON_ROUTE)], "TokensGathered: DRIVE ROUTE"),
    ],
)
def test_every_record_has_a_sentence(records: list[r.Record], expected: str) -> None:
    assert sentence(*records) == expected


def test_a_sentence_has_at_most_the_beginning_of_a_value() -> None:
    assert len(sentence(r.DataWritten(*ON_ROUTE, "text", "x" * 1000, 1))) == len("text = ") + 200


@pytest.mark.parametrize(
    ("record", "kind", "importance"),
    [
        (ASKED, Kind.PROMPTS, Importance.ATTENTION),
        (r.ErrorThrown(*ON_ROUTE, "LOST"), Kind.EVENTS, Importance.ERROR),
        (r.ErrorThrown(*ON_ROUTE, "LOST", "", "Catch"), Kind.EVENTS, Importance.ATTENTION),
        (
            r.BehaviorUnsettled("r1.b1", BehaviorState.UNKNOWN),
            Kind.BEHAVIORS,
            Importance.WARNING,
        ),
        (r.OperatorTookControl("evsg1", "ann"), Kind.OPERATORS, Importance.WARNING),
        (r.RunPaused(0), Kind.RUN, Importance.WARNING),
        (
            r.BehaviorEnded(*ON_ROUTE, "r1.b1", BehaviorState.LOST, "LOST"),
            Kind.BEHAVIORS,
            Importance.WARNING,
        ),
        (r.ServiceEnded(*ON_ROUTE, "s1", "FAILED"), Kind.BEHAVIORS, Importance.ERROR),
        (r.TokenLeft(*ON_ROUTE, r.TokenOutcome.FAILED), Kind.TOKENS, Importance.ATTENTION),
        (r.RunEnded(r.RunOutcome.STOPPED, ""), Kind.RUN, Importance.ERROR),
    ],
)
def test_what_an_operator_must_see_is_urgent(
    record: r.Record, kind: Kind, importance: Importance
) -> None:
    view = RunView(RunSummary("r1", "m.bpmn", "", RunStatus.RUNNING, 0), VIGNETTE)
    description = describe(StampedRecord("r1", 1, 0.0, record), view)
    assert (description.kind, description.importance) == (kind, importance)
    assert description.importance.is_urgent


def test_what_goes_well_is_not_urgent() -> None:
    assert not Importance.GOOD.is_urgent
    assert not Importance.NORMAL.is_urgent


def test_names_cannot_control_a_terminal() -> None:
    assert printable("a\x1b[2J\nb\tc\u202e") == "a?[2J b c?"
