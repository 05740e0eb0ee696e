"""Properties of commands: are vehicles and payloads commanded as they should be?

`watch_interruptions` extends the net by a place for each vehicle. It gets a token when a behavior
that holds the vehicle is ended by something else than its own report, and loses it when another
behavior begins on that vehicle.
"""

from collections.abc import Collection
from dataclasses import replace

from m2pem.verify.net.petri_net import Flag, Place, Role, Rule, System, Trigger
from m2pem.verify.properties.results import Result, Searched, Violation

INTERRUPTED = "interrupted-commanded-again"
"""The property that is read from rules that also note which vehicles are interrupted."""


def _flagged(searched: Searched, flag: Flag, message: str) -> list[Violation]:
    """The shortest run to each element and matter that has a flag."""
    found, rules = searched.found, searched.system.rules
    first: dict[tuple[str, str], tuple[int, int]] = {}
    for rule, state in sorted(found.of_flag(flag).items(), key=lambda each: each[1]):
        key = (_thrower(rules[rule].steps), rules[rule].flagged)
        first.setdefault(key, (rule, state))
    return [
        Violation(
            message.format(element=searched.label(element), what=what),
            _held_by(searched, rule, element),
            (*found.run_to(state), rule),
        )
        for (element, what), (rule, state) in first.items()
    ]


def _thrower(steps: "tuple[object, ...]") -> str:
    for step in steps:
        if getattr(step, "action", None) == "thrown":
            return str(getattr(step, "element", ""))
    return str(getattr(steps[0], "element", "")) if steps else ""


def _held_by(searched: Searched, rule: int, element: str) -> tuple[str, ...]:
    """The element, and those that hold what it wants."""
    places = searched.system.places
    others = [places[p].element for p in searched.system.rules[rule].read if places[p].resources]
    return tuple(dict.fromkeys((element, *others)))


def one_behavior_each(searched: Searched) -> Result:
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
    )


def errors_caught(searched: Searched) -> Result:
    """No error that the model throws ends the run uncaught."""
    violations = _flagged(
        searched, Flag.UNCAUGHT, "error {what} of {element} is caught by nothing: the run fails"
    )
    return searched.result(
        "errors-caught", "Every error that the model throws is caught.", violations
    )


def failures_handled(searched: Searched) -> Result:
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
    )


def interrupted_commanded_again(searched: Searched) -> Result:
    """Every vehicle whose behavior was interrupted is commanded again, or stopped, by the model."""
    text = "Every interrupted vehicle is commanded again, or stopped, by the model."
    found = searched.watched
    if found is None:
        return searched.result(INTERRUPTED, text, [], static=True)
    first: dict[str, int] = {}
    for state in found.terminals:
        tokens = found.marking(state).tokens
        if found.system.failed in tokens:
            continue
        for place, resource in searched.resources.items():
            if place in tokens:
                first.setdefault(resource, state)
    violations: list[Violation] = []
    for resource, state in first.items():
        run = tuple(found.run_to(state))
        stopped = _interruption(searched, found, run, resource)
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
    searched: Searched, found: "object", run: tuple[int, ...], resource: str
) -> tuple[str, ...]:
    """The element that interrupted last, and the task that it interrupted."""
    watched = searched.watched
    assert watched is not None
    del found
    places = {p for p, r in searched.resources.items() if r == resource}
    for rule in reversed(run):
        each = watched.system.rules[rule]
        marked = {t for _, t in each.copies} | {p for p, _ in each.produce}
        if marked & places:
            held = [
                watched.system.places[p].element
                for p, t in each.copies
                if t in places and watched.system.places[p].resources
            ]
            held += [
                watched.system.places[p].element
                for p, _ in each.consume
                if resource in watched.system.places[p].resources
            ]
            return tuple(dict.fromkeys((each.element, *held)))
    return ()


def watch_interruptions(
    system: System, vehicles: Collection[str]
) -> tuple[System, dict[int, str]] | None:
    """The same system, and by place the vehicle; None: no vehicle can be interrupted.

    Payloads are not looked at: a camera that is left alone does no harm.
    """
    held = {
        p.index: mine
        for p in system.places
        if (mine := tuple(each for each in p.resources if each in vehicles))
    }
    if not any(_interrupts(system, rule, held) for rule in system.rules):
        return None
    resources = sorted({r for each in held.values() for r in each})
    first = len(system.places)
    number = {resource: first + n for n, resource in enumerate(resources)}
    places = [
        Place(number[r], f"{r}~interrupted", system.process, 0, Role.CONTROL) for r in resources
    ]
    rules = [_noting(system, rule, held, number) for rule in system.rules]
    watched = replace(system, places=(*system.places, *places), rules=tuple(rules), single=None)
    return watched, {n: resource for resource, n in number.items()}


def _interrupts(
    system: System, rule: Rule, held: dict[int, tuple[str, ...]]
) -> list[tuple[int, bool]]:
    """Holding places that a rule takes the token off; whether for sure."""
    if any(p in system.ends for p, _ in rule.produce):
        return []
    lost = [(p, False) for p in rule.kill if p in held]
    if rule.trigger not in (Trigger.SUCCEEDS, Trigger.FAILS):
        lost += [(p, True) for p, _ in rule.consume if p in held]
    lost += [(s, False) for s, _ in rule.moves if s in held]
    return lost


def _noting(
    system: System, rule: Rule, held: dict[int, tuple[str, ...]], number: dict[str, int]
) -> Rule:
    lost = _interrupts(system, rule, held)
    begun = {r for p, _ in rule.produce for r in held.get(p, ())}
    kill, produce = set(rule.kill), dict(rule.produce)
    copies = list(rule.copies)
    for place, sure in lost:
        for resource in held[place]:
            if resource in begun:
                continue
            note = number[resource]
            if sure:
                kill.add(note)
                produce[note] = 1
            else:
                copies.insert(0, (place, note))
    for resource in begun:
        kill.add(number[resource])
    if not lost and not begun:
        return rule
    moved = [pair for pair in rule.moves if pair[0] not in held]
    held_moves = [pair for pair in rule.moves if pair[0] in held]
    if held_moves:  # the note is made before the token moves
        return replace(
            rule,
            moves=(),
            copies=(*copies, *held_moves, *moved),
            kill=tuple(sorted(kill | {a for a, _ in (*held_moves, *moved)})),
            produce=tuple(sorted(produce.items())),
        )
    return replace(
        rule,
        copies=tuple(copies),
        kill=tuple(sorted(kill)),
        produce=tuple(sorted(produce.items())),
    )
