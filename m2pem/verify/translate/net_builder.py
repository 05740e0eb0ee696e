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
    Place,
    Role,
    Rule,
    Scope,
    Step,
    System,
    Trigger,
    Variable,
    with_outcomes,
)
from m2pem.verify.net.size_limit import Bound


@dataclass(frozen=True, slots=True)
class Effect:
    """Fields as in `Rule`. `kill_scopes` stand for all places in them, `quiet_scopes` must have
    no token in them. `guard` and `assign` are by variable."""

    steps: tuple[Step, ...] = ()
    consume: tuple[int, ...] = ()
    read: frozenset[int] = frozenset()
    inhibit: frozenset[int] = frozenset()
    quiet_scopes: frozenset[int] = frozenset()
    moves: tuple[tuple[int, int], ...] = ()
    copies: tuple[tuple[int, int], ...] = ()
    kill: frozenset[int] = frozenset()
    kill_scopes: frozenset[int] = frozenset()
    produce: tuple[int, ...] = ()
    guard: "dict[int, frozenset[int]]" = field(default_factory=dict)
    assign: dict[int, int] = field(default_factory=dict)
    flag: Flag | None = None
    flagged: str = ""

    def then(self, other: "Effect") -> "Effect | None":
        """Both, this one first; None when they ask for what excludes each other."""
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
            self.quiet_scopes | other.quiet_scopes,
            self.moves + other.moves,
            self.copies + other.copies,
            self.kill | other.kill,
            self.kill_scopes | other.kill_scopes,
            self.produce + other.produce,
            guard,
            {**self.assign, **other.assign},
            self.flag or other.flag,
            self.flagged or other.flagged,
        )

    def saying(self, element: str, action: Action, detail: str = "") -> "Effect":
        """With one more step at its beginning."""
        return replace(self, steps=(Step(element, action, detail), *self.steps))


def product(first: Iterable[Effect], second: Iterable[Effect]) -> list[Effect]:
    """Every pair of the two that does not exclude itself."""
    others = list(second)
    pairs = (one.then(other) for one in first for other in others)
    return [pair for pair in pairs if pair is not None]


@dataclass(slots=True, eq=False)
class Area:
    """A scope in the making. `frame`: the process instance whose data it sees."""

    index: int
    element: Element
    parent: "Area | None"
    path: tuple[str, ...]
    frame: tuple[str, ...]
    depth_of_calls: tuple[str, ...] = ()
    places: list[int] = field(default_factory=list)
    children: "list[Area]" = field(default_factory=list)
    hidden: frozenset[str] = frozenset()
    """Names that only this activity, or its instances, know: not followed."""
    host: "object | None" = None
    """How its activity ends, when it is the inside of one (`Host`)."""
    several: bool = False
    """Tokens in it may meet others without harm."""
    open: int | None = None
    """Place that has a token while its event subprocesses can begin."""


@dataclass(slots=True)
class Draft:
    """A rule in the making."""

    effect: Effect
    kind: Kind
    trigger: Trigger | None = None
    detail: str = ""
    due_us: int | None = None


@dataclass(frozen=True, slots=True)
class Timed:
    """A timer whose duration is known: it runs while all of `running` have a token."""

    after_us: int
    running: tuple[int, ...]
    rules: list[Draft]


