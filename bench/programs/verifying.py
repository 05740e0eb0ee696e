"""Verifies: each line of standard input is an order as JSON; figures and a verdict as JSON.

    {"how": "whole" | "reduced" | "spin", "xml": ...}
    {"how": ..., "xml": ..., "requirement": "<> completed(t0_2)"}
    {"how": "builtin" | "spin", "file": ..., "fleet": ... | null}

The first searches all that a model can do, with nothing left out, without orders that lead to the
same, or with Spin. The second asks a requirement of it. The third does to a mission what
`m2pem verify` does. Times are CPU time, that of Spin and its compiler in them; `wall_s` is not.
"""

import json
import resource
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median
from typing import Any, TypeVar

from bench.measured import peak_kb
from m2pem.bpmn import parse_mission
from m2pem.cli.verify import findings
from m2pem.executive.loading import load_source
from m2pem.executive.verification import SearchEngine
from m2pem.fleet.default_fleet import fleet_for
from m2pem.mission.mission import Mission
from m2pem.scripting.verification import search_request
from m2pem.verify.check import search as search_as_it_does
from m2pem.verify.ltl import parse
from m2pem.verify.ltl.model_check import Result as Answered
from m2pem.verify.net.petri_net import PetriNet
from m2pem.verify.net.simplify import simplify
from m2pem.verify.properties import ALL, SearchedMission
from m2pem.verify.properties.results import Result, Verdict
from m2pem.verify.requirements import Requirement
from m2pem.verify.requirements.check import (
    Answer,
    check_requirement,
    net_for,
    reduction_for,
)
from m2pem.verify.search.explore import Exploration, Limits, explore
from m2pem.verify.search.stubborn_sets import StubbornSets
from m2pem.verify.spin.search import search as search_with_spin
from m2pem.verify.translate import translate

T = TypeVar("T")
LIMIT_S = 300.0
ENOUGH_S = 0.5
MOST_TIMES = 9


class Steps:
    """CPU seconds by step, of this process and of those that it waited for."""

    def __init__(self) -> None:
        self.took_s: dict[str, float] = {}

    def step(self, name: str, work: Callable[[], T]) -> T:
        """Do a step."""
        began = cpu_s()
        done = work()
        self.took_s[name] = cpu_s() - began
        return done


def cpu_s() -> float:
    """CPU seconds so far."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def searched(how: str, xml: str, limits: Limits, steps: Steps) -> tuple[int, str]:
    """States and the verdict."""
    mission, net = _transitions(xml, steps)
    if how == "spin":
        found = steps.step("search_s", lambda: search_with_spin(net, limits))
        wrong = found.stuck_runs or found.transition_runs or found.overflow_runs
        fired = len(found.fired) == len(net.transitions)
        if found.stopped is not None:
            return found.states, f"undecided: {found.stopped}"
        return found.states, "violated" if wrong or not fired else "holds"
    seen = steps.step("search_s", lambda: _seen(how, net, limits))
    results = steps.step(
        "judge_s", lambda: [each(SearchedMission(mission, net, seen)) for each in ALL]
    )
    if seen.stopped is not None:
        return len(seen.states), f"undecided: {seen.stopped}"
    return len(seen.states), verdicts(results)


def _transitions(xml: str, steps: Steps) -> tuple[Mission, PetriNet]:
    mission = steps.step("read_s", lambda: parse_mission(xml.encode(), "bench.bpmn"))
    fleet = fleet_for(mission)
    return mission, steps.step("derive_s", lambda: simplify(translate(mission, fleet)))


def _seen(how: str, net: PetriNet, limits: Limits) -> Exploration:
    return explore(net, limits, reduction=StubbornSets(net) if how == "reduced" else None)


def required(how: str, xml: str, formula: str, limits: Limits, steps: Steps) -> tuple[int, str]:
    """States of the search, and of the product with what the requirement forbids; the answer."""
    mission = steps.step("read_s", lambda: parse_mission(xml.encode(), "bench.bpmn"))
    asked = Requirement("asked", parse(formula), "")
    fleet = fleet_for(mission)
    net = steps.step("derive_s", lambda: net_for(mission, fleet, [asked]))

    def search() -> Answer:
        reduction = reduction_for(net, mission, fleet, asked) if how == "reduced" else None
        found = explore(net, limits, reduction=reduction)
        return check_requirement(found, mission, fleet, asked)

    answer = steps.step("search_s", search)
    if answer.result is Answered.UNDECIDED:
        return answer.states, f"undecided: {answer.why}"
    return answer.states, str(answer.result)


def checked(how: str, file: str, fleet: str | None, steps: Steps) -> tuple[int, str]:
    """What `m2pem verify` does; its steps are taken once before, to see what each of them takes."""
    asked = search_request(load_source(file), fleet, None, {})
    net = steps.step(
        "derive_s", lambda: simplify(translate(asked.mission, asked.fleet, options=asked.options))
    )
    limits = Limits(tokens=3)
    if how == "spin":
        states = steps.step("search_s", lambda: search_with_spin(net, limits)).states
    else:
        states = len(steps.step("search_s", lambda: search_as_it_does(net, limits)).states)

    def everything() -> Sequence[Result]:
        asked = search_request(load_source(file), fleet, None, {})
        found = findings(asked, SearchEngine(how, "exact", limits), strict=False)
        return found.results

    return states, verdicts(steps.step("all_s", everything))


def verdicts(results: Sequence[Result]) -> str:
    """ "holds", or the names of those that do not."""
    named: dict[str, list[str]] = {}
    for each in results:
        if each.verdict is not Verdict.HOLDS:
            warning = each.warning and each.verdict is Verdict.VIOLATED
            named.setdefault("warning" if warning else each.verdict, []).append(each.property)
    kinds = [kind for kind in ("violated", "undecided", "warning") if kind in named]
    said = [f"{kind}: {', '.join(named[kind])}" for kind in kinds]
    if not named.keys() - {"warning"}:
        said.insert(0, "holds")
    return "; ".join(said)


def answer(order: dict[str, Any], steps: Steps) -> tuple[int, str]:
    """Do what an order says, once."""
    how, limit_s = order["how"], order.get("limit_s", LIMIT_S)
    limits = Limits(states=3_000_000, seconds=limit_s, memory_mb=8_000, tokens=3)
    if "file" in order:
        return checked(how, str(Path(order["file"])), order["fleet"], steps)
    if "requirement" in order:
        return required(how, order["xml"], order["requirement"], limits, steps)
    return searched(how, order["xml"], limits, steps)


def main() -> None:
    """Do each order until there is something to measure, and answer."""
    for line in sys.stdin:
        print(json.dumps(measured(json.loads(line))), flush=True)


def measured(order: dict[str, Any]) -> dict[str, Any]:
    """Do an order until there is something to measure."""
    times: list[dict[str, float]] = []
    while True:
        steps = Steps()
        began = time.perf_counter()
        states, verdict = answer(order, steps)
        took = {**steps.took_s, "wall_s": time.perf_counter() - began}
        # The whole, unless it was measured apart from its steps.
        took.setdefault("all_s", sum(steps.took_s.values()))
        times.append(took)
        if verdict.startswith("undecided"):
            break
        spent = sum(each["wall_s"] for each in times)
        if spent > order.get("enough_s", ENOUGH_S) or len(times) >= MOST_TIMES:
            break
    figures = {name: median(each[name] for each in times) for name in times[0]}
    return {**figures, "states": states, "peak_kb": peak_kb(), "verdict": verdict}


if __name__ == "__main__":
    main()
