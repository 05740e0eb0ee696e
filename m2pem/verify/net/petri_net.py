"""A mission as a Petri net with inhibitor arcs, reset arcs and a few variables.

A marking says how many tokens each place has, and which value each variable has. A transition is
enabled when each place of `consume` has that many tokens, each of `read` has one, none of `inhibit`
has any, each of `at_most` has no more than that many, and each variable of `guard` has one of the
values named. Firing, in this order:

1. the tokens of `consume` are removed;
2. for each pair of `moves`, all tokens on the first place go to the second, and for each pair of
   `copies`, each token on the first place puts one on the second; an empty first place is no
   obstacle, and a second place that is full stays as it is;
3. the places of `reset` lose all their tokens;
4. the tokens of `produce` are added;
5. the variables of `assign` get their values.

Priorities: `Kind.INTERNAL` transitions fire whenever they are enabled; `Kind.JOIN` ones when no
internal one is; `Kind.EXTERNAL` ones when neither is. Transitions of one kind fire in any order.

An *outcome* is what is decided when a transition fires: by something outside, or by a choice that
the mission leaves open. Fairness is about outcomes: one that is possible again and again happens
again and again. Transitions of one outcome are the same answer, report or timer in different
states: never are two of them enabled. A join only waits, and decides nothing. A choice of
resources, which waits as joins do, decides.

Both the built-in search and the PROMELA that is written for Spin are made from this alone.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

from m2pem.mission.values import Value


class Kind(StrEnum):
    """The priority of a transition."""

    INTERNAL = "internal"
    """A step that the executive does by itself."""
    JOIN = "join"
    """An inclusive or complex join completes, or resources are chosen for a task. That waits until
    nothing else can move."""
    EXTERNAL = "outside"
    """An answer, report, timer, signal or message. It comes when the executive has nothing to do.
    """


class Role(StrEnum):
    """The meaning of a token on a place."""

    ENTERING = "entering"
    """The token has entered an element that is executed next."""
    FLOW = "flow"
    """The token has come to a join by that sequence flow, and waits there."""
    ACTIVE = "active"
    """The token is on an activity that works, or waits at an event or gateway."""
    TRIGGERED = "triggered"
    """The trigger that an element waited for has come."""
    CONTROL = "control"
    """No token of the mission, but something that the net must remember."""
    END = "end"
    """The run is over."""


class Trigger(StrEnum):
    """The input of an external transition, with which the engine can execute a run."""

    SUCCEEDS = "succeeds"
    """A behavior's or service's work ends well."""
    FAILS = "fails"
    """A behavior or service ends with the error of `detail`."""
    ANSWER = "answer"
    """An operator answers with the decision of `detail`."""
    TIMER = "timer"
    """The timer of the element is due."""
    SIGNAL = "signal"
    """The signal of id `detail` comes from outside."""
    MESSAGE = "message"
    """The message of id `detail` comes from outside."""
    CONDITION = "condition"
    """A condition that the net cannot follow becomes true."""


class Flag(StrEnum):
    """Why a transition that fires is a violation."""

    CONFLICT = "conflict"
    """A behavior wants a resource that another one holds (RESOURCE_UNAVAILABLE)."""
    UNCAUGHT = "uncaught"
    """An error that the model throws leaves the process uncaught."""
    UNCAUGHT_FAILURE = "uncaught failure"
    """A behavior, service or prompt fails, and nothing catches that."""
    UNHEARD = "unheard"
    """An escalation, signal or message is thrown that nothing can catch."""


@dataclass(frozen=True, slots=True)
class Scope:
    """A process, a subprocess, a called process, or the inside of an activity.

    `element`: the id of the process or activity. `path`: ids of the activities from outside to it;
    they distinguish a place from the same place in another call.
    """

    index: int
    element: str
    parent: int | None
    path: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Place:
    """A place.

    `name`: unique, for people. `element`: the id of the mission's element that it belongs to.
    `several`: more than one token at a time is meant, or harmless. `resources` are held, by
    behavior `behavior`, as long as there is a token.
    """

    index: int
    name: str
    element: str
    scope: int
    role: Role
    several: bool = False
    resources: tuple[str, ...] = ()
    behavior: str = ""
    once: bool = False
    """A token that does not fit is lost; that is a finding, unless `several` are meant."""
    free: tuple[str, ...] = ()
    """A pool of interchangeable resources: each token says that one of them is free. It never has
    more tokens than resources."""
    returns: tuple[int, ...] = ()
    """Where a resource goes when the place loses its token, a pool or a place of kept resources:
    each transition that resets the place copies its tokens there."""
    kept: tuple[str, ...] = ()
    """A pool of interchangeable resources: each token says that one of them is kept between tasks,
    and that none of these has it now."""
    keepers: tuple[str, ...] = ()
    """Of a place of kept resources: the tasks that keep them, until the end of the process or
    subprocess `until`. Of a place without `kept`: the task that keeps what is free while it waits
    for the rest."""
    until: str = ""
    holder: int | None = None
    """Of a place with `returns`: the active place of the task that holds the resources."""
    space: str = ""
    """A shared space: each token is a vehicle that is in it."""
    most: int = 0
    """The most tokens that it can have, if it is known and more than one."""
    vehicles: tuple[str, ...] = ()
    """Each token is one of these vehicles, which is in the shared spaces `inside`."""
    inside: tuple[str, ...] = ()

    @property
    def counts_moves(self) -> bool:
        """Whether a token that is moved or copied to it, and does not fit, is lost."""
        return self.several or self.role is Role.TRIGGERED


@dataclass(frozen=True, slots=True)
class Variable:
    """A name of the data store that conditions depend on, with the values that it can have.

    An `exact` value is that value; any other represents all values that compare alike.
    """

    index: int
    name: str
    values: tuple[Value, ...]
    exact: tuple[bool, ...]
    initial: int
    key: str = ""
    """The name in the data store; `name` also says in which called process."""


COMPENSATION_BEGINS, COMPENSATION_ENDS = "is undone", "has been undone"
"""Details of steps: the compensation of an activity begins, or is over."""


class Action(StrEnum):
    """The change of an element in a step."""

    ENTERED = "entered"
    COMPLETED = "completed"
    INTERRUPTED = "interrupted"
    TAKEN = "taken"
    """A sequence flow."""
    TRIGGERED = "triggered"
    THROWN = "thrown"
    """An event throws, or an activity's error propagates."""
    LEFT = "left"
    """A vehicle of an activity leaves the shared space of `detail`."""
    STANDS = "stands"
    """A vehicle of the process has stopped; `detail` says where it stands in a shared space."""
    PASSED_OVER = "passed over"
    """A task gets nothing: task `detail`, which comes before and waits, may keep what is free."""
    RELEASED = "released"
    """A process has nothing left to do, and keeps nothing more."""
    REFUSED = "refused"
    """An activity may not enter the shared space of `detail`, which is full."""
    ALLOCATED = "allocated"
    """A task gets the resources of `detail` (`m2pem.verify.net.choices`); "": it gets none, because
    too few are free."""
    NOT_FOLLOWED = "not followed"
    """A process would begin, beyond the instances that the net has."""


