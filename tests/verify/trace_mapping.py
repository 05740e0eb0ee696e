"""Does the engine do only what the net can do? A run of it is followed, state by state.

What is proved of the net holds of a mission only as far as each step of the engine is a run of
them. `Follower` keeps every state of the net that looks like the engine's after each input.
"""

import re
from collections import Counter
from collections.abc import Iterable

from m2pem.engine.records import RunOutcome
from m2pem.engine.state import RunState, RunStatus, Scope, Token
from m2pem.mission.elements import CallActivity, ComplexGateway, InclusiveGateway, ParallelGateway
from m2pem.verify.net.encoding import Encoding
from m2pem.verify.net.petri_net import Kind, PetriNet, Role

Look = Counter[tuple[tuple[str, ...], str]]
"""Tokens by where they are: the activities around them, and their element."""

Tested = tuple[int, int, int]
"""A transition, and bits of a state that must be as these: most are not, which is seen quickly."""

_MOST_AT_ONCE = 4
"""Timers that one tick may let fire."""
_MOST_CANDIDATES = 500
_MOST_STATES = 4_000
_NUMBERED = re.compile(r"(#\d+|\[\d+\])$")


def look_of_run(state: RunState) -> Look:
    """How a run of the engine looks: where its tokens are."""
    look: Look = Counter()
    for token in state.tokens.values():
        if not token.is_reopened:
            look[_path(token.scope), _element(token)] += 1
    return look


def _element(token: Token) -> str:
    node = token.node
    joins = isinstance(node, ComplexGateway) or (
        isinstance(node, ParallelGateway | InclusiveGateway) and len(node.incoming) > 1
    )
    return token.flow.id if joins and token.flow is not None else node.id


def _path(scope: Scope) -> tuple[str, ...]:
    owner = scope.owner
    if owner is None:
        return (scope.container.id,)
    path = (*_path(owner.scope), owner.node.id)
    if scope.loop is None and isinstance(owner.node, CallActivity):
        return (*path, owner.node.called.id)
    return path


class TooManyStatesError(Exception):
    """The net leaves so much open that a run of the engine cannot be followed."""


class Follower:
    """The states of a net that a run of the engine may be in."""

    def __init__(self, net: PetriNet, tokens: int = 15) -> None:
        """`tokens`: room on each place."""
        self.net = net
        bits = tokens.bit_length()
        self.encoding = Encoding(
            net, {p.index: bits for p in net.places if p.role not in (Role.END,)}
        )
        self._outside = self._tested(Kind.EXTERNAL)
        self._joins = self._tested(Kind.JOIN)
        self._internal = self._tested(Kind.INTERNAL)
        self._known: dict[int, set[int]] = {}
        self._paths = [
            tuple(_NUMBERED.sub("", step) for step in scope.path) for scope in net.scopes
        ]
        self.candidates: set[int] = self._quiet({self.encoding.initial})

    # --- looks ----------------------------------------------------------------------------------

    def look(self, number: int) -> Look:
        """How a state of the net looks."""
        look: Look = Counter()
        for place, count in self.encoding.marking(number).tokens.items():
            each = self.net.places[place]
            if each.role not in (Role.CONTROL, Role.END, Role.TRIGGERED):
                look[self._paths[each.scope], each.element] += count
        return look

    def agrees(self, number: int, state: RunState, look: Look) -> bool:
        """Whether a state of the net looks like the engine's."""
        ends = self.encoding.marking(number).tokens.keys() & self.net.ends
        if state.status is not RunStatus.ENDED:
            return not ends and self.look(number) == look
        if state.outcome is RunOutcome.COMPLETED:
            return self.net.completed in ends
        if state.outcome is RunOutcome.TERMINATED:
            return self.net.terminated in ends
        if state.detail.startswith("stuck"):
            return not ends and not self._after(number)
        return self.net.failed in ends

    # --- steps ----------------------------------------------------------------------------------

    def _tested(self, kind: Kind) -> list[Tested]:
        compiled = self.encoding.transitions
        found = (r.index for r in self.net.transitions if r.kind is kind)
        return [(each, compiled[each].test, compiled[each].need) for each in found]

    def _fire(self, transitions: Iterable[Tested], number: int) -> list[int]:
        encoding = self.encoding
        return [
            encoding.fire(r, number)[0]
            for r, test, need in transitions
            if number & test == need and encoding.enabled(r, number)
        ]

    def _quiet(self, states: set[int]) -> set[int]:
        """Where the internal steps lead that follow."""
        seen, waiting, found = set(states), list(states), set()
        while waiting:
            state = waiting.pop()
            after = self._fire(self._internal, state) or self._fire(self._joins, state)
            if not after:
                found.add(state)
            for each in after:
                if each not in seen:
                    if len(seen) > _MOST_STATES:
                        raise TooManyStatesError
                    seen.add(each)
                    waiting.append(each)
        return found

    def _after(self, number: int) -> set[int]:
        if number not in self._known:
            self._known[number] = self._quiet(set(self._fire(self._outside, number)))
        return self._known[number]

    def step(self, state: RunState) -> bool:
        """The engine has taken an input in. False: no run of the transitions looks like
        its state.
        """
        look = look_of_run(state)
        reached = set(self.candidates)
        for _ in range(_MOST_AT_ONCE):
            found = {each for each in reached if self.agrees(each, state, look)}
            if found:
                more = {
                    each
                    for number in self.candidates
                    for each in self._after(number)
                    if self.agrees(each, state, look)
                }
                self.candidates = set(list(found | more)[:_MOST_CANDIDATES])
                return True
            reached = {each for number in reached for each in self._after(number)}
            if len(reached) > _MOST_CANDIDATES:
                raise TooManyStatesError
            if not reached:
                break
        return False
