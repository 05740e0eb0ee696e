"""An m2pem node that is commanded by the topics `command` and `behavior_status`."""

import asyncio
import logging
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any
from uuid import UUID

from m2pem.api import BehaviorState
from m2pem_plugin_ros.drivers.driver import Order, Outcome, Seat
from m2pem_plugin_ros.drivers.node.link import (
    ANSWER_WITHIN_S,
    LOOK_WITHIN_S,
    REMEMBERED,
    RESTARTED,
    STILL_S,
    Insisting,
    Send,
)
from m2pem_plugin_ros.interfaces.behavior_command import (
    Verb,
    behavior_command,
    goal_command,
    start_command,
)
from m2pem_plugin_ros.interfaces.behavior_status import Status
from m2pem_plugin_ros.log_throttle import Complaints

_GOES_ON = frozenset({BehaviorState.ACCEPTED, BehaviorState.RUNNING})


@dataclass(slots=True)
class _Pursued:
    """A goal that was not heard to have ended. `heard`: the node has said something of it.
    `number`: that of its last status. `cancelled`: it is to end. `shown_us`: when vehicle_status
    said last that it goes on."""

    goal: UUID
    order: Order | None
    number: int = 0
    heard: bool = False
    cancelled: bool = False
    shown_us: int | None = None


