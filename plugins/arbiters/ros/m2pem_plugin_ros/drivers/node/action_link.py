"""Commands an m2pem node by the action `execute_behavior`."""

import asyncio
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any
from uuid import UUID

from action_msgs import msg as action
from action_msgs import srv as action_services
from m2pem_interfaces.action import ExecuteBehavior

from m2pem.api import BehaviorState
from m2pem.api.latest_task import LatestTask, cancel_and_wait
from m2pem.api.remember import remember
from m2pem_plugin_ros.drivers.driver import DriverSetup, Order, Outcome
from m2pem_plugin_ros.drivers.goal_services import ACTIVE, GoalServices
from m2pem_plugin_ros.drivers.node.link import (
    QUERY_WITHIN_S,
    REMEMBERED,
    REPLACED,
    RESTARTED,
    STILL_S,
    Retries,
)
from m2pem_plugin_ros.interfaces.behavior_command import start_command
from m2pem_plugin_ros.interfaces.behavior_status import ENDS, read_status
from m2pem_plugin_ros.interfaces.key_values import WireError
from m2pem_plugin_ros.log_throttle import LogThrottle
from m2pem_plugin_ros.runtime import RosTimeoutError, qos

CALL_S = 2.0
"""Timeout of a service that answers at once, in real seconds."""

ATTEMPTS = 5
"""After this many unanswered goals to a node that is received, the order fails."""

CANCELS = action_services.CancelGoal.Response.ERROR_NONE

_ENDS = {
    action.GoalStatus.STATUS_SUCCEEDED: BehaviorState.SUCCEEDED,
    action.GoalStatus.STATUS_CANCELED: BehaviorState.CANCELLED,
    action.GoalStatus.STATUS_ABORTED: BehaviorState.FAILED,
}


@dataclass(slots=True)
class _PendingGoal:
    """A goal. `acknowledged`: the node has it. `answered`: it is known whether the node has it.
    `news`: set when it has ended, or when its result is to be requested."""

    goal: UUID
    order: Order | None
    acknowledged: bool = False
    answered: bool = False
    cancelled: bool = False
    over: bool = False
    number: int = 0
    shown_us: int | None = None
    news: asyncio.Event = field(default_factory=asyncio.Event)


