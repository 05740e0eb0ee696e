"""What the executive does in each broken mission, and not in the mended one: the mistake itself.

Nothing here comes from the checker. What operators, services, vehicles and clocks do is written out
as an answers file, the mission is rehearsed, and the records show the mistake or do not.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

from tests.broken.expected import BROKEN, REPOSITORY

Records = Sequence[Any]
"""Of a rehearsal, in their order."""

VIGNETTE = REPOSITORY / "missions" / "vignette1.bpmn"
EXAMPLES = REPOSITORY / "examples"

DETECTED = """
answers: {UserSendRoute: [continue, abort]}
services: {Detector: [{after: 5 s, write: {detection.type: gpr}}]}
"""
ROUTE_DRIVEN_FIRST = """
answers: {UserSendRoute: [continue, abort]}
services: {Detector: [{after: 60 s, write: {detection.type: gpr}}]}
behaviors: {DriveRoute: [{after: 5 s, end: succeeded}]}
"""
BOTH_TAKE_LONG = """
behaviors:
  DriveRoad: [{after: 2000 s, end: succeeded}]
  SurveyField: [{after: 2000 s, end: succeeded}]
"""
ONE_AFTER_THE_OTHER = """
behaviors:
  DriveRoad: [{after: 5 s, end: succeeded}]
  SurveyField: [{after: 500 s, end: succeeded}]
"""
LINK_LOST = "behaviors: {DriveRoad: [{after: 5 s, end: failed, error: LINK_LOST}]}"


@dataclass(frozen=True)
class Situation:
    """`answers`: each is a rehearsal of its own; `shows` is asked of the records of all of them.

    `mended`: the text of the mission without the mistake.
    """

    name: str
    answers: Sequence[str]
    shows: Callable[[Sequence[Records]], bool]
    mended: str

    @property
    def broken(self) -> str:
        return (BROKEN / f"{self.name}.bpmn").read_text(encoding="utf-8")


def named(records: Records, name: str, **fields: object) -> list[Any]:
    """Records of a name that have these fields."""
    return [
        each
        for each in records
        if type(each).__name__ == name
        and all(getattr(each, field) == value for field, value in fields.items())
    ]


def entered(records: Records, element: str) -> int:
    return len(named(records, "TokenEntered", element=element))


def ended(records: Records, outcome: str) -> Any:
    """The run's end, if it ends so."""
    (over,) = named(records, "RunEnded")
    return over if over.outcome == outcome else None


# --- what is seen ---------------------------------------------------------------------------------


def _stuck_at_the_join(runs: Sequence[Records]) -> bool:
    over = ended(runs[0], "failed")
    return over is not None and over.detail == "stuck: no token can move from JoinDetection"


def _thrown_and_not_received(runs: Sequence[Records]) -> bool:
    thrown = named(runs[0], "SignalThrown", element="ThrowStop")
    driving = not named(runs[0], "BehaviorCancelRequested")
    return len(thrown) == 1 and driving and not entered(runs[0], "SignalStop")


def _wanted_while_it_is_commanded(runs: Sequence[Records]) -> bool:
    holding: dict[str, str] = {}
    for each in runs[0]:
        match type(each).__name__:
            case "BehaviorRequested":
                holding[each.behavior] = each.element
            case "BehaviorEnded":
                holding.pop(each.behavior)
            case "ErrorThrown" if each.code == "RESOURCE_UNAVAILABLE":
                return (each.element, [*holding.values()]) == ("SurveyField", ["DriveRoad"])
    return False


def _interrupted_and_left(runs: Sequence[Records]) -> bool:
    records = runs[0]
    late = next(
        n for n, r in enumerate(records) if r in named(records, "TokenEntered", element="TooLate")
    )
    flying = [r.behavior for r in records[:late] if _commands(r, "uav1")]
    cancelled = {r.behavior for r in named(records[late:], "BehaviorEnded")}
    return set(flying) <= cancelled and not any(_commands(r, "uav1") for r in records[late:])


def _commands(record: Any, resource: str) -> bool:
    return type(record).__name__ == "BehaviorRequested" and resource in record.resources


