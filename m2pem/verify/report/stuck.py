"""Deadlocks explained: what each token waits for, and what in the run made that impossible."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from m2pem.mission import elements as e
from m2pem.verify.net import choices
from m2pem.verify.net.encoding import Marking
from m2pem.verify.net.petri_net import Action, PetriNet, Transition
from m2pem.verify.report.run_steps import ElementNames, RunStep, Token


@dataclass(frozen=True, slots=True)
class WaitingTokens:
    """Tokens that wait at an element. `missing`: flows by which a token would have to come."""

    element: str
    text: str
    missing: tuple[str, ...] = ()


def why_stuck(
    element_names: ElementNames,
    run_steps: Sequence[RunStep],
    tokens: Sequence[Token],
    waiting: Mapping[str, str] | None = None,
) -> list[WaitingTokens]:
    """What the remaining tokens wait for, one sentence for each element.

    An activity that waits for its inside is left out when the inside is described. `waiting`: what
    tasks wait for that have no resources (`waits_for_resources`).
    """
    joins: dict[str, list[str]] = {}
    found: list[WaitingTokens] = []
    for token in tokens:
        if token.flow:
            flow = element_names.mission.elements.get(token.flow)
            if isinstance(flow, e.SequenceFlow):
                joins.setdefault(flow.target.id, []).append(flow.id)
    for join, arrived in joins.items():
        found.append(_at_join(element_names, run_steps, join, arrived))
    around = {owner for stuck in found for owner in _around(element_names, stuck.element)}
    around |= {owner for t in tokens if not t.flow for owner in _around(element_names, t.element)}
    for token in tokens:
        if not token.flow and token.element not in around:
            said = _waits(element_names, token.element)
            if waiting is not None and token.element in waiting:
                said = f"{element_names.with_id(token.element)} {waiting[token.element]}"
            found.append(WaitingTokens(token.element, said))
    return found


def waits_for_resources(
    net: PetriNet, element_names: ElementNames, marking: Marking
) -> dict[str, str]:
    """Say of each task that asks for resources, or for space, what it waits for, and what has
    that."""
    asked: dict[str, dict[str, None]] = {}
    full: dict[str, dict[str, None]] = {}
    asking: dict[str, None] = {}
    keepers: dict[str, dict[str, None]] = {}
    for transition in net.transitions:
        first = transition.steps[0] if transition.steps else None
        if first is None or first.action is not Action.ALLOCATED or not first.detail:
            continue
        places = choices.read(first.detail).values()
        wanted = (each for fillings in places for filling in fillings for each in filling.resources)
        asked.setdefault(first.element, {}).update(dict.fromkeys(wanted))
        own = (p for p, _ in transition.consume if net.places[p].element == first.element)
        if any(place in marking.tokens for place in own):
            asking[first.element] = None
            spaces = full.setdefault(first.element, {})
            spaces.update(dict.fromkeys(_only_lacks(net, transition, marking)))
            keepers.setdefault(first.element, {}).update(
                dict.fromkeys(_who_keeps(net, transition, marking))
            )
    holders = _holders(net, element_names, marking)
    found: dict[str, str] = {}
    for element in asking:
        if full[element]:
            said = [_who_is_in(net, element_names, marking, space) for space in full[element]]
            found[element] = f"waits for {' and '.join(said)}"
            continue
        held = {r: holders[r] for r in asked[element] if r in holders}
        said = [f"{r} is {by}" for r, by in held.items()]
        if keepers[element]:
            names = " and ".join(map(element_names.name, keepers[element]))
            said.append(f"what is free is kept by {names} until it has the rest")
        who = ", ".join(said)
        found[element] = (
            f"waits for {_any_of(list(asked[element]))}, {who or 'which it cannot get'}"
        )
    return found


def _holders(net: PetriNet, element_names: ElementNames, marking: Marking) -> dict[str, str]:
    """Say of each resource which task has it, or for which one it is kept until what ends."""
    found: dict[str, str] = {}
    for place in net.places:
        if place.index not in marking.tokens:
            continue
        if place.kept:
            keepers = _any_of([element_names.name(each) for each in place.keepers])
            said = f"kept by {keepers} until {element_names.name(place.until)} ends"
            found.update(dict.fromkeys(place.kept, said))
            continue
        pools = [
            resource
            for pool in place.returns
            for resource in net.places[pool].free or net.places[pool].kept
        ]
        said = f"held by {element_names.name(place.element)}"
        ends = [net.places[pool].until for pool in place.returns if net.places[pool].until]
        if ends:
            said += f" and kept until {element_names.name(ends[0])} ends"
        found.update(dict.fromkeys(place.resources or pools, said))
    return found


def _who_keeps(net: PetriNet, transition: Transition, marking: Marking) -> list[str]:
    """Return the tasks that wait and keep what a transition would take, if it is all free."""
    tokens = marking.tokens
    if any(tokens.get(place, 0) < count for place, count in transition.consume):
        return []
    return [
        keeper
        for place in transition.inhibit
        if place in tokens and not net.places[place].kept
        for keeper in net.places[place].keepers
    ]


def _only_lacks(net: PetriNet, transition: Transition, marking: Marking) -> list[str]:
    """Return the shared spaces that have no room for a transition which lacks nothing else."""
    tokens = marking.tokens
    if any(tokens.get(place, 0) < count for place, count in transition.consume):
        return []
    if any(place not in tokens for place in transition.read):
        return []
    if any(place in tokens for place in transition.inhibit):
        return []
    over = [place for place, most in transition.at_most if tokens.get(place, 0) > most]
    return [net.places[p].space for p in over] if all(net.places[p].space for p in over) else []


def _who_is_in(net: PetriNet, element_names: ElementNames, marking: Marking, space: str) -> str:
    """Say who is in a shared space: `bridge, where ugv1 (Cross) is`."""
    said: list[str] = []
    for place in net.places:
        if space in place.inside and place.index in marking.tokens:
            one = len(place.vehicles) == 1
            who = place.vehicles[0] if one else f"one of {', '.join(place.vehicles)}"
            moves = place.element != net.process
            doing = f" with {element_names.name(place.element)}" if moves else ""
            said.append(f"{who} is{doing}")
    return f"{space}, where {' and '.join(said)}" if said else space


def _any_of(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"


def _around(element_names: ElementNames, element: str) -> set[str]:
    """The subprocesses and call activities that an element is in, at any depth."""
    found: set[str] = set()
    waiting = [element]
    while waiting:
        node = element_names.mission.elements.get(waiting.pop())
        container = node.container if isinstance(node, e.FlowNode) else None
        if isinstance(container, e.SubProcess):
            owners = [container.id]
        elif container is not None:
            owners = [
                each.id
                for each in element_names.mission.nodes
                if isinstance(each, e.CallActivity) and each.called is container
            ]
        else:
            owners = []
        waiting += [owner for owner in owners if owner not in found]
        found.update(owners)
    return found


def _waits(element_names: ElementNames, element: str) -> str:
    node = element_names.mission.elements.get(element)
    name = element_names.with_id(element)
    if isinstance(node, e.Event | e.ReceiveTask | e.EventBasedGateway):
        return f"a token waits at {name} for what can no longer come"
    return f"a token stays on {name}"


def _at_join(
    element_names: ElementNames, run_steps: Sequence[RunStep], join: str, arrived: Sequence[str]
) -> WaitingTokens:
    node = element_names.mission.elements[join]
    assert isinstance(node, e.FlowNode)
    missing = tuple(flow.id for flow in node.incoming if flow.id not in arrived)
    name = element_names.with_id(join)
    if not missing:
        return WaitingTokens(join, f"tokens wait at {name}")
    sources = [flow.source.id for flow in node.incoming if flow.id in missing]
    plural = "s" if len(arrived) > 1 else ""
    came = element_names.all_of([_source(element_names, flow) for flow in arrived])
    text = (
        f"token{plural} from {came} wait{'' if plural else 's'} at {name} for "
        f"{element_names.all_of(sources)}, which can no longer come"
    )
    reasons = [reason for flow in missing if (reason := _reason(element_names, run_steps, flow))]
    if reasons:
        text += f", because {' and '.join(dict.fromkeys(reasons))}"
    return WaitingTokens(join, text, missing)


def _source(element_names: ElementNames, flow: str) -> str:
    known = element_names.mission.elements.get(flow)
    return known.source.id if isinstance(known, e.SequenceFlow) else flow


def _reason(element_names: ElementNames, run_steps: Sequence[RunStep], flow: str) -> str:
    """The nearest event upstream of a flow that explains why no token came by it."""
    start = element_names.mission.elements[flow]
    assert isinstance(start, e.SequenceFlow)
    seen: set[str] = set()
    waiting: list[tuple[e.FlowNode, str]] = [(start.source, flow)]
    while waiting:
        node, towards = waiting.pop(0)
        if node.id in seen:
            continue
        seen.add(node.id)
        last = _last(run_steps, node.id)
        if last is not None:
            return _cause(element_names, last, node, towards)
        if isinstance(node, e.BoundaryEvent):
            waiting.append((node.attached_to, node.id))
        waiting += [(each.source, each.id) for each in node.incoming]
    return f"nothing leads to {element_names.name(start.source.id)}"


def _last(run_steps: Sequence[RunStep], element: str) -> RunStep | None:
    """The last step in which an element was left."""
    leaves = (Action.COMPLETED, Action.INTERRUPTED)
    for run_step in reversed(run_steps):
        if any(step.element == element and step.action in leaves for step in run_step.actions):
            return run_step
    return None


def _cause(element_names: ElementNames, run_step: RunStep, node: e.FlowNode, towards: str) -> str:
    name = element_names.name(node.id)
    if towards in element_names.mission.elements and isinstance(
        element_names.mission.elements[towards], e.BoundaryEvent
    ):
        event = element_names.name(towards)
        return f"{name} was over (step {run_step.number}) before '{event}' was triggered"
    went = [element_names.name(flow.id) for flow in node.outgoing if flow.id in run_step.passes]
    if went and towards not in run_step.passes:
        return f"{name} went on by '{', '.join(went)}' (step {run_step.number})"
    return f"{name} was left only once (step {run_step.number})"
