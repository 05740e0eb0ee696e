"""What records about data and events do to the state."""

from heapq import heapify, heappop, heappush

from m2pem.engine import records as r
from m2pem.engine.state import (
    KeptMessage,
    RunState,
    Scope,
    Token,
    Wait,
)
from m2pem.mission.elements import (
    FlowNode,
)

STALE_TIMERS = 64
"""Ended timers stay in their heap until there are this many more than active ones."""


def node_of(state: RunState, element: str) -> FlowNode:
    """Return the flow node of an id."""
    node = state.mission.elements[element]
    assert isinstance(node, FlowNode)
    return node


def data_written(state: RunState, record: r.DataWritten) -> None:
    if not record.own:
        store = state.scopes[record.store].data if record.store else state.shared.data
        store[record.key] = record.value
        return
    token = state.tokens[record.own]
    if token.own is None:
        token.own = {}
    token.own[record.key] = record.value


def event_awaited(state: RunState, record: r.EventAwaited) -> None:
    holder: Token | Scope
    if record.token:
        holder = token = state.tokens[record.token]
        token.armed = True
        scope = token.scope
    else:
        holder, token, scope = state.scopes[record.scope], None, state.scopes[record.scope]
    wait = Wait(
        record.wait,
        token,
        scope,
        node_of(state, record.element),
        record.trigger,
        record.ref,
        record.due_us,
        record.calendar,
        record.left,
        record.cycle,
        record.armed_us,
    )
    state.last_wait = record.wait
    state.waits[wait.id] = wait
    if holder.waits is None:
        holder.waits = {}
    holder.waits[wait.id] = wait
    if wait.trigger is r.Trigger.TIMER:
        heappush(state.dates if wait.calendar else state.timers, (wait.due_us, wait.id))
    elif wait.trigger is r.Trigger.CONDITION:
        state.conditions[wait.id] = not record.spent
    else:
        state.catchers.setdefault((wait.trigger, wait.ref), {})[wait.id] = wait


def end_wait(state: RunState, wait: Wait) -> None:
    """Remove a wait: its event has occurred, or is awaited no longer."""
    del state.waits[wait.id]
    waits = wait.token.waits if wait.token is not None else wait.scope.waits
    assert waits is not None
    del waits[wait.id]
    if wait.trigger is r.Trigger.TIMER:
        heap = state.dates if wait.calendar else state.timers
        while heap and heap[0][1] not in state.waits:
            heappop(heap)
        if len(heap) > 2 * len(state.waits) + STALE_TIMERS:
            heap[:] = [entry for entry in heap if entry[1] in state.waits]
            heapify(heap)
        return
    if wait.trigger is r.Trigger.CONDITION:
        del state.conditions[wait.id]
        return
    key = (wait.trigger, wait.ref)
    catchers = state.catchers[key]
    del catchers[wait.id]
    if not catchers:
        del state.catchers[key]


def event_triggered(state: RunState, record: r.EventTriggered) -> None:
    wait = state.waits[record.wait]
    end_wait(state, wait)
    if record.kept:
        take_message(state, wait.ref, record.letter)


def take_message(state: RunState, message: str, letter: int = 0) -> None:
    """Remove one of the kept messages of an id: it is received."""
    messages = state.kept_messages[message]
    messages.pop(letter)
    if not messages:
        del state.kept_messages[message]


def condition_reset(state: RunState, record: r.ConditionReset) -> None:
    state.conditions[record.wait] = True


def message_thrown(state: RunState, record: r.MessageThrown) -> None:
    if record.kept:
        state.kept_messages.setdefault(record.message, []).append(
            KeptMessage(record.data, record.keys)
        )
