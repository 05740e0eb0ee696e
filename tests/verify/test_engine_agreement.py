"""What is verified is what flies: each run of the engine is a run of the net."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

from m2pem.bpmn import read_mission
from m2pem.errors import MissionError
from m2pem.fleet.default_fleet import fleet_for
from m2pem.mission.mission import Mission
from m2pem.verify.check import check
from m2pem.verify.net.petri_net import Exactness, PetriNet
from m2pem.verify.net.simplify import simplify
from m2pem.verify.properties.results import Verdict
from m2pem.verify.search.explore import Limits, explore
from m2pem.verify.translate import Options, translate
from tests.engine.notation import mission as notation
from tests.engine.random_missions import graph, structured
from tests.verify.conformance import play
from tests.verify.models import Walk
from tests.verify.trace_mapping import TooManyStatesError

ROOT = Path(__file__).parents[2]
OPEN = Options(open_world=True, service_writes={"Detector": ["detection.type"]})
IN_ORDER = replace(OPEN, timers_in_order=True)
MISSIONS = sorted([*ROOT.glob("missions/*.bpmn"), *ROOT.glob("examples/*/mission.bpmn")])
COUNTING = {"compensation_each_time", "compensation_loop"}
"""Cases whose data would have to be given at the start: without, they count for ever."""

CASES = [path for path in sorted(ROOT.glob("tests/data/*/*.bpmn")) if path.stem not in COUNTING]
PARTS = 8
"""In which all cases are walked; all at once, they take long."""


def walked(mission: Mission, net: PetriNet, seeds: range) -> str:
    fleet = fleet_for(mission)
    for seed in seeds:
        try:
            walk = Walk(mission, fleet, net, seed)
            lost = walk.go()
        except TooManyStatesError:
            continue
        if lost and not _explained(walk, net):
            return f"seed {seed}: {lost}"
    return ""


def _explained(walk: Walk, net: PetriNet) -> bool:
    """What docs/verification-internals.md says of where the net stops short of the engine."""
    if any(a.exactness is Exactness.BOUNDED for a in net.approximations):
        return True
    if "EXPRESSION" in walk.run.state.detail:
        return True
    if walk.run.state.detail.startswith("stuck"):
        return any("may become true" in a.what for a in net.approximations)
    return bool(explore(simplify(net), Limits(states=20_000, tokens=3)).overflows)


@pytest.mark.parametrize("file", MISSIONS, ids=lambda f: f"{f.parent.name}-{f.stem}")
def test_the_transitions_can_do_what_the_engine_does_of_a_mission(file: Path) -> None:
    mission = read_mission(file)
    assert walked(mission, translate(mission, options=OPEN), range(8)) == ""
    assert walked(mission, translate(mission, options=IN_ORDER), range(8, 12)) == ""


@pytest.mark.parametrize("part", range(PARTS))
def test_the_transitions_can_do_what_the_engine_does_of_every_case_of_the_standard(
    part: int,
) -> None:
    assert lost_of(CASES[part::PARTS]) == {}


@pytest.mark.long
def test_no_more_is_lost_of_a_case_that_counts_for_ever_than_what_it_counts() -> None:
    assert lost_of(sorted(ROOT.glob("tests/data/*/compensation_*.bpmn"))).keys() <= COUNTING


def lost_of(files: list[Path]) -> dict[str, str]:
    """By name of the file, the first run of the engine that the transitions cannot do."""
    lost = {}
    for file in files:
        try:
            mission = read_mission(file)
        except MissionError:
            continue
        net = translate(mission, options=OPEN)
        found = walked(mission, net, range(2))
        if sum(transition.due_us is not None for transition in net.transitions) > 1:
            found = found or walked(mission, translate(mission, options=IN_ORDER), range(2, 4))
        if found:
            lost[file.stem] = found
    return lost


def seeds(short: Sequence[int], all_of_them: range) -> list[object]:
    """Seeds of a random mission as parameters: all but some are long."""
    return [
        pytest.param(seed, marks=() if seed in short else pytest.mark.long) for seed in all_of_them
    ]


@pytest.mark.parametrize("seed", seeds([0, 1, *range(3, 13)], range(40)))
def test_the_transitions_can_do_what_the_engine_does_of_a_random_mission(seed: int) -> None:
    mission = notation((structured if seed % 2 else graph)(Random(seed)))
    assert walked(mission, translate(mission, options=OPEN), range(2)) == ""


@pytest.mark.parametrize("seed", seeds(range(40, 48), range(40, 60)))
def test_the_engines_timers_come_in_order_in_a_random_mission(seed: int) -> None:
    mission = notation((structured if seed % 2 else graph)(Random(seed)))
    assert walked(mission, translate(mission, options=IN_ORDER), range(3)) == ""


def test_the_runs_that_violate_a_property_can_be_played_to_the_engine() -> None:
    mission = read_mission(ROOT / "missions" / "vignette1.bpmn")
    options = Options(service_writes={"Detector": ["detection.type"]})
    report = check(mission, options=options)
    failures = next(each for each in report.results if each.property == "failures-handled")
    assert failures.verdict is Verdict.VIOLATED
    for violation in failures.violations:
        played = play(mission, fleet_for(mission), report.net, violation.run)
        assert played.agrees, played.stopped
        assert "which no event catches" in played.steps[-1].records[-1].detail  # type: ignore[union-attr]
