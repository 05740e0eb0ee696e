"""Executing the steps that an input causes, one after the other: the engine's only loop."""

from collections import deque
from collections.abc import Iterator

from m2pem.engine import records as r
from m2pem.engine.arming import arm_next, condition_fires
from m2pem.engine.breakpoints import Pausing
from m2pem.engine.elements import HANDLERS
from m2pem.engine.elements.activities import activate_later
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
    """An execution with its loop. `batch`: steps that one input may cause before a yield."""

    __slots__ = ("batch", "pausing", "steps_done")

    handlers = HANDLERS

    def __init__(self, state: RunState, fleet: Fleet | None, batch: int) -> None:
        super().__init__(state, fleet)
        self.batch = batch
        self.steps_left = batch
        self.steps_done = 0
        self.pausing: Pausing | None = None  # a run that is not debugged has none

    def begin(self, now_us: int) -> None:
        """Prepare for an input that came at `now_us`; steps left over come first."""
        self.now_us = self.state.shared.now_us = now_us
        if self.mission is not self.state.mission:  # a replay has revised it
            self.read_mission()
        self.steps_left = self.batch
        self.look_for_breakpoints()
        if self.state.yielded and self.state.status is RunStatus.RUNNING:
            self.reload_queue()

    def look_for_breakpoints(self) -> None:
        """Follow the breakpoints that the state has from now on."""
        there = self.state.breakpoints
        self.breakpoints = there.elements if there is not None else frozenset()
        self.pausing = Pausing(self) if there is not None or self.state.stepping else None

    def run_steps(self) -> None:
        """Execute tokens until none can move, or the batch is used up."""
        state, queue, entered = self.state, self.queue, self.entered
        while state.status is RunStatus.RUNNING:
            while queue or entered or self.data_changed:
                # Tokens that are armed at once count, too: their number may double at each turn.
                if self.steps_left <= 0 and self._has_steps():
                    if self.pausing is not None:
                        self.pausing.pauses(queue)
                    return
                if entered:
                    self.steps_left -= 1
                    arm_next(self)
                    continue
                if self.data_changed:
                    self.data_changed = False
                    self._fire_conditions()
                    continue
                if self.pausing is not None and self.pausing.pauses_before(queue):
                    return
                if not queue:
                    break
                item = queue.popleft()
                # Written out, as this is the inner loop.
                if type(item) is Token:
                    if state.tokens.get(item.id) is item and not item.incident:
                        self.steps_left -= 1
                        _ACTIVATE[type(item.node)](self, item)
                elif state.scopes.get(item.id) is item:
                    assert isinstance(item, Scope)
                    self.steps_left -= 1
                    check_scope(self, item)
            if self.pausing is not None and self.pausing.pauses_before(queue):
                return
            if not fire_joins(self):
                return

    def _has_steps(self) -> bool:
        """Whether a queued token or scope is still current; drops those before it that are not."""
        queue, entered = self.queue, self.entered
        while queue and not self._is_current(queue[0]):
            queue.popleft()
        while entered and not self._is_current(entered[0]):
            entered.popleft()
        return bool(queue or entered)

    def _fire_conditions(self) -> None:
        """Fire the conditions that have become true, in the order of arming; as many as the batch
        allows, and one at least."""
        conditions, waits = self.state.conditions, self.state.waits
        for number in list(conditions):
            if self.steps_left <= 0 and (self.queue or self.entered):
                self.data_changed = True
                return
            if number in conditions and condition_fires(self, waits[number]):
                self.steps_left -= 1
                trigger(self, waits[number], {})

    def _is_current(self, item: Token | Scope) -> bool:
        """Whether a queued token or scope has not moved or ended before its turn."""
        if type(item) is Token:
            return self.is_active(item)
        return self.state.scopes.get(item.id) is item

    def finish(self) -> list[Record]:
        """Return all records of the input; steps that are left over are in a `RunYielded`."""
        self.run_steps()
        if self.queue or self.entered:
            self._yield()
        else:
            self._fail_if_stuck()
        self.state.shared.now_us = None
        self.steps_done += self.batch - self.steps_left
        records, self.records = self.records, []
        return records

    def _yield(self) -> None:
        # Written out for speed: there may be thousands at each of many batches.
        tokens, scopes = self.state.tokens, self.state.scopes
        steps = []
        there = set[int]()
        for item in self._in_order():
            if type(item) is Token:
                if tokens.get(item.id) is item and not item.incident and item.id not in there:
                    there.add(item.id)
                    steps.append(item.id)
            elif scopes.get(item.id) is item:
                # As often as it is queued: it may complete at any of its turns.
                steps.append(-item.id)
        self.queue.clear()
        self.entered.clear()
        self.emit(r.RunYielded(tuple(steps)))

    def _in_order(self) -> Iterator[Token | Scope]:
        """Yield what is queued and what has entered, each in its order; a token may be in both."""
        entered = deque(self.entered)
        in_both = set(entered) & set(self.queue) if entered else ()
        for item in self.queue:
            while item in in_both and entered and entered[0] is not item:
                yield entered.popleft()
            yield item
        yield from entered

    def reload_queue(self) -> None:
        """Queue the steps that a yield left over."""
        steps = self.state.yielded
        if steps:
            self.emit(r.RunYielded(()))
            # The batch before may have been another process.
            self.joins_to_check.update(self.state.scopes)
            self.data_changed = True
        tokens = self.state.tokens
        for number in steps:
            if number > 0:
                token = tokens.get(number)
                if token is None:
                    continue
                activate_later(self, token)
            else:
                scope = self.state.scopes.get(-number)
                if scope is not None:
                    self.queue.append(scope)

    def _another_process_can_begin(self) -> bool:
        """Whether a signal or message from outside can begin another process."""
        return any(
            isinstance(definition, SignalEventDefinition | MessageEventDefinition)
            for start in self.triggered_starts
            for definition in definitions_of(start)
        )

    def _fail_if_stuck(self) -> None:
        """Fail the run if no token can move and nothing is awaited (a deadlock)."""
        state = self.state
        if state.status is not RunStatus.RUNNING:
            return
        if (
            state.allocations
            or state.prompts
            or state.services
            or state.incidents
            or len(state.waits) > len(state.conditions)
        ):
            return
        if state.conditions and state.shared.keys and self._another_process_can_begin():
            return  # it may write to a data store what a condition reads
        if any(token.behavior for token in state.tokens.values()):
            return
        stuck = dict.fromkeys(
            token.node.id for token in state.tokens.values() if token.inner is None
        )
        end_run(self, RunOutcome.FAILED, f"stuck: no token can move from {', '.join(stuck)}")