def _no_way_on(runs: Sequence[Records]) -> bool:
    thrown = named(runs[0], "ErrorThrown", element="Decision", code="NO_FLOW")
    return bool(thrown) and ended(runs[0], "failed") is not None


def _ended_twice(runs: Sequence[Records]) -> bool:
    return entered(runs[0], "End") == entered(runs[0], "DriveHome") == 2


def _passed_over(runs: Sequence[Records]) -> bool:
    (thrown,) = named(runs[0], "EscalationThrown", element="EndDetected")
    return not thrown.caught_by and not entered(runs[0], "Reverse")


def _failed_for_the_error(runs: Sequence[Records]) -> bool:
    thrown = named(runs[0], "ErrorThrown", element="NotDelivered", code="NOT_DELIVERED")
    return [each.caught_by for each in thrown] == [""] and ended(runs[0], "failed") is not None


def _asked_for_ever(runs: Sequence[Records]) -> bool:
    """However operators decide, they are asked again, as long as anybody likes to look on."""
    return all(
        not named(records, "RunEnded", outcome="completed") and entered(records, "AskOperator") > 5
        for records in runs
    )


def _never_surveyed(runs: Sequence[Records]) -> bool:
    return not any(entered(records, "SurveyField") for records in runs)


# --- what is mended -------------------------------------------------------------------------------


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def _example(name: str) -> str:
    return _text(EXAMPLES / name / "mission.bpmn")


def _both_told() -> str:
    """After ten minutes the rover and the aircraft are told to come home."""
    text = _text(BROKEN / "timer_leaves_a_vehicle_flying.bpmn")
    begin, end = text.index('<scriptTask id="DriveHome"'), text.index('<endEvent id="End"')
    home = text[begin:end]
    fly = home.replace("DriveHome", "FlyHome").replace('vehicle="rover"', 'vehicle="uav1"')
    flows = "".join(
        f'<sequenceFlow id="{source}-{target}" sourceRef="{source}" targetRef="{target}"/>'
        for source, target in [("TooLate", "FlyHome"), ("FlyHome", "EndFlown")]
    )
    added = "".join(
        line
        for line in fly.splitlines(keepends=True)
        if "<incoming>" not in line and "<outgoing>" not in line
    )
    mended = text[:end] + added + '<endEvent id="EndFlown"/>' + flows + text[end:]
    # Pictures would lack what is added.
    return mended[: mended.index("<bpmndi:")] + "</definitions>"


def _decisions(*choices: str, times: int = 1) -> list[str]:
    return [
        f"answers: {{AskOperator: [{', '.join(each)}]}}" for each in product(choices, repeat=times)
    ]


def situations() -> Iterable[Situation]:
    """One for each broken mission."""
    vignette, two = _text(VIGNETTE), _example("t03_two_vehicles")
    asking = _example("t02_ask_the_operator")
    survey, look = "survey", "look"
    return (
        Situation("join_fed_by_one_branch", [ROUTE_DRIVEN_FIRST], _stuck_at_the_join, vignette),
        Situation("signal_with_a_wrong_id", [DETECTED], _thrown_and_not_received, vignette),
        Situation("two_tasks_on_one_vehicle", [""], _wanted_while_it_is_commanded, two),
        Situation(
            "timer_leaves_a_vehicle_flying", [BOTH_TAKE_LONG], _interrupted_and_left, _both_told()
        ),
        Situation("unanswered_decision", _decisions("nothing"), _no_way_on, asking),
        Situation("exclusive_join_after_a_fork", [ONE_AFTER_THE_OTHER], _ended_twice, two),
        Situation("uncaught_escalation", [DETECTED], _passed_over, vignette),
        Situation(
            "uncaught_error",
            [LINK_LOST],
            _failed_for_the_error,
            _example("t16_faults_on_purpose"),
        ),
        Situation(
            "loop_without_a_way_out", _decisions(survey, look, times=3), _asked_for_ever, asking
        ),
        Situation("dead_task", _decisions(survey, look, "nothing"), _never_surveyed, asking),
    )
