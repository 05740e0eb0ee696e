"""What is to be found in each broken mission, and where."""

from dataclasses import dataclass
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
BROKEN = REPOSITORY / "docs" / "broken"


@dataclass(frozen=True)
class Expected:
    """Property `asked` is violated at `elements`; `words` are in the sentence that says so.

    `warning`: it is a warning, unless strict; what else is found is a violation.
    """

    name: str
    asked: str
    elements: frozenset[str]
    words: str
    warning: bool = False

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
        "can-be-triggered",
        frozenset({"SignalStop"}),
        "SignalStop (stop) waits for Stop driving, which nothing in the mission sends",
    ),
    Expected(
        "two_tasks_on_one_vehicle",
        "one-behavior",
        frozenset({"SurveyField", "DriveRoad"}),
        "SurveyField (SURVEY FIELD) wants rover while DriveRoad (DRIVE ROAD) commands it",
    ),
    Expected(
        "timer_leaves_a_vehicle_flying",
        "interrupted-commanded-again",
        frozenset({"SurveyField", "TooLate"}),
        "uav1 is interrupted by TooLate (ten minutes) and not commanded again",
    ),
    Expected(
        "unanswered_decision",
        "decisions-handled",
        frozenset({"Decision", "AskOperator"}),
        "after 'nothing' at AskOperator (WHAT TO DO?), no flow of Decision",
    ),
    Expected(
        "exclusive_join_after_a_fork",
        "proper-completion",
        frozenset({"End"}),
        "End (all done) is reached twice",
    ),
    Expected(
        "uncaught_escalation",
        "is-caught",
        frozenset({"EndDetected"}),
        "of EndDetected (hazard detected) is caught by nothing",
        warning=True,
    ),
    Expected(
        "uncaught_error",
        "errors-caught",
        frozenset({"NotDelivered"}),
        "error NOT_DELIVERED of NotDelivered (not delivered) is caught by nothing",
    ),
    Expected(
        "loop_without_a_way_out",
        "no-livelock",
        frozenset({"AskOperator", "Decision", "SurveyField"}),
        "for ever, with no way out",
    ),
    Expected(
        "dead_task",
        "no-dead-element",
        frozenset({"SurveyField"}),
        "SurveyField (SURVEY FIELD) is never reached",
    ),
]
