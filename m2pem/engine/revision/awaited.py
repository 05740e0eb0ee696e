"""What a revision does to the events that tokens and scopes of a run await.

An event whose definitions are the same is awaited as before. Others are armed again: a duration
counts from when it was first armed, a cycle from now. What has occurred already does not occur
again, and so is not armed.
"""

from collections.abc import Iterable, Sequence

from m2pem.engine.data import reader
from m2pem.engine.execution import armed_triggers, definitions_of, is_awaited, triggered_starts
from m2pem.engine.records import Trigger
from m2pem.engine.revision.draft import PlanDraft
from m2pem.engine.revision.plan import Arming, EffectKind, called
from m2pem.engine.revision.work import has_begun
from m2pem.engine.state import RunState, Scope, Token, TokenOrScope, Wait
from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.mission.difference import plain
from m2pem.mission.elements import (
    Activity,
    Container,
    Event,
    EventBasedGateway,
    FlowNode,
    Process,
    ReceiveTask,
)
from m2pem.mission.events import (
    MessageEventDefinition,
    TimerEventDefinition,
    TimerKind,
)
from m2pem.mission.mission import Mission
from m2pem.mission.timers import wait_us
from m2pem.units import US_PER_S


class AwaitedEvents:
    """Plans for the events that are awaited."""

    def __init__(self, state: RunState, new: Mission, draft: PlanDraft, now_us: int) -> None:
        self._state = state
        self._new = new
        self._draft = draft
        self._now_us = now_us

    def of_token(self, token: Token, again: FlowNode, *, restarts: bool) -> None:
        """Plan for what a token that stays awaits. `restarts`: its task begins again; what its
        task itself awaits is disarmed already."""
        node = token.node
        awaited = _by_node(token.waits)
        if isinstance(node, EventBasedGateway):
            if awaited:
                self._gateway(token, again, awaited)
            return
        if node in awaited and not restarts and definitions_of(node):
            if not _is_awaited(again):
                why = f"a token waits at {called(node)}, which awaits nothing in the new version"
                self._draft.refuse_token(token, why, again.container)
                return
            self._changed(token, node, again, awaited[node])
        if isinstance(node, Activity) and isinstance(again, Activity):
            self._boundary(token, node, again, awaited, restarts=restarts)

    def of_scope(self, scope: Scope, container: Container) -> None:
        """Plan for the start events of event subprocesses of a scope and, in the scope that the run
        began with, for what begins other processes."""
        awaited = _by_node(scope.waits)
        old, new = _starts(scope.container), _starts(container)
        if scope is self._state.root:
            assert isinstance(container, Process)
            assert isinstance(scope.container, Process)
            old += filter(armed_triggers, triggered_starts(self._state.mission, scope.container))
            began = triggered_starts(self._new, container)
            new += filter(armed_triggers, began)
            self._kept_messages_for(scope, began)
        live = not (scope.interrupted or scope.completing or scope.cancelled or scope.reopened)
        self._compare(scope, old, new, awaited, may_arm=live)

    def _kept_messages_for(self, root: Scope, starts: Iterable[FlowNode]) -> None:
        """Say which processes begin with messages that the run has kept."""
        kept = self._state.kept_messages
        for start in starts:
            for each in definitions_of(start):
                if isinstance(each, MessageEventDefinition) and each.message.id in kept:
                    text = f"{called(start)} takes messages that were kept and nothing waits for"
                    self._add(EffectKind.ARMS, root, start, text)

    def _gateway(self, token: Token, again: FlowNode, awaited: dict[FlowNode, list[Wait]]) -> None:
        node = token.node
        assert isinstance(node, EventBasedGateway)
        old = [flow.target for flow in node.outgoing]
        new = [flow.target for flow in again.outgoing]
        if node.parallel and [plain(each) for each in old] != [plain(each) for each in new]:
            why = f"{called(node)} waits for all events after it, which change"
            self._draft.refuse_token(token, why, again.container)
            return
        self._compare(token, old, new, awaited, may_arm=True)

    def _boundary(
        self,
        token: Token,
        node: Activity,
        again: Activity,
        awaited: dict[FlowNode, list[Wait]],
        *,
        restarts: bool,
    ) -> None:
        if token.instance is not None:
            return  # boundary events belong to the outer instance
        inner = token.inner
        undone = inner is not None and (inner.reopened or inner.cancelled)
        # Armed as its turn comes: it begins again, or it could not be armed before its incident.
        failed = bool(token.incident) and any(map(is_awaited, node.boundary))
        later = not token.armed and (restarts or failed)
        may_arm = has_begun(token) and not undone and not later
        here = {each: waits for each, waits in awaited.items() if each is not node}
        self._compare(token, node.boundary, again.boundary, here, may_arm=may_arm)

    # --- comparing ------------------------------------------------------------------------------

    def _compare(
        self,
        holder: TokenOrScope,
        old: Sequence[FlowNode],
        new: Sequence[FlowNode],
        awaited: dict[FlowNode, list[Wait]],
        *,
        may_arm: bool,
    ) -> None:
        """Plan for events of which `old` were awaited, or have occurred, and `new` are to be."""
        now = {each.id: each for each in new}
        before = {each.id: each for each in old}
        for node, waits in awaited.items():
            again = now.get(node.id)
            if again is not None and type(again) is type(node):
                self._changed(holder, node, again, waits)
                continue
            for wait in waits:
                self._draft.disarm(wait)
            self._add(EffectKind.DISARMS, holder, node, f"{called(node)} is not awaited any more")
            if again is not None and may_arm:
                self._arm(holder, again)
        for event in new:
            was = before.get(event.id)
            occurred = was is not None and _is_awaited(was) and was not in awaited
            known = was is not None and was in awaited
            if may_arm and _is_awaited(event) and not known and not occurred:
                self._arm(holder, event)

    def _arm(self, holder: TokenOrScope, event: FlowNode) -> None:
        self._add(EffectKind.ARMS, holder, event, f"{called(event)} is awaited from now on")
        self._draft.arm(_arming(holder, event, None))

    def _changed(
        self, holder: TokenOrScope, node: FlowNode, again: FlowNode, waits: list[Wait]
    ) -> None:
        """Plan for an awaited event that both versions have."""
        if _trigger(node) == _trigger(again):
            return
        several = isinstance(node, Event) and node.parallel_multiple
        if several and len(waits) < len(definitions_of(node)):
            self._changes_in_between(holder, node, again)
            return
        for wait in waits:
            self._draft.disarm(wait)
        since_us = _since(node, again, waits)
        text = f"{called(again)} is awaited as the new version says"
        if since_us is not None:
            text = f"{text}{self._when(holder, again, since_us)}"
        self._add(EffectKind.REARMS, holder, again, text)
        if _is_awaited(again):
            self._draft.arm(_arming(holder, again, since_us))

    def _changes_in_between(self, holder: TokenOrScope, node: FlowNode, again: FlowNode) -> None:
        """Refuse other triggers of an event that has had one of several."""
        why = f"{called(node)} has had one of its triggers, and they change"
        token = holder if isinstance(holder, Token) else holder.owner
        if token is None:
            self._draft.refuse(node.id, f"{why}: keep them")
            return
        on = self._new.elements[token.node.id]
        assert isinstance(on, FlowNode)
        self._draft.refuse_token(token, why, on.container)

    def _when(self, holder: TokenOrScope, event: FlowNode, since_us: int) -> str:
        """Return when a duration is over that counts from when it was armed, for a sentence."""
        definition = definitions_of(event)[0]
        assert isinstance(definition, TimerEventDefinition)
        now_us = self._state.mission_time_us(self._now_us)
        try:
            text = definition.expression.evaluate(reader(holder))
            length_us = wait_us(text, self._now_us - (now_us - since_us))
        except (ExpressionError, ExpressionSyntaxError) as error:
            return f": its duration is wrong, and ends in an error: {error}"
        left_s = (since_us + length_us - now_us) / US_PER_S
        counts = "; its duration counts from when it was armed"
        return f"{counts}, and is over: it fires at once" if left_s <= 0 else counts

    def _add(self, kind: EffectKind, holder: TokenOrScope, event: FlowNode, text: str) -> None:
        number = holder.id if isinstance(holder, Token) else 0
        self._draft.add(kind, event.id, number, text)


