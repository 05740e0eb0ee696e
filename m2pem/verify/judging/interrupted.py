"""Every vehicle that is interrupted is commanded again: the model says what it does next."""

from collections.abc import Iterator
from dataclasses import replace

from m2pem.verify.judging.case import Case
from m2pem.verify.results import Violation
from m2pem.verify.system import Trigger

_PAYLOAD = "/"  # in the id of a resource: of a vehicle
_OWN_ENDS = (Trigger.SUCCEEDS, Trigger.FAILS)


def abandoned(case: Case) -> Iterator[Violation]:
    """A vehicle's task is interrupted, and a good end is reached without commanding it again.

    A payload that is not told anything stands still, and is no danger: it is left out.
    """
    resources = sorted({each for place in case.system.places for each in place.resources})
    found: dict[tuple[str, ...], list[tuple[str, Violation]]] = {}
    for resource in resources:
        if _PAYLOAD in resource:
            continue
        holding = {p.index for p in case.system.places if resource in p.resources}
        held = [bool(holding & case.places(n)) for n in range(len(case.found.states))]
        violation = _of(case, resource, held)
        if violation is not None:
            found.setdefault(violation.elements, []).append((resource, violation))
    for together in found.values():
        first = together[0][1]
        names = [resource for resource, _ in together]
        who = f"{', '.join(names[:-1])} and {names[-1]}" if len(names) > 1 else names[0]
        yield replace(first, message=f"{first.message} {who} what to do then")


def _of(case: Case, resource: str, held: list[bool]) -> Violation | None:
    came: dict[int, tuple[int, int]] = {}
    waiting: list[int] = []
    for number in range(len(case.found.states)):
        if held[number]:
            for rule, after in case.found.successors(number):
                own = case.system.rules[rule].trigger in _OWN_ENDS
                # What ends the whole run ends it for every vehicle, and needs no other command.
                if not held[after] and not own and after not in case.good and after not in came:
                    came[after] = (number, rule)
                    waiting.append(after)
    first = set(came)
    while waiting:
        number = waiting.pop(0)
        if number in case.good:
            return _violation(case, resource, number, came, first)
        for rule, after in case.found.successors(number):
            if not held[after] and after not in came:
                came[after] = (number, rule)
                waiting.append(after)
    return None


def _violation(
    case: Case, resource: str, end: int, came: dict[int, tuple[int, int]], first: set[int]
) -> Violation:
    rules: list[int] = []
    number = end
    while True:
        interrupted = number in first
        number, rule = came[number]
        rules.append(rule)
        if interrupted:
            break
    by = case.system.rules[rules[-1]].element
    before = case.places(number)
    tasks = [
        place.element
        for place in case.system.places
        if place.index in before and resource in place.resources
    ]
    run = (*case.found.run_to(number), *reversed(rules))
    return Violation(
        f"{case.words.name(by)} interrupts {case.words.all_of(tasks)}, and nothing tells",
        (*dict.fromkeys(tasks), by),
        run,
    )
