"""Random nets that look like missions: blocks within blocks, most with something wrong in them.

Branches that are joined, or end each for itself; loops; scopes that are interrupted by a timer, by
an error that one of their branches throws, or by any failure; inclusive joins; conditions on data.
Then a few things are changed at random, so that tokens are doubled, lost or waited for in vain.
"""

from dataclasses import dataclass, field, replace
from random import Random

from m2pem.verify.net.petri_net import (
    Action,
    Kind,
    PetriNet,
    Place,
    Role,
    Scope,
    Step,
    Transition,
    Variable,
)

_ENDS = 3
_FIRST = ("row", "fork", "fork", "scope", "scope", "loop")
_ANY = ("task", "task", "task", "step", "row", "row", "fork", "fork", "choice", "loop", "scope")
_IN_BRANCHES = ("task", "task", "task", "task", "row", "row", "fork", "loop", "choice", "scope")
_BLOCKS = (_FIRST, _ANY)
"""By depth, what there is; the last goes for what is deeper, too."""
_BLOCKS_OF_BRANCHES = (("scope", "scope", "loop", "row"), ("fork", "fork", "row"), _IN_BRANCHES)


@dataclass
class _Draft:
    dice: Random
    budget: int
    failing: float
    blocks: tuple[tuple[str, ...], ...]
    places: list[Place] = field(default_factory=list)
    transitions: list[Transition] = field(default_factory=list)
    scopes: list[set[int]] = field(default_factory=list)
    variables: tuple[Variable, ...] = (
        Variable(0, "v0", (0, 1), (True, True), 0),
        Variable(1, "v1", (0, 1, 2), (True, True, True), 1),
    )

    def place(self, role: Role = Role.ACTIVE) -> int:
        number = len(self.places)
        self.places.append(Place(number, f"p{number}", f"e{number}", 0, role))
        if role is not Role.END:
            for scope in self.scopes:
                scope.add(number)
        return number

    def transition(self, kind: Kind, consume: list[int], produce: list[int], **more: object) -> int:
        number = len(self.transitions)
        action = self.dice.choice([Action.COMPLETED, Action.COMPLETED, Action.ENTERED])
        step = Step(self.dice.choice([f"e{consume[0]}", f"r{number}"]), action)
        made = Transition(
            number,
            f"r{number}",
            kind,
            (step,),
            consume=tuple((p, 1) for p in dict.fromkeys(consume)),
            produce=tuple((p, 1) for p in dict.fromkeys(produce)),
            **more,  # type: ignore[arg-type]
        )
        self.transitions.append(made)
        return number

    def block(self, source: int, target: int, depth: int) -> None:
        """Something that takes a token from one place to another."""
        self.budget -= 1
        kind = self.dice.choice(self.blocks[min(depth, len(self.blocks) - 1)])
        if depth > 4 or self.budget <= 0:
            kind = "task"
        getattr(self, f"_{kind}")(source, target, depth)

    def _task(self, source: int, target: int, depth: int) -> None:
        self.transition(Kind.EXTERNAL, [source], [target], assign=self._assignment(15))

    def _step(self, source: int, target: int, depth: int) -> None:
        self.transition(Kind.INTERNAL, [source], [target], assign=self._assignment(30))

    def _row(self, source: int, target: int, depth: int) -> None:
        between = self.place(self.dice.choice([Role.ACTIVE, Role.ENTERING, Role.TRIGGERED]))
        self.block(source, between, depth + 1)
        self.block(between, target, depth + 1)

    def _fork(self, source: int, target: int, depth: int) -> None:
        role = self.dice.choice([Role.ACTIVE, Role.ENTERING])
        starts = [self.place(role) for _ in range(self.dice.choice((2, 3, 3)))]
        ends = [self.place() for _ in starts]
        inside = set(starts)
        self.scopes.append(inside)
        self.transition(self.dice.choice([Kind.INTERNAL, Kind.EXTERNAL]), [source], starts)
        for start, end in zip(starts, ends, strict=True):
            self._branch(start, end, depth)
        self.scopes.remove(inside)
        if self.dice.random() < 0.8:
            self.transition(Kind.INTERNAL, ends, [target], assign=self._assignment(20))
            return
        for one in ends:  # an inclusive join: whoever came, if nobody else comes
            others = tuple(end for end in ends if end != one)
            waits = tuple(sorted(inside - set(ends)))
            self.transition(Kind.JOIN, [one], [target], inhibit=waits, reset=others)

    def _branch(self, source: int, target: int, depth: int) -> None:
        if self.dice.random() < self.failing:
            last = self.place()
            self.transition(Kind.EXTERNAL, [last], [target])
            target = last
        self.block(source, target, depth + 1)

    def _choice(self, source: int, target: int, depth: int) -> None:
        variable = self.dice.choice(self.variables)
        guarded = self.dice.random() < 0.5
        for value in range(2):
            start = self.place()
            guard = ((variable.index, frozenset({value})),) if guarded else ()
            kind = Kind.INTERNAL if guarded else self.dice.choice([Kind.INTERNAL, Kind.EXTERNAL])
            self.transition(kind, [source], [start], guard=guard)
            self.block(start, target, depth + 1)
        if guarded and len(variable.values) > 2:
            self.transition(Kind.INTERNAL, [source], [target], guard=((1, frozenset({2})),))

    def _loop(self, source: int, target: int, depth: int) -> None:
        after = self.place()
        self.block(source, after, depth + 1)
        kind = self.dice.choice([Kind.EXTERNAL, Kind.EXTERNAL, Kind.INTERNAL])
        self.transition(kind, [after], [source])
        self.transition(kind, [after], [target])

    def _scope(self, source: int, target: int, depth: int) -> None:
        running, handler = self.place(Role.CONTROL), self.place()
        inside: set[int] = set()
        self.scopes.append(inside)
        starts = [self.place() for _ in range(self.dice.choice((2, 2, 3)))]
        for start in starts:
            end = self.place(Role.CONTROL)
            self.block(start, end, depth + 1)
        ends = [p for p in inside if self.places[p].role is Role.CONTROL and p not in starts]
        self.scopes.remove(inside)
        everything = tuple(sorted(inside))
        waits = tuple(p for p in everything if p not in ends)
        self.transition(
            self.dice.choice([Kind.INTERNAL, Kind.EXTERNAL]), [source], [running, *starts]
        )
        self.transition(
            Kind.INTERNAL, [running], [target], inhibit=waits, reset=everything, quiet=True
        )
        for kind in (Kind.EXTERNAL, Kind.INTERNAL):
            if self.dice.random() < 0.6:
                thrown = [running] if kind is Kind.EXTERNAL else [running, self._thrown(waits)]
                reset = tuple(p for p in everything if p not in thrown)
                self.transition(kind, thrown, [handler], reset=reset)
        if self.dice.random() < self.failing:  # whatever is done may fail
            done = {p for r in self.transitions if r.kind is Kind.EXTERNAL for p, _ in r.consume}
            for place in waits:
                if place in done and self.dice.random() < 0.9:
                    self.transition(Kind.EXTERNAL, [running, place], [handler], reset=everything)
        self.block(handler, target, depth + 2)
        if self.dice.random() < 0.25:  # what does not interrupt
            beside = self.place()
            for scope in self.scopes:
                scope.add(beside)
            self.transition(Kind.EXTERNAL, [running], [running, beside])

    def _thrown(self, inside: tuple[int, ...]) -> int:
        """A place to which something in a scope comes if it goes wrong."""
        place = self.place()
        self.transition(Kind.EXTERNAL, [self.dice.choice(inside)], [place])
        return place

    def _assignment(self, percent: int) -> tuple[tuple[int, int], ...]:
        if self.dice.randrange(100) >= percent:
            return ()
        variable = self.dice.choice(self.variables)
        return ((variable.index, self.dice.randrange(len(variable.values))),)

    def spoil(self) -> None:
        """Change one transition into something else."""
        number = self.dice.randrange(len(self.transitions))
        transition = self.transitions[number]
        place = self.dice.randrange(_ENDS, len(self.places))
        made = dict(transition.produce)
        taken = {p for p, _ in transition.consume}
        match self.dice.randrange(9):
            case 0:
                made[place] = 1
            case 1:
                made.pop(self.dice.choice(sorted(made)), None) if made else None
            case 2 if place not in taken:
                transition = replace(transition, inhibit=tuple({*transition.inhibit, place}))
            case 3:
                transition = replace(transition, read=tuple({*transition.read, place}))
            case 4:
                transition = replace(
                    transition, kind=self.dice.choice([Kind.INTERNAL, Kind.EXTERNAL])
                )
            case 5:
                value = self.dice.randrange(2)
                transition = replace(
                    transition, guard=((self.dice.randrange(2), frozenset({value})),)
                )
            case 6:
                made = {**dict.fromkeys(made, 0), place: 1}
                made = {p: n for p, n in made.items() if n}
            case 7 if transition.reset:
                kept = {p for p in transition.reset if self.dice.random() < 0.2}
                transition = replace(
                    transition, reset=tuple(p for p in transition.reset if p not in kept)
                )
            case _:
                transition = replace(transition, assign=self._assignment(100))
        self.transitions[number] = replace(transition, produce=tuple(sorted(made.items())))


def random_mission_net(
    dice: Random, size: int = 12, *, spoilt: int = 2, failing: bool = False
) -> PetriNet:
    """`size`: of how many blocks, at most; `spoilt`: how many changes at most are made to it.

    `failing`: most scopes have parallel branches in which everything may fail.
    """
    share, blocks = (0.9, _BLOCKS_OF_BRANCHES) if failing else (0.3, _BLOCKS)
    draft = _Draft(dice, dice.randint(size // 2, size), share, blocks)
    for _ in range(_ENDS):
        draft.place(Role.END)
    start, last = draft.place(), draft.place()
    draft.block(start, last, 0)
    draft.transition(Kind.INTERNAL, [last], [0])
    for _ in range(dice.randint(0, spoilt)):
        draft.spoil()
    return PetriNet(
        "random.bpmn",
        "P",
        (Scope(0, "P", None, ()),),
        tuple(draft.places),
        draft.variables,
        tuple(draft.transitions),
        ((start, 1),),
        completed=0,
        terminated=1,
        failed=2,
        elements={
            step.element: step.element
            for transition in draft.transitions
            for step in transition.steps
        },
    )
