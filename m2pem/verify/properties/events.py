"""Properties of events and prompts: can triggers come, is everything thrown caught, are all answers
handled?
"""

from m2pem.mission import elements as e
from m2pem.mission.events import Signal
from m2pem.verify.net.petri_net import Action, Flag, Step, Transition, Trigger
from m2pem.verify.properties.results import Result, SearchedMission, Violation
from m2pem.verify.translate.mission import messages_from_black_box_pools


def can_be_triggered(searched: SearchedMission) -> Result:
    """Every catcher waits for a signal or message that something sends."""
    mission = searched.mission
    sent = {each.id for node in mission.nodes for each in e.thrown_by(node)}
    sent |= messages_from_black_box_pools(mission)
    sent |= {s.id for s in mission.signals.values() if s.from_operator or s.returned}
    sent |= {m.id for m in mission.messages.values() if m.from_operator}
    violations: list[Violation] = []
    for node in mission.nodes:
        for root in e.caught_by(node):
            if root.id not in sent:
                violations.append(
                    Violation(
                        f"{searched.label(node.id)} waits for {root.name or root.id}, which"
                        ' nothing in the mission sends; m2pem:from="operator" says that'
                        " operators do",
                        (node.id,),
                    )
                )
    return searched.result(
        "can-be-triggered",
        "Whatever waits for a signal or message can get it.",
        violations,
        static=True,
    )


def is_caught(searched: SearchedMission) -> Result:
    """Every signal or escalation that is thrown can be caught."""
    mission = searched.mission
    caught = {
        each.id for node in mission.nodes for each in e.caught_by(node) if isinstance(each, Signal)
    }
    violations: list[Violation] = []
    for node in mission.nodes:
        thrown = {each.id for each in e.thrown_by(node) if isinstance(each, Signal)}
        for signal in sorted(thrown - caught):
            violations.append(
                Violation(
                    f"{searched.label(node.id)} throws signal {signal}, which nothing catches",
                    (node.id,),
                )
            )
    found, transitions = searched.found, searched.net.transitions
    for transition, state in sorted(found.of_flag(Flag.UNHEARD).items(), key=lambda each: each[1]):
        element = transitions[transition].element
        violations.append(
            Violation(
                f"escalation {transitions[transition].flagged} of {searched.label(element)}"
                " is caught by nothing",
                (element,),
                (*found.run_to(state), transition),
            )
        )
    return searched.result(
        "is-caught",
        "Every signal and escalation that is thrown can be caught.",
        violations,
        warning=True,
        static=searched.never(Flag.UNHEARD),
    )


def prompts_have_decisions(searched: SearchedMission) -> Result:
    """Every prompt offers a decision."""
    violations = [
        Violation(f"{searched.label(node.id)} asks, and has no decision to answer with", (node.id,))
        for node in searched.mission.nodes
        if isinstance(node, e.UserTask) and node.prompt is not None and not node.prompt.decisions
    ]
    return searched.result(
        "prompts-have-decisions", "Every prompt can be answered.", violations, static=True
    )


def has_no_flow(transition: Transition) -> Step | None:
    """The step in which a gateway has no flow to take; None: there is none."""
    return next(
        (s for s in transition.steps if s.action is Action.THROWN and s.detail == "NO_FLOW"), None
    )


def decisions_handled(searched: SearchedMission) -> Result:
    """No decision of an operator leads to a gateway without a flow for it."""
    found, transitions = searched.found, searched.net.transitions
    violations: list[Violation] = []
    seen: set[tuple[str, str]] = set()
    for transition, state in sorted(found.fired.items(), key=lambda each: each[1]):
        thrown = has_no_flow(transitions[transition])
        if thrown is None:
            continue
        run = (*found.run_to(state), transition)
        asked = next(
            (transitions[r] for r in reversed(run) if transitions[r].trigger is Trigger.ANSWER),
            None,
        )
        if asked is None or (asked.element, thrown.element) in seen:
            continue
        seen.add((asked.element, thrown.element))
        violations.append(
            Violation(
                f"after {asked.detail!r} at {searched.label(asked.element)}, no flow of"
                f" {searched.label(thrown.element)} is true and it has no default",
                (thrown.element, asked.element),
                run,
            )
        )
    return searched.result(
        "decisions-handled",
        "Every decision of an operator is handled.",
        violations,
        static=bool(transitions) and not any(map(has_no_flow, transitions)),
    )


__all__ = ["Flag", "decisions_handled", "prompts_have_decisions"]
