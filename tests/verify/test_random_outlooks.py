"""What an outlook says of random missions of all kinds is what the engine then does."""

from collections import Counter
from collections.abc import Iterable
from random import Random

import pytest

from m2pem.verify.outlook import Verdict
from tests.seeds import named
from tests.verify.outlook_plays import BAD, GOOD, Case

FEW = 100
MANY = 5_000


def agreed(seed: int) -> tuple[str, str] | None:
    """The kind of choice and the verdict; None: a loop of the mission does not wait."""
    dice = Random(seed)
    case = Case.drawn(dice)
    found = case.foreseen()
    playing = case.begun()
    if playing is None:
        return None
    if found.verdict in (Verdict.COMPLETES, Verdict.CANNOT_COMPLETE):
        ends = set(playing.ends(dice))
        false = BAD if found.verdict is Verdict.COMPLETES else GOOD
        assert false not in ends, found
    return type(case.choice).__name__, found.verdict.value


def counted(seeds: Iterable[int]) -> Counter[str]:
    """How often each verdict was given."""
    found: Counter[str] = Counter()
    for seed in seeds:
        with named(seed):
            said = agreed(seed)
        found[said[1] if said else "loops"] += 1
    return found


def test_what_is_foreseen_of_random_missions_comes() -> None:
    found = counted(range(FEW))
    assert found[Verdict.COMPLETES] > FEW / 3
    assert found[Verdict.CANNOT_COMPLETE] > FEW / 20
    assert found[Verdict.UNKNOWN] + found[Verdict.MAY_NOT_COMPLETE] < FEW / 2


@pytest.mark.long
@pytest.mark.timeout(7200)
def test_what_is_foreseen_of_many_random_missions_comes() -> None:
    counted(range(MANY))
