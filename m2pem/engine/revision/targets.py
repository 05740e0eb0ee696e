"""Where tokens can go in the new version of a mission, and whether they can go where they are to.

A token stays within its scope: it goes to another element of the same process or subprocess, or to
a sequence flow there that leads to a join, or it ends.
"""

from collections import deque
from collections.abc import Collection, Iterator

from m2pem.engine.apply.tokens import is_join
from m2pem.engine.incidents import is_outside_the_flow, targets_in
from m2pem.engine.state import Token
from m2pem.mission.elements import Container, FlowNode, SequenceFlow
from m2pem.mission.mission import Mission
from m2pem.suggestions import suggest_or

NAMED = 6
"""Candidates that a refusal names in its sentence, at most."""


def moved_with(token: Token) -> Token:
    """Return the token that is moved in place of one: an instance of a loop or multi-instance
    activity is moved with its activity as a whole."""
    while token.instance is not None and token.scope.owner is not None:
        token = token.scope.owner
    return token


def candidates(token: Token, container: Container) -> tuple[str, ...]:
    """Return where a token can go in the container that its scope has in the new version, the
    nearest after its element in the old version first."""
    fixed = token.instance is not None or token.compensates is not None
    if fixed or is_outside_the_flow(token.node):
        return ()
    there = {each.id: each for each in targets_in(container)}
    nearest = [id_ for id_ in _after(token.node) if id_ in there]
    return tuple(dict.fromkeys((*nearest, *there)))


def _after(node: FlowNode) -> Iterator[str]:
    """Yield the ids of a node, and of flows and nodes after it, the nearest first."""
    yield from (flow.id for flow in node.incoming if is_join(node))
    seen, waiting = {node}, deque([node])
    while waiting:
        each = waiting.popleft()
        yield each.id
        for flow in each.outgoing:
            yield flow.id
            if flow.target not in seen:
                seen.add(flow.target)
                waiting.append(flow.target)


def why_not(token: Token, container: Container, target: str, new: Mission) -> str:
    """Return why a token cannot go to a target in the new version; "" if it can."""
    what = token.node.label
    if token.compensates is not None:
        return f"the token on {what!r} undoes an activity: it cannot be moved"
    if not target:
        return ""
    there = candidates(token, container)
    if target in there:
        return ""
    found = new.elements.get(target)
    if found is None:
        return (
            f"the new version has no element {target!r}; {suggest_or(target, there, _can(there))}"
        )
    if isinstance(found, FlowNode) and found.container is container and is_join(found):
        flows = ", ".join(flow.id for flow in found.incoming)
        return f"{target} joins several sequence flows: say by which the token comes: {flows}"
    if isinstance(found, SequenceFlow):
        return f"{target} leads to no join in {container.label!r}: name the element; {_can(there)}"
    return f"the token on {what!r} stays in {container.label!r}; {_can(there)}"


def way_out(token: Token, there: Collection[str]) -> str:
    """Return what can be done about a token that cannot stay, as the rest of a sentence.

    `there`: its candidates.
    """
    if token.compensates is not None:
        return "it undoes an activity: wait until that is done"
    return _can(there, token.node.id)


def _can(there: Collection[str], again: str = "") -> str:
    """Return where a token can go. `again`: its element, which begins again then."""
    if not there:
        return "it can end"
    listed = [f"{each} (begins again)" if each == again else each for each in list(there)[:NAMED]]
    more = f" (and {len(there) - NAMED} more)" if len(there) > NAMED else ""
    return f"it can go to {', '.join(listed)}{more}, or end"
