"""What a search decides before it is over, and when it ends after a violation."""

from collections.abc import Callable
from pathlib import Path
from random import Random

import pytest

from m2pem.bpmn import parse_mission
from m2pem.verify.check import check
from m2pem.verify.net.encoding import Encoding
from m2pem.verify.net.petri_net import PetriNet
from m2pem.verify.properties import ALL, NAMES, SearchedMission
from m2pem.verify.properties.early import EarlyResults
from m2pem.verify.properties.results import Result, Verdict
from m2pem.verify.properties.soundness import IN_EACH_STATE
from m2pem.verify.search import explore as searching
from m2pem.verify.search.explore import Limits, Stopped, explore
from m2pem.verify.search.stubborn_sets import StubbornSets
from tests.verify.models import branches, unsafe
from tests.verify.random_mission_nets import random_mission_net
from tests.verify.random_nets import random_net

ROOT = Path(__file__).parents[2]
BROKEN = sorted((ROOT / "docs" / "broken").glob("*.bpmn"))
LEAST = 2_000


@pytest.fixture
def _looks_at_every_state(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small nets are searched between two looks otherwise."""
    monkeypatch.setattr(searching, "LOOK_EVERY", 1)
    monkeypatch.setattr(searching, "LOOK_EVERY_CHOICE", 1)


def test_after_a_violation_only_a_share_is_searched() -> None:
    limits = Limits(tokens=3, after_violation=LEAST, seconds=1e9)
    report = check(unsafe(12), limits=limits)
    assert report.found.stopped is Stopped.VIOLATION
    assert report.verdict is Verdict.VIOLATED
    assert report.states < 10 * LEAST
    by_name = {each.property: each for each in report.results}
    assert by_name["one-token"].verdict is Verdict.VIOLATED
    assert by_name["no-livelock"].verdict is Verdict.UNDECIDED
    assert by_name["no-livelock"].covered.endswith("stopped by a violation that was found before")


def test_without_a_share_the_search_goes_on_to_its_limits() -> None:
    limits = Limits(states=3 * LEAST, tokens=3, after_violation=None, seconds=1e9)
    report = check(unsafe(12), limits=limits)
    assert report.found.stopped is Stopped.STATES
    assert report.verdict is Verdict.VIOLATED


def test_warnings_do_not_end_a_search() -> None:
    vignette = ROOT / "missions" / "vignette1.bpmn"
    mission = parse_mission(vignette.read_bytes(), str(vignette))
    report = check(mission, limits=Limits(tokens=3, after_violation=0))
    assert report.found.complete
    assert "failures-handled" in {each.property for each in report.results if each.violations}


@pytest.mark.usefixtures("_looks_at_every_state")
def test_each_result_is_said_once_and_as_soon_as_it_is_certain() -> None:
    said: list[Result] = []
    limits = Limits(tokens=3, after_violation=LEAST, seconds=1e9)
    report = check(unsafe(6), limits=limits, decided=said.append)
    names = [each.property for each in said]
    assert len(names) == len(set(names))
    before = names[: names.index("one-token")]
    assert {"can-be-triggered", "prompts-have-decisions", "errors-caught"} <= set(before)
    assert tuple(each.property for each in report.results) == NAMES
    verdicts = {each.property: each.verdict for each in report.results}
    assert {each.property: each.verdict for each in said} == {
        name: verdict for name, verdict in verdicts.items() if verdict is not Verdict.UNDECIDED
    }


@pytest.mark.usefixtures("_looks_at_every_state")
@pytest.mark.parametrize("file", BROKEN, ids=lambda file: file.stem)
def test_what_is_decided_early_is_what_the_whole_search_says(file: Path) -> None:
    mission = parse_mission(file.read_bytes(), str(file))
    whole = check(mission, limits=Limits(tokens=3, after_violation=None))
    early = check(mission, limits=Limits(tokens=3, after_violation=0))
    assert early.verdict is whole.verdict
    for part, full in zip(early.results, whole.results, strict=True):
        assert part.verdict in (full.verdict, Verdict.UNDECIDED)


@pytest.mark.usefixtures("_looks_at_every_state")
@pytest.mark.parametrize("reduced", [False, True])
@pytest.mark.parametrize("make", [random_net, random_mission_net])
def test_of_random_nets_nothing_is_said_early_that_is_not_so(
    make: Callable[[Random], PetriNet], reduced: bool
) -> None:
    decided = compared = 0
    mission = branches(1)
    for seed in range(150):
        net = make(Random(seed))
        whole = explore(net, Limits(states=3_000, tokens=3, after_violation=None, seconds=1e9))
        if not whole.complete:
            continue
        compared += 1
        early = EarlyResults(mission, net)
        reduction = StubbornSets(net) if reduced else None
        limits = Limits(states=3_000, tokens=3, after_violation=seed % 5, seconds=1e9)
        part = explore(net, limits, reduction=reduction, watch=early)
        full = SearchedMission(mission, net, whole)
        less = SearchedMission(mission, net, part)
        for each in ALL[:7]:
            said, found = each(full), early.merged(each(less))
            if found.covered != IN_EACH_STATE:  # that is a weaker sense
                assert found.verdict in (said.verdict, Verdict.UNDECIDED), (seed, found, said)
            decided += found.verdict is Verdict.VIOLATED
            for violation in found.violations:
                assert _can_happen(net, whole.encoding, violation.run), (seed, violation)
    assert compared > 60
    assert decided > 40


def _can_happen(net: PetriNet, encoding: Encoding, run: tuple[int, ...]) -> bool:
    state = encoding.initial
    for number in run:
        if not encoding.enabled(number, state):
            return False
        state, _ = encoding.fire(number, state)
    return True