UNASKED = "unasked"
"""Detail of the success of a behavior that goes on until it is interrupted: nothing may count on
it."""

REASSIGNED = "LINK_LOST (reassigned)"
"""Detail of the failure of a behavior that is lost: its task asks for resources again."""

BEGINS = "begins"
"""Detail of the step in which an activity begins its work, after its boundary events are armed."""


@dataclass(frozen=True, slots=True)
class Step:
    """Something that a transition does, in the words of the mission. `element` is an id of it."""

    element: str
    action: Action
    detail: str = ""


Guard = tuple[tuple[int, frozenset[int]], ...]
"""By variable, the allowed values (as indexes into `Variable.values`)."""


@dataclass(frozen=True, slots=True)
class Transition:
    """A transition. Places and variables are named by their index; a place is in a tuple once.

    `steps`: what it does, in order; the first belongs to its own element. `trigger` and `detail`
    say what comes from outside. `flag`: firing it at all is a violation.
    """

    index: int
    name: str
    kind: Kind
    steps: tuple[Step, ...]
    consume: tuple[tuple[int, int], ...] = ()
    read: tuple[int, ...] = ()
    inhibit: tuple[int, ...] = ()
    guard: Guard = ()
    moves: tuple[tuple[int, int], ...] = ()
    copies: tuple[tuple[int, int], ...] = ()
    reset: tuple[int, ...] = ()
    produce: tuple[tuple[int, int], ...] = ()
    assign: tuple[tuple[int, int], ...] = ()
    trigger: Trigger | None = None
    detail: str = ""
    flag: Flag | None = None
    flagged: str = ""
    """What the flag is about: a resource, an error's code, a signal's id."""
    quiet: bool = False
    """Its scope must be empty: all of the scope's places are in `inhibit`."""
    due_us: int | None = None
    """Of a timer whose duration the mission states: microseconds after it is armed."""
    at_most: tuple[tuple[int, int], ...] = ()

    outcomes: tuple[int, ...] = ()
    """The outcomes that it stands for (see the module)."""

    @property
    def element(self) -> str:
        return self.steps[0].element


