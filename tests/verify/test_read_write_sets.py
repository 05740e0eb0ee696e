"""What is tested again after a rule has fired takes little room, however many rules there are."""

from random import Random

import pytest

from m2pem.verify.net.encoding import Encoding
from m2pem.verify.search import read_write_sets
from m2pem.verify.search.explore import explore
from m2pem.verify.search.read_write_sets import affected_rules
from m2pem.verify.translate import translate
from tests.engine.notation import mission as notation
from tests.engine.random_missions import structured
from tests.verify.random_systems import random_system
from tests.verify.test_spin_agreement import SMALL

VERY_MANY_RULES = 513350847
"""A random mission with an element that reads so many values that it has thousands of rules."""


def test_rules_that_change_the_same_are_followed_by_the_same() -> None:
    system = translate(notation(structured(Random(VERY_MANY_RULES))))
    assert len(system.rules) > 20_000
    affected = affected_rules(Encoding(system))
    named = sum(len(each) for each in {id(each): each for each in affected}.values())
    assert named < 2_000_000 < sum(map(len, affected))


@pytest.mark.parametrize("seed", range(20))
def test_without_room_every_rule_is_tested_again(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    system = random_system(Random(seed))
    found = explore(system, SMALL)
    monkeypatch.setattr(read_write_sets, "_MOST_NAMED", 0)
    assert len({id(each) for each in affected_rules(Encoding(system))}) < len(system.rules)
    again = explore(system, SMALL)
    assert set(again.states) == set(found.states)
    assert again.fired.keys() == found.fired.keys()
