"""Soundness: does the mission always complete, properly, and without dead elements?"""

from collections.abc import Sequence
from dataclasses import replace

from m2pem.mission import elements as e
from m2pem.mission.events import ErrorEventDefinition
from m2pem.mission.loops import MultiInstance
from m2pem.mission.mission import Mission
from m2pem.mission.reachability import reach
from m2pem.verify.net.petri_net import (
    UNASKED,
    Action,
    Exactness,
    Flag,
    Kind,
    PetriNet,
    Role,
    Trigger,
)
from m2pem.verify.properties.results import BEYOND, Result, SearchedMission, Verdict, Violation
from m2pem.verify.search.fairness import FairCycles

_UNREAD = "an expression may fail whose data are not followed"


def proper_completion(searched: SearchedMission) -> Result:
    """No token is left behind, and no end event is reached twice in one instance of its scope."""
    violations: list[Violation] = []
    found = searched.found
    for place in found.overflows:
        each = searched.net.places[place]
        if each.once and not each.several:
            violations.append(
                Violation(
                    f"{searched.label(each.element)} is reached twice in one instance of its scope",
                    (each.element,),
                    found.overflow_runs[place],
                )
            )
    return searched.result(
        "proper-completion",
        "No end event is reached twice in one instance of its scope.",
        violations,
    )


def one_token_each(searched: SearchedMission) -> Result:
    """No element has two tokens at a time where the mission means one."""
    violations: list[Violation] = []
    found = searched.found
    for place in found.overflows:
        each = searched.net.places[place]
        where = searched.node_of(each.element)
        if each.once or each.several or any(where in known.elements for known in violations):
            continue
        more = " and more and more" if place in found.beyond else ""
        violations.append(
            Violation(
                f"{searched.label(where)} gets a second token{more}"
                " before the first has left: tokens that were parted are not joined",
                (where,),
                found.overflow_runs[place],
            )
        )
    return searched.result(
        "one-token", "Tokens that were parted do not meet again unjoined.", violations
    )


CAN_COMPLETE = "From everywhere, the end can be reached."
FAIR = "It ends, if nothing that can happen again and again is put off for ever."
IN_EACH_STATE = (
    "for runs in which that is so of each state that comes again and again: orders that lead to"
    " the same were left out of the search"
)
"""The sense in which completion is proved, where the search used a reduction."""


def no_deadlock(searched: SearchedMission) -> Result:
    """Something can always happen, until the run is over."""
    text = "No token is stuck for ever."
    return searched.result("no-deadlock", text, _stuck(searched), begins=True)


def _stuck(searched: SearchedMission) -> list[Violation]:
    """The nearest state of each set of elements at which a run can be stuck."""
    found = searched.found
    first: dict[tuple[str, ...], int] = {}
    for state in found.terminals:
        if not searched.ended(state):
            first.setdefault(searched.where(state), state)
    return [
        Violation(
            f"stuck at {searched.labels(stuck) or 'the process'}: nothing can happen any more",
            stuck,
            tuple(found.run_to(state)),
        )
        for stuck, state in first.items()
    ]


def _reaching(searched: SearchedMission, goals: list[int], *, asked: bool) -> bytearray:
    """The states from which some of the goals can be reached, if no work fails uncaught.

    A failure of a vehicle that ends the run is no way out; nor is, if only what is `asked` for
    counts, the success of a behavior that goes on until it is interrupted.
    """
    found = searched.found
    assert found.edge_start is not None
    assert found.edge_transition is not None
    assert found.edge_state is not None
    count = len(found.states)
    before: list[list[int]] = [[] for _ in range(count)]
    for state in range(count):
        for at in range(found.edge_start[state], found.edge_start[state + 1]):
            each = found.edge_transition[at]
            if not _fails(searched, each) and not (asked and _unasked(searched, each)):
                before[found.edge_state[at]].append(state)
    marked = bytearray(count)
    waiting = list(goals)
    for state in waiting:
        marked[state] = 1
    while waiting:
        for each in before[waiting.pop()]:
            if not marked[each]:
                marked[each] = 1
                waiting.append(each)
    return marked


def _fails(searched: SearchedMission, transition: int) -> bool:
    return searched.net.transitions[transition].flag is Flag.UNCAUGHT_FAILURE


def _unasked(searched: SearchedMission, transition: int) -> bool:
    each = searched.net.transitions[transition]
    return each.trigger is Trigger.SUCCEEDS and each.detail == UNASKED


def _begins(searched: SearchedMission, transition: int) -> bool:
    """Whether a trigger from outside begins a process: that does not happen for ever."""
    each, places = searched.net.transitions[transition], searched.net.places
    if each.trigger not in (Trigger.MESSAGE, Trigger.SIGNAL):
        return False
    waiting = [p for p in each.read if places[p].role is not Role.CONTROL]
    return not (each.consume or waiting or each.moves or each.copies)


