"""Builder of the net: places and scopes by what they stand for, and transitions made of parts.

`Effect` is a part of a transition. `enter_at_once` fuses the first transition of an element that
waits with each transition that leads to it: a token that enters such an element waits at once, and
misses nothing that is thrown (`m2pem.engine.arming`).
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache

from m2pem.mission.elements import (
    Activity,
    ComplexGateway,
    Element,
    FlowNode,
    InclusiveGateway,
    ParallelGateway,
    SequenceFlow,
)
from m2pem.verify.net.petri_net import (
    Action,
    Approximation,
    Exactness,
    Flag,
    Kind,
    PetriNet,
    Place,
    Role,
    Scope,
    Step,
    Transition,
    Trigger,
    Variable,
    own_outcome,
    with_outcomes,
)
from m2pem.verify.net.size_limit import SizeLimit


@dataclass(frozen=True, slots=True)
class Effect:
    """A part of a transition, with the fields of `Transition`.

    `reset_scopes` stand for all places in them, `interrupt_scopes` for all but those of what is
    kept until their end; `empty_scopes` must have no token in them. `lets_go`: places of kept
    resources, which are kept no longer, also those that tasks have now. `releases`: scopes of
    activities; what they have is kept no longer. `guard` and `assign` are by variable.
    """

    steps: tuple[Step, ...] = ()
    consume: tuple[int, ...] = ()
    read: frozenset[int] = frozenset()
    inhibit: frozenset[int] = frozenset()
    empty_scopes: frozenset[int] = frozenset()
    moves: tuple[tuple[int, int], ...] = ()
    copies: tuple[tuple[int, int], ...] = ()
    reset: frozenset[int] = frozenset()
    reset_scopes: frozenset[int] = frozenset()
    produce: tuple[int, ...] = ()
    guard: "dict[int, frozenset[int]]" = field(default_factory=dict)
    assign: dict[int, int] = field(default_factory=dict)
    flag: Flag | None = None
    flagged: str = ""
    at_most: tuple[tuple[int, int], ...] = ()
    interrupt_scopes: frozenset[int] = frozenset()
    lets_go: frozenset[int] = frozenset()
    releases: frozenset[int] = frozenset()

    def then(self, other: "Effect") -> "Effect | None":
        """Return both effects together, this one first; None if they exclude each other."""
        guard = dict(self.guard)
        for variable, values in other.guard.items():
            if variable in self.assign:
                if self.assign[variable] not in values:
                    return None
                continue
            both = guard[variable] & values if variable in guard else values
            if not both:
                return None
            guard[variable] = both
        read, inhibit = self.read | other.read, self.inhibit | other.inhibit
        if read & inhibit or inhibit & set(self.consume + other.consume):
            return None
        return Effect(
            self.steps + other.steps,
            self.consume + other.consume,
            read,
            inhibit,
            self.empty_scopes | other.empty_scopes,
            self.moves + other.moves,
            self.copies + other.copies,
            self.reset | other.reset,
            self.reset_scopes | other.reset_scopes,
            self.produce + other.produce,
            guard,
            {**self.assign, **other.assign},
            self.flag or other.flag,
            self.flagged or other.flagged,
            self.at_most + other.at_most,
            self.interrupt_scopes | other.interrupt_scopes,
            self.lets_go | other.lets_go,
            self.releases | other.releases,
        )

    def and_then(self, other: "Effect") -> "Effect":
        """Return both effects together, as `then`; they do not exclude each other."""
        both = self.then(other)
        assert both is not None
        return both

    def with_step(self, element: str, action: Action, detail: str = "") -> "Effect":
        """Return the effect with one more step at its beginning."""
        return replace(self, steps=(Step(element, action, detail), *self.steps))


def product(first: Iterable[Effect], second: Iterable[Effect]) -> list[Effect]:
    """Every pair of the two lists whose effects do not exclude each other."""
    others = list(second)
    pairs = (one.then(other) for one in first for other in others)
    return [pair for pair in pairs if pair is not None]


@dataclass(slots=True, eq=False)
class ScopeDraft:
    """A scope under construction. `frame`: the process instance whose data it sees."""

    index: int
    element: Element
    parent: "ScopeDraft | None"
    path: tuple[str, ...]
    frame: tuple[str, ...]
    depth_of_calls: tuple[str, ...] = ()
    places: list[int] = field(default_factory=list)
    children: "list[ScopeDraft]" = field(default_factory=list)
    hidden: frozenset[str] = frozenset()
    """Names of data that only this activity, or its instances, have: not followed."""
    instance: "object | None" = None
    """The `ActivityInstance` whose inside it is, if it is one."""
    several: bool = False
    """Several tokens on one place in it are no finding."""
    counted: bool = False
    """The same; those that do not fit are lost."""
    open: int | None = None
    """The place that has a token while its event subprocesses can begin."""


@dataclass(slots=True)
class TransitionDraft:
    """A transition under construction."""

    effect: Effect
    kind: Kind
    trigger: Trigger | None = None
    detail: str = ""
    due_us: int | None = None


@dataclass(frozen=True, slots=True)
class Timed:
    """A timer whose duration is known. It runs while all places of `running` have a token."""

    after_us: int
    running: tuple[int, ...]
    transitions: list[TransitionDraft]


class NetBuilder:
    """Collects places, scopes and transitions; `finish` makes a net of them."""

    def __init__(self, size_limit: SizeLimit) -> None:
        self.size_limit = size_limit
        self.scopes: list[ScopeDraft] = []
        self.places: list[Place] = []
        self.drafts: list[TransitionDraft] = []
        self.approximations: dict[Approximation, None] = {}
        self.elements: dict[str, str] = {}
        self.holders: dict[str, list[int]] = {}
        self.timed: dict[int, list[Timed]] = {}
        self.at_once: set[int] = set()
        """Entry places of elements that wait as soon as they are entered (`enter_at_once`)."""
        self.holding: list[int] = []
        """Places whose resources come from pools."""
        self.repeated: frozenset[FlowNode] = frozenset()
        """Nodes on which several tokens are meant: what they follow may happen again."""
        self.same_holding: dict[tuple[int, tuple[int, ...]], int] = {}
        """By a place of `holding` and other places to which its resources may go, the place of the
        same task that has the same resources and gives them back there."""
        self._at: dict[tuple[object, int, str], int] = {}

    # --- parts ----------------------------------------------------------------------------------

    def scope(
        self,
        element: Element,
        parent: ScopeDraft | None,
        step: str = "",
        frame: tuple[str, ...] | None = None,
    ) -> ScopeDraft:
        """Add a scope. `step`: distinguishes it from others of its parent; by default the element's
        id.
        """
        path = (*parent.path, step or element.id) if parent is not None else (element.id,)
        made = ScopeDraft(
            len(self.scopes),
            element,
            parent,
            path,
            frame if frame is not None else (parent.frame if parent else ()),
            parent.depth_of_calls if parent is not None else (),
            several=parent is not None and parent.several,
            counted=parent is not None and parent.counted,
        )
        self.scopes.append(made)
        if parent is not None:
            parent.children.append(made)
        return made

    def place(
        self,
        element: Element,
        scope: ScopeDraft,
        role: Role,
        suffix: str = "",
        *,
        several: bool = False,
        resources: tuple[str, ...] = (),
        behavior: str = "",
        returns: tuple[int, ...] = (),
        holder: int | None = None,
    ) -> int:
        """Return the place of an element in a scope; it is created at the first call."""
        key = (element, scope.index, f"{role}{suffix}")
        known = self._at.get(key)
        if known is not None:
            return known
        name = "/".join((*scope.path[1:], element.id))
        name += {Role.ENTERING: "", Role.ACTIVE: "!", Role.FLOW: ">"}.get(role, f"~{role.value}")
        number = self._at[key] = len(self.places)
        self.places.append(
            Place(
                number,
                f"{name}{suffix}",
                element.id,
                scope.index,
                role,
                several or scope.several,
                resources,
                behavior,
                scope.counted,
                returns=returns,
                holder=holder,
            )
        )
        scope.places.append(number)
        if returns:
            self.holding.append(number)
        for resource in resources:
            self.holders.setdefault(resource, []).append(number)
        return number

    def transition(
        self,
        effect: Effect,
        kind: Kind = Kind.INTERNAL,
        trigger: Trigger | None = None,
        detail: str = "",
        due_us: int | None = None,
    ) -> TransitionDraft:
        """Add a transition."""
        self.size_limit.count_transition(_first_element(effect))
        draft = TransitionDraft(effect, kind, trigger, detail, due_us)
        self.drafts.append(draft)
        return draft

    def add_element(self, element: Element) -> None:
        """Note that an element has transitions."""
        self.elements[element.id] = element.label

    def approximate(
        self, element: Element, exactness: Exactness, what: str, bound: str = ""
    ) -> None:
        """Note where the net is not exactly what the engine does."""
        self.approximations[Approximation(element.id, exactness, what, bound)] = None

    def counted(self, element: Element, scope: ScopeDraft, suffix: str) -> int:
        """Return a place that counts, as far as it has room: what is beyond is lost."""
        number = self.place(element, scope, Role.CONTROL, suffix, several=True)
        self.places[number] = replace(self.places[number], once=True)
        return number

    # --- the end --------------------------------------------------------------------------------

    def finish(
        self,
        mission: str,
        process: str,
        variables: tuple[Variable, ...],
        initial: tuple[int, ...],
        ends: tuple[int, int, int],
    ) -> PetriNet:
        """Return the net, with the places of every scope in place of the scope."""
        inside = {scope.index: self._inside(scope) for scope in reversed(self.scopes)}

        @cache  # whatever ends one scope shares one list of its places: there may be many of both
        def reset_places(
            reset: frozenset[int], ended: frozenset[int], interrupted: frozenset[int]
        ) -> tuple[int, ...]:
            places = [inside[index][0] for index in ended]
            places += [inside[index][0] - self._kept_until(index) for index in interrupted]
            return tuple(sorted(reset.union(*places)))

        transitions: list[Transition] = []
        names: Counter[str] = Counter()
        for draft in self.drafts:
            effect = draft.effect
            reset = reset_places(
                effect.reset | effect.lets_go, effect.reset_scopes, effect.interrupt_scopes
            )
            transition = self._transition(draft, len(transitions), names, inside, reset)
            if transition is not None:
                transitions.append(transition)
        return PetriNet(
            mission,
            process,
            tuple(
                Scope(a.index, a.element.id, a.parent.index if a.parent else None, a.path)
                for a in self.scopes
            ),
            tuple(self.places),
            variables,
            tuple(with_outcomes(transitions)),
            tuple(Counter(initial).items()),
            *ends,
            tuple(self.approximations),
            self.elements,
        )

    def _inside(self, scope: ScopeDraft) -> tuple[frozenset[int], frozenset[int]]:
        everything: set[int] = set()
        waiting = [scope]
        while waiting:
            each = waiting.pop()
            everything.update(each.places)
            waiting.extend(each.children)
        tokens = {n for n in everything if self.places[n].role is not Role.CONTROL}
        return frozenset(everything), frozenset(tokens)

    def _kept_until(self, scope: int) -> frozenset[int]:
        """Return the places of what is kept until the end of a scope."""
        return frozenset(n for n in self.scopes[scope].places if self.places[n].kept)

    def _transition(
        self,
        draft: TransitionDraft,
        number: int,
        names: Counter[str],
        inside: dict[int, tuple[frozenset[int], frozenset[int]]],
        reset: tuple[int, ...],
    ) -> Transition | None:
        effect = draft.effect
        self.size_limit.check_time(_first_element(effect))
        inhibit = set(effect.inhibit)
        for index in effect.empty_scopes:
            inhibit |= inside[index][1]
        consume = Counter(effect.consume)
        inhibit -= set(consume)
        if inhibit & effect.read:
            return None
        element = _first_element(effect)
        names[element] += 1
        return Transition(
            number,
            f"{element}.{names[element]}",
            draft.kind,
            effect.steps,
            tuple(sorted(consume.items())),
            tuple(sorted(effect.read)),
            tuple(sorted(inhibit)),
            tuple(sorted(effect.guard.items())),
            effect.moves + self._kept_otherwise(effect, reset),
            effect.copies + self._given_back(effect, reset),
            reset,
            tuple(sorted(Counter(effect.produce).items())),
            tuple(sorted(effect.assign.items())),
            draft.trigger,
            draft.detail,
            effect.flag,
            effect.flagged,
            bool(effect.empty_scopes),
            draft.due_us,
            tuple(sorted(dict(sorted(effect.at_most, reverse=True)).items())),
            own_outcome(number, draft.kind, effect.steps),
        )

    def _given_back(self, effect: Effect, reset: tuple[int, ...]) -> tuple[tuple[int, int], ...]:
        """Return the copies with which a transition that resets places gives resources back."""
        if not self.holding:
            return ()
        emptied = set(reset)
        return tuple(
            (held, target)
            for held in self.holding
            if held in emptied
            for place in self.places[held].returns
            if (target := self._goes_to(place, emptied, free=self._frees(effect, held))) is not None
        )

    def _frees(self, effect: Effect, held: int) -> bool:
        """Whether what goes from a place that an effect resets is kept no longer."""
        return held in effect.lets_go or self.places[held].scope in effect.releases

    def _goes_to(self, place: int, emptied: set[int], *, free: bool) -> int | None:
        """Return where a resource goes that is given back to a place; None: the run is over.
        `free`: it is not kept."""
        while place in emptied or (free and self.places[place].kept):
            returns = self.places[place].returns
            if not returns:  # at the end of the run, all places are emptied
                return None
            place = returns[0]
        return place

    def _kept_otherwise(
        self, effect: Effect, reset: tuple[int, ...]
    ) -> tuple[tuple[int, int], ...]:
        """Return the moves with which the resources that tasks have are kept no longer, or as those
        of no task, when the place that they would be given back to is emptied."""
        if not self.same_holding:
            return ()
        emptied = set(reset)
        found: list[tuple[int, int]] = []
        for (held, returns), other in self.same_holding.items():
            goes_to = tuple(
                self._goes_to(place, emptied, free=place in effect.lets_go)
                for place in self.places[held].returns
            )
            if held not in emptied and goes_to == returns:
                found.append((held, other))
        return tuple(found)


def _first_element(effect: Effect) -> str:
    return effect.steps[0].element if effect.steps else "run"


def is_join(node: FlowNode) -> bool:
    """Whether tokens wait at a node by the flow that they came by."""
    if isinstance(node, ComplexGateway):
        return True
    return isinstance(node, ParallelGateway | InclusiveGateway) and len(node.incoming) > 1


def arrival(net: NetBuilder, flow: SequenceFlow, scope: ScopeDraft) -> int:
    """The place that a token comes to by a flow."""
    if is_join(flow.target):
        return net.place(flow, scope, Role.FLOW)
    return entry_place(net, flow.target, scope)


def entry_place(net: NetBuilder, node: FlowNode, scope: ScopeDraft) -> int:
    """The place of a token that has entered a node."""
    many = isinstance(node, Activity) and node.start_quantity > 1
    return net.place(node, scope, Role.ENTERING, several=many or node in net.repeated)


def enter_at_once(net: NetBuilder, initial: Sequence[int]) -> tuple[int, ...]:
    """Fuse the first transition of an element that waits with each transition that leads to it.

    Returns the places that have a token at first.
    """
    entries = {place: draft for place in net.at_once if (draft := _entry(net, place)) is not None}
    needed: set[int] = set()
    """Entry places to which some transition still brings a token."""
    for draft in net.drafts:
        draft.effect = _joined(draft.effect, entries, needed)
    first = _joined(Effect(produce=tuple(initial)), entries, needed)
    over = {id(entry) for place, entry in entries.items() if place not in needed}
    net.drafts = [draft for draft in net.drafts if id(draft) not in over]
    return first.produce


def _entry(net: NetBuilder, place: int) -> TransitionDraft | None:
    """The one transition that takes a token from a place, if it has no other condition."""
    takes = [draft for draft in net.drafts if place in draft.effect.consume]
    if len(takes) != 1 or takes[0].kind is not Kind.INTERNAL:
        return None
    effect = takes[0].effect
    asks = effect.read or effect.inhibit or effect.empty_scopes or effect.guard or effect.at_most
    ends = effect.reset_scopes or effect.interrupt_scopes
    does_more = effect.moves or effect.copies or ends or effect.flag is not None
    return None if effect.consume != (place,) or asks or does_more else takes[0]


def _joined(effect: Effect, entries: dict[int, TransitionDraft], needed: set[int]) -> Effect:
    waiting = [place for place in effect.produce if place in entries]
    while waiting:
        place = waiting.pop()
        entry = entries[place].effect
        rest = list(effect.produce)
        rest.remove(place)
        if not entry.reset.isdisjoint(rest) or not entry.assign.keys().isdisjoint(effect.assign):
            needed.add(place)
            continue
        effect = replace(
            effect,
            steps=effect.steps + entry.steps,
            reset=effect.reset | entry.reset,
            produce=(*rest, *entry.produce),
            assign={**effect.assign, **entry.assign},
        )
        waiting += [each for each in entry.produce if each in entries]
    return effect
