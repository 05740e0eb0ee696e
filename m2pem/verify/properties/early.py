"""What a search has decided before it is over.

A violation that has happened in a run stays, whatever else is found; and an element that was
reached is not dead. What can only be said of all runs is decided when the search is complete.
"""

from collections.abc import Callable, Iterable, Iterator
from itertools import islice

from m2pem.mission.mission import Mission
from m2pem.verify.net.petri_net import Flag, PetriNet
from m2pem.verify.properties.commands import (
    errors_caught,
    failures_handled,
    interrupted_commanded_again,
    one_behavior_each,
)
from m2pem.verify.properties.events import (
    can_be_triggered,
    decisions_handled,
    has_no_flow,
    is_caught,
    prompts_have_decisions,
)
from m2pem.verify.properties.results import Confirm, Result, SearchedMission, Verdict
from m2pem.verify.properties.soundness import (
    following_from_deadlock,
    no_dead_element,
    no_deadlock,
    one_token_each,
    proper_completion,
    to_be_reached,
)
from m2pem.verify.search.explore import Exploration

Property = Callable[[SearchedMission], Result]
Decided = Callable[[Result], None]

_OF_THE_NET = (
    no_dead_element,
    can_be_triggered,
    is_caught,
    one_behavior_each,
    errors_caught,
    failures_handled,
    prompts_have_decisions,
    decisions_handled,
)
"""Properties that the mission's text or its net may decide."""
_OF_FLAG: dict[Flag, Property] = {
    Flag.CONFLICT: one_behavior_each,
    Flag.UNCAUGHT: errors_caught,
    Flag.UNCAUGHT_FAILURE: failures_handled,
    Flag.UNHEARD: is_caught,
}


class EarlyResults:
    """Collects what is decided while the net of a mission is searched: the `Watch` of its search.

    `decided` gets each result once, when it is certain; later there may be more violations in it.
    """

    def __init__(
        self,
        mission: Mission,
        net: PetriNet,
        decided: Decided | None = None,
        confirm: Confirm | None = None,
    ) -> None:
        self.results: dict[str, Result] = {}
        self._confirm = confirm
        self._mission, self._net, self._decided = mission, net, decided
        self._unreached = set(to_be_reached(mission, net))
        self._found: Exploration | None = None
        self._terminals = self._fired = self._overflows = 0

    @property
    def violated(self) -> bool:
        """Whether a property is violated that is no mere warning."""
        return any(
            each.verdict is Verdict.VIOLATED and not each.warning for each in self.results.values()
        )

    def begin(self, unsearched: Exploration) -> None:
        """Decide what needs no search."""
        searched = self._searched(unsearched)
        self.settle(each(searched) for each in _OF_THE_NET)

    def look(self, found: Exploration) -> bool:
        """See `Watch`."""
        searched = self._searched(found)
        for each in dict.fromkeys(self._due(searched)):  # each once
            result = each(searched)
            self.settle([result])
            if each is no_deadlock and result.violations:
                self.settle(following_from_deadlock(searched, result.violations[0]))
        return self.violated

    def _searched(self, found: Exploration) -> SearchedMission:
        return SearchedMission(self._mission, self._net, found, confirm=self._confirm)

    def _due(self, searched: SearchedMission) -> Iterator[Property]:
        """The properties that something new among what was found may decide."""
        found = searched.found
        if found is not self._found:
            self._found = found
            self._terminals = self._fired = self._overflows = 0
        if any(
            not searched.ended(state) for state in islice(found.terminals, self._terminals, None)
        ):
            yield no_deadlock
        if len(found.overflows) > self._overflows:
            yield proper_completion
            yield one_token_each
        for number in islice(found.fired, self._fired, None):
            transition = self._net.transitions[number]
            if transition.flag is not None:
                yield _OF_FLAG[transition.flag]
            if has_no_flow(transition):
                yield decisions_handled
            if self._unreached:
                self._unreached -= {step.element for step in transition.steps}
                if not self._unreached:
                    yield no_dead_element
        self._terminals, self._fired = len(found.terminals), len(found.fired)
        self._overflows = len(found.overflows)

    def settle(self, results: Iterable[Result]) -> None:
        """Keep and say those results that are certain, unless they were before."""
        for result in results:
            if result.verdict not in (Verdict.HOLDS, Verdict.VIOLATED):
                continue
            if result.property in self.results:
                continue
            self.results[result.property] = result
            if self._decided is not None:
                self._decided(result)

    def merged(self, result: Result) -> Result:
        """Return a result at the end of a search; if it is not certain, what was certain before.

        A search with more room that was ended may not come as far as the one before it.
        """
        if result.verdict not in (Verdict.HOLDS, Verdict.VIOLATED):
            return self.results.get(result.property, result)
        return result


class EarlyInterruptions:
    """The `Watch` of the search that notes which vehicles are interrupted (`resources`).

    `violated`: whether another property is, so that no more than a share is searched.
    """

    def __init__(
        self,
        mission: Mission,
        net: PetriNet,
        resources: dict[int, str],
        *,
        violated: bool,
        confirm: Confirm | None = None,
    ) -> None:
        self._mission, self._net, self._resources = mission, net, resources
        self._violated, self._confirm = violated, confirm

    def look(self, found: Exploration) -> bool:
        """See `Watch`."""
        if self._violated:
            return True
        marked = found.encoding.places_mask(self._resources)
        if not any(found.states[state] & marked for state in found.terminals):
            return False
        searched = SearchedMission(
            self._mission, self._net, found, found, self._resources, self._confirm
        )
        return interrupted_commanded_again(searched).verdict is Verdict.VIOLATED
