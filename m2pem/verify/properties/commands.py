"""Properties of commands: are vehicles and payloads commanded as they should be?

`watch_interruptions` extends the net by a place for each vehicle, or for each pool of vehicles. It
gets a token when a behavior that holds the vehicle is ended by something else than its own report,
and loses it when another behavior begins on that vehicle.
"""

from collections.abc import Collection
from dataclasses import replace

from m2pem.verify.net.petri_net import Flag, PetriNet, Place, Role, Transition, Trigger
from m2pem.verify.properties.results import Result, SearchedMission, Violation

INTERRUPTED = "interrupted-commanded-again"
"""The property that is read from the net of `watch_interruptions`."""


def _flagged(searched: SearchedMission, flag: Flag, message: str) -> list[Violation]:
    """The shortest run to each element and subject that has a flag."""
    found, transitions = searched.found, searched.net.transitions
    first: dict[tuple[str, str], tuple[int, int]] = {}
    for transition, state in sorted(found.of_flag(flag).items(), key=lambda each: each[1]):
        key = (_thrower(transitions[transition].steps), transitions[transition].flagged)
        first.setdefault(key, (transition, state))
    return [
        Violation(
            message.format(element=searched.label(element), what=what),
            _held_by(searched, transition, element),
            (*found.run_to(state), transition),
        )
        for (element, what), (transition, state) in first.items()
    ]


def _thrower(steps: "tuple[object, ...]") -> str:
    for step in steps:
        if getattr(step, "action", None) == "thrown":
            return str(getattr(step, "element", ""))
    return str(getattr(steps[0], "element", "")) if steps else ""


def _held_by(searched: SearchedMission, transition: int, element: str) -> tuple[str, ...]:
    """The element, and those that hold what it needs."""
    places = searched.net.places
    others = [
        places[p].element for p in searched.net.transitions[transition].read if places[p].resources
    ]
    return tuple(dict.fromkeys((element, *others)))


def one_behavior_each(searched: SearchedMission) -> Result:
    """No vehicle or payload is commanded by two behaviors at once."""
    violations = [
        Violation(
            f"{each.message} while {searched.labels(each.elements[1:]) or 'it'} commands it",
            each.elements,
            each.run,
        )
        for each in _flagged(searched, Flag.CONFLICT, "{element} wants {what}")
    ]
    return searched.result(
        "one-behavior",
        "No vehicle or payload is commanded by two behaviors at once.",
        violations,
        static=searched.never(Flag.CONFLICT),
    )


def errors_caught(searched: SearchedMission) -> Result:
    """No error that the model throws ends the run uncaught."""
    violations = _flagged(
        searched, Flag.UNCAUGHT, "error {what} of {element} is caught by nothing: the run fails"
    )
    return searched.result(
        "errors-caught",
        "Every error that the model throws is caught.",
        violations,
        static=searched.never(Flag.UNCAUGHT),
    )


def failures_handled(searched: SearchedMission) -> Result:
    """A behavior, service or prompt that may fail has an error boundary event around it."""
    violations = _flagged(
        searched,
        Flag.UNCAUGHT_FAILURE,
        "{element} may fail ({what}), and nothing around it catches that: the run fails",
    )
    return searched.result(
        "failures-handled",
        "Work that may fail has an error boundary event.",
        violations,
        warning=True,
        static=searched.never(Flag.UNCAUGHT_FAILURE),
    )


def interrupted_commanded_again(searched: SearchedMission) -> Result:
    """Every vehicle whose behavior was interrupted is commanded again, or stopped, by the model."""
    text = "Every interrupted vehicle is commanded again, or stopped, by the model."
    found = searched.watched
    if found is None:
        return searched.result(INTERRUPTED, text, [], static=True)
    first: dict[str, int] = {}
    for state in found.terminals:
        tokens = found.marking(state).tokens
        if found.net.failed in tokens:
            continue
        for place, resource in searched.resources.items():
            if place in tokens:
                first.setdefault(resource, state)
    violations: list[Violation] = []
    for resource, state in first.items():
        run = tuple(found.run_to(state))
        stopped = _interruption(searched, run, resource)
        violations.append(
            Violation(
                f"{resource} is interrupted by {searched.labels(stopped[:1])} and not commanded"
                " again: only its arbiter's cancel stops it",
                stopped,
                run,
            )
        )
    return searched.result(INTERRUPTED, text, violations, found=found)


def _interruption(
    searched: SearchedMission, run: tuple[int, ...], resource: str
) -> tuple[str, ...]:
    """The element that interrupted last, and the task that it interrupted."""
    watched = searched.watched
    assert watched is not None
    places = {p for p, r in searched.resources.items() if r == resource}
    for transition in reversed(run):
        each = watched.net.transitions[transition]
        marked = {t for _, t in each.copies} | {p for p, _ in each.produce}
        if marked & places:
            held = [
                watched.net.places[p].element
                for p, t in each.copies
                if t in places
                and (watched.net.places[p].resources or watched.net.places[p].returns)
            ]
            held += [
                watched.net.places[p].element
                for p, _ in each.consume
                if resource in watched.net.places[p].resources
            ]
            return tuple(dict.fromkeys((each.element, *held)))
    return ()


