"""Whether the moments of a run of the engine are those of a run of the checker's net."""

from collections.abc import Iterable

from m2pem.fleet.fleet import Fleet
from m2pem.mission.mission import Mission
from m2pem.verify.ltl.formula import Completed, Proposition
from m2pem.verify.net.encoding import Encoding
from m2pem.verify.net.petri_net import Kind, PetriNet, Role
from m2pem.verify.requirements.propositions import Labels
from tests.verify.trace_mapping import TooManyStatesError

MOST_STATES = 20_000


class NetRuns:
    """The runs of a net that have had certain moments: the states in which they are now."""

    def __init__(
        self, net: PetriNet, mission: Mission, fleet: Fleet, propositions: Iterable[Proposition]
    ) -> None:
        labels = Labels(net, mission, fleet, tuple(propositions))
        bits = (15).bit_length()
        self._encoding = Encoding(
            net, {p.index: bits for p in net.places if p.role not in (Role.END,)}
        )
        self._when = labels.of_transitions
        self._completions = sum(
            1 << n for n, each in enumerate(labels.propositions) if isinstance(each, Completed)
        )
        self._true_in = labels.of_states(self._encoding)
        self._net = net
        self._kinds = [
            [t.index for t in net.transitions if t.kind is kind]
            for kind in (Kind.INTERNAL, Kind.JOIN, Kind.EXTERNAL)
        ]
        self._known: dict[int, list[tuple[int, int]]] = {}
        self.states = {self._encoding.initial}
        self._begun = False

    def successors(self, state: int) -> list[tuple[int, int]]:
        known = self._known.get(state)
        if known is None:
            encoding = self._encoding
            known = []
            for kind in self._kinds:
                known = [
                    (each, encoding.fire(each, state)[0])
                    for each in kind
                    if encoding.enabled(each, state)
                ]
                if known:
                    break
            self._known[state] = known
        return known

    def accept(self, letter: int) -> bool:
        """Whether a run goes on with this moment."""
        if not self._begun:
            self._begun = True
            return all(self._true_in(each) == letter for each in self.states)
        completed, now = letter & self._completions, letter & ~self._completions
        before = self._closed(self.states)
        after = {
            target
            for state in before
            for transition, target in self.successors(state)
            if self._when[transition] == completed and self._true_in(target) == now
        }
        if not completed:
            after |= {state for state in before if self._true_in(state) == now}
        if len(after) > MOST_STATES:
            raise TooManyStatesError
        self.states = after
        return bool(after)

    def _closed(self, states: set[int]) -> set[int]:
        """The states, and all that they reach without changing a proposition."""
        seen, waiting = set(states), list(states)
        while waiting:
            state = waiting.pop()
            now = self._true_in(state)
            for transition, target in self.successors(state):
                if target in seen or self._when[transition] or self._true_in(target) != now:
                    continue
                seen.add(target)
                waiting.append(target)
                if len(seen) > MOST_STATES:
                    raise TooManyStatesError
        return seen