class Net:
    """Collects places, areas and rules; `finish` makes them a system."""

    def __init__(self, bound: Bound) -> None:
        self.bound = bound
        self.areas: list[Area] = []
        self.places: list[Place] = []
        self.drafts: list[Draft] = []
        self.approximations: dict[Approximation, None] = {}
        self.elements: dict[str, str] = {}
        self.holders: dict[str, list[int]] = {}
        self.timed: dict[int, list[Timed]] = {}
        self.at_once: set[int] = set()
        """Places of tokens at what waits as soon as it is entered (`entering`)."""
        self._at: dict[tuple[object, int, str], int] = {}

    # --- parts ----------------------------------------------------------------------------------

    def area(
        self,
        element: Element,
        parent: Area | None,
        step: str = "",
        frame: tuple[str, ...] | None = None,
    ) -> Area:
        """A new scope. `step`: what tells it from others of its parent, else the element's id."""
        path = (*parent.path, step or element.id) if parent is not None else (element.id,)
        made = Area(
            len(self.areas),
            element,
            parent,
            path,
            frame if frame is not None else (parent.frame if parent else ()),
            parent.depth_of_calls if parent is not None else (),
            several=parent.several if parent is not None else False,
        )
        self.areas.append(made)
        if parent is not None:
            parent.children.append(made)
        return made

    def place(
        self,
        element: Element,
        area: Area,
        role: Role,
        suffix: str = "",
        *,
        several: bool = False,
        resources: tuple[str, ...] = (),
        behavior: str = "",
    ) -> int:
        """The place of an element in an area, made when it is first asked for."""
        key = (element, area.index, f"{role}{suffix}")
        known = self._at.get(key)
        if known is not None:
            return known
        name = "/".join((*area.path[1:], element.id))
        name += {Role.ENTERING: "", Role.ACTIVE: "!", Role.FLOW: ">"}.get(role, f"~{role.value}")
        number = self._at[key] = len(self.places)
        self.places.append(
            Place(
                number,
                f"{name}{suffix}",
                element.id,
                area.index,
                role,
                several or area.several,
                resources,
                behavior,
            )
        )
        area.places.append(number)
        for resource in resources:
            self.holders.setdefault(resource, []).append(number)
        return number

    def rule(
        self,
        effect: Effect,
        kind: Kind = Kind.INTERNAL,
        trigger: Trigger | None = None,
        detail: str = "",
        due_us: int | None = None,
    ) -> Draft:
        """A new rule."""
        self.bound.rule(_spelled_out(effect))
        draft = Draft(effect, kind, trigger, detail, due_us)
        self.drafts.append(draft)
        return draft

    def knows(self, element: Element) -> None:
        """An element that has rules."""
        self.elements[element.id] = element.label

    def approximate(self, element: Element, exactness: Exactness, what: str) -> None:
        """Note where the rules are not what the engine does."""
        self.approximations[Approximation(element.id, exactness, what)] = None

    # --- the end --------------------------------------------------------------------------------

    def finish(
        self,
        mission: str,
        process: str,
        variables: tuple[Variable, ...],
        initial: tuple[int, ...],
        ends: tuple[int, int, int],
    ) -> System:
        """All of it, with every scope spelled out as its places."""
        inside = {area.index: self._inside(area) for area in reversed(self.areas)}

        @cache  # whatever ends one scope shares one list of its places: there may be many of both
        def killed(kill: frozenset[int], scopes: frozenset[int]) -> tuple[int, ...]:
            return tuple(sorted(kill.union(*(inside[scope][0] for scope in scopes))))

        rules: list[Rule] = []
        names: Counter[str] = Counter()
        for draft in self.drafts:
            kill = killed(draft.effect.kill, draft.effect.kill_scopes)
            rule = self._rule(draft, len(rules), names, inside, kill)
            if rule is not None:
                rules.append(rule)
        return System(
            mission,
            process,
            tuple(
                Scope(a.index, a.element.id, a.parent.index if a.parent else None, a.path)
                for a in self.areas
            ),
            tuple(self.places),
            variables,
            tuple(with_outcomes(rules)),
            tuple(Counter(initial).items()),
            *ends,
            tuple(self.approximations),
            self.elements,
        )

    def _inside(self, area: Area) -> tuple[frozenset[int], frozenset[int]]:
        everything: set[int] = set()
        waiting = [area]
        while waiting:
            each = waiting.pop()
            everything.update(each.places)
            waiting.extend(each.children)
        tokens = {n for n in everything if self.places[n].role is not Role.CONTROL}
        return frozenset(everything), frozenset(tokens)

    def _rule(
        self,
        draft: Draft,
        number: int,
        names: Counter[str],
        inside: dict[int, tuple[frozenset[int], frozenset[int]]],
        kill: tuple[int, ...],
    ) -> Rule | None:
        effect = draft.effect
        self.bound.look(_spelled_out(effect))
        inhibit = set(effect.inhibit)
        for scope in effect.quiet_scopes:
            inhibit |= inside[scope][1]
        consume = Counter(effect.consume)
        inhibit -= set(consume)
        if inhibit & effect.read:
            return None
        element = _spelled_out(effect)
        names[element] += 1
        return Rule(
            number,
            f"{element}.{names[element]}",
            draft.kind,
            effect.steps,
            tuple(sorted(consume.items())),
            tuple(sorted(effect.read)),
            tuple(sorted(inhibit)),
            tuple(sorted(effect.guard.items())),
            effect.moves,
            effect.copies,
            kill,
            tuple(sorted(Counter(effect.produce).items())),
            tuple(sorted(effect.assign.items())),
            draft.trigger,
            draft.detail,
            effect.flag,
            effect.flagged,
            bool(effect.quiet_scopes),
            draft.due_us,
        )


