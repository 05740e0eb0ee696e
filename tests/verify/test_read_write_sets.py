"""What is tested again after a transition has fired takes little room, however many transitions
there are.
"""

from random import Random

import pytest

from m2pem.verify.net.encoding import Encoding
from m2pem.verify.search import read_write_sets
from m2pem.verify.search.explore import explore
from m2pem.verify.search.read_write_sets import affected_transitions
from m2pem.verify.translate import translate
from tests.engine.notation import mission as notation
from tests.engine.random_missions import structured
from tests.verify.random_nets import random_net
from tests.verify.test_spin_agreement import SMALL

VERY_MANY_TRANSITIONS = 513350847
"""A random mission with an element that reads so many values that it has thousands of transitions.
"""


def test_transitions_that_change_the_same_are_followed_by_the_same() -> None:
    net = translate(notation(structured(Random(VERY_MANY_TRANSITIONS))))
    assert len(net.transitions) > 15_000
    affected = affected_transitions(Encoding(net))
    named = sum(len(each) for each in {id(each): each for each in affected}.values())
    assert named < 2_000_000 < sum(map(len, affected))


@pytest.mark.parametrize("seed", range(20))
def test_without_room_every_transition_is_tested_again(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    net = random_net(Random(seed))
    found = explore(net, SMALL)
    monkeypatch.setattr(read_write_sets, "MOST_NAMED", 0)
    assert len({id(each) for each in affected_transitions(Encoding(net))}) < len(net.transitions)
    again = explore(net, SMALL)
    assert set(again.states) == set(found.states)
    assert again.fired.keys() == found.fired.keys()
