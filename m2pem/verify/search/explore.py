"""Searching all that a net can lead to, state by state, shortest runs first.

    found = explore(net)
    found.complete                    # whether that was all
    found.terminals                   # states in which no transition can fire
    found.run_to(state)               # the transitions that lead there

`Exploration` is what properties are read from. A place that gets more tokens than it has room for
is noted (`overflows`), and the search starts again with more room for it, up to `Limits.tokens`.
"""

import gc
import time
from array import array
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

from m2pem.verify.net.encoding import Encoding, Marking
from m2pem.verify.net.petri_net import Flag, Kind, PetriNet
from m2pem.verify.search.read_write_sets import affected_transitions, as_sets, tests_of
from m2pem.verify.search.stubborn_sets import Reduction, states_to_expand

_LOOK_EVERY = 128
"""States between two readings of the clock; states that take longer count more."""
_LOOK_EVERY_STEPS = 10_000
_LOOK_EVERY_CHOICE = 4
"""The same with a reduction, which takes longer for each state."""
_BYTES_A_STATE = 250
"""Approximate memory of a state beside its own bits; a state that waits to be searched takes more.
"""
_BYTES_A_WAITING_STATE = 56
_BYTES_A_TRANSITION = 8
"""Of each transition that is enabled in a waiting state."""
_BYTES_AN_EDGE = 16


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of a check; beyond, it is undecided. `tokens`: on a place where one is meant."""

    states: int = 2_000_000
    seconds: float = 600.0
    memory_mb: float = 2_000.0
    tokens: int = 7


class Stopped(StrEnum):
    """Why a search did not see all."""

    STATES = "the limit of states"
    TIME = "the limit of time"
    MEMORY = "the limit of memory"
    TOKENS = "a place that gets more and more tokens"
    TRANSITIONS = "the limit of transitions"
    DEPTH = "the limit of depth"
    BITSTATE = "a table that may take a new state for a known one"
    INTERRUPTED = "an interruption by hand"


@dataclass(frozen=True, slots=True)
class Progress:
    """The progress of a search."""

    states: int
    waiting: int
    seconds: float


@dataclass(slots=True)
class Exploration:
    """What a search has seen. States are numbered in the order in which they were found.

    `fired`: by transition, the first state in which it fired. `flagged`: those of them that have a
    flag. `overflows`: by place, the first state and transition at which a token came to a place
    that had one, where one is meant. `beyond`: places that got more than `Limits.tokens`. `edges`:
    successors of each state as (transition, state), if they were kept.
    """

    net: PetriNet
    encoding: Encoding
    states: list[int]
    parents: "array[int]"
    via: "array[int]"
    transitions: int
    stopped: Stopped | None
    seconds: float
    terminals: list[int]
    fired: dict[int, int]
    overflows: dict[int, tuple[int, int]] = field(default_factory=dict)
    overflow_runs: dict[int, tuple[int, ...]] = field(default_factory=dict)
    beyond: frozenset[int] = frozenset()
    edge_start: "array[int] | None" = None
    edge_transition: "array[int] | None" = None
    edge_state: "array[int] | None" = None
    reduced: bool = False

    @property
    def complete(self) -> bool:
        """Whether everything that can happen was seen, within the net's approximations."""
        return self.stopped is None

    @property
    def flagged(self) -> dict[int, int]:
        """By transition that should never fire, the first state in which it did."""
        return {r: at for r, at in self.fired.items() if self.net.transitions[r].flag is not None}

    def of_flag(self, flag: Flag) -> dict[int, int]:
        """The same, of one flag."""
        return {r: at for r, at in self.fired.items() if self.net.transitions[r].flag is flag}

    def run_to(self, number: int) -> list[int]:
        """The transitions that lead to a state from the initial one: one of the shortest runs."""
        transitions: list[int] = []
        while number:
            transitions.append(self.via[number])
            number = self.parents[number]
        return transitions[::-1]

    def marking(self, number: int) -> Marking:
        """Decode a state into a marking."""
        return self.encoding.marking(self.states[number])

    def successors(self, number: int) -> Iterator[tuple[int, int]]:
        """The steps from a state as (transition, state); only when edges were kept."""
        assert self.edge_start is not None
        assert self.edge_transition is not None
        assert self.edge_state is not None
        for at in range(self.edge_start[number], self.edge_start[number + 1]):
            yield self.edge_transition[at], self.edge_state[at]


