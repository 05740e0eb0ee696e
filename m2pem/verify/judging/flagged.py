"""Properties that one step violates: a resource wanted twice, an error that nothing catches."""

from collections.abc import Iterable, Iterator

from m2pem.model import elements as e
from m2pem.model.events import SignalEventDefinition
from m2pem.verify.judging.case import MOST_ALARMS, Case, compensates
from m2pem.verify.results import Violation
from m2pem.verify.system import Flag, Rule

_NO_FLOW = "NO_FLOW"


def conflicts(case: Case) -> Iterator[Violation]:
    """A task wants a vehicle or payload that another one has."""
    told: set[frozenset[str]] = set()
    for rule, run in _runs(case, Flag.CONFLICT):
        holders = [
            place.element
            for place in case.system.places
            if rule.flagged in place.resources and place.element != rule.element
        ]
        now = {token.element for token in case.story(run[:-1])[1]}
        who = [each for each in dict.fromkeys(holders) if each in now] or [rule.element]
        both = frozenset([rule.element, *who])
        if both in told:
            continue
        told.add(both)
        yield Violation(
            f"{case.words.name(rule.element)} wants {rule.flagged} while "
            f"{case.words.all_of(who)} still has it",
            tuple(dict.fromkeys([rule.element, *who])),
            run,
        )


def uncaught(case: Case) -> Iterator[Violation]:
    """An error that the model throws leaves the process."""
    for rule, run in _runs(case, Flag.UNCAUGHT):
        if not _undecided(case, rule):
            what = case.words.thrown(rule.flagged)
            at = case.words.name(rule.element)
            yield Violation(
                f"{at} throws {what}, nothing catches it, and the mission fails",
                (rule.element,),
                run,
            )


def unanswered(case: Case) -> Iterator[Violation]:
    """No flow of a gateway is there for what was decided."""
    for rule, run in _runs(case, Flag.UNCAUGHT):
        if _undecided(case, rule):
            story, _ = case.story(run)
            said = [told for told in story if told.trigger == "answer"]
            asked = f", after '{said[-1].detail}' was answered at " if said else ""
            where = case.words.name(said[-1].element) if said else ""
            yield Violation(
                f"no flow out of {case.words.name(rule.element)} is true{asked}{where}, and it has "
                "no default flow: the mission fails",
                (rule.element,),
                run,
            )


def failures(case: Case) -> Iterator[Violation]:
    """A behavior, service or prompt may fail, and nothing catches that."""
    for rule, run in _runs(case, Flag.UNCAUGHT_FAILURE):
        name = case.words.name(rule.element)
        yield Violation(
            f"when {name} fails, nothing catches it, and the mission fails",
            (rule.element,),
            run,
        )


def unheard(case: Case) -> Iterator[Violation]:
    """What is thrown reaches nobody."""
    for rule, run in _runs(case, Flag.UNHEARD):
        thrown = case.words.thrown(rule.flagged)
        yield Violation(
            f"{case.words.name(rule.element)} throws {thrown}, which nobody can catch",
            (rule.element,),
            run,
        )
    yield from _signals_to_nobody(case)


def untriggered(case: Case) -> Iterator[Violation]:
    """What waits for something that never comes."""
    for node in case.mission.nodes:
        waits = isinstance(node, e.BoundaryEvent | e.IntermediateCatchEvent) and node.definitions
        if not waits or compensates(node) or node.id not in case.unreached:
            continue
        host = node.attached_to.id if isinstance(node, e.BoundaryEvent) else ""
        if host and host in case.unreached:
            continue
        if host or all(flow.id not in case.unreached for flow in node.incoming):
            yield Violation(
                f"{case.words.with_id(node.id)} waits for what can never come", (node.id,)
            )


def _signals_to_nobody(case: Case) -> Iterator[Violation]:
    """Signals that tokens throw and no element of the file catches."""
    events = [node for node in case.mission.nodes if isinstance(node, e.Event)]
    throwing = [node for node in events if isinstance(node, e.EndEvent | e.IntermediateThrowEvent)]
    caught = {ref for node in events if node not in throwing for ref in _signals(node)}
    for node in throwing:
        for ref in _signals(node):
            if ref not in caught and node.id in case.reached:
                thrown = case.words.thrown(ref)
                name = case.words.with_id(node.id)
                yield Violation(
                    f"{name} throws {thrown}, which nobody can catch",
                    (node.id,),
                    case.run_through(node.id),
                )


def _signals(node: e.Event) -> list[str]:
    return [d.signal.id for d in node.definitions if isinstance(d, SignalEventDefinition)]


def _runs(case: Case, flag: Flag) -> Iterator[tuple[Rule, tuple[int, ...]]]:
    """By element, the first of its rules with a flag that fired, with a run that ends with it."""
    seen: set[tuple[str, str]] = set()
    fired: Iterable[tuple[int, int]] = case.found.of_flag(flag).items()
    for number, state in sorted(fired, key=lambda item: item[1]):
        rule = case.system.rules[number]
        key = (rule.element, "" if flag is Flag.UNCAUGHT_FAILURE else rule.flagged)
        if key not in seen and len(seen) < MOST_ALARMS:
            seen.add(key)
            yield rule, (*case.found.run_to(state), number)


def _undecided(case: Case, rule: Rule) -> bool:
    return rule.flagged == _NO_FLOW and isinstance(
        case.mission.elements.get(rule.element), e.Gateway
    )
