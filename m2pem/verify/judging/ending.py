"""Properties of how runs end: stuck, never, with something left, with an element never reached."""

from collections.abc import Iterator

from m2pem.model import elements as e
from m2pem.verify.judging.case import MOST_ALARMS, Case, compensates
from m2pem.verify.results import Violation
from m2pem.verify.system import Flag, Role, Rule

_FAILURES = (Flag.UNCAUGHT_FAILURE, Flag.CONFLICT)


def deadlocks(case: Case) -> Iterator[Violation]:
    """Nothing can happen any more, and the run is not over."""
    seen: set[frozenset[str]] = set()
    for number in case.stuck:
        run = tuple(case.found.run_to(number))
        stuck = case.why(run)
        where = frozenset(each.element for each in stuck)
        if where in seen or len(seen) == MOST_ALARMS:
            continue
        seen.add(where)
        text = "; ".join(each.text for each in stuck) or "nothing can happen any more"
        yield Violation(text, tuple(each.element for each in stuck), run)


def livelocks(case: Case) -> Iterator[Violation]:
    """Something can always happen, but never an end, as long as nothing fails."""
    ends = {*case.good, *case.stuck}
    ends |= {
        at for rule, at in case.found.fired.items() if case.system.rules[rule].flag is Flag.UNCAUGHT
    }
    hopeful = case.reaching(ends, _not_failing)
    trapped = [
        n for n in range(len(case.found.states)) if n not in hopeful and n not in case.failed
    ]
    for number in trapped:
        loop = _circle(case, number)
        if loop:
            elements = tuple(
                dict.fromkeys(
                    case.system.rules[each].element
                    for each in loop
                    if case.system.rules[each].steps
                )
            )
            tasks = [each for each in elements if isinstance(_node(case, each), e.Activity)]
            names = case.words.all_of(tasks or elements)
            yield Violation(
                f"{names} can go on for ever, and no end can be reached",
                elements,
                tuple(case.found.run_to(number)),
                loop,
            )
            return


def without_completion(case: Case) -> Iterator[Violation]:
    """From some state no good end can be reached any more."""
    hopeful = case.reaching(case.good)
    dead_ends = {*case.failed, *case.stuck}
    for number in range(len(case.found.states)):
        if number not in hopeful and number not in dead_ends:
            run = tuple(case.found.run_to(number))
            told, tokens = case.story(run)
            since = (
                f"after step {told[-1].number} ({told[-1].text})" if told else "from the beginning"
            )
            yield Violation(
                f"{since} no good end can be reached any more",
                tuple(dict.fromkeys([*(token.flow or token.element for token in tokens)])),
                run,
            )
            return


def twice(case: Case) -> Iterator[Violation]:
    """An end event is reached twice in one instance of its scope."""
    for place, run in case.found.overflow_runs.items():
        known = case.system.places[place]
        if known.role is Role.CONTROL:
            yield Violation(
                f"{case.words.name(known.element)} is reached twice in one run",
                (known.element,),
                run,
            )


def overfull(case: Case) -> Iterator[Violation]:
    """A second token comes where one is meant."""
    for place, run in case.found.overflow_runs.items():
        known = case.system.places[place]
        if known.role is not Role.CONTROL:
            more = " and more and more of them" if place in case.found.beyond else ""
            yield Violation(
                f"a second token{more} can come to {case.words.name(known.element)}: "
                "branches that run side by side are not joined before it",
                (known.element,),
                run,
            )


def dead(case: Case) -> Iterator[Violation]:
    """Elements that no run gets to; told where they begin."""
    for flow in case.mission.flows:
        if flow.id not in case.unreached or flow.source.id in case.unreached:
            continue
        behind = _behind(case, flow)
        condition = f" ({flow.condition})" if flow.condition is not None else ""
        name = case.words.name(flow.id)
        beyond = case.words.all_of([each for each in behind if _named(case, each)])
        what = f"{beyond} can never be reached: " if beyond else ""
        source = case.words.name(flow.source.id)
        yield Violation(
            f"{what}flow '{name}' out of {source} is never taken{condition}",
            (*behind, flow.id),
        )
    for node in case.mission.nodes:
        if (
            isinstance(node, e.BoundaryEvent)
            and not compensates(node)
            and node.id in case.unreached
            and node.attached_to.id in case.reached
        ):
            behind = [each for flow in node.outgoing for each in _behind(case, flow)]
            tasks = case.words.all_of([each for each in behind if _named(case, each)])
            also = f", and {tasks} can never be reached" if tasks else ""
            name = case.words.with_id(node.id)
            yield Violation(f"{name} is never triggered{also}", (node.id, *behind))


def _behind(case: Case, flow: e.SequenceFlow) -> list[str]:
    """Nodes that are unreached because of a flow that is."""
    found: list[str] = []
    waiting = [flow.target]
    while waiting:
        node = waiting.pop(0)
        if node.id in case.unreached and node.id not in found:
            found.append(node.id)
            waiting += [each.target for each in node.outgoing]
    return found


def _named(case: Case, element: str) -> bool:
    return isinstance(_node(case, element), e.Activity)


def _node(case: Case, element: str) -> object:
    return case.mission.elements.get(element)


def _not_failing(rule: Rule) -> bool:
    return rule.flag not in _FAILURES


def _circle(case: Case, start: int) -> tuple[int, ...]:
    """Rules that lead from a state back to itself; none if that cannot be."""
    came: dict[int, tuple[int, int]] = {}
    waiting = [start]
    while waiting:
        number = waiting.pop(0)
        for rule, after in case.found.successors(number):
            if not _not_failing(case.system.rules[rule]):
                continue
            if after == start:
                rules = [rule]
                while number != start:
                    number, before = came[number]
                    rules.append(before)
                return tuple(reversed(rules))
            if after not in came:
                came[after] = (number, rule)
                waiting.append(after)
    return ()