class ActionLink:
    def __init__(self, setup: DriverSetup, name: str, log_throttle: LogThrottle) -> None:
        self._setup = setup
        self._log_throttle = log_throttle
        self._client = GoalServices(
            setup.ros, ExecuteBehavior, name, self._statuses, self._feedback, qos.COMMANDS
        )
        self._pauses = Retries(setup.context.clock, setup.context.may_send)
        self._current: _PendingGoal | None = None
        self._pending: dict[UUID, _PendingGoal] = {}
        self._shown: dict[UUID, int] = {}
        self._goals_shown = asyncio.Event()
        self._ended: dict[UUID, Outcome] = {}
        self._tasks = LatestTask(
            lambda error: log_throttle.log("internal error of m2pem", repr(error))
        )
        self._node_is_received = False

    @property
    def order(self) -> Order | None:
        return self._current.order if self._current is not None else None

    @property
    def missing(self) -> str:
        """The services of the action that are not discovered; "" if all are."""
        return self._client.missing

    # --- orders ---------------------------------------------------------------------------------

    def begin(self, order: Order) -> None:
        """Send the goal until it is answered."""
        self._let_go()
        pending = self._add_pending(order.goal, order)
        self._current = pending
        self._node_is_received = False
        self._tasks.add(self._give(pending, order))

    def end(self, goal: UUID) -> None:
        """Cancel the goal until it has ended."""
        if (outcome := self._ended.get(goal)) is not None:
            self._setup.events.ended(goal, outcome)
            return
        pending = self._pending.get(goal)
        if pending is None:
            pending = self._add_pending(goal, None)
            pending.answered = (
                True  # a goal of an earlier process; if the node does not have it, it has ended
            )
            self._tasks.add(self._attend(pending))
        if not pending.cancelled:
            pending.cancelled = True
            self._tasks.add(self._cancel(pending))

    async def query(self, order: Order) -> Outcome:
        """Return the state of a goal by the status topic, or by its result."""
        create = asyncio.get_running_loop().create_task
        asked = create(self._client.result(order.goal, QUERY_WITHIN_S))
        shown = create(self._shown_active(order.goal))  # the node sends no result of such a goal
        try:
            await asyncio.wait([asked, shown], return_when=asyncio.FIRST_COMPLETED)
            if not asked.done():
                self._adopt(order)
                return Outcome(BehaviorState.RUNNING)
            ended = asked.result()
        except RosTimeoutError:
            reason = f"the vehicle's node did not answer within {QUERY_WITHIN_S:g} s"
            return Outcome(BehaviorState.UNKNOWN, reason=reason)
        finally:
            await cancel_and_wait(asked, shown)
        if ended.status == action.GoalStatus.STATUS_UNKNOWN:
            return Outcome(BehaviorState.UNKNOWN, reason=RESTARTED)
        return self._outcome(order.goal, ended)

    async def _shown_active(self, goal: UUID) -> None:
        while self._shown.get(goal) not in ACTIVE:
            self._goals_shown.clear()
            await self._goals_shown.wait()

    def _adopt(self, order: Order) -> None:
        if self._current is None or self._current.goal != order.goal:
            self._let_go()
            pending = self._current = self._add_pending(order.goal, order)
            pending.acknowledged = pending.answered = True
            self._tasks.add(self._attend(pending))

    def abandon(self) -> None:
        for pending in self._pending.values():
            pending.over = True
        self._tasks.cancel()
        self._pending.clear()
        self._current = None

    async def close(self) -> None:
        self.abandon()
        await self._tasks.close()

    # --- messages of the vehicle ----------------------------------------------------------------

    def vehicle_does(self, behavior: str) -> None:
        """Request the result of the current goal if the vehicle does something else: its node may
        have restarted."""
        self._node_is_received = True
        for each in self._pending.values():
            if behavior == str(each.goal):
                each.shown_us = self._setup.context.clock.now_us()
        pending = self._current
        if pending is None:
            return
        if behavior == str(pending.goal):
            pending.acknowledged = True
            self._setup.events.progress(pending.goal)
        elif pending.acknowledged:
            pending.news.set()

    def _statuses(self, statuses: Mapping[UUID, int]) -> None:
        for goal, number in statuses.items():
            remember(self._shown, goal, number, REMEMBERED)
            self._goals_shown.set()
            pending = self._pending.get(goal)
            if pending is not None:
                pending.acknowledged = True
                if number not in ACTIVE:
                    pending.news.set()

    def _feedback(self, goal: UUID, message: Any) -> None:
        pending = self._pending.get(goal)
        if pending is None:
            return
        self._setup.events.alive()
        try:
            status = read_status(message.status)
        except WireError as error:
            self._log_throttle.log("invalid feedback", str(error))
            return
        if status.id != str(goal) or status.number <= pending.number:
            return
        pending.number = status.number
        if status.state is BehaviorState.RUNNING:
            self._setup.events.progress(goal)
            if status.remaining is not None:
                self._setup.events.remains(goal, status.remaining)

    # --- one goal -------------------------------------------------------------------------------

    async def _give(self, pending: _PendingGoal, order: Order) -> None:
        now_us = self._setup.context.clock.now_us()
        command = start_command(order, self._setup.ros.stamp_us(now_us))
        content = ExecuteBehavior.Goal(command=command)
        attempts = 0
        while not (pending.acknowledged or pending.over):
            if pending.cancelled and attempts:
                break  # the goal may have arrived; `_cancel` checks it
            while not self._setup.context.may_send():
                await self._pauses.pause()
            try:
                accepted = await self._client.send(pending.goal, content, CALL_S)
            except RosTimeoutError:
                attempts += self._node_is_received
                if attempts >= ATTEMPTS and not pending.cancelled:
                    self._give_up(pending)
                    return
                continue
            if accepted or await self._is_known(pending.goal):
                pending.acknowledged = True
            else:
                reason = "the vehicle's node refused the goal"
                self._over(pending, Outcome(BehaviorState.REJECTED, "REJECTED", reason))
        pending.answered = True
        await self._attend(pending)

    def _give_up(self, pending: _PendingGoal) -> None:
        reason = "the vehicle's node runs, but does not answer goals"
        self._over(pending, Outcome(BehaviorState.FAILED, "TIMEOUT", reason))

    async def _is_known(self, goal: UUID) -> bool:
        """Return whether the node has a goal that it refused. It refuses a goal that was sent
        twice."""
        if goal in self._shown:
            return True
        try:
            ended = await self._client.result(goal, CALL_S)
        except RosTimeoutError:
            return True  # the goal is active: for others, the node answers at once
        return bool(ended.status != action.GoalStatus.STATUS_UNKNOWN)

    async def _attend(self, pending: _PendingGoal) -> None:
        """Request the result of a goal whenever there is news, until it has ended."""
        while not pending.over:
            await pending.news.wait()
            pending.news.clear()
            try:
                ended = await self._client.result(pending.goal, CALL_S)
            except RosTimeoutError:
                if self._shown.get(pending.goal, action.GoalStatus.STATUS_EXECUTING) not in ACTIVE:
                    pending.news.set()  # it has ended, but its outcome is not known yet
                continue
            if ended.status != action.GoalStatus.STATUS_UNKNOWN:
                self._over(pending, self._outcome(pending.goal, ended))
            elif self._goes_on(pending):
                cause = "another node in its namespace does not have its behavior"
                self._log_throttle.log(cause, str(pending.goal))
                await self._pauses.pause()
                pending.news.set()
            elif pending.cancelled:
                self._over(pending, Outcome(BehaviorState.CANCELLED, reason=RESTARTED))
            else:
                self._over(pending, Outcome(BehaviorState.LOST, "LINK_LOST", RESTARTED))

    def _goes_on(self, pending: _PendingGoal) -> bool:
        """Whether vehicle_status reported the goal just now. Then another node answered UNKNOWN."""
        if pending.shown_us is None:
            return False
        return self._setup.context.clock.now_us() - pending.shown_us < STILL_S * 1e6

    async def _cancel(self, pending: _PendingGoal) -> None:
        while not pending.over:
            try:
                answer = await self._client.cancel(pending.goal, CALL_S)
            except RosTimeoutError:
                continue
            if answer.return_code != CANCELS and pending.answered:
                pending.news.set()  # it has ended, or was never there
            await self._pauses.pause()

    # --- inside ---------------------------------------------------------------------------------

    def _add_pending(self, goal: UUID, order: Order | None) -> _PendingGoal:
        self._ended.pop(goal, None)
        pending = self._pending[goal] = _PendingGoal(goal, order)
        return pending

    def _let_go(self) -> None:
        """Drop all goals, as another order replaces them."""
        for goal in self._pending:
            remember(self._ended, goal, REPLACED, REMEMBERED)
        self.abandon()

    def _over(self, pending: _PendingGoal, outcome: Outcome) -> None:
        if pending.over:
            return
        pending.over = True
        pending.news.set()
        self._pending.pop(pending.goal, None)
        if self._current is pending:
            self._current = None
        remember(self._ended, pending.goal, outcome, REMEMBERED)
        self._setup.events.ended(pending.goal, outcome)

    def _outcome(self, goal: UUID, ended: Any) -> Outcome:
        """Return the outcome that the status of the behavior says; without a valid one, that of the
        action."""
        try:
            status = read_status(ended.result.status)
            if status.id == str(goal) and status.state in ENDS:
                return Outcome(status.state, status.code, status.reason, status.outputs)
            wrong = f"the result of {goal} is a status of {status.id} with state {status.state}"
        except WireError as error:
            wrong = str(error)
        self._log_throttle.log("an invalid result", wrong)
        return Outcome(_ENDS.get(ended.status, BehaviorState.FAILED), reason=wrong)