def _spelled_out(effect: Effect) -> str:
    return effect.steps[0].element if effect.steps else "run"


def is_join(node: FlowNode) -> bool:
    """Whether tokens wait at it by the flow that they came by."""
    if isinstance(node, ComplexGateway):
        return True
    return isinstance(node, ParallelGateway | InclusiveGateway) and len(node.incoming) > 1


def arrival(net: Net, flow: SequenceFlow, area: Area) -> int:
    """The place that a token comes to by a flow."""
    if is_join(flow.target):
        return net.place(flow, area, Role.FLOW)
    return at(net, flow.target, area)


def at(net: Net, node: FlowNode, area: Area) -> int:
    """The place of a token that a node is to be executed on."""
    many = isinstance(node, Activity) and node.start_quantity > 1
    return net.place(node, area, Role.ENTERING, several=many)


def enter_at_once(net: Net, initial: Sequence[int]) -> tuple[int, ...]:
    """Join the first rule of what waits with each rule that leads to it.

    Gives the places that have a token at first.
    """
    entries = {place: draft for place in net.at_once if (draft := _entry(net, place)) is not None}
    needed: set[int] = set()
    """Places to which some rule still brings a token without what follows."""
    for draft in net.drafts:
        draft.effect = _joined(net, draft.effect, entries, needed)
    first = _joined(net, Effect(produce=tuple(initial)), entries, needed)
    over = {id(entry) for place, entry in entries.items() if place not in needed}
    net.drafts = [draft for draft in net.drafts if id(draft) not in over]
    return first.produce


def _entry(net: Net, place: int) -> Draft | None:
    """The one rule that takes a token from a place, if it asks for nothing else."""
    takes = [draft for draft in net.drafts if place in draft.effect.consume]
    if len(takes) != 1 or takes[0].kind is not Kind.INTERNAL:
        return None
    effect = takes[0].effect
    asks = effect.read or effect.inhibit or effect.quiet_scopes or effect.guard
    does_more = effect.moves or effect.copies or effect.kill_scopes or effect.flag is not None
    return None if effect.consume != (place,) or asks or does_more else takes[0]


def _joined(net: Net, effect: Effect, entries: dict[int, Draft], needed: set[int]) -> Effect:
    waiting = [place for place in effect.produce if place in entries]
    while waiting:
        place = waiting.pop()
        entry = entries[place].effect
        rest = list(effect.produce)
        rest.remove(place)
        if not entry.kill.isdisjoint(rest) or not entry.assign.keys().isdisjoint(effect.assign):
            needed.add(place)
            continue
        effect = Effect(
            effect.steps + entry.steps,
            effect.consume,
            effect.read,
            effect.inhibit,
            effect.quiet_scopes,
            effect.moves,
            effect.copies,
            effect.kill | entry.kill,
            effect.kill_scopes,
            (*rest, *entry.produce),
            effect.guard,
            {**effect.assign, **entry.assign},
            effect.flag,
            effect.flagged,
        )
        waiting += [each for each in entry.produce if each in entries]
    return effect
