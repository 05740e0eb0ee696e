"""Making the plan of a revision: each token, scope and event of a run, one after the other.

The rules are those of docs/revising.md. A plan depends on the state, the new version and the moves
that are asked for alone; `now_us` is only for what its sentences say about timers.
"""

from collections import deque
from collections.abc import Collection, Mapping

from m2pem.engine.apply.tokens import is_join
from m2pem.engine.revision.awaited import AwaitedEvents
from m2pem.engine.revision.draft import PlanDraft
from m2pem.engine.revision.plan import EffectKind, Move, RevisionPlan, called
from m2pem.engine.revision.targets import why_not
from m2pem.engine.revision.work import plan_work, same_instances
from m2pem.engine.state import CompletedActivity, RunState, RunStatus, Scope, Token
from m2pem.mission.difference import plain
from m2pem.mission.elements import (
    Activity,
    AdHocSubProcess,
    CallActivity,
    Container,
    FlowNode,
    Process,
    SequenceFlow,
    SubProcess,
)
from m2pem.mission.mission import Mission
from m2pem.suggestions import suggest


def plan_revision(
    state: RunState,
    new: Mission,
    moves: Mapping[str, str],
    now_us: int,
    adjustable: Collection[str] = (),
) -> RevisionPlan:
    """Return what a revision to a new version does to a run.

    `moves`: where a token on an element goes first, by the ids of elements or, at a join, of
    sequence flows; "": it ends there. `now_us`: microseconds since the Unix epoch. `adjustable`:
    behaviors whose speed can change while they go on.
    """
    decided_us, state.shared.now_us = state.shared.now_us, now_us
    try:
        return _Planning(state, new, moves, now_us, adjustable).plan()
    finally:
        state.shared.now_us = decided_us