class Exactness(StrEnum):
    """The difference between the net of an element and the engine."""

    MORE = "more"
    """The net can do all that the engine can, and more: a proof holds, an alarm may be false."""
    BOUNDED = "bounded"
    """The net covers the engine up to a bound: what is proved holds up to that bound."""


@dataclass(frozen=True, slots=True)
class Approximation:
    """An element whose net is not exactly what the engine does, and the difference.

    `bound`: it makes a difference only if more tokens come to the place of that name than it has
    room for, or if an element of that id is not followed (`Action.NOT_FOLLOWED`); "": it may.
    """

    element: str
    exactness: Exactness
    what: str
    bound: str = ""


@dataclass(frozen=True, slots=True)
class PetriNet:
    """The net of a mission.

    `initial`: places with a token at first. `completed`, `terminated`, `failed`: the places that
    say how the run ended. `elements`: the label of every element that has transitions, by id.
    `single`: places that are known to have one token at most; None: not analyzed.
    """

    mission: str
    process: str
    scopes: tuple[Scope, ...]
    places: tuple[Place, ...]
    variables: tuple[Variable, ...]
    transitions: tuple[Transition, ...]
    initial: tuple[tuple[int, int], ...]
    completed: int
    terminated: int
    failed: int
    approximations: tuple[Approximation, ...] = ()
    elements: Mapping[str, str] = field(default_factory=dict)
    single: frozenset[int] | None = None

    @property
    def ends(self) -> frozenset[int]:
        """The places that say that the run is over."""
        return frozenset({self.completed, self.terminated, self.failed})


_Decided = tuple[object, ...]


def with_outcomes(transitions: Sequence[Transition]) -> list[Transition]:
    """Return the same transitions, where those that are alike have one outcome."""
    alike: dict[_Decided, list[tuple[Transition, int]]] = {}
    made: list[Transition] = []
    for transition in transitions:
        outcome = transition.index
        if transition.kind is Kind.EXTERNAL:
            others = alike.setdefault(_decided(transition), [])
            taken = {outcome for other, outcome in others if not _exclude(transition, other)}
            outcome = next((each for _, each in others if each not in taken), outcome)
            others.append((transition, outcome))
        same = outcome == transition.index
        made.append(transition if same else replace(transition, outcomes=(outcome,)))
    return made


def own_outcome(index: int, kind: Kind, steps: Sequence[Step]) -> tuple[int, ...]:
    """Return the outcome of a transition that is like no other: none of a join, which decides
    nothing."""
    if kind is Kind.JOIN and not any(step.action is Action.ALLOCATED for step in steps):
        return ()
    return (index,)


def _decided(transition: Transition) -> _Decided:
    return (
        transition.trigger,
        transition.detail,
        transition.element,
        transition.consume,
        transition.assign,
    )


def _exclude(one: Transition, other: Transition) -> bool:
    """Whether two transitions are never enabled together."""
    guard = dict(one.guard)
    if any(v in guard and not guard[v] & values for v, values in other.guard):
        return True
    return any(
        {*(p for p, _ in a.consume), *a.read} & set(b.inhibit)
        for a, b in ((one, other), (other, one))
    )


def outcomes_of(net: PetriNet) -> Mapping[int, tuple[int, ...]]:
    """The outcomes of each transition: several, where it was fused from several transitions."""
    if any(transition.outcomes for transition in net.transitions):
        return {transition.index: transition.outcomes for transition in net.transitions}
    return {r.index: own_outcome(r.index, r.kind, r.steps) for r in net.transitions}
