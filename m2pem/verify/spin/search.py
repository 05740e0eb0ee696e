"""All that a system's rules can lead to, as Spin sees it.

    found = search(system)
    found.states, found.fired, found.overflow_runs, found.rule_runs, found.stuck_runs

Spin sees all once, which tells the rules that ever fire; for each that should not, and for what
else is wrong, it is asked again for a run that leads there. Every run is fired again, rule by rule,
before it is believed.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from m2pem.errors import InternalError
from m2pem.verify.net.encoding import Encoding
from m2pem.verify.net.petri_net import Action, System
from m2pem.verify.search.explore import Limits, Progress, Stopped
from m2pem.verify.spin.programs import Workshop
from m2pem.verify.spin.promela import Asks, Model, identifiers, text_of
from m2pem.verify.spin.queries import Asking, Storage, Told
from m2pem.verify.spin.trail import may_fire, replay
from m2pem.verify.spin.trail import read as read_trail

_MOST_SHORTEST = 200_000
"""States up to which a shortest run is asked for: searching nearest first takes more memory."""
_SHORTEST_S = 20.0
_STUCK_RUNS = 5
_NO_FLOW = "NO_FLOW"

Run = tuple[int, ...]
"""Rules, one after the other."""


@dataclass(slots=True)
class Found:
    """What Spin saw. Runs are rules from the beginning.

    `fired`: rules that ever fire, if all was seen. `rule_runs`: to each of the rules that runs
    were wanted to, if it fires; it is the run's last. `overflow_runs`: to a second token on a place
    where one is meant. `beyond`: places that get more tokens than the limit. `stuck_runs`: to
    states in which nothing can fire and the run is not over, one or a few. `left_runs`: to where a
    run stops with a token on the place.
    """

    system: System
    encoding: Encoding
    wanted: "Wanted"
    states: int = 0
    transitions: int = 0
    seconds: float = 0.0
    stopped: Stopped | None = None
    fired: frozenset[int] = frozenset()
    rule_runs: dict[int, Run] = field(default_factory=dict)
    overflow_runs: dict[int, Run] = field(default_factory=dict)
    beyond: set[int] = field(default_factory=set)
    stuck_runs: list[Run] = field(default_factory=list)
    left_runs: dict[int, Run] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Wanted:
    """What runs are wanted to: rules, being stuck, places where a token is left at the end."""

    rules: frozenset[int]
    stuck: bool = True
    left: tuple[int, ...] = ()

    @classmethod
    def of(cls, system: System) -> "Wanted":
        """To what can be a violation: rules with a flag, and gateways without a way on."""
        return cls(
            frozenset(
                rule.index
                for rule in system.rules
                if rule.flag is not None
                or any(s.action is Action.THROWN and s.detail == _NO_FLOW for s in rule.steps)
            )
        )


def search(
    system: System,
    limits: Limits | None = None,
    *,
    wanted: Wanted | None = None,
    storage: Storage = Storage.EXACT,
    progress: Callable[[Progress], None] | None = None,
) -> Found:
    """Have Spin search a system. `wanted`: by default, what can be a violation.

    Raises:
        SpinMissingError: Spin or a compiler is not installed.
        InternalError: Spin says something that is not so.
    """
    limits = limits or Limits()
    with Workshop() as shop:
        asking = Asking(shop, limits, storage, time.monotonic(), progress)
        searching = _Search(system, wanted or Wanted.of(system), asking)
        try:
            searching.run()
        except KeyboardInterrupt:
            searching.found.stopped = Stopped.INTERRUPTED
        searching.found.seconds = asking.began_ago()
        return searching.found


class _Search:
    def __init__(self, system: System, wanted: Wanted, asking: Asking) -> None:
        self.system = system
        self.wanted = wanted
        self.asking = asking
        self.encoding = Encoding(system)
        self.found = Found(system, self.encoding, wanted)
        self._by_name = {
            name: place.index
            for place, name in zip(
                system.places,
                identifiers("at_", [place.name for place in system.places]),
                strict=True,
            )
        }

    def run(self) -> None:
        found = self.found
        told, model = self._see_all()
        found.stopped = told.stopped
        found.states, found.transitions = told.report.states, told.report.transitions
        complete = told.stopped in (None, Stopped.BITSTATE)
        if complete:
            reached = set(model.rule_at) - told.report.unreached
            found.fired = frozenset(model.rule_at[line] for line in reached)
            if self.wanted.stuck and model.stuck_line not in told.report.unreached_skips:
                self._get_stuck()
            for rule in sorted(found.fired & self.wanted.rules):
                if self._in_time():
                    self._lead_to(rule)
            for place in self.wanted.left:
                if self._in_time():
                    self._leave(place)
        elif told.stopped is not Stopped.INTERRUPTED:
            self._anything()
        if found.beyond and found.stopped is None:
            found.stopped = Stopped.TOKENS

    def _in_time(self) -> bool:
        """Whether there is time for another question: each has a large model translated anew."""
        if self.asking.began_ago() <= self.asking.limits.seconds:
            return True
        self.found.stopped = self.found.stopped or Stopped.TIME
        return False

    # --- all there is ---------------------------------------------------------------------------

    def _see_all(self) -> tuple[Told, Model]:
        """Give places more room until none gets more tokens than it has room for."""
        limits, found = self.asking.limits, self.found
        most_bits = max((limits.tokens + 1).bit_length() - 1, 1)
        wider: dict[int, int] = {}
        told_once: set[int] = set()
        while True:
            self.encoding = found.encoding = Encoding(self.system, wider)
            asked = frozenset(p.index for p in self.system.places) - found.beyond - told_once
            model = self._model(Asks(full=asked))
            told = self.asking.ask(model)
            if told.report.found is None:
                return told, model
            place = self._place_of(told.report.assertion)
            run = self._runs(model)[0]
            if not self.system.places[place].several and place not in found.overflow_runs:
                asks = Asks(full=frozenset({place}))
                found.overflow_runs[place] = self._short(asks, told) or run
            if self.system.places[place].once:
                told_once.add(place)
            elif self.encoding.width[place] < most_bits:
                wider[place] = most_bits
            else:
                found.beyond.add(place)

    def _place_of(self, assertion: str) -> int:
        words = assertion.strip("( )").replace("<=", " ").split()
        if not words or words[0] not in self._by_name:
            raise InternalError(f"Spin names an assertion that nobody made: {assertion}")
        return self._by_name[words[0]]

    # --- what is wrong --------------------------------------------------------------------------

    def _get_stuck(self) -> None:
        model = self._model(Asks(stuck=True))
        told = self._ask_nearest(model, _STUCK_RUNS)
        if told.report.found is None:
            if told.stopped is None:
                raise InternalError("Spin finds no run that is stuck, and says that there is one")
            return
        self.found.stuck_runs = self._runs(model)
        for run in self.found.stuck_runs:
            self._see_stuck(run)

    def _leave(self, place: int) -> None:
        model = self._model(Asks(left=frozenset({place})))
        if self._ask_nearest(model).report.found is None:
            return
        run = self.found.left_runs[place] = self._runs(model)[0]
        state = replay(self.encoding, run)[-1]
        if not state & self.encoding.mask[place] or may_fire(self.encoding, state):
            raise InternalError("Spin says that a run stops with a token left where it does not")

    def _see_stuck(self, run: Run) -> None:
        state = replay(self.encoding, run)[-1]
        ends = self.encoding.places_mask(self.system.ends)
        if state & ends or may_fire(self.encoding, state):
            raise InternalError("Spin says that a run is stuck that can go on")

    def _lead_to(self, rule: int) -> None:
        model = self._model(Asks(rules=frozenset({rule})))
        told = self._ask_nearest(model)
        if told.report.found is None:
            if told.stopped is None:
                raise InternalError(f"Spin finds no run to rule {rule}, which it says can fire")
            return
        run = self._runs(model)[0]
        if run[-1:] != (rule,):
            raise InternalError(f"Spin's run to rule {rule} does not end with it")
        self.found.rule_runs[rule] = run

    def _anything(self) -> None:
        """After a search that did not see all: the first thing that is wrong, if it is found."""
        flagged = self.wanted.rules
        model = self._model(Asks(rules=flagged, stuck=self.wanted.stuck))
        told = self.asking.ask(model, seconds=_SHORTEST_S)
        if told.report.found is None:
            return
        run = self._runs(model)[0]
        if run and run[-1] in flagged:
            self.found.rule_runs[run[-1]] = run
            self.found.fired = frozenset(run)
        else:
            self._see_stuck(run)
            self.found.stuck_runs = [run]

    # --- runs -----------------------------------------------------------------------------------

    def _model(self, asks: Asks) -> Model:
        return text_of(self.system, self.encoding, asks)

    def _ask_nearest(self, model: Model, errors: int = 1) -> Told:
        """A shortest run if that does not take too much, else any.

        One that was not found, and not shown to be missing, leaves the whole undecided.
        """
        if self.found.states <= _MOST_SHORTEST:
            told = self.asking.ask(model, shortest=True, errors=errors, seconds=_SHORTEST_S)
            if told.stopped is None:
                return told
            self._go_on(told)
        told = self.asking.ask(model, errors=errors)
        self._go_on(told)
        self.found.stopped = self.found.stopped or told.stopped
        return told

    def _go_on(self, told: Told) -> None:
        if told.stopped is Stopped.INTERRUPTED:
            raise KeyboardInterrupt

    def _short(self, asks: Asks, told: Told) -> Run | None:
        """A shortest run to what `told` found, if it is not too far."""
        if told.report.states > _MOST_SHORTEST:
            return None
        model = self._model(asks)
        again = self.asking.ask(model, shortest=True, seconds=_SHORTEST_S)
        self._go_on(again)
        return self._runs(model)[0] if again.report.found is not None else None

    def _runs(self, model: Model) -> list[Run]:
        """The runs that Spin has left, fired again."""
        shop = self.asking.shop
        texts: Sequence[str] = [shop.trail(n) for n in range(_STUCK_RUNS + 1)]
        runs = [read_trail(text, model.rule_at).prefix for text in texts if text]
        if not runs:
            raise InternalError("Spin found an error, and left no trail to it")
        for run in runs:
            replay(self.encoding, run)
        return runs
