"""Random nets that use all that transitions can do, sensible or not."""

from random import Random

from m2pem.verify.net.petri_net import (
    Action,
    Flag,
    Kind,
    PetriNet,
    Place,
    Role,
    Scope,
    Step,
    Transition,
    Variable,
)

_KINDS = (Kind.INTERNAL, Kind.INTERNAL, Kind.JOIN, Kind.EXTERNAL, Kind.EXTERNAL)
_OF_RESOURCES = (
    Action.ALLOCATED,
    Action.LEFT,
    Action.STANDS,
    Action.REFUSED,
    Action.PASSED_OVER,
    Action.RELEASED,
)
_ACTIONS = [each for each in Action if each not in _OF_RESOURCES]
_ENDS = 3


def random_net(dice: Random, places: int = 7, transitions: int = 9) -> PetriNet:
    made = [Place(n, f"end{n}", f"end{n}", 0, Role.END) for n in range(_ENDS)]
    made += [
        Place(n, f"p{n}", f"e{n}", 0, Role.ACTIVE, several=dice.random() < 0.15)
        for n in range(_ENDS, _ENDS + places)
    ]
    variables = tuple(
        Variable(n, f"v{n}", tuple(range(size)), (True,) * size, dice.randrange(size))
        for n, size in enumerate((2, 3))
    )
    tokens = range(_ENDS, _ENDS + places)
    return PetriNet(
        "random.bpmn",
        "P",
        (Scope(0, "P", None, ()),),
        tuple(made),
        variables,
        tuple(_transition(dice, n, tokens, variables) for n in range(transitions)),
        ((_ENDS, 1),),
        completed=0,
        terminated=1,
        failed=2,
        elements={each.element: each.element for each in made},
    )


def _transition(
    dice: Random, number: int, tokens: range, variables: tuple[Variable, ...]
) -> Transition:
    def some(most: int, chance: float = 1.0) -> list[int]:
        return dice.sample(tokens, dice.randint(0, most)) if dice.random() < chance else []

    consumed = dice.sample(tokens, dice.choice((1, 1, 1, 2)))
    guard = [
        (v.index, frozenset(dice.sample(range(len(v.values)), dice.randint(1, len(v.values)))))
        for v in variables
        if dice.random() < 0.2
    ]
    pairs = [tuple(dice.sample(tokens, 2)) for _ in range(2)]
    ends = dice.random() < 0.15
    made = [dice.randrange(_ENDS)] if ends else some(2)
    return Transition(
        number,
        f"r{number}",
        dice.choice(_KINDS),
        (Step(f"e{consumed[0]}", dice.choice(_ACTIONS)),),
        consume=tuple((p, 1) for p in consumed),
        read=tuple(some(1, 0.2)),
        inhibit=tuple(p for p in some(2, 0.2) if p not in consumed),
        guard=tuple(guard),
        moves=(pairs[0],) if dice.random() < 0.15 else (),  # type: ignore[arg-type]
        copies=(pairs[1],) if dice.random() < 0.15 else (),  # type: ignore[arg-type]
        reset=tuple(tokens) if ends else tuple(some(4, 0.2)),
        produce=tuple((p, dice.choice((1, 1, 1, 2)) if not ends else 1) for p in made),
        assign=tuple(
            (v.index, dice.randrange(len(v.values))) for v in variables if dice.random() < 0.3
        ),
        flag=Flag.CONFLICT if dice.random() < 0.1 else None,
        flagged="uav1",
    )
