"""The exploration of a net with Spin.

One search of all states finds the transitions that ever fire. For each that should not, and for
other violations, another query asks for a run that leads there. Every run is fired again,
transition by transition, before it is reported.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from m2pem.errors import InternalError
from m2pem.verify.net.encoding import Encoding
from m2pem.verify.net.petri_net import Action, PetriNet
from m2pem.verify.search.explore import MANY_STATES, Limits, Progress, Stopped, explore
from m2pem.verify.spin.programs import CheckerFolder
from m2pem.verify.spin.promela import Assertions, Model, identifiers, text_of
from m2pem.verify.spin.queries import QueryResult, SpinQueries, Storage
from m2pem.verify.spin.trail import may_fire, replay
from m2pem.verify.spin.trail import read as read_trail

_MOST_SHORTEST = 200_000
"""Most states for which a shortest run is asked for: a breadth-first search takes more memory."""
_SHORTEST_S = 20.0
_STUCK_RUNS = 5
_NO_FLOW = "NO_FLOW"

Run = tuple[int, ...]
"""A run: transitions, one after the other."""


@dataclass(slots=True)
class SpinExploration:
    """What Spin saw. Runs are transitions from the initial state.

    `fired`: transitions that ever fire, if all was seen. `transition_runs`: to each transition that
    runs were wanted to, if it fires; it is the run's last. `overflow_runs`: to a second token on a
    place where one is meant. `beyond`: places that get more tokens than the limit. `stuck_runs`: to
    deadlocks before the end of the run, one or a few. `left_runs`: to where a run stops with a
    token on the place.
    """

    net: PetriNet
    encoding: Encoding
    wanted: "WantedRuns"
    states: int = 0
    transitions: int = 0
    seconds: float = 0.0
    stopped: Stopped | None = None
    fired: frozenset[int] = frozenset()
    transition_runs: dict[int, Run] = field(default_factory=dict)
    overflow_runs: dict[int, Run] = field(default_factory=dict)
    beyond: set[int] = field(default_factory=set)
    stuck_runs: list[Run] = field(default_factory=list)
    left_runs: dict[int, Run] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class WantedRuns:
    """The targets of wanted runs: transitions, deadlocks, places with a token left at the end."""

    transitions: frozenset[int]
    stuck: bool = True
    left: tuple[int, ...] = ()

    @classmethod
    def of(cls, net: PetriNet) -> "WantedRuns":
        """Everything that can be a violation: transitions with a flag, and gateways without a way
        on.
        """
        return cls(
            frozenset(
                transition.index
                for transition in net.transitions
                if transition.flag is not None
                or any(s.action is Action.THROWN and s.detail == _NO_FLOW for s in transition.steps)
            )
        )


def search(
    net: PetriNet,
    limits: Limits | None = None,
    *,
    wanted: WantedRuns | None = None,
    storage: Storage = Storage.EXACT,
    progress: Callable[[Progress], None] | None = None,
) -> SpinExploration:
    """Search a net with Spin. `wanted`: by default, everything that can be a violation.

    Raises:
        SpinMissingError: Spin or a compiler is not installed.
        InternalError: Spin's answer is wrong.
    """
    limits = limits or Limits()
    with CheckerFolder() as shop:
        queries = SpinQueries(shop, limits, storage, time.monotonic(), progress)
        searching = _Search(net, wanted or WantedRuns.of(net), queries)
        try:
            searching.run()
        except KeyboardInterrupt:
            searching.found.stopped = Stopped.INTERRUPTED
        searching.found.seconds = queries.began_ago()
        return searching.found


class _Search:
    def __init__(self, net: PetriNet, wanted: WantedRuns, queries: SpinQueries) -> None:
        self.net = net
        self.wanted = wanted
        self.queries = queries
        self.encoding = Encoding(net)
        self.found = SpinExploration(net, self.encoding, wanted)
        self._by_name = {
            name: place.index
            for place, name in zip(
                net.places,
                identifiers("at_", [place.name for place in net.places]),
                strict=True,
            )
        }

    def run(self) -> None:
        found = self.found
        result, model = self._see_all()
        found.stopped = result.stopped
        found.states, found.transitions = result.report.states, result.report.transitions
        complete = result.stopped in (None, Stopped.BITSTATE)
        if complete:
            reached = set(model.transition_at) - result.report.unreached
            found.fired = frozenset(model.transition_at[line] for line in reached)
            if self.wanted.stuck and model.stuck_line not in result.report.unreached_skips:
                self._get_stuck()
            for transition in sorted(found.fired & self.wanted.transitions):
                if self._in_time():
                    self._lead_to(transition)
            for place in self.wanted.left:
                if self._in_time():
                    self._leave(place)
        elif result.stopped is not Stopped.INTERRUPTED:
            self._anything()
        if found.beyond and found.stopped is None:
            found.stopped = Stopped.TOKENS

    def _in_time(self) -> bool:
        """Whether there is time for another query: each translates a large model anew."""
        if self.queries.began_ago() <= self.queries.limits.seconds:
            return True
        self.found.stopped = self.found.stopped or Stopped.TIME
        return False

    # --- all there is ---------------------------------------------------------------------------

    def _see_all(self) -> tuple[QueryResult, Model]:
        """Search all states; give places more room until none gets more tokens than it has room
        for.
        """
        limits, found = self.queries.limits, self.found
        most_bits = max((limits.tokens + 1).bit_length() - 1, 1)
        # Where several tokens are meant, there is as much room as in the built-in search: both see
        # the same states.
        places, small = self.net.places, replace(limits, states=MANY_STATES)
        wide = explore(self.net, small, keep_edges=False).encoding.wider
        wider = {place: bits for place, bits in wide.items() if places[place].several}
        reported_once: set[int] = set()
        while True:
            self.encoding = found.encoding = Encoding(self.net, wider)
            asked = frozenset(p.index for p in self.net.places) - found.beyond - reported_once
            model = self._model(Assertions(full=asked))
            result = self.queries.query(model)
            if result.report.found is None:
                return result, model
            place = self._place_of(result.report.assertion)
            run = self._runs(model)[0]
            if not self.net.places[place].several and place not in found.overflow_runs:
                assertions = Assertions(full=frozenset({place}))
                found.overflow_runs[place] = self._short(assertions, result) or run
            if self.net.places[place].once:
                reported_once.add(place)
            elif self.encoding.width[place] < most_bits and not self.net.places[place].several:
                wider[place] = most_bits
            else:
                found.beyond.add(place)

    def _place_of(self, assertion: str) -> int:
        words = assertion.strip("( )").replace("<=", " ").split()
        if not words or words[0] not in self._by_name:
            raise InternalError(f"Spin names an assertion that is not in the model: {assertion}")
        return self._by_name[words[0]]

    # --- what is wrong --------------------------------------------------------------------------

    def _get_stuck(self) -> None:
        model = self._model(Assertions(stuck=True))
        result = self._ask_nearest(model, _STUCK_RUNS)
        if result.report.found is None:
            if result.stopped is None:
                raise InternalError("Spin finds no run that is stuck, and says that there is one")
            return
        self.found.stuck_runs = self._runs(model)
        for run in self.found.stuck_runs:
            self._see_stuck(run)

    def _leave(self, place: int) -> None:
        model = self._model(Assertions(left=frozenset({place})))
        if self._ask_nearest(model).report.found is None:
            return
        run = self.found.left_runs[place] = self._runs(model)[0]
        state = replay(self.encoding, run)[-1]
        if not state & self.encoding.mask[place] or may_fire(self.encoding, state):
            raise InternalError("Spin says that a run stops with a token left where it does not")

    def _see_stuck(self, run: Run) -> None:
        state = replay(self.encoding, run)[-1]
        ends = self.encoding.places_mask(self.net.ends)
        if state & ends or may_fire(self.encoding, state):
            raise InternalError("Spin says that a run is stuck that can go on")

    def _lead_to(self, transition: int) -> None:
        model = self._model(Assertions(transitions=frozenset({transition})))
        result = self._ask_nearest(model)
        if result.report.found is None:
            if result.stopped is None:
                raise InternalError(
                    f"Spin finds no run to transition {transition}, which it says can fire"
                )
            return
        run = self._runs(model)[0]
        if run[-1:] != (transition,):
            raise InternalError(f"Spin's run to transition {transition} does not end with it")
        self.found.transition_runs[transition] = run

    def _anything(self) -> None:
        """After an incomplete search: look for any violation that is found soon."""
        flagged = self.wanted.transitions
        model = self._model(Assertions(transitions=flagged, stuck=self.wanted.stuck))
        result = self.queries.query(model, seconds=_SHORTEST_S)
        if result.report.found is None:
            return
        run = self._runs(model)[0]
        if run and run[-1] in flagged:
            self.found.transition_runs[run[-1]] = run
            self.found.fired = frozenset(run)
        else:
            self._see_stuck(run)
            self.found.stuck_runs = [run]

    # --- runs -----------------------------------------------------------------------------------

    def _model(self, assertions: Assertions) -> Model:
        return text_of(self.net, self.encoding, assertions)

    def _ask_nearest(self, model: Model, errors: int = 1) -> QueryResult:
        """Ask for a shortest run if that is cheap enough, else for any.

        A run that was neither found nor excluded leaves the whole undecided.
        """
        if self.found.states <= _MOST_SHORTEST:
            result = self.queries.query(model, shortest=True, errors=errors, seconds=_SHORTEST_S)
            if result.stopped is None:
                return result
            self._go_on(result)
        result = self.queries.query(model, errors=errors)
        self._go_on(result)
        self.found.stopped = self.found.stopped or result.stopped
        return result

    def _go_on(self, result: QueryResult) -> None:
        if result.stopped is Stopped.INTERRUPTED:
            raise KeyboardInterrupt

    def _short(self, assertions: Assertions, result: QueryResult) -> Run | None:
        """A shortest run to what `result` found, if it is not too long."""
        if result.report.states > _MOST_SHORTEST:
            return None
        model = self._model(assertions)
        again = self.queries.query(model, shortest=True, seconds=_SHORTEST_S)
        self._go_on(again)
        return self._runs(model)[0] if again.report.found is not None else None

    def _runs(self, model: Model) -> list[Run]:
        """The runs that Spin has left, fired again."""
        shop = self.queries.shop
        texts: Sequence[str] = [shop.trail(n) for n in range(_STUCK_RUNS + 1)]
        runs = [read_trail(text, model.transition_at).prefix for text in texts if text]
        if not runs:
            raise InternalError("Spin found an error, and left no trail to it")
        for run in runs:
            replay(self.encoding, run)
        return runs
