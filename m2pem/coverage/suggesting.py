"""Suggests answers files that reach what no scenario sees; each was rehearsed, and does."""

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from m2pem.coverage.items import Item, Kind, seen_in
from m2pem.coverage.reach import Reach
from m2pem.coverage.scripting import Content, NotScriptableError, answers_for
from m2pem.engine.records import TokenEntered
from m2pem.executive.verification import known_ways
from m2pem.mission.values import Value
from m2pem.rehearsal.answers import Answers
from m2pem.rehearsal.answers_file import AnswersModel
from m2pem.rehearsal.rehearsal import RehearsalResult, Rehearser
from m2pem.verify.conformance_run import ConformanceRun

MAX_STEPS = 20_000
"""Engine steps after which a rehearsal of a suggestion is given up."""

_FIRST = (Kind.END, Kind.ERROR, Kind.EVENT, Kind.FLOW, Kind.ELEMENT)
"""Ends come first: on the way to them most of the rest is seen."""


@dataclass(frozen=True, slots=True)
class Suggestion:
    """An answers file, what it reaches that nothing before it does, and how its rehearsal ended.

    `entered`: the elements among those, in the order in which tokens entered them first.
    """

    answers: Content
    reaches: tuple[Item, ...]
    entered: tuple[str, ...]
    ended: str
    detail: str


def suggest_answers(
    reach: Reach,
    rehearser: Rehearser,
    data: Mapping[str, Value],
    wanted: Sequence[Item],
    seconds: float,
) -> tuple[tuple[Suggestion, ...], dict[str, str]]:
    """Return suggestions that reach as much of `wanted` as can be, and why the rest is out of
    reach, by key.

    After `seconds` no more is looked for.
    """
    until = time.monotonic() + seconds
    found: list[Suggestion] = []
    unscripted: dict[str, str] = {}
    missing = {item.key: item for item in sorted(wanted, key=lambda item: _FIRST.index(item.kind))}
    for item in list(missing.values()):
        if item.key not in missing or not reach.reaches(item):
            continue
        if time.monotonic() > until:
            unscripted[item.key] = f"a run reaches it; answers were looked for for {seconds:g} s"
            continue
        reason = "a run reaches it"
        for content, result in _tries(reach, rehearser, data, item):
            if isinstance(result, str):
                reason = f"a run reaches it, and no answers file does: {result}"
                continue
            reason = (
                "a run reaches it; rehearsed with the same answers, the mission goes another way"
            )
            seen = seen_in(each.record for each in result.records)
            if item.key in seen:
                reached = [missing.pop(key) for key in list(missing) if key in seen]
                found.append(_suggestion(content, reached, result))
                break
        else:
            unscripted[item.key] = reason
    return tuple(found), {key: each for key, each in unscripted.items() if key in missing}


def _suggestion(answers: Content, reaches: Sequence[Item], result: RehearsalResult) -> Suggestion:
    keys = {item.key for item in reaches}
    entered = (each.record for each in result.records if isinstance(each.record, TokenEntered))
    first = dict.fromkeys(each.element for each in entered if each.element in keys)
    summary = result.summary
    return Suggestion(answers, tuple(reaches), tuple(first), summary.status.value, summary.detail)


def _tries(
    reach: Reach, rehearser: Rehearser, data: Mapping[str, Value], item: Item
) -> Iterator[tuple[Content, RehearsalResult | str]]:
    """Yield answers that may reach an item and what their rehearsal did, or why there are none."""
    mission, fleet = rehearser.mission, rehearser.fleet
    for steps in reach.runs_to(item):
        player = ConformanceRun(mission, fleet, reach.process, data, known_ways(fleet, mission))
        try:
            contents = answers_for(player, steps)
        except NotScriptableError as error:
            yield {}, str(error)
            continue
        for content in contents:
            answers = Answers(AnswersModel.model_validate(content))
            yield (
                content,
                rehearser.rehearse(data=data, answers=answers, max_steps=MAX_STEPS, observed=False),
            )