def _lost(searched: SearchedMission, *, ends_only: bool) -> list[int]:
    """States from which no end (or nothing that ends at all) can be reached, in their order.

    Of an incomplete search: those of which that is certain.
    """
    found = searched.found
    goals = [s for s in found.terminals if not ends_only or searched.ended(s)]
    if not found.complete:
        goals += [*range(found.expanded, len(found.states)), *found.cut]
    marked = _reaching(searched, goals, asked=ends_only)
    return [state for state in range(len(found.states)) if not marked[state]]


def _shown(searched: SearchedMission, lost: Sequence[int]) -> int:
    """Return the first of some states in which a task waits for resources; else the first one."""
    net, found = searched.net, searched.found
    asking = {
        place
        for each in net.transitions
        if any(step.action is Action.ALLOCATED for step in each.steps)
        for place, _ in each.consume
        if net.places[place].element == each.element and net.places[place].role is Role.CONTROL
    }
    for state in lost if asking else ():
        if asking & found.marking(state).tokens.keys() and all(
            net.transitions[each].kind is Kind.EXTERNAL for each, _ in found.successors(state)
        ):
            return state
    return lost[0]


def can_complete(searched: SearchedMission) -> Result:
    """From every state, the end can be reached."""
    violations: list[Violation] = []
    lost = _lost(searched, ends_only=True)
    if lost:
        state = _shown(searched, lost)
        stuck = searched.where(state)
        violations.append(_no_end(searched, stuck, tuple(searched.found.run_to(state))))
    violations = _of_ends(searched, violations)
    return searched.result("can-complete", CAN_COMPLETE, violations, begins=True)


def _of_all_runs(searched: SearchedMission, violations: list[Violation]) -> list[Violation]:
    """Say of violations that no run ends after them whether that is certain: not beyond a bound,
    and not if the engine goes on where the net is stuck."""
    stuck = no_deadlock(searched) if violations else None
    doubt = BEYOND if searched.is_bounded else ""
    if stuck is not None and stuck.verdict is Verdict.MAY_BE_VIOLATED:
        doubt = doubt or stuck.covered
    return [replace(each, doubt=doubt) for each in violations]


def _of_ends(searched: SearchedMission, violations: list[Violation]) -> list[Violation]:
    """The same, of what a run violates as well that gets stuck: certain, if the engine does."""
    stuck = no_deadlock(searched) if violations else None
    if stuck is None or stuck.verdict is not Verdict.VIOLATED:
        return _of_all_runs(searched, violations)
    if searched.result("", "", violations[:1], begins=True).verdict is Verdict.VIOLATED:
        return violations
    return [_no_end(searched, each.elements, each.run) for each in stuck.violations[:1]]


def _no_end(searched: SearchedMission, where: tuple[str, ...], run: tuple[int, ...]) -> Violation:
    last = searched.net.transitions[run[-1]].element if run else ""
    message = f"from {searched.labels(where)} on, the end cannot be reached any more"
    if last:
        message += f" (since {searched.label(last)})"
    return Violation(message, where, run)


def following_from_deadlock(searched: SearchedMission, stuck: Violation) -> tuple[Result, Result]:
    """Return what a deadlock violates as well: `can-complete` and `completes-if-fair`."""
    return (
        searched.result(
            "can-complete",
            CAN_COMPLETE,
            [_no_end(searched, stuck.elements, stuck.run)],
            begins=True,
        ),
        searched.result("completes-if-fair", FAIR, [stuck], begins=True),
    )


def completes_if_fair(searched: SearchedMission) -> Result:
    """The mission completes if all that is possible again and again happens again and again.

    With a reduction it is known only whether the end can be reached from everywhere, and whether
    there are cycles at all. If so, the mission completes in a stronger sense of fairness, and the
    result says so.
    """
    found = searched.found
    rounds = FairCycles(
        found, lambda transition: _fails(searched, transition) or _begins(searched, transition)
    )
    violations: list[Violation] = []
    note = ""
    if not found.reduced:
        violations = _stuck(searched)[:1] or _fair_cycle(searched, rounds)
    if not violations and (lost := _lost(searched, ends_only=True)):
        violations = [_never_ends(searched, _shown(searched, lost))]
    elif not violations and found.reduced and found.complete and rounds.any:
        note = IN_EACH_STATE
    violations = _of_ends(searched, violations)
    return searched.result("completes-if-fair", FAIR, violations, note=note, begins=True)


