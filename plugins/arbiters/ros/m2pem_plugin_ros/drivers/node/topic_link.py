"""Commands an m2pem node by the topics `command` and `behavior_status`."""

import asyncio
import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any
from uuid import UUID

from m2pem.api import BehaviorState
from m2pem.api.remember import remember
from m2pem_plugin_ros.drivers.driver import DriverSetup, Order, Outcome
from m2pem_plugin_ros.drivers.node.link import (
    ANSWER_WITHIN_S,
    QUERY_WITHIN_S,
    REMEMBERED,
    REPLACED,
    RESTARTED,
    STILL_S,
    Retries,
    Send,
)
from m2pem_plugin_ros.interfaces.behavior_command import (
    Verb,
    behavior_command,
    goal_command,
    start_command,
)
from m2pem_plugin_ros.interfaces.behavior_status import Status
from m2pem_plugin_ros.log_throttle import LogThrottle

_GOES_ON = frozenset({BehaviorState.ACCEPTED, BehaviorState.RUNNING})


@dataclass(slots=True)
class _PendingGoal:
    """A goal that has not ended. `acknowledged`: the node has reported it. `number`: of its last
    status. `cancelled`: a CANCEL is sent. `shown_us`: when vehicle_status reported it last."""

    goal: UUID
    order: Order | None
    number: int = 0
    acknowledged: bool = False
    cancelled: bool = False
    shown_us: int | None = None


