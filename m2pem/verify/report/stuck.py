"""Why tokens cannot go on: what each waits for, and what in the run made that impossible."""

from collections.abc import Sequence
from dataclasses import dataclass

from m2pem.mission import elements as e
from m2pem.verify.net.petri_net import Action
from m2pem.verify.report.run_steps import Token, Told, Words


@dataclass(frozen=True, slots=True)
class Stuck:
    """Tokens that wait at an element. `missing`: flows by which a token would have to come."""

    element: str
    text: str
    missing: tuple[str, ...] = ()


def why_stuck(words: Words, story: Sequence[Told], tokens: Sequence[Token]) -> list[Stuck]:
    """What the tokens that are left wait for, one sentence an element.

    An activity that waits for what is inside of it is left out when that is told.
    """
    joins: dict[str, list[str]] = {}
    found: list[Stuck] = []
    for token in tokens:
        if token.flow:
            flow = words.mission.elements.get(token.flow)
            if isinstance(flow, e.SequenceFlow):
                joins.setdefault(flow.target.id, []).append(flow.id)
    for join, arrived in joins.items():
        found.append(_at_join(words, story, join, arrived))
    around = {owner for stuck in found for owner in _around(words, stuck.element)}
    around |= {owner for t in tokens if not t.flow for owner in _around(words, t.element)}
    for token in tokens:
        if not token.flow and token.element not in around:
            found.append(Stuck(token.element, _waits(words, token.element)))
    return found


def _around(words: Words, element: str) -> set[str]:
    """The subprocesses and call activities that an element is in, at any depth."""
    found: set[str] = set()
    waiting = [element]
    while waiting:
        node = words.mission.elements.get(waiting.pop())
        container = node.container if isinstance(node, e.FlowNode) else None
        if isinstance(container, e.SubProcess):
            owners = [container.id]
        elif container is not None:
            owners = [
                each.id
                for each in words.mission.nodes
                if isinstance(each, e.CallActivity) and each.called is container
            ]
        else:
            owners = []
        waiting += [owner for owner in owners if owner not in found]
        found.update(owners)
    return found


def _waits(words: Words, element: str) -> str:
    node = words.mission.elements.get(element)
    name = words.with_id(element)
    if isinstance(node, e.Event | e.ReceiveTask | e.EventBasedGateway):
        return f"a token waits at {name} for what can no longer come"
    return f"a token stays on {name}"


def _at_join(words: Words, story: Sequence[Told], join: str, arrived: Sequence[str]) -> Stuck:
    node = words.mission.elements[join]
    assert isinstance(node, e.FlowNode)
    missing = tuple(flow.id for flow in node.incoming if flow.id not in arrived)
    name = words.with_id(join)
    if not missing:
        return Stuck(join, f"tokens wait at {name}")
    sources = [flow.source.id for flow in node.incoming if flow.id in missing]
    plural = "s" if len(arrived) > 1 else ""
    came = words.all_of([_source(words, flow) for flow in arrived])
    text = (
        f"token{plural} from {came} wait{'' if plural else 's'} at {name} for "
        f"{words.all_of(sources)}, which can no longer come"
    )
    reasons = [reason for flow in missing if (reason := _reason(words, story, flow))]
    if reasons:
        text += f", because {' and '.join(dict.fromkeys(reasons))}"
    return Stuck(join, text, missing)


def _source(words: Words, flow: str) -> str:
    known = words.mission.elements.get(flow)
    return known.source.id if isinstance(known, e.SequenceFlow) else flow


def _reason(words: Words, story: Sequence[Told], flow: str) -> str:
    """What happened upstream of a flow that no token came by: the nearest, told as a cause."""
    start = words.mission.elements[flow]
    assert isinstance(start, e.SequenceFlow)
    seen: set[str] = set()
    waiting: list[tuple[e.FlowNode, str]] = [(start.source, flow)]
    while waiting:
        node, towards = waiting.pop(0)
        if node.id in seen:
            continue
        seen.add(node.id)
        last = _last(story, node.id)
        if last is not None:
            return _cause(words, last, node, towards)
        if isinstance(node, e.BoundaryEvent):
            waiting.append((node.attached_to, node.id))
        waiting += [(each.source, each.id) for each in node.incoming]
    return f"nothing leads to {words.name(start.source.id)}"


def _last(story: Sequence[Told], element: str) -> Told | None:
    """The last step in which an element was left."""
    leaves = (Action.COMPLETED, Action.INTERRUPTED)
    for told in reversed(story):
        if any(step.element == element and step.action in leaves for step in told.actions):
            return told
    return None


def _cause(words: Words, told: Told, node: e.FlowNode, towards: str) -> str:
    name = words.name(node.id)
    if towards in words.mission.elements and isinstance(
        words.mission.elements[towards], e.BoundaryEvent
    ):
        return f"{name} was over (step {told.number}) before '{words.name(towards)}' was triggered"
    went = [words.name(flow.id) for flow in node.outgoing if flow.id in told.passes]
    if went and towards not in told.passes:
        return f"{name} went on by '{', '.join(went)}' (step {told.number})"
    return f"{name} was left only once (step {told.number})"