def _fair_cycle(searched: SearchedMission, rounds: FairCycles) -> list[Violation]:
    lasso = rounds.nearest()
    if lasso is None:
        return []
    elements = _elements(searched, lasso.cycle)
    return [
        Violation(
            f"goes round {searched.labels(elements)} for ever, though nothing that can happen again"
            " and again is put off",
            elements,
            lasso.prefix,
            lasso.cycle,
        )
    ]


def _never_ends(searched: SearchedMission, lost: int) -> Violation:
    """From a state on, no end can be reached."""
    found = searched.found
    stuck = next((s for s in found.terminals if not searched.ended(s)), None)
    if stuck is not None:
        return _stuck(searched)[0]
    into, cycle = _into_cycle(searched, lost, asked=True)
    where = _elements(searched, cycle) or searched.where(lost)
    how = "and can reach no end any more" if cycle else "or fails"
    return Violation(
        f"goes round {searched.labels(where)} for ever, {how}",
        where,
        (*found.run_to(lost), *into),
        cycle,
    )


def _elements(searched: SearchedMission, transitions: Sequence[int]) -> tuple[str, ...]:
    return tuple(
        dict.fromkeys(searched.net.transitions[transition].element for transition in transitions)
    )


def no_livelock(searched: SearchedMission) -> Result:
    """The mission never goes on for ever without a way out."""
    found = searched.found
    violations: list[Violation] = []
    over: set[int] = set()
    """States from which something fails, and nothing goes round."""
    for lost in _lost(searched, ends_only=False):
        into, cycle = _into_cycle(searched, lost, over=over)
        if not cycle:
            continue
        elements = _elements(searched, cycle)
        violations.append(
            Violation(
                f"goes round {searched.labels(elements)} for ever, with no way out",
                elements,
                (*found.run_to(lost), *into),
                cycle,
            )
        )
        break
    violations = _of_all_runs(searched, violations)
    return searched.result("no-livelock", "Nothing goes on for ever without a way out.", violations)


def _into_cycle(
    searched: SearchedMission, start: int, *, asked: bool = False, over: set[int] | None = None
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Transitions that lead from a state to a cycle, and those of the cycle; without a cycle, those
    to where it ends. `asked`: as above. `over`: states that lead to no cycle; more are added.
    """
    seen: dict[int, int] = {}
    transitions: list[int] = []
    state = start
    while state not in seen:
        seen[state] = len(transitions)
        steps = (
            each
            for each in searched.found.successors(state)
            if not _fails(searched, each[0]) and not (asked and _unasked(searched, each[0]))
        )
        transition, state = next(steps, (-1, -1))
        if over is not None and (transition < 0 or state in over):
            over.update(seen)
            return tuple(transitions), ()
        if transition < 0:
            return tuple(transitions), ()
        transitions.append(transition)
    return tuple(transitions[: seen[state]]), tuple(transitions[seen[state] :])


def no_dead_element(searched: SearchedMission) -> Result:
    """Every element is reached in some run."""
    net, found = searched.net, searched.found
    reached = {
        step.element for transition in found.fired for step in net.transitions[transition].steps
    }
    wanted = to_be_reached(searched.mission, net)
    everything = bool(wanted) and wanted.keys() <= reached
    # What no transition reaches is dead, whatever was searched.
    possible = {step.element for each in net.transitions for step in each.steps}
    doubt = BEYOND if searched.is_bounded else ""
    unread = _after_unread_expressions(searched.mission, net)
    violations = [
        Violation(
            f"{searched.label(element)} is never reached",
            (element,),
            doubt=_UNREAD if element in unread else doubt if element in possible else "",
        )
        for element in wanted
        if element not in (reached if found.complete else possible)
    ]
    text = "Every element is reached in some run."
    return searched.result("no-dead-element", text, violations, static=everything)


def _after_unread_expressions(mission: Mission, net: PetriNet) -> set[str]:
    """Return the elements to which an error EXPRESSION leads, if not all data are followed: the net
    has such errors only where all that the expression reads is, and none of collections."""
    followed = all(each.exactness is not Exactness.MORE for each in net.approximations)
    if followed and not any(isinstance(a.loop, MultiInstance) for a in mission.activities()):
        return set()
    caught = [
        event
        for event in mission.nodes
        for definition in getattr(event, "definitions", ())
        if isinstance(event, e.BoundaryEvent | e.StartEvent)
        and isinstance(definition, ErrorEventDefinition)
        and (definition.error is None or definition.error.code == "EXPRESSION")
    ]
    return {each.id for each in reach(caught)}


def to_be_reached(mission: Mission, net: PetriNet) -> dict[str, None]:
    """Return the elements that a run must reach, in the order of the net."""
    unknown = {a.element for a in net.approximations if a.exactness is Exactness.BOUNDED}
    return dict.fromkeys(
        element
        for element in net.elements
        if element not in unknown and not e.undoes(mission.elements.get(element))
    )
