"""Engine runs that keep vehicles between tasks, followed by the net with what is kept."""

from collections import Counter
from random import Random

from m2pem.engine import inputs as i
from m2pem.engine.state import BehaviorPhase, Keeping, RunState, RunStatus
from m2pem.fleet.fleet import Fleet
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.elements import Process
from m2pem.mission.mission import Mission
from m2pem.verify.net.petri_net import PetriNet
from tests.verify.allocator import Allocator
from tests.verify.models import Walk
from tests.verify.trace_mapping import Follower, Look

Kept = Counter[tuple[tuple[str, ...], str, bool]]
"""By pool, until the end of what, and whether a task has it now: how many are kept."""


class KeepingFollower(Follower):
    """Follows the net by what is kept, too: how many of each pool, until when, idle or not."""

    def agrees(self, number: int, state: RunState, look: Look) -> bool:
        """A run that is over keeps nothing."""
        if not super().agrees(number, state, look):
            return False
        return state.status is RunStatus.ENDED or self.kept(number) == self.kept_by(state)

    @property
    def may_be_stuck(self) -> bool:
        """Whether nothing can happen any more in a state of the net that the run may be in."""
        return any(not self._after(number) for number in self.candidates)

    def kept(self, number: int) -> Kept:
        """What is kept in a state of the net."""
        found: Kept = Counter()
        places = self.net.places
        for place, count in self.encoding.marking(number).tokens.items():
            each = places[place]
            if each.kept:
                found[each.kept, each.until, False] += count
                continue
            for returns in map(places.__getitem__, each.returns):
                if returns.kept:
                    found[returns.kept, returns.until, True] += count
        return found

    def kept_by(self, state: RunState) -> Kept:
        """What a run of the engine keeps."""
        pools = {each: place.free for place in self.net.places for each in place.free}
        active = {
            resource
            for resource, holders in state.held.items()
            if any(state.behaviors[h].phase is not BehaviorPhase.CANCELLING for h in holders)
        }
        return Counter(
            (pools[resource], _until(keeping), resource in active)
            for resource, keeping in state.kept.items()
        )


def _until(keeping: Keeping) -> str:
    """The id of what ends the keeping; of a called process, that of the call."""
    scope = keeping.until
    if scope.owner is not None and isinstance(scope.container, Process):
        return scope.owner.node.id
    return scope.container.id


class KeepingWalk(Walk):
    """A run of the engine whose requests dice answer, followed by the net with what is kept."""

    def __init__(self, mission: Mission, fleet: Fleet, net: PetriNet, seed: int) -> None:
        super().__init__(mission, fleet, net, seed, Allocator(fleet, Random(seed)))
        self.follower: KeepingFollower = KeepingFollower(net)
        self.fails = True
        """Whether behaviors may fail."""

    def give(self, item: i.Input) -> bool:
        """Each input comes later than the one before: who asks first is served first."""
        self.now_us += 1
        return super().give(item)

    def things(self) -> list[i.Input]:
        """Failures after which tasks are executed again are more frequent than others."""
        found = super().things()
        again = [each for each in found if _fails(each, AGAIN)]
        others = [each for each in found if not _fails(each)]
        if not self.fails:
            return others
        ends = [each for each in found if _fails(each) and not _fails(each, AGAIN)]
        return [*others, *again, *again, *(ends if self.dice.random() < ENDS else ())]


AGAIN = "ROUTE_BLOCKED"
ENDS = 0.2


def _fails(item: i.Input, code: str = "") -> bool:
    failed = isinstance(item, i.BehaviorReported) and item.state is BehaviorState.FAILED
    return failed and code in ("", item.code)
