"""Doing the steps that an input causes, one after the other: the engine's only loop."""

from collections import deque
from collections.abc import Iterator

from m2pem.engine import records as r
from m2pem.engine.arming import arm_next, comes_true
from m2pem.engine.elements import HANDLERS
from m2pem.engine.elements.activities import has_entered
from m2pem.engine.elements.gateways import fire_joins
from m2pem.engine.elements.subprocesses import check_scope
from m2pem.engine.execution import Execution, definitions_of
from m2pem.engine.records import Record, RunOutcome
from m2pem.engine.scopes import end_run
from m2pem.engine.state import RunState, RunStatus, Scope, Token
from m2pem.engine.triggering import trigger
from m2pem.fleet.fleet import Fleet
from m2pem.mission.events import MessageEventDefinition, SignalEventDefinition

_ACTIVATE = {kind: handler.activate for kind, handler in HANDLERS.items()}


class Steps(Execution):
    """An execution that can work its queue off."""

    __slots__ = ("batch", "done")

    handlers = HANDLERS

    def __init__(self, state: RunState, fleet: Fleet | None, batch: int) -> None:
        super().__init__(state, fleet)
        self.batch = batch
        self.left = batch
        self.done = 0

    def begin(self, now_us: int) -> None:
        """Get ready for an input that came at `now_us`; steps left over go first."""
        self.now_us = now_us
        self.left = self.batch
        if self.state.yielded and self.state.status is RunStatus.RUNNING:
            self.reload_queue()

    def run_steps(self) -> None:
        """Execute tokens until none can move, or the batch is used up."""
        state, queue, entered = self.state, self.queue, self.entered
        while state.status is RunStatus.RUNNING:
            while queue or entered or self.changed:
                # Of what comes at once, too, each takes its part: tokens may double at each turn.
                if self.left <= 0 and self._has_steps():
                    return
                if entered:
                    self.left -= 1
                    arm_next(self)
                    continue
                if self.changed:
                    self.changed = False
                    self._fire_conditions()
                    continue
                if not queue:
                    break
                item = queue.popleft()
                # Written out, as this is the inner loop.
                if type(item) is Token:
                    if state.tokens.get(item.id) is item:
                        self.left -= 1
                        _ACTIVATE[type(item.node)](self, item)
                elif state.scopes.get(item.id) is item:
                    assert isinstance(item, Scope)
                    self.left -= 1
                    check_scope(self, item)
            if not fire_joins(self):
                return

    def _has_steps(self) -> bool:
        """Whether anything of what came next is still there; what has gone is forgotten."""
        queue, entered = self.queue, self.entered
        while queue and not self._is_there(queue[0]):
            queue.popleft()
        while entered and not self._is_there(entered[0]):
            entered.popleft()
        return bool(queue or entered)

    def _fire_conditions(self) -> None:
        """Those that have become true, in the order in which they were armed; as far as the batch
        goes, and one at least."""
        conditions, waits = self.state.conditions, self.state.waits
        for number in list(conditions):
            if self.left <= 0 and (self.queue or self.entered):
                self.changed = True
                return
            if number in conditions and comes_true(self, waits[number]):
                self.left -= 1
                trigger(self, waits[number], {})

    def _is_there(self, item: Token | Scope) -> bool:
        """Whether it is still where it was when it was queued, and not ended before its turn."""
        if type(item) is Token:
            return self.state.tokens.get(item.id) is item
        return self.state.scopes.get(item.id) is item

    def finish(self) -> list[Record]:
        """All records of the input: its steps are done, or left over in a `RunYielded`."""
        self.run_steps()
        if self.queue or self.entered:
            self._yield()
        else:
            self._notice_a_stuck_run()
        self.done += self.batch - self.left
        records, self.records = self.records, []
        return records

    def _yield(self) -> None:
        # Written out, as there may be many thousands at each of many batches.
        tokens, scopes = self.state.tokens, self.state.scopes
        steps = []
        for item in dict.fromkeys(self._in_order()):
            if type(item) is Token:
                if tokens.get(item.id) is item:
                    steps.append(item.id)
            elif scopes.get(item.id) is item:
                steps.append(-item.id)
        self.queue.clear()
        self.entered.clear()
        self.emit(r.RunYielded(tuple(steps)))

    def _in_order(self) -> Iterator[Token | Scope]:
        """What is queued and what has entered, each in its order; a token may be in both."""
        entered = deque(self.entered)
        in_both = set(entered) & set(self.queue) if entered else ()
        for item in self.queue:
            while item in in_both and entered and entered[0] is not item:
                yield entered.popleft()
            yield item
        yield from entered

    def reload_queue(self) -> None:
        """Take up the steps that a yield left over."""
        steps = self.state.yielded
        if steps:
            self.emit(r.RunYielded(()))
            # The batch before may have been another process.
            self.moved.update(self.state.scopes)
            self.changed = True
        tokens, queue, waits = self.state.tokens, self.queue, self.waits
        for number in steps:
            if number > 0:
                token = tokens.get(number)
                if token is None:
                    continue
                if (token.instance is None and token.node not in waits) or has_entered(token):
                    queue.append(token)
                else:
                    self.execute_later(token)
            else:
                scope = self.state.scopes.get(-number)
                if scope is not None:
                    self.queue.append(scope)

    def _others_can_begin(self) -> bool:
        """Whether a signal or message from outside can begin another process."""
        return any(
            isinstance(definition, SignalEventDefinition | MessageEventDefinition)
            for start in self.triggered_starts
            for definition in definitions_of(start)
        )

    def _notice_a_stuck_run(self) -> None:
        """No token can move and nothing is awaited: the run has failed (a deadlock)."""
        state = self.state
        if state.status is not RunStatus.RUNNING:
            return
        if state.prompts or state.services or len(state.waits) > len(state.conditions):
            return
        if state.conditions and state.shared.keys and self._others_can_begin():
            return  # they may write to a data store what a condition reads
        if any(token.behavior for token in state.tokens.values()):
            return
        stuck = dict.fromkeys(
            token.node.id for token in state.tokens.values() if token.inner is None
        )
        end_run(self, RunOutcome.FAILED, f"stuck: no token can move from {', '.join(stuck)}")