class _Planning:
    """The plan of one revision in the making."""

    def __init__(
        self,
        state: RunState,
        new: Mission,
        moves: Mapping[str, str],
        now_us: int,
        adjustable: Collection[str],
    ) -> None:
        self._state = state
        self._new = new
        self._moves = moves
        self._draft = PlanDraft(state, new, moves, adjustable)
        self._events = AwaitedEvents(state, new, self._draft, now_us)
        self._moved: set[str] = set()
        self._waiting: deque[tuple[Scope, Container]] = deque()
        """Scopes whose turn comes, and what they are instances of in the new version. A process may
        call itself a thousand times, so nothing recurses."""

    def plan(self) -> RevisionPlan:
        state, draft = self._state, self._draft
        if state.status in (RunStatus.NEW, RunStatus.ENDED):
            draft.refuse("", f"the run is {state.status.value}: only one under way is revised")
            return draft.finish()
        if draft.is_unchanged and not self._moves:
            draft.refuse("", "the run has this version already, and no token is moved")
            return draft.finish()
        for scope in state.scopes.values():
            if scope.owner is None:
                self._instance(scope)
        while self._waiting:
            self._scope(*self._waiting.popleft())
        root = state.root
        if root is not None and root.id not in state.scopes and self._process(root) is None:
            text = f"the run began with {called(root.container)}: keep it in the new version"
            draft.refuse(root.container.id, text)
        self._unused_moves()
        self._data_stores()
        return draft.finish()

    def _unused_moves(self) -> None:
        old = self._state.mission.elements
        for element in self._moves:
            if element in self._moved:
                continue
            if element in old:
                text = f"no token is on {called(old[element])}, which is to be moved"
            else:
                text = (
                    f"the mission has no element {element!r}; {suggest(element, old, 'elements')}"
                )
            self._draft.refuse(element, text)

    def _data_stores(self) -> None:
        state = self._state
        for key in sorted(state.mission.data_stores ^ self._new.data_stores):
            values = {name for scope in state.scopes.values() for name in scope.data}
            if any(name.partition(".")[0] == key for name in values | set(state.shared.data)):
                what = "is a data store now" if key in self._new.data_stores else "is none now"
                text = f"{key!r} has a value, and {what}: give the data store another name"
                self._draft.refuse("", text)

    # --- scopes ---------------------------------------------------------------------------------

    def _instance(self, scope: Scope) -> None:
        """Plan for an instance of a process that no other one called."""
        process = self._process(scope)
        if process is None:
            text = f"{called(scope.container)} is under way, and not in the new version"
            self._draft.refuse(scope.container.id, f"{text}: keep it, or stop the run")
            return
        self._waiting.append((scope, process))

    def _process(self, scope: Scope) -> Process | None:
        """Return the process of an instance in the new version; None: it has none of that id."""
        found = self._new.elements.get(scope.container.id)
        return found if isinstance(found, Process) else None

    def _scope(self, scope: Scope, container: Container) -> None:
        for token in list(scope.tokens.values()):
            self._token(token, container)
        if scope.loop is None:
            self._events.of_scope(scope, container)
        self._completed_in(scope, container)
        for node, used in scope.activated.items():
            again = self._new.elements.get(node.id)
            flows = [flow.id for flow in again.incoming] if isinstance(again, FlowNode) else []
            if flows != [flow.id for flow in node.incoming] or type(again) is not type(node):
                text = (
                    f"{called(node)} has taken {', '.join(flow.id for flow in used)}, and waits to "
                    "reset: its incoming sequence flows cannot change before it has"
                )
                self._draft.refuse(node.id, text)
        if isinstance(scope.container, AdHocSubProcess) and scope.loop is None:
            self._ad_hoc(scope, container)

    def _ad_hoc(self, scope: Scope, container: Container) -> None:
        """Plan for the choice of activities in an ad-hoc subprocess."""
        old = scope.container
        assert isinstance(old, AdHocSubProcess)
        assert isinstance(container, AdHocSubProcess)
        draft, token = self._draft, scope.owner
        number = token.id if token is not None else 0
        if (old.active_elements is None) != (container.active_elements is None):
            why = f"who chooses the activities of {called(old)} changes while it is under way"
            assert token is not None
            draft.refuse_token(token, why, container.container)
            return
        there = {node.id for node in container.entries}
        for node in scope.chosen:
            if node.id not in there:
                text = f"{called(node)} was chosen, and does not begin: the new version has it not"
                draft.add(EffectKind.ENDS, node.id, 0, text)
        offered = [[(node.id, node.label) for node in each.entries] for each in (old, container)]
        said = [
            plain((each.ordering, each.completion, each.cancel_remaining))
            for each in (old, container)
        ]
        if offered[0] != offered[1] or said[0] != said[1]:
            draft.recheck(scope)
            if token is not None and token.prompt:
                text = f"operators are asked again what is to be done next in {called(container)}"
                draft.add(EffectKind.RESTARTS, old.id, number, text)

    # --- tokens ---------------------------------------------------------------------------------

    def _token(self, token: Token, container: Container) -> None:
        """Plan for a token in a scope that has `container` in the new version."""
        node, draft = token.node, self._draft
        if node.id in self._moves and token.instance is None:
            self._moved.add(node.id)
            self._move(token, container, self._moves[node.id])
            return
        again = self._new.elements.get(node.id)
        if not isinstance(again, FlowNode):
            self._homeless(token, container, "which the new version has not")
        elif type(again) is not type(node):
            self._homeless(token, container, f"which is {_a(again.kind)} in the new version")
        elif again.container is not container:
            where = f"which the new version has in {called(again.container)}"
            self._homeless(token, container, where)
        elif self._arrived(token, again, container) and self._may_go_on(token, again):
            work = plan_work(self._state, self._new, token, again, draft)
            self._events.of_token(token, again, restarts=work)
            if token.inner is not None:
                self._waiting.append((token.inner, _inside(token.inner, again)))

    def _homeless(self, token: Token, container: Container, why: str) -> None:
        text = f"a token is on {called(token.node)}, {why}{_doing(self._state, token)}"
        self._draft.refuse_token(token, text, container)

    def _move(self, token: Token, container: Container, target: str) -> None:
        node = token.node
        if refusal := why_not(token, container, target, self._new):
            self._draft.refuse_move(token, refusal, container)
            return
        ending = _ending(self._state, token)
        if target:
            text = f"the token on {called(node)} goes to {called(self._new.elements[target])}"
            kind = EffectKind.MOVES
        else:
            text, kind = f"the token on {called(node)} ends", EffectKind.ENDS
        self._draft.add(kind, node.id, token.id, f"{text}{ending}")
        self._draft.move(Move(token.id, token.scope.id, target))

    def _arrived(self, token: Token, again: FlowNode, container: Container) -> bool:
        """Check a token at a join: whether the flow that it came by leads there, and what it waits
        for from now on. False: it was refused."""
        node = token.node
        if not (is_join(again) or is_join(node)):
            return True
        flow = self._new.elements.get(token.flow.id) if token.flow is not None else None
        leads_there = isinstance(flow, SequenceFlow) and flow.target is again
        if is_join(again) and not leads_there:
            came_by = token.flow.id if token.flow is not None else "no sequence flow"
            why = f"where it came by {came_by}, which does not lead there in the new version"
            self._homeless(token, container, why)
            return False
        old = [each.id for each in node.incoming]
        new = [each.id for each in again.incoming]
        if token.flow is not None and sorted(old) != sorted(new):
            if is_join(again):
                text = f"the token that waits at {called(again)} waits for {', '.join(new)} now"
            else:
                text = f"the token that waits at {called(again)} goes on: nothing is joined there"
            self._draft.add(EffectKind.GOES_ON, node.id, token.id, text)
        return True

    def _may_go_on(self, token: Token, again: FlowNode) -> bool:
        """Check what an activity has begun and cannot go on as another. False: it was refused."""
        node, draft = token.node, self._draft
        if not isinstance(node, Activity) or not isinstance(again, Activity):
            return True
        if token.instance is None and (why := same_instances(token, node, again)):
            draft.refuse_token(token, why, again.container)
            return False
        gathered = token.scope.gathered.get(node)
        if gathered and node.start_quantity != again.start_quantity:
            why = (
                f"{len(gathered)} tokens wait at {called(node)}, of which the startQuantity changes"
            )
            draft.refuse_token(token, why, again.container)
            return False
        other = _called_id(node) != _called_id(again)
        if other and token.inner is not None and token.inner.loop is None:
            why = f"{called(node)} has called {_called_id(node)}, and now calls {_called_id(again)}"
            draft.refuse_token(token, why, again.container)
            return False
        begun_by_event = isinstance(node, SubProcess) and node.triggered_by_event
        if begun_by_event != (isinstance(again, SubProcess) and again.triggered_by_event):
            why = f"{called(node)} is under way, and is begun in another way in the new version"
            draft.refuse_token(token, why, again.container)
            return False
        return True

    # --- what can be undone ---------------------------------------------------------------------

    def _completed_in(self, scope: Scope, container: Container) -> None:
        """Check what has completed in a scope, and within that."""
        waiting = deque([(scope, container)])
        while waiting:
            each, there = waiting.popleft()
            for completion in (each.compensable or {}).values():
                inside = self._completed(completion, there)
                if inside is not None and completion.kept_scope is not None:
                    waiting.append((completion.kept_scope, inside))

    def _completed(self, completion: CompletedActivity, container: Container) -> Container | None:
        """Check that what has completed can still be undone. Returns the container of its kept
        scope in the new version; None: it has none, or was refused."""
        node = completion.node
        again = self._new.elements.get(node.id)
        there = type(again) is type(node) and isinstance(again, Activity)
        if not there or not isinstance(again, Activity) or again.container is not container:
            text = f"{called(node)} has completed and may be undone: keep it in the new version"
            self._draft.refuse(node.id, text)
            return None
        kept = completion.kept_scope
        if kept is None:
            old, new = node.compensation, again.compensation
            if old is not None and (new is None or new.id != old.id or type(new) is not type(old)):
                text = f"{called(node)} has completed, and {called(old)} is to undo it: keep both"
                self._draft.refuse(node.id, text)
            return None
        if again.compensation is not None:
            text = f"{called(node)} has completed and is undone by what was done in it: keep that"
            self._draft.refuse(node.id, text)
            return None
        other = _called_id(again) != _called_id(node)
        if other and kept.loop is None:
            text = f"{called(node)} has called {_called_id(node)}, which may be undone: keep it"
            self._draft.refuse(node.id, text)
            return None
        return _inside(kept, again)


