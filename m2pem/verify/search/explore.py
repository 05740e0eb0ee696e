"""Searching all that a net can lead to, state by state, shortest runs first.

    found = explore(net)
    found.complete                    # whether that was all
    found.terminals                   # states in which no transition can fire
    found.run_to(state)               # the transitions that lead there

`Exploration` is what properties are read from. A place that gets more tokens than it has room for
is noted (`overflows`), and the search starts again with more room for it, up to `Limits.tokens`.
Until then, what follows such a step is not searched.

A `Watch` sees what was found while the search goes on. When it has seen a violation, the search
goes on for a share of what it has searched (`Limits.after_violation`), and ends.
"""

import gc
import time
from array import array
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Protocol

from m2pem.verify.net.encoding import Encoding, Marking
from m2pem.verify.net.petri_net import Flag, Kind, PetriNet
from m2pem.verify.search.read_write_sets import affected_transitions, as_sets, tests_of
from m2pem.verify.search.stubborn_sets import Reduction, states_to_expand

LOOK_EVERY = 128
"""States between two readings of the clock; states that take longer count more."""
LOOK_EVERY_STEPS = 10_000
LOOK_EVERY_CHOICE = 4
"""The same with a reduction, which takes longer for each state."""
_BYTES_A_STATE = 250
"""Approximate memory of a state beside its own bits; a state that waits to be searched takes more.
"""
_BYTES_A_WAITING_STATE = 56
_BYTES_A_TRANSITION = 8
"""Of each transition that is enabled in a waiting state."""
_BYTES_AN_EDGE = 16
MANY_TOKENS = 127
"""Tokens that are followed on a place where several are meant, as far as that is cheap."""
MANY_STATES = 20_000
"""The most states of a search that begins again with room for more of those."""
AFTER_VIOLATION_STATES = 50_000
"""States that are searched after a violation in any case."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of a check; beyond, it is undecided. `tokens`: on a place where one is meant.

    `after_violation`: when a `Watch` has seen a violation, the search ends after as many states
    again as it took to find it, at least after this many; None: it goes on to its end. It is a
    number of states, so that an answer does not depend on the speed of the machine.
    """

    states: int = 2_000_000
    seconds: float = 600.0
    memory_mb: float = 2_000.0
    tokens: int = 7
    after_violation: int | None = AFTER_VIOLATION_STATES


class Stopped(StrEnum):
    """Why a search did not see all."""

    STATES = "the limit of states"
    TIME = "the limit of time"
    MEMORY = "the limit of memory"
    TOKENS = "a place that gets more and more tokens"
    TRANSITIONS = "the limit of transitions"
    DEPTH = "the limit of depth"
    BITSTATE = "a table that may take a new state for a known one"
    VIOLATION = "a violation that was found before"
    INTERRUPTED = "an interruption by hand"


@dataclass(frozen=True, slots=True)
class Progress:
    """The progress of a search. `memory_mb`: about what it needs, 0 if that is not known."""

    states: int
    waiting: int
    seconds: float
    memory_mb: float = 0.0