def watch_interruptions(
    net: PetriNet, vehicles: Collection[str]
) -> tuple[PetriNet, dict[int, str]] | None:
    """Return the extended net, and by place the vehicle; None: no vehicle can be interrupted.

    A vehicle of a pool that is interrupted goes to the pool's own such place, from which tasks may
    take it as well; so does one that is kept between tasks. Payloads are not considered: a camera
    that no behavior commands does no harm.
    """
    pools = {
        p.index: pool
        for p in net.places
        if (pool := p.free or p.kept) and set(pool) <= set(vehicles)
    }
    held = {
        p.index: mine
        for p in net.places
        if not p.returns and (mine := tuple(each for each in p.resources if each in vehicles))
    }
    given = {p.index for p in net.places if set(p.returns) & pools.keys() and not p.kept}
    if not any(_interrupts(net, each, {*held, *given}) for each in net.transitions):
        return None
    resources = sorted({r for each in held.values() for r in each})
    first = len(net.places)
    number = {resource: first + n for n, resource in enumerate(resources)}
    places = [Place(number[r], f"{r}~interrupted", net.process, 0, Role.CONTROL) for r in resources]
    stopped = {pool: first + len(places) + n for n, pool in enumerate(pools)}
    places += [
        replace(net.places[pool], index=n, name=f"{net.places[pool].name}~interrupted", returns=())
        for pool, n in stopped.items()
    ]
    transitions = [
        each
        for transition in net.transitions
        for each in _taking(
            _stopping(net, _noting(net, transition, held, number), stopped), stopped
        )
    ]
    watched = replace(
        net,
        places=(*net.places, *places),
        transitions=tuple(replace(each, index=n) for n, each in enumerate(transitions)),
        single=None,
    )
    names = {n: _one_of(pools[pool]) for pool, n in stopped.items()}
    return watched, {**{n: resource for resource, n in number.items()}, **names}


def _one_of(pool: tuple[str, ...]) -> str:
    return pool[0] if len(pool) == 1 else f"one of {', '.join(pool)}"


def _interrupts(
    net: PetriNet, transition: Transition, held: Collection[int]
) -> list[tuple[int, bool]]:
    """Holding places that a transition takes the token off; and whether it always does."""
    if any(p in net.ends for p, _ in transition.produce):
        return []
    consumed = {p for p, _ in transition.consume}
    reports = transition.trigger in (Trigger.SUCCEEDS, Trigger.FAILS)
    lost = [
        (p, False)
        for p in transition.reset
        if p in held and not (reports and net.places[p].holder in consumed)
    ]
    if not reports:
        lost += [(p, True) for p in consumed if p in held]
    lost += [(s, False) for s, _ in transition.moves if s in held]
    return lost


def _stopping(net: PetriNet, transition: Transition, stopped: dict[int, int]) -> Transition:
    """Give back what a transition interrupts to the places of interrupted vehicles."""
    given_back = {p for p, pool in transition.copies if pool in stopped and p not in stopped}
    interrupted = {p for p, _ in _interrupts(net, transition, given_back)}
    kept = [(stopped[p], stopped[pool]) for p, pool in transition.copies if p in stopped]
    if not interrupted and not kept:
        return transition
    copies = [
        (p, stopped[pool] if p in interrupted and pool in stopped else pool)
        for p, pool in transition.copies
    ]
    reset = tuple(sorted({*transition.reset, *(place for place, _ in kept)}))
    return replace(transition, copies=(*copies, *kept), reset=reset)


def _taking(transition: Transition, stopped: dict[int, int]) -> list[Transition]:
    """Return the transitions in place of one that takes vehicles from pools, or tests them.

    The vehicles of a pool that are free are those that were interrupted and the others.
    """
    consume, at_most = dict(transition.consume), dict(transition.at_most)
    tested = {pool: most for pool, most in at_most.items() if pool in stopped}
    found = [(consume, at_most)]
    for pool, count in transition.consume:
        if pool in stopped:
            found = [
                (_shared(taken, pool, stopped[pool], part), limits)
                for taken, limits in found
                for part in range(count + 1)
            ]
    for pool, most in tested.items():
        found = [
            (taken, {**limits, pool: most - part, stopped[pool]: part})
            for taken, limits in found
            for part in range(most + 1)
        ]
    empty = [stopped[pool] for pool in transition.inhibit if pool in stopped]
    reads = [transition.read]
    for pool in transition.read:
        if pool in stopped:
            reads.append(tuple(stopped[p] if p == pool else p for p in transition.read))
    if len(found) == len(reads) == 1 and not empty:
        return [transition]
    return [
        replace(
            transition,
            consume=tuple(sorted(taken.items())),
            at_most=tuple(sorted(limits.items())),
            inhibit=(*transition.inhibit, *empty),
            read=read,
        )
        for taken, limits in found
        for read in reads
    ]


def _shared(consume: dict[int, int], place: int, other: int, part: int) -> dict[int, int]:
    """Take a part of what is consumed from another place."""
    return {p: n for p, n in {**consume, place: consume[place] - part, other: part}.items() if n}


def _noting(
    net: PetriNet, transition: Transition, held: dict[int, tuple[str, ...]], number: dict[str, int]
) -> Transition:
    lost = _interrupts(net, transition, held.keys())
    begun = {r for p, _ in transition.produce for r in held.get(p, ())}
    reset, produce = set(transition.reset), dict(transition.produce)
    copies = list(transition.copies)
    for place, sure in lost:
        for resource in held[place]:
            if resource in begun:
                continue
            note = number[resource]
            if sure:
                reset.add(note)
                produce[note] = 1
            else:
                copies.insert(0, (place, note))
    for resource in begun:
        reset.add(number[resource])
    if not lost and not begun:
        return transition
    moved = [pair for pair in transition.moves if pair[0] not in held]
    held_moves = [pair for pair in transition.moves if pair[0] in held]
    if held_moves:  # the note is made before the token moves
        return replace(
            transition,
            moves=(),
            copies=(*copies, *held_moves, *moved),
            reset=tuple(sorted(reset | {a for a, _ in (*held_moves, *moved)})),
            produce=tuple(sorted(produce.items())),
        )
    return replace(
        transition,
        copies=tuple(copies),
        reset=tuple(sorted(reset)),
        produce=tuple(sorted(produce.items())),
    )