def _by_node(waits: dict[int, Wait] | None) -> dict[FlowNode, list[Wait]]:
    found: dict[FlowNode, list[Wait]] = {}
    for wait in (waits or {}).values():
        found.setdefault(wait.node, []).append(wait)
    return found


def _arming(holder: TokenOrScope, event: FlowNode, since_us: int | None) -> Arming:
    if isinstance(holder, Token):
        return Arming(holder.id, holder.scope.id, event.id, since_us)
    return Arming(0, holder.id, event.id, since_us)


def _trigger(node: FlowNode) -> object:
    """Return what an event waits for, to compare."""
    several = isinstance(node, Event) and node.parallel_multiple
    return several, tuple(plain(each) for each in definitions_of(node))


def _is_awaited(node: FlowNode) -> bool:
    if isinstance(node, ReceiveTask):
        return node.message is not None
    return isinstance(node, Event) and is_awaited(node)


def _starts(container: Container) -> list[FlowNode]:
    return [start for inner in container.event_subprocesses for start in inner.starts]


def _since(old: FlowNode, new: FlowNode, waits: list[Wait]) -> int | None:
    """Return from when the duration of a changed timer counts; None: it is armed for the first
    time, or is no duration."""
    before, now = definitions_of(old), definitions_of(new)
    if len(before) != 1 or len(now) != 1 or len(waits) != 1:
        return None
    durations = (
        isinstance(each, TimerEventDefinition) and each.kind is TimerKind.DURATION
        for each in (before[0], now[0])
    )
    if waits[0].trigger is not Trigger.TIMER or not all(durations):
        return None
    return waits[0].armed_us
