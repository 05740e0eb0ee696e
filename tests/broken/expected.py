"""What is to be found in each broken mission, and where."""

from dataclasses import dataclass
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
BROKEN = REPOSITORY / "docs" / "broken"


@dataclass(frozen=True)
class Expected:
    """Property `asked` is violated at `elements`; `words` are in the sentence that says so."""

    name: str
    asked: str
    elements: frozenset[str]
    words: str

    @property
    def mission(self) -> Path:
        return BROKEN / f"{self.name}.bpmn"

    @property
    def picture(self) -> Path:
        return BROKEN / f"{self.name}.svg"


EXPECTED = [
    Expected(
        "join_fed_by_one_branch",
        "no-deadlock",
        frozenset({"JoinDetection"}),
        "for DRIVE STOP, which can no longer come, because DRIVE ROUTE was over",
    ),
    Expected(
        "signal_with_a_wrong_id",
        "is-caught",
        frozenset({"ThrowStop"}),
        "throws the signal 'Stop driving', which nobody can catch",
    ),
    Expected(
        "two_tasks_on_one_vehicle",
        "one-behavior",
        frozenset({"SurveyField", "DriveRoad"}),
        "SURVEY FIELD wants rover while DRIVE ROAD still has it",
    ),
    Expected(
        "timer_leaves_a_vehicle_flying",
        "commanded-again",
        frozenset({"SurveyField", "TooLate"}),
        "interrupts SURVEY FIELD, and nothing tells uav1 what to do then",
    ),
    Expected(
        "unanswered_decision",
        "decisions-handled",
        frozenset({"Decision"}),
        "after 'nothing' was answered at WHAT TO DO?",
    ),
    Expected(
        "exclusive_join_after_a_fork",
        "proper-completion",
        frozenset({"End"}),
        "all done is reached twice",
    ),
    Expected(
        "escalation_nobody_catches",
        "is-caught",
        frozenset({"EndDetected"}),
        "throws the escalation 'Hazard detected', which nobody can catch",
    ),
    Expected(
        "error_nobody_catches",
        "errors-caught",
        frozenset({"NotDelivered"}),
        "throws the error 'Not delivered', nothing catches it",
    ),
    Expected(
        "loop_without_a_way_out",
        "no-livelock",
        frozenset({"AskOperator", "Decision", "SurveyField", "Decided"}),
        "can go on for ever, and no end can be reached",
    ),
    Expected(
        "dead_task",
        "no-dead-element",
        frozenset({"SurveyField", "FlowDecisionToSurveyField"}),
        "SURVEY FIELD can never be reached",
    ),
]
