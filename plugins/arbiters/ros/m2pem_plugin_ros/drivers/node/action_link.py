"""Commands an m2pem node by the action `execute_behavior`."""

import asyncio
from collections.abc import Callable, Coroutine
from dataclasses import dataclass, field
from typing import Any
from uuid import UUID

from action_msgs import msg as action
from action_msgs import srv as action_services
from m2pem_interfaces.action import ExecuteBehavior
from unique_identifier_msgs import msg as unique_identifier

from m2pem.api import BehaviorState
from m2pem.api.latest_task import cancel_and_wait
from m2pem_plugin_ros.drivers.driver import DriverSetup, Order, Outcome
from m2pem_plugin_ros.drivers.node.link import (
    QUERY_WITHIN_S,
    REMEMBERED,
    RESTARTED,
    STILL_S,
    Retries,
)
from m2pem_plugin_ros.interfaces.behavior_command import start_command
from m2pem_plugin_ros.interfaces.behavior_status import ENDS, read_status
from m2pem_plugin_ros.interfaces.key_values import WireError
from m2pem_plugin_ros.log_throttle import LogThrottle
from m2pem_plugin_ros.runtime import RosRuntime, RosTimeoutError, qos

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
        self._client = GoalClient(setup.ros, name, Listeners(self._status, self._feedback))
        self._pauses = Retries(setup.context.clock, setup.context.may_send)
        self._current: _PendingGoal | None = None
        self._pending: dict[UUID, _PendingGoal] = {}
        self._shown: dict[UUID, int] = {}
        self._goals_shown = asyncio.Event()
        self._ended: dict[UUID, Outcome] = {}
        self._tasks: set[asyncio.Task[None]] = set()
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
        self._run(self._give(pending, order))

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
            self._run(self._attend(pending))
        if not pending.cancelled:
            pending.cancelled = True
            self._run(self._cancel(pending))

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
            number, status = asked.result()
        except RosTimeoutError:
            reason = f"the vehicle's node did not answer within {QUERY_WITHIN_S:g} s"
            return Outcome(BehaviorState.UNKNOWN, reason=reason)
        finally:
            await cancel_and_wait(asked, shown)
        if number == action.GoalStatus.STATUS_UNKNOWN:
            return Outcome(BehaviorState.UNKNOWN, reason=RESTARTED)
        return self._outcome(order.goal, number, status)

    async def _shown_active(self, goal: UUID) -> None:
        while self._shown.get(goal) not in ACTIVE:
            self._goals_shown.clear()
            await self._goals_shown.wait()

    def _adopt(self, order: Order) -> None:
        if self._current is None or self._current.goal != order.goal:
            self._let_go()
            pending = self._current = self._add_pending(order.goal, order)
            pending.acknowledged = pending.answered = True
            self._run(self._attend(pending))

    def abandon(self) -> None:
        for pending in self._pending.values():
            pending.over = True
        for task in self._tasks:
            task.cancel()
        self._pending.clear()
        self._current = None

    async def close(self) -> None:
        tasks = list(self._tasks)
        self.abandon()
        await asyncio.gather(*tasks, return_exceptions=True)

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

    def _status(self, goal: UUID, number: int) -> None:
        self._shown.pop(goal, None)
        self._shown[goal] = number
        if len(self._shown) > REMEMBERED:
            del self._shown[next(iter(self._shown))]
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
            status = read_status(message)
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
        attempts = 0
        while not (pending.acknowledged or pending.over):
            if pending.cancelled and attempts:
                break  # the goal may have arrived; `_cancel` checks it
            while not self._setup.context.may_send():
                await self._pauses.pause()
            try:
                accepted = await self._client.send(pending.goal, command, CALL_S)
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
            number, _ = await self._client.result(goal, CALL_S)
        except RosTimeoutError:
            return True  # the goal is active: for others, the node answers at once
        return bool(number != action.GoalStatus.STATUS_UNKNOWN)

    async def _attend(self, pending: _PendingGoal) -> None:
        """Request the result of a goal whenever there is news, until it has ended."""
        while not pending.over:
            await pending.news.wait()
            pending.news.clear()
            try:
                number, status = await self._client.result(pending.goal, CALL_S)
            except RosTimeoutError:
                if self._shown.get(pending.goal, action.GoalStatus.STATUS_EXECUTING) not in ACTIVE:
                    pending.news.set()  # it has ended, but its outcome is not known yet
                continue
            if number != action.GoalStatus.STATUS_UNKNOWN:
                self._over(pending, self._outcome(pending.goal, number, status))
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
                code = await self._client.cancel(pending.goal, CALL_S)
            except RosTimeoutError:
                continue
            if code != CANCELS and pending.answered:
                pending.news.set()  # it has ended, or was never there
            await self._pauses.pause()

    # --- inside ---------------------------------------------------------------------------------

    @property
    def _name(self) -> str:
        return self._setup.connection.resource

    def _add_pending(self, goal: UUID, order: Order | None) -> _PendingGoal:
        self._ended.pop(goal, None)
        pending = self._pending[goal] = _PendingGoal(goal, order)
        return pending

    def _let_go(self) -> None:
        """Drop all goals, as another order replaces them."""
        for goal, pending in self._pending.items():
            pending.over = True
            self._remember(
                goal, Outcome(BehaviorState.CANCELLED, reason="another behavior has replaced it")
            )
        for task in self._tasks:
            task.cancel()
        self._pending.clear()
        self._current = None

    def _over(self, pending: _PendingGoal, outcome: Outcome) -> None:
        if pending.over:
            return
        pending.over = True
        pending.news.set()
        self._pending.pop(pending.goal, None)
        if self._current is pending:
            self._current = None
        self._remember(pending.goal, outcome)
        self._setup.events.ended(pending.goal, outcome)

    def _remember(self, goal: UUID, outcome: Outcome) -> None:
        self._ended[goal] = outcome
        if len(self._ended) > REMEMBERED:
            del self._ended[next(iter(self._ended))]

    def _outcome(self, goal: UUID, number: int, message: Any) -> Outcome:
        """Return the outcome that the status of the behavior says; without a valid one, that of the
        action."""
        try:
            status = read_status(message)
            if status.id == str(goal) and status.state in ENDS:
                return Outcome(status.state, status.code, status.reason, status.outputs)
            wrong = f"the result of {goal} is a status of {status.id} with state {status.state}"
        except WireError as error:
            wrong = str(error)
        self._log_throttle.log("an invalid result", wrong)
        return Outcome(_ENDS.get(number, BehaviorState.FAILED), reason=wrong)

    def _run(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._done)

    def _done(self, task: asyncio.Task[None]) -> None:
        self._tasks.discard(task)
        if not task.cancelled() and (error := task.exception()) is not None:
            self._log_throttle.log("internal error of m2pem", repr(error))