class TopicLink:
    """Implements `NodeLink`. The driver passes behavior statuses to `status`."""

    def __init__(self, setup: DriverSetup, send: Send, log_throttle: LogThrottle) -> None:
        self._setup = setup
        self._send = send
        self._log_throttle = log_throttle
        self._retries = Retries(setup.context.clock, setup.context.may_send)
        self._current: _PendingGoal | None = None
        self._pending: dict[str, _PendingGoal] = {}
        self._ended: dict[str, Outcome] = {}
        self._queries: dict[str, asyncio.Future[Status]] = {}
        self._node_received_us: int | None = None
        self._orders: dict[UUID, Order] = {}

    @property
    def order(self) -> Order | None:
        return self._current.order if self._current is not None else None

    # --- orders ---------------------------------------------------------------------------------

    def begin(self, order: Order) -> None:
        """Send START until the node reports the goal."""
        self._let_go()
        self._know(order)
        pending = _PendingGoal(order.goal, order)
        self._current = self._pending[str(order.goal)] = pending
        self._ended.pop(str(order.goal), None)
        began_us = self._now_us()
        self._node_received_us = None

        def send_again() -> bool:
            if pending.acknowledged or pending.cancelled:
                return False
            if self._waited_s(began_us) > ANSWER_WITHIN_S:
                reason = f"the vehicle's node answered no START for {ANSWER_WITHIN_S:g} s"
                self._send(self._about(Verb.CANCEL, pending))
                self._over(pending, Outcome(BehaviorState.FAILED, "TIMEOUT", reason))
                return False
            self._send(start_command(order, self._stamp_us()))
            return True

        self._retries.start("start", send_again)

    def end(self, goal: UUID) -> None:
        """Send CANCEL until the node reports that the goal has ended, or is unknown."""
        id_ = str(goal)
        if (outcome := self._ended.get(id_)) is not None:
            self._setup.events.ended(goal, outcome)
            return
        pending = self._pending.setdefault(id_, _PendingGoal(goal, None))
        if pending.cancelled:
            return
        pending.cancelled = True
        self._retries.start(f"cancel {goal}", self._cancel_of(pending))

    def _cancel_of(self, pending: _PendingGoal) -> Callable[[], bool]:
        said = 0

        def send_again() -> bool:
            nonlocal said
            if str(pending.goal) not in self._pending:
                return False
            self._send(self._about(Verb.CANCEL, pending))
            if said:  # for an unknown behavior, the node answers only QUERY
                self._send(self._about(Verb.QUERY, pending))
            said += 1
            return True

        return send_again

    async def query(self, order: Order) -> Outcome:
        """Send QUERY until it is answered. A goal that goes on is adopted."""
        id_ = str(order.goal)
        self._know(order)
        answer = self._queries.setdefault(id_, asyncio.get_running_loop().create_future())
        query = self._about(Verb.QUERY, _PendingGoal(order.goal, order))

        def send_again() -> bool:
            self._send(query)
            return not answer.done()

        self._retries.start(f"look {id_}", send_again)
        late = asyncio.ensure_future(self._setup.context.clock.sleep(QUERY_WITHIN_S))
        waited: list[asyncio.Future[Any]] = [answer, late]
        try:
            await asyncio.wait(waited, return_when=asyncio.FIRST_COMPLETED)
        finally:
            late.cancel()
            self._retries.stop(f"look {id_}")
            self._queries.pop(id_, None)
        if not answer.done():
            reason = f"the vehicle's node did not answer within {QUERY_WITHIN_S:g} s"
            return Outcome(BehaviorState.UNKNOWN, reason=reason)
        status = answer.result()
        if status.state in _GOES_ON:
            self._adopt(order, status)
            return Outcome(BehaviorState.RUNNING, remaining=status.remaining)
        if status.state is BehaviorState.UNKNOWN:
            return Outcome(BehaviorState.UNKNOWN, reason=RESTARTED)
        return _outcome(status)

    def _adopt(self, order: Order, status: Status) -> None:
        if self._current is None or self._current.goal != order.goal:
            self._let_go()
            self._current = _PendingGoal(order.goal, order, status.number, acknowledged=True)
            self._pending[str(order.goal)] = self._current

    def abandon(self) -> None:
        self._retries.stop_all()
        self._current = None
        self._pending.clear()

    async def close(self) -> None:
        self.abandon()

    # --- messages of the vehicle ----------------------------------------------------------------

    def status(self, status: Status) -> None:
        """Process a status of any behavior. Statuses may be repeated and out of order."""
        if (answer := self._queries.get(status.id)) is not None and not answer.done():
            answer.set_result(status)
        pending = self._pending.get(status.id)
        if pending is None:
            if status.id not in self._ended and status.id not in self._queries:
                # It may be of another executive, or from before a restart.
                cause = "a status of a behavior that was not sent"
                self._log_throttle.log(cause, status.id, logging.INFO)
        elif status.state is BehaviorState.UNKNOWN:
            self._unknown(pending)
        elif status.number > pending.number:
            pending.number = status.number
            pending.acknowledged = True
            if status.state.terminal:
                self._over(pending, _outcome(status))
            elif status.state is BehaviorState.RUNNING:
                self._setup.events.progress(pending.goal)
                if status.remaining is not None:
                    self._setup.events.remains(pending.goal, status.remaining)

    def _unknown(self, pending: _PendingGoal) -> None:
        if pending.shown_us is not None and self._waited_since_s(pending.shown_us) < STILL_S:
            cause = "another node in its namespace does not have its behavior"
            self._log_throttle.log(cause, str(pending.goal))
        elif pending.cancelled:
            reason = "the vehicle's node does not have the behavior"
            self._over(pending, Outcome(BehaviorState.CANCELLED, reason=reason))
        elif pending.acknowledged:
            self._over(pending, Outcome(BehaviorState.LOST, "LINK_LOST", RESTARTED))

    def vehicle_does(self, behavior: str) -> None:
        """Send QUERY for the current goal if the vehicle does something else: a status may be lost,
        or the node restarted."""
        if self._node_received_us is None:
            self._node_received_us = self._now_us()
        if (shown := self._pending.get(behavior)) is not None:
            shown.shown_us = self._now_us()
        pending = self._current
        if pending is None or pending.cancelled:
            return
        id_ = str(pending.goal)
        if behavior == id_:
            pending.acknowledged = True
            self._setup.events.progress(pending.goal)
            self._retries.stop("query")
            return
        if not pending.acknowledged:
            return

        def send_again() -> bool:
            if self._current is not pending or id_ not in self._pending:
                return False
            self._send(self._about(Verb.QUERY, pending))
            return True

        if not self._retries.goes_on("query"):
            self._retries.start("query", send_again)

    # --- inside ---------------------------------------------------------------------------------

    def _now_us(self) -> int:
        return self._setup.context.clock.now_us()

    def _stamp_us(self) -> int:
        return self._setup.ros.stamp_us(self._now_us())

    def _waited_since_s(self, then_us: int) -> float:
        return (self._now_us() - then_us) / 1e6

    def _waited_s(self, began_us: int) -> float:
        """Return how long a node that is received has not answered."""
        if self._node_received_us is None:
            return 0.0
        return (self._now_us() - max(began_us, self._node_received_us)) / 1e6

    def _about(self, verb: int, pending: _PendingGoal) -> Any:
        order = pending.order or self._orders.get(pending.goal)
        if order is None:
            return goal_command(verb, pending.goal, self._stamp_us())
        epoch = self._setup.context.epoch_of(order.request.id)
        return behavior_command(verb, order, self._stamp_us(), epoch)

    def _know(self, order: Order) -> None:
        """Keep an order, so that later messages about its goal name its run."""
        remember(self._orders, order.goal, order, REMEMBERED)

    def _let_go(self) -> None:
        """Drop all goals, as another order replaces them."""
        self._retries.stop("start")
        self._retries.stop("query")
        for id_, pending in list(self._pending.items()):
            self._retries.stop(f"cancel {pending.goal}")
            remember(self._ended, id_, REPLACED, REMEMBERED)
        self._pending.clear()
        self._current = None

    def _over(self, pending: _PendingGoal, outcome: Outcome) -> None:
        id_ = str(pending.goal)
        remember(self._ended, id_, outcome, REMEMBERED)
        del self._pending[id_]
        if self._current is pending:
            self._current = None
        self._setup.events.ended(pending.goal, outcome)


def _outcome(status: Status) -> Outcome:
    return Outcome(status.state, status.code, status.reason, status.outputs)