def _inside(scope: Scope, node: FlowNode) -> Container:
    """Return the container that the scope of an activity has in the new version."""
    if scope.loop is not None:
        return node.container
    if isinstance(node, CallActivity):
        return node.called
    assert isinstance(node, SubProcess)
    return node


def _called_id(node: Activity) -> str:
    return node.called.id if isinstance(node, CallActivity) else ""


def _a(kind: str) -> str:
    return f"{'an' if kind[0] in 'aeiou' else 'a'} {kind}"


def _doing(state: RunState, token: Token) -> str:
    """Return what a token does on its element, as a part of a sentence; "": it only waits."""
    if token.behavior:
        behavior = state.behaviors[token.behavior]
        return f" (behavior {behavior.name} of {', '.join(behavior.resources)})"
    if token.prompt:
        return f" (prompt {token.prompt} is open)"
    if token.service:
        return f" (service {state.services[token.service].name})"
    if token.incident:
        return f" (incident {token.incident} is open)"
    if token.inner is not None and token.inner.tokens:
        return f" ({len(token.inner.tokens)} in it)"
    return ""


def _ending(state: RunState, token: Token) -> str:
    """Return what ends when a token is moved, as the rest of a sentence."""
    ended: list[str] = []
    waiting = [token]
    while waiting:
        each = waiting.pop()
        if each.behavior:
            behavior = state.behaviors[each.behavior]
            ended.append(f"behavior {behavior.name} of {', '.join(behavior.resources)}")
        if each.allocation:
            ended.append("the wait for resources")
        if each.prompt:
            ended.append(f"prompt {each.prompt}")
        if each.service:
            ended.append(f"service {state.services[each.service].name}")
        if each.incident:
            ended.append(f"incident {each.incident}")
        if each.inner is not None:
            waiting.extend(reversed(each.inner.tokens.values()))
    return f"; cancelled: {', '.join(ended)}" if ended else ""