Status = action.GoalStatus

ACTIVE = frozenset({Status.STATUS_ACCEPTED, Status.STATUS_EXECUTING, Status.STATUS_CANCELING})


@dataclass(frozen=True, slots=True)
class Listeners:
    """Callbacks on the event loop: `status` with a goal and its GoalStatus, `feedback` with a goal
    and its feedback."""

    status: Callable[[UUID, int], None]
    feedback: Callable[[UUID, Any], None]


class GoalClient:
    """A client of the action `execute_behavior`, by its services and topics.

    The client of rclpy knows only the goals that it has sent. After a restart, goals are found by
    their UUID.
    """

    def __init__(self, ros: RosRuntime, name: str, listeners: Listeners) -> None:
        self._ros = ros
        self._listeners = listeners
        parts = ExecuteBehavior.Impl
        self._send = ros.client(parts.SendGoalService, f"{name}/_action/send_goal")
        self._result = ros.client(parts.GetResultService, f"{name}/_action/get_result")
        self._cancel = ros.client(action_services.CancelGoal, f"{name}/_action/cancel_goal")
        ros.subscribe(
            action.GoalStatusArray,
            f"{name}/_action/status",
            self._on_statuses,
            qos.STATUS,
        )
        ros.subscribe(
            parts.FeedbackMessage, f"{name}/_action/feedback", self._on_feedback, qos.COMMANDS
        )

    @property
    def missing(self) -> str:
        services = (self._send, self._result, self._cancel)
        names = [str(each.srv_name) for each in services if not each.service_is_ready()]
        return f"the service {' and '.join(names)}" if names else ""

    async def send(self, goal: UUID, command: Any, timeout_s: float) -> bool:
        """Send a goal, and return whether it was accepted. A goal that the node has already is not
        accepted.

        Raises:
            RosTimeoutError: no answer in time; the goal may still have arrived.
        """
        request = ExecuteBehavior.Impl.SendGoalService.Request(
            goal_id=_message(goal), goal=ExecuteBehavior.Goal(command=command)
        )
        return bool((await self._ros.call(self._send, request, timeout_s)).accepted)

    async def result(self, goal: UUID, timeout_s: float) -> tuple[int, Any]:
        """Return the GoalStatus of a goal, and the status of its behavior. The node answers when
        the goal has ended, or at once with STATUS_UNKNOWN.

        Raises:
            RosTimeoutError: no answer in time: the goal is active, or no node answers.
        """
        request = ExecuteBehavior.Impl.GetResultService.Request(goal_id=_message(goal))
        response = await self._ros.call(self._result, request, timeout_s)
        return response.status, response.result.status

    async def cancel(self, goal: UUID, timeout_s: float) -> int:
        """Cancel a goal, and return the code of CancelGoal.

        Raises:
            RosTimeoutError: no answer in time.
        """
        request = action_services.CancelGoal.Request()
        request.goal_info.goal_id = _message(goal)
        response = await self._ros.call(self._cancel, request, timeout_s)
        return int(response.return_code)

    def _on_statuses(self, message: Any) -> None:
        for status in message.status_list:
            self._listeners.status(_uuid(status.goal_info.goal_id), status.status)

    def _on_feedback(self, message: Any) -> None:
        self._listeners.feedback(_uuid(message.goal_id), message.feedback.status)


def _message(goal: UUID) -> Any:
    return unique_identifier.UUID(uuid=list(goal.bytes))


def _uuid(message: Any) -> UUID:
    return UUID(bytes=bytes(message.uuid))