def explore(
    net: PetriNet,
    limits: Limits | None = None,
    *,
    reduction: Reduction | None = None,
    keep_edges: bool = True,
    progress: Callable[[Progress], None] | None = None,
) -> Exploration:
    """Explore the states of a net, nearest first.

    `reduction` chooses the transitions that are tried in a state; None tries all. A reduction needs
    edges, so they are always kept with one. KeyboardInterrupt ends the search; what was seen until
    then is returned (`Stopped`).
    """
    limits = limits or Limits()
    wider: dict[int, int] = {}
    overflows: dict[int, tuple[int, int]] = {}
    runs: dict[int, tuple[int, ...]] = {}
    began = time.monotonic()
    while True:
        edges = keep_edges or reduction is not None
        search = _Search(net, Encoding(net, wider), limits, began, edges)
        found = search.run(reduction, progress)
        while found.stopped is None and search.puts_off_for_ever(found):
            found = search.run(reduction, progress)
        again = False
        for place, (state, transition) in found.overflows.items():
            if not _exact(found, found.run_to(state), limits):
                continue
            if place not in overflows and not net.places[place].several:
                overflows[place] = (state, transition)
                runs[place] = (*found.run_to(state), transition)
            if net.places[place].once:
                continue
            bits = found.encoding.width[place] + 1
            if found.stopped in (None, Stopped.TOKENS) and (1 << bits) - 1 <= limits.tokens:
                wider[place] = bits
                again = True
        if not again:
            found.beyond = frozenset(
                place for place in found.overflows if not net.places[place].once
            )
            if found.beyond and found.stopped is None:
                found.stopped = Stopped.TOKENS
            found.overflows = overflows
            found.overflow_runs = runs
            return found


def _exact(found: Exploration, run: Sequence[int], limits: Limits) -> bool:
    """Whether no token on a run was lost for want of room that the next search will have.

    What comes after such a loss need not be a run: it may miss a step that had to come first.
    """
    encoding = found.encoding
    state = encoding.initial
    for transition in run:
        state, full = encoding.fire(transition, state)
        for place in encoding.places_in(full) if full else ():
            widest = (1 << (encoding.width[place] + 1)) - 1 > limits.tokens
            if not widest and not found.net.places[place].once:
                return False
    return True


def _complete_only(*columns: "list[int] | array[int]") -> None:
    """Drop the last row if it is incomplete: an interrupt comes between any two instructions."""
    rows = min(map(len, columns))
    for column in columns:
        del column[rows:]