class ByTopics:
    """Implements `Link`. Statuses come to `status`."""

    def __init__(self, seat: Seat, send: Send, complaints: Complaints) -> None:
        self._seat = seat
        self._send = send
        self._complaints = complaints
        self._insisting = Insisting(seat.context.clock)
        self._current: _Pursued | None = None
        self._pursued: dict[str, _Pursued] = {}
        self._ended: dict[str, Outcome] = {}
        self._looks: dict[str, asyncio.Future[Status]] = {}
        self._node_heard_us: int | None = None
        self._orders: OrderedDict[UUID, Order] = OrderedDict()

    @property
    def order(self) -> Order | None:
        """What the vehicle is to do now."""
        return self._current.order if self._current is not None else None

    # --- what is asked of the vehicle -----------------------------------------------------------

    def begin(self, order: Order) -> None:
        """START, until the node has said something of it."""
        self._let_go()
        self._know(order)
        pursued = _Pursued(order.goal, order)
        self._current = self._pursued[str(order.goal)] = pursued
        self._ended.pop(str(order.goal), None)
        began_us = self._now_us()
        self._node_heard_us = None

        def say() -> bool:
            if pursued.heard or pursued.cancelled:
                return False
            if self._waited_s(began_us) > ANSWER_WITHIN_S:
                reason = f"the vehicle's node answered no START for {ANSWER_WITHIN_S:g} s"
                self._send(self._about(Verb.CANCEL, pursued))
                self._over(pursued, Outcome(BehaviorState.FAILED, "TIMEOUT", reason))
                return False
            self._send(start_command(order, self._now_us()))
            return True

        self._insisting.start("start", say)

    def end(self, goal: UUID) -> None:
        """CANCEL, until the node has said that it has ended, or knows nothing of it."""
        id_ = str(goal)
        if (outcome := self._ended.get(id_)) is not None:
            self._seat.told.ended(goal, outcome)
            return
        pursued = self._pursued.setdefault(id_, _Pursued(goal, None))
        if pursued.cancelled:
            return
        pursued.cancelled = True
        self._insist(pursued, self._cancel_of(pursued))

    def _cancel_of(self, pursued: _Pursued) -> Callable[[], bool]:
        said = 0

        def say() -> bool:
            nonlocal said
            if str(pursued.goal) not in self._pursued:
                return False
            self._send(self._about(Verb.CANCEL, pursued))
            if said:  # of what it does not know, it answers to nothing else
                self._send(self._about(Verb.QUERY, pursued))
            said += 1
            return True

        return say

    async def look(self, order: Order) -> Outcome:
        """QUERY, until it is answered. What goes on is ours from then on."""
        id_ = str(order.goal)
        self._know(order)
        answer = self._looks.setdefault(id_, asyncio.get_running_loop().create_future())
        query = self._about(Verb.QUERY, _Pursued(order.goal, order))

        def say() -> bool:
            self._send(query)
            return not answer.done()

        self._insisting.start(f"look {id_}", say)
        late = asyncio.ensure_future(self._seat.context.clock.sleep(LOOK_WITHIN_S))
        waited: list[asyncio.Future[Any]] = [answer, late]
        try:
            await asyncio.wait(waited, return_when=asyncio.FIRST_COMPLETED)
        finally:
            late.cancel()
            self._insisting.stop(f"look {id_}")
            self._looks.pop(id_, None)
        if not answer.done():
            reason = f"the vehicle's node did not answer within {LOOK_WITHIN_S:g} s"
            return Outcome(BehaviorState.UNKNOWN, reason=reason)
        status = answer.result()
        if status.state in _GOES_ON:
            self._adopt(order, status)
            return Outcome(BehaviorState.RUNNING)
        if status.state is BehaviorState.UNKNOWN:
            return Outcome(BehaviorState.UNKNOWN, reason=RESTARTED)
        return _outcome(status)

    def _adopt(self, order: Order, status: Status) -> None:
        if self._current is None or self._current.goal != order.goal:
            self._let_go()
            self._current = _Pursued(order.goal, order, status.number, heard=True)
            self._pursued[str(order.goal)] = self._current

    def forget(self) -> None:
        """Nothing is repeated any more."""
        self._insisting.stop_all()
        self._current = None
        self._pursued.clear()

    async def close(self) -> None:
        """Send nothing more."""
        self.forget()

    # --- what the vehicle says ------------------------------------------------------------------

    def status(self, status: Status) -> None:
        """Of any behavior, in any order, any number of times."""
        if (answer := self._looks.get(status.id)) is not None and not answer.done():
            answer.set_result(status)
        pursued = self._pursued.get(status.id)
        if pursued is None:
            if status.id not in self._ended and status.id not in self._looks:
                # Another executive's, perhaps, or of before ours was started.
                cause = "a status of what we have not given it"
                self._complaints.add(cause, status.id, logging.INFO)
        elif status.state is BehaviorState.UNKNOWN:
            self._unknown(pursued)
        elif status.number > pursued.number:
            pursued.number = status.number
            pursued.heard = True
            if status.state.terminal:
                self._over(pursued, _outcome(status))
            elif status.state is BehaviorState.RUNNING:
                self._seat.told.progress(pursued.goal)

    def _unknown(self, pursued: _Pursued) -> None:
        if pursued.shown_us is not None and self._waited_since_s(pursued.shown_us) < STILL_S:
            cause = "another node in its namespace knows nothing of what it does"
            self._complaints.add(cause, str(pursued.goal))
        elif pursued.cancelled:
            reason = "the vehicle's node knows nothing of it"
            self._over(pursued, Outcome(BehaviorState.CANCELLED, reason=reason))
        elif pursued.heard:
            self._over(pursued, Outcome(BehaviorState.LOST, "LINK_LOST", RESTARTED))

    def vehicle_does(self, behavior: str) -> None:
        """If it is not what it should do, ask: statuses may be lost, and nodes restarted."""
        if self._node_heard_us is None:
            self._node_heard_us = self._now_us()
        if (shown := self._pursued.get(behavior)) is not None:
            shown.shown_us = self._now_us()
        pursued = self._current
        if pursued is None or pursued.cancelled:
            return
        id_ = str(pursued.goal)
        if behavior == id_:
            pursued.heard = True
            self._seat.told.progress(pursued.goal)
            self._insisting.stop("query")
            return
        if not pursued.heard:
            return

        def say() -> bool:
            if self._current is not pursued or id_ not in self._pursued:
                return False
            self._send(self._about(Verb.QUERY, pursued))
            return True

        if not self._insisting.goes_on("query"):
            self._insisting.start("query", say)

    # --- inside ---------------------------------------------------------------------------------

    @property
    def _name(self) -> str:
        return self._seat.connection.resource

    def _now_us(self) -> int:
        return self._seat.context.clock.now_us()

    def _waited_since_s(self, then_us: int) -> float:
        return (self._now_us() - then_us) / 1e6

    def _waited_s(self, began_us: int) -> float:
        """For how long a node that is there has not answered."""
        if self._node_heard_us is None:
            return 0.0
        return (self._now_us() - max(began_us, self._node_heard_us)) / 1e6

    def _about(self, verb: int, pursued: _Pursued) -> Any:
        order = pursued.order or self._orders.get(pursued.goal)
        if order is None:
            return goal_command(verb, pursued.goal, self._now_us())
        epoch = self._seat.context.epoch_of(order.request.id)
        return behavior_command(verb, order, self._now_us(), epoch)

    def _know(self, order: Order) -> None:
        """What is told of a goal names its run, also after it was given up."""
        self._orders[order.goal] = order
        self._orders.move_to_end(order.goal)
        if len(self._orders) > REMEMBERED:
            self._orders.popitem(last=False)

    def _insist(self, pursued: _Pursued, say: Callable[[], bool]) -> None:
        self._insisting.start(f"cancel {pursued.goal}", say)

    def _let_go(self) -> None:
        """What it did is not told of any more: another takes over."""
        self._insisting.stop("start")
        self._insisting.stop("query")
        for id_, pursued in list(self._pursued.items()):
            self._insisting.stop(f"cancel {pursued.goal}")
            self._remember(id_, Outcome(BehaviorState.CANCELLED, reason="another took over"))
        self._pursued.clear()
        self._current = None

    def _over(self, pursued: _Pursued, outcome: Outcome) -> None:
        id_ = str(pursued.goal)
        self._remember(id_, outcome)
        del self._pursued[id_]
        if self._current is pursued:
            self._current = None
        self._seat.told.ended(pursued.goal, outcome)

    def _remember(self, id_: str, outcome: Outcome) -> None:
        self._ended[id_] = outcome
        if len(self._ended) > REMEMBERED:
            del self._ended[next(iter(self._ended))]


def _outcome(status: Status) -> Outcome:
    return Outcome(status.state, status.code, status.reason, status.outputs)