@dataclass(slots=True)
class Exploration:
    """What a search has seen. States are numbered in the order in which they were found.

    `fired`: by transition, the first state in which it fired. `flagged`: those of them that have a
    flag. `overflows`: by place, the first state and transition at which a token came to a place
    that had one, where one is meant. `beyond`: places that got more than `Limits.tokens`. `lost`:
    places, where several are meant, that lost tokens: what follows is not certain. `edges`:
    successors of each state as (transition, state), if they were kept. `expanded`: how many states
    have all their successors, but for those of `cut`: there, a place has no room for a token.
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
    lost: frozenset[int] = frozenset()
    edge_start: "array[int] | None" = None
    edge_transition: "array[int] | None" = None
    edge_state: "array[int] | None" = None
    reduced: bool = False
    expanded: int = 0
    cut: set[int] = field(default_factory=set)

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


class Watch(Protocol):
    """Looks at what a search has found while it goes on."""

    def look(self, found: Exploration) -> bool:
        """Whether there is a violation in what was found; called when there is more in it."""


def explore(
    net: PetriNet,
    limits: Limits | None = None,
    *,
    reduction: Reduction | None = None,
    keep_edges: bool = True,
    progress: Callable[[Progress], None] | None = None,
    watch: Watch | None = None,
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
    observer = _Observer(limits, watch)
    began = time.monotonic()
    while True:
        edges = keep_edges or reduction is not None
        search = _Search(net, Encoding(net, wider), limits, began, edges, observer)
        while True:
            found = search.run(reduction, progress)
            full = [place for place in found.overflows if search.grows(place)]
            if found.stopped is not None or full or not search.puts_off_for_ever(found):
                break
        for place, at in found.overflows.items():
            if place not in overflows and not net.places[place].several:
                overflows[place] = at
                runs[place] = found.overflow_runs[place]
        far = [place for place in found.overflows if search.grows_far(place)]
        more = max(4 * MANY_STATES // len(found.states), 1).bit_length() - 1 if far else 0
        if len(found.states) > MANY_STATES or more < len(far):
            far = []
        if (full or far) and found.stopped is None:
            wider |= {place: found.encoding.width[place] + 1 for place in full}
            for place in far:
                most = found.encoding.width[place] + more // len(far)
                wider[place] = min(MANY_TOKENS.bit_length(), most)
            continue
        found.lost = frozenset(place for place in found.overflows if net.places[place].several)
        found.beyond = frozenset(
            place
            for place in found.overflows
            if not (net.places[place].once or search.grows(place))
        )
        if found.beyond and found.stopped is None:
            found.stopped = Stopped.TOKENS
        found.overflows = overflows
        found.overflow_runs = runs
        return found


class _Observer:
    """Asks a watch, and says when enough was searched after a violation."""

    def __init__(self, limits: Limits, watch: Watch | None) -> None:
        self.watch = watch
        self.least = limits.after_violation
        self.before = 0
        """States of the searches before this one, which had less room or deferred too much."""
        self.most: int | None = None
        self.seen = (0, 0, 0)

    def enough(self, found: Exploration, states: int) -> bool:
        """Whether to end a search that has found so many states."""
        if self.watch is None:
            return False
        searched = self.before + states
        now = (len(found.terminals), len(found.fired), len(found.overflows))
        if self.most is None and now != self.seen:
            self.seen = now
            found.stopped = Stopped.VIOLATION  # not all was seen: nothing holds yet
            violated = self.watch.look(found)
            if violated and self.least is not None:
                self.most = searched + max(searched, self.least)
            found.stopped = None
        return self.most is not None and searched > self.most


def _complete_only(*columns: "list[int] | array[int]") -> None:
    """Drop the last row if it is incomplete: an interrupt comes between any two instructions."""
    rows = min(map(len, columns))
    for column in columns:
        del column[rows:]


class _Search:
    def __init__(
        self,
        net: PetriNet,
        encoding: Encoding,
        limits: Limits,
        began: float,
        keep_edges: bool,
        observer: _Observer,
    ) -> None:
        self.net = net
        self.encoding = encoding
        self.limits = limits
        self.began = began
        self.keep_edges = keep_edges
        self.observer = observer
        self.growing = encoding.places_mask(p.index for p in net.places if self.grows(p.index))
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

    def grows(self, place: int) -> bool:
        """Whether a place that is full gets more room in another search."""
        bits = self.encoding.width[place] + 1
        return not self.net.places[place].once and (1 << bits) - 1 <= self.limits.tokens

    def grows_far(self, place: int) -> bool:
        """Whether a place on which several tokens are meant gets more room after a small search."""
        more = self.encoding.width[place] < MANY_TOKENS.bit_length()
        return self.net.places[place].several and not self.grows(place) and more

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
            found.expanded = len(edge_start)
            if found.stopped is Stopped.INTERRUPTED:
                found.expanded = max(0, found.expanded - 1)
            while len(edge_start) <= len(states):
                edge_start.append(len(edge_transition))
        found.seconds = time.monotonic() - self.began
        self.observer.before += len(states)
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
        overflow_runs, growing, cut = found.overflow_runs, self.growing, found.cut
        transitions = looked = overfull = 0
        look_every = LOOK_EVERY if choose is None else LOOK_EVERY_CHOICE
        self.partly, self.inner = partly, inner = set(), set()
        self.goes_back = False
        at = 0
        count = len(states)
        while at < count:
            if at % look_every == 0 or transitions - looked > LOOK_EVERY_STEPS:
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
                if unfired[number]:
                    unfired[number] = False
                    fired[number] = at
                if full:
                    for place in encoding.places_in(full & ~overfull) if full & ~overfull else ():
                        overflows[place] = (at, number)
                        overflow_runs[place] = (*found.run_to(at), number)
                        overfull |= encoding.mask[place]
                    if full & growing:
                        cut.add(at)
                        transitions -= 1
                        continue
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
        size = states * (_BYTES_A_STATE + self.encoding.bits // 7)
        if self.keep_edges:
            size += found.transitions * _BYTES_AN_EDGE
        # What may fire in those that wait: about as much as in the first and the last of them.
        ends = [len(each) for each in (waiting[done], waiting[-1]) if each is not None]
        size += (states - done) * (
            _BYTES_A_WAITING_STATE + _BYTES_A_TRANSITION * sum(ends) // len(ends)
        )
        if progress is not None:
            progress(Progress(states, states - done, seconds, size / 1e6))
        if self.observer.enough(found, states):
            found.stopped = Stopped.VIOLATION
        elif states > self.limits.states:
            found.stopped = Stopped.STATES
        elif seconds > self.limits.seconds:
            found.stopped = Stopped.TIME
        elif size > self.limits.memory_mb * 1e6:
            found.stopped = Stopped.MEMORY
        return found.stopped is not None