class _Search:
    def __init__(
        self, net: PetriNet, encoding: Encoding, limits: Limits, began: float, keep_edges: bool
    ) -> None:
        self.net = net
        self.encoding = encoding
        self.limits = limits
        self.began = began
        self.keep_edges = keep_edges
        self.whole: set[int] = set()
        """States on a cycle, in which nothing may be deferred (the ignoring proviso)."""
        self.partly: set[int] = set()
        self.inner: set[int] = set()
        self.goes_back = False
        transitions = encoding.transitions
        self.affected = affected_transitions(encoding)
        self.affected_sets = as_sets(self.affected)
        self.rank = [
            0 if transition.kind is Kind.INTERNAL else 1 if transition.kind is Kind.JOIN else 2
            for transition in net.transitions
        ]
        self.masks = [(c.test, c.need, ~c.clear, c.put, c.plain) for c in transitions]

    def run(
        self, reduction: Reduction | None, progress: Callable[[Progress], None] | None
    ) -> Exploration:
        encoding = self.encoding
        states: list[int] = [encoding.initial]
        index: dict[int, int] = {encoding.initial: 0}
        parents, via = array("q", [0]), array("i", [-1])
        edge_start, edge_transition, edge_state = array("q"), array("i"), array("q")
        found = Exploration(
            self.net,
            encoding,
            states,
            parents,
            via,
            0,
            None,
            0.0,
            [],
            {},
            edge_start=edge_start if self.keep_edges else None,
            edge_transition=edge_transition if self.keep_edges else None,
            edge_state=edge_state if self.keep_edges else None,
            reduced=reduction is not None,
        )
        choose = reduction.bind(encoding) if reduction is not None else None
        waiting: list[tuple[int, ...] | None] = [
            tuple(n for n in range(len(self.masks)) if encoding.enabled(n, encoding.initial))
        ]
        collecting = gc.isenabled()
        gc.disable()  # nothing here is cyclic, and looking for cycles among millions takes long
        try:
            self._loop(found, states, index, parents, via, waiting, choose, progress)
        except KeyboardInterrupt:
            found.stopped = Stopped.INTERRUPTED
            _complete_only(states, parents, via)
            _complete_only(edge_transition, edge_state)
        finally:
            if collecting:
                gc.enable()
        if self.keep_edges:
            while len(edge_start) <= len(states):
                edge_start.append(len(edge_transition))
        found.seconds = time.monotonic() - self.began
        return found

    def _loop(  # noqa: PLR0915 (one loop, kept flat for its speed)
        self,
        found: Exploration,
        states: list[int],
        index: dict[int, int],
        parents: "array[int]",
        via: "array[int]",
        waiting: "list[tuple[int, ...] | None]",
        choose: Callable[[int, Sequence[int]], Sequence[int]] | None,
        progress: Callable[[Progress], None] | None,
    ) -> None:
        encoding, masks, rank = self.encoding, self.masks, self.rank
        affected, affected_sets = self.affected, self.affected_sets
        fired, overflows, terminals = found.fired, found.overflows, found.terminals
        edge_start, edge_transition, edge_state = (
            found.edge_start,
            found.edge_transition,
            found.edge_state,
        )
        enabled_now, fire = encoding.enabled, encoding.fire
        fast = [(keep, put) if plain else None for _, _, keep, put, plain in masks]
        tests = tests_of(affected, masks)
        unfired = [True] * len(masks)
        add_state, add_parent, add_via = states.append, parents.append, via.append
        wait, setdefault = waiting.append, index.setdefault
        outside = [each == 2 for each in rank]
        transitions = looked = overfull = 0
        look_every = _LOOK_EVERY if choose is None else _LOOK_EVERY_CHOICE
        self.partly, self.inner = partly, inner = set(), set()
        self.goes_back = False
        at = 0
        count = len(states)
        while at < count:
            if at % look_every == 0 or transitions - looked > _LOOK_EVERY_STEPS:
                found.transitions = looked = transitions
                if self._stop(found, count, at, waiting, progress):
                    return
            state = states[at]
            enabled = waiting[at]
            waiting[at] = None
            assert enabled is not None
            if edge_start is not None:
                edge_start.append(transitions)
            if not enabled:
                terminals.append(at)
                at += 1
                continue
            usable: Sequence[int] = enabled
            if not all([outside[n] for n in enabled]):  # noqa: C419 (a list is faster)
                best = min([rank[n] for n in enabled])
                usable = [n for n in enabled if rank[n] == best]
                if choose is not None:
                    inner.add(at)
            if choose is not None and len(usable) > 1 and state not in self.whole:
                chosen = choose(state, usable)
                if len(chosen) < len(usable):
                    partly.add(at)
                    usable = chosen
            transitions += len(usable)
            for number in usable:
                masks_of = fast[number]
                if masks_of is not None:
                    after = state & masks_of[0]
                    put = masks_of[1]
                    full = after & put
                    after |= put
                else:
                    after, full = fire(number, state)
                if full & ~overfull:
                    for place in encoding.places_in(full & ~overfull):
                        overflows[place] = (at, number)
                        overfull |= encoding.mask[place]
                if unfired[number]:
                    unfired[number] = False
                    fired[number] = at
                known = setdefault(after, count)
                if known == count:
                    count += 1
                    add_state(after)
                    add_parent(at)
                    add_via(number)
                    touched = affected_sets[number]
                    new = [n for n in enabled if n not in touched]
                    for n, test, need, plain in tests[number]:
                        if after & test == need and (plain or enabled_now(n, after)):
                            new.append(n)
                    wait(tuple(new))
                elif known <= at:
                    self.goes_back = True
                if edge_transition is not None:
                    edge_transition.append(number)
                    edge_state.append(known)  # type: ignore[union-attr]
            at += 1
        found.transitions = transitions

    def puts_off_for_ever(self, found: Exploration) -> bool:
        """Whether the search defers a transition for ever. If so, it starts again and
        defers less.
        """
        if not self.partly or not self.goes_back:
            return False
        count = len(found.states)
        targets = [[state for _, state in found.successors(n)] for n in range(count)]
        more = states_to_expand(targets, self.inner, self.partly)
        self.whole.update(found.states[n] for n in more)
        return bool(more)

    def _stop(
        self,
        found: Exploration,
        states: int,
        done: int,
        waiting: "list[tuple[int, ...] | None]",
        progress: Callable[[Progress], None] | None,
    ) -> bool:
        seconds = time.monotonic() - self.began
        if progress is not None:
            progress(Progress(states, states - done, seconds))
        size = states * (_BYTES_A_STATE + self.encoding.bits // 7)
        if self.keep_edges:
            size += found.transitions * _BYTES_AN_EDGE
        # What may fire in those that wait: about as much as in the first and the last of them.
        ends = [len(each) for each in (waiting[done], waiting[-1]) if each is not None]
        size += (states - done) * (
            _BYTES_A_WAITING_STATE + _BYTES_A_TRANSITION * sum(ends) // len(ends)
        )
        if states > self.limits.states:
            found.stopped = Stopped.STATES
        elif seconds > self.limits.seconds:
            found.stopped = Stopped.TIME
        elif size > self.limits.memory_mb * 1e6:
            found.stopped = Stopped.MEMORY
        return found.stopped is not None
