"""Rules that also note which resources lost their behavior to an interruption.

A place for each resource gets a token when a behavior that holds it is ended by something else
than its own report, and loses it when another behavior begins on that resource.
"""

from collections.abc import Collection
from dataclasses import replace

from m2pem.verify.system import Place, Role, Rule, System, Trigger


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
