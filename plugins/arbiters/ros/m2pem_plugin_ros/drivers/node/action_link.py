"""An m2pem node that is commanded by the action `execute_behavior`."""

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
from m2pem_plugin_ros.drivers.driver import Order, Outcome, Seat
from m2pem_plugin_ros.drivers.node.link import (
    LOOK_WITHIN_S,
    REMEMBERED,
    RESTARTED,
    STILL_S,
    Insisting,
)
from m2pem_plugin_ros.interfaces.behavior_command import start_command
from m2pem_plugin_ros.interfaces.behavior_status import ENDS, read_status
from m2pem_plugin_ros.interfaces.key_values import WireError
from m2pem_plugin_ros.log_throttle import Complaints
from m2pem_plugin_ros.runtime import RosRuntime, RosTimeoutError, qos

CALL_S = 2.0
"""Of real time, for a service that answers at once."""

ATTEMPTS = 5
"""So many unanswered goals, while the node is heard, and it will not do it."""

CANCELS = action_services.CancelGoal.Response.ERROR_NONE

_ENDS = {
    action.GoalStatus.STATUS_SUCCEEDED: BehaviorState.SUCCEEDED,
    action.GoalStatus.STATUS_CANCELED: BehaviorState.CANCELLED,
    action.GoalStatus.STATUS_ABORTED: BehaviorState.FAILED,
}


@dataclass(slots=True)
class _Pursued:
    """A goal. `heard`: the node has it. `answered`: whether the node has it is known. `news`: set
    when it was shown to have ended, or when it should be asked for."""

    goal: UUID
    order: Order | None
    heard: bool = False
    answered: bool = False
    cancelled: bool = False
    over: bool = False
    number: int = 0
    shown_us: int | None = None
    news: asyncio.Event = field(default_factory=asyncio.Event)


class ByAction:
    """Implements `Link`."""

    def __init__(self, seat: Seat, name: str, complaints: Complaints) -> None:
        self._seat = seat
        self._complaints = complaints
        self._client = GoalClient(seat.ros, name, Listeners(self._status, self._feedback))
        self._pauses = Insisting(seat.context.clock)
        self._current: _Pursued | None = None
        self._pursued: dict[UUID, _Pursued] = {}
        self._shown: dict[UUID, int] = {}
        self._goals_shown = asyncio.Event()
        self._ended: dict[UUID, Outcome] = {}
        self._tasks: set[asyncio.Task[None]] = set()
        self._node_is_heard = False

    @property
    def order(self) -> Order | None:
        """What the vehicle is to do now."""
        return self._current.order if self._current is not None else None

    # --- what is asked of the vehicle -----------------------------------------------------------

    def begin(self, order: Order) -> None:
        """Send the goal, until it is answered."""
        self._let_go()
        pursued = self._pursue(order.goal, order)
        self._current = pursued
        self._node_is_heard = False
        self._run(self._give(pursued, order))

    def end(self, goal: UUID) -> None:
        """Cancel the goal, until it has ended."""
        if (outcome := self._ended.get(goal)) is not None:
            self._seat.told.ended(goal, outcome)
            return
        pursued = self._pursued.get(goal)
        if pursued is None:
            pursued = self._pursue(goal, None)
            pursued.answered = True  # not given by us; if it is unknown, that is its end
            self._run(self._attend(pursued))
        if not pursued.cancelled:
            pursued.cancelled = True
            self._run(self._cancel(pursued))

    async def look(self, order: Order) -> Outcome:
        """What the topic of goals shows, or else what the node answers."""
        create = asyncio.get_running_loop().create_task
        asked = create(self._client.result(order.goal, LOOK_WITHIN_S))
        shown = create(self._shown_active(order.goal))  # of such a goal, no result comes
        try:
            await asyncio.wait([asked, shown], return_when=asyncio.FIRST_COMPLETED)
            if not asked.done():
                self._adopt(order)
                return Outcome(BehaviorState.RUNNING)
            number, status = asked.result()
        except RosTimeoutError:
            reason = f"the vehicle's node did not answer within {LOOK_WITHIN_S:g} s"
            return Outcome(BehaviorState.UNKNOWN, reason=reason)
        finally:
            for task in (asked, shown):
                task.cancel()
            await asyncio.gather(asked, shown, return_exceptions=True)
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
            pursued = self._current = self._pursue(order.goal, order)
            pursued.heard = pursued.answered = True
            self._run(self._attend(pursued))

    def forget(self) -> None:
        """Nothing is asked any more."""
        for pursued in self._pursued.values():
            pursued.over = True
        for task in self._tasks:
            task.cancel()
        self._pursued.clear()
        self._current = None

    async def close(self) -> None:
        """Ask nothing more."""
        tasks = list(self._tasks)
        self.forget()
        await asyncio.gather(*tasks, return_exceptions=True)

    # --- what the vehicle says ------------------------------------------------------------------

    def vehicle_does(self, behavior: str) -> None:
        """If it is not what it should do, ask: a node may have been restarted."""
        self._node_is_heard = True
        for each in self._pursued.values():
            if behavior == str(each.goal):
                each.shown_us = self._seat.context.clock.now_us()
        pursued = self._current
        if pursued is None:
            return
        if behavior == str(pursued.goal):
            pursued.heard = True
            self._seat.told.progress(pursued.goal)
        elif pursued.heard:
            pursued.news.set()

    def _status(self, goal: UUID, number: int) -> None:
        self._shown.pop(goal, None)
        self._shown[goal] = number
        if len(self._shown) > REMEMBERED:
            del self._shown[next(iter(self._shown))]
        self._goals_shown.set()
        pursued = self._pursued.get(goal)
        if pursued is not None:
            pursued.heard = True
            if number not in ACTIVE:
                pursued.news.set()

    def _feedback(self, goal: UUID, message: Any) -> None:
        pursued = self._pursued.get(goal)
        if pursued is None:
            return
        self._seat.told.heard()
        try:
            status = read_status(message)
        except WireError as error:
            self._complaints.add("feedback that cannot be", str(error))
            return
        if status.id != str(goal) or status.number <= pursued.number:
            return
        pursued.number = status.number
        if status.state is BehaviorState.RUNNING:
            self._seat.told.progress(goal)

    # --- one goal -------------------------------------------------------------------------------

    async def _give(self, pursued: _Pursued, order: Order) -> None:
        command = start_command(order, self._seat.context.clock.now_us())
        attempts = 0
        while not (pursued.heard or pursued.over):
            if pursued.cancelled and attempts:
                break  # it may have arrived; `_cancel` finds out
            try:
                accepted = await self._client.send(pursued.goal, command, CALL_S)
            except RosTimeoutError:
                attempts += self._node_is_heard
                if attempts >= ATTEMPTS and not pursued.cancelled:
                    self._give_up(pursued)
                    return
                continue
            if accepted or await self._is_known(pursued.goal):
                pursued.heard = True
            else:
                reason = "the vehicle's node refused the goal"
                self._over(pursued, Outcome(BehaviorState.REJECTED, "REJECTED", reason))
        pursued.answered = True
        await self._attend(pursued)

    def _give_up(self, pursued: _Pursued) -> None:
        reason = "the vehicle's node is there, and does not answer to goals"
        self._over(pursued, Outcome(BehaviorState.FAILED, "TIMEOUT", reason))

    async def _is_known(self, goal: UUID) -> bool:
        """A goal that was sent again is refused, as it is there already."""
        if goal in self._shown:
            return True
        try:
            number, _ = await self._client.result(goal, CALL_S)
        except RosTimeoutError:
            return True  # it goes on: of others, the answer would have come at once
        return bool(number != action.GoalStatus.STATUS_UNKNOWN)

    async def _attend(self, pursued: _Pursued) -> None:
        """Wait until there are news, and ask."""
        while not pursued.over:
            await pursued.news.wait()
            pursued.news.clear()
            try:
                number, status = await self._client.result(pursued.goal, CALL_S)
            except RosTimeoutError:
                if self._shown.get(pursued.goal, action.GoalStatus.STATUS_EXECUTING) not in ACTIVE:
                    pursued.news.set()  # it has ended, and how is not known yet
                continue
            if number != action.GoalStatus.STATUS_UNKNOWN:
                self._over(pursued, self._outcome(pursued.goal, number, status))
            elif self._goes_on(pursued):
                cause = "another node in its namespace knows nothing of what it does"
                self._complaints.add(cause, str(pursued.goal))
                await self._pauses.pause()
                pursued.news.set()
            elif pursued.cancelled:
                self._over(pursued, Outcome(BehaviorState.CANCELLED, reason=RESTARTED))
            else:
                self._over(pursued, Outcome(BehaviorState.LOST, "LINK_LOST", RESTARTED))

    def _goes_on(self, pursued: _Pursued) -> bool:
        """Whether vehicle_status said so just now: then it is another node that does not know."""
        if pursued.shown_us is None:
            return False
        return self._seat.context.clock.now_us() - pursued.shown_us < STILL_S * 1e6

    async def _cancel(self, pursued: _Pursued) -> None:
        while not pursued.over:
            try:
                code = await self._client.cancel(pursued.goal, CALL_S)
            except RosTimeoutError:
                continue
            if code != CANCELS and pursued.answered:
                pursued.news.set()  # it has ended, or was never there
            await self._pauses.pause()

    # --- inside ---------------------------------------------------------------------------------

    @property
    def _name(self) -> str:
        return self._seat.connection.resource

    def _pursue(self, goal: UUID, order: Order | None) -> _Pursued:
        self._ended.pop(goal, None)
        pursued = self._pursued[goal] = _Pursued(goal, order)
        return pursued

    def _let_go(self) -> None:
        """What it did is not told of any more: another takes over."""
        for goal, pursued in self._pursued.items():
            pursued.over = True
            self._remember(goal, Outcome(BehaviorState.CANCELLED, reason="another took over"))
        for task in self._tasks:
            task.cancel()
        self._pursued.clear()
        self._current = None

    def _over(self, pursued: _Pursued, outcome: Outcome) -> None:
        if pursued.over:
            return
        pursued.over = True
        pursued.news.set()
        self._pursued.pop(pursued.goal, None)
        if self._current is pursued:
            self._current = None
        self._remember(pursued.goal, outcome)
        self._seat.told.ended(pursued.goal, outcome)

    def _remember(self, goal: UUID, outcome: Outcome) -> None:
        self._ended[goal] = outcome
        if len(self._ended) > REMEMBERED:
            del self._ended[next(iter(self._ended))]

    def _outcome(self, goal: UUID, number: int, message: Any) -> Outcome:
        """What the status says, if it is one; else what the action says."""
        try:
            status = read_status(message)
            if status.id == str(goal) and status.state in ENDS:
                return Outcome(status.state, status.code, status.reason, status.outputs)
            wrong = f"the result of {goal} is a status of {status.id} that is {status.state}"
        except WireError as error:
            wrong = str(error)
        self._complaints.add("a result that cannot be", wrong)
        return Outcome(_ENDS.get(number, BehaviorState.FAILED), reason=wrong)

    def _run(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._done)

    def _done(self, task: asyncio.Task[None]) -> None:
        self._tasks.discard(task)
        if not task.cancelled() and (error := task.exception()) is not None:
            self._complaints.add("m2pem is wrong", repr(error))


Status = action.GoalStatus

ACTIVE = frozenset({Status.STATUS_ACCEPTED, Status.STATUS_EXECUTING, Status.STATUS_CANCELING})


@dataclass(frozen=True, slots=True)
class Listeners:
    """Called on the event loop: `status` with a goal and its number of GoalStatus, `feedback`
    with a goal and the feedback."""

    status: Callable[[UUID, int], None]
    feedback: Callable[[UUID, Any], None]


class GoalClient:
    """A client of the action `execute_behavior` in which goals are their UUIDs."""

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
            self._hear_statuses,
            qos.STATUS,
        )
        ros.subscribe(
            parts.FeedbackMessage, f"{name}/_action/feedback", self._hear_feedback, qos.COMMANDS
        )

    async def send(self, goal: UUID, command: Any, timeout_s: float) -> bool:
        """Whether the goal was accepted. One that is known already is not, too.

        Raises:
            RosTimeoutError: no answer in time; it may have arrived all the same.
        """
        request = ExecuteBehavior.Impl.SendGoalService.Request(
            goal_id=_message(goal), goal=ExecuteBehavior.Goal(command=command)
        )
        return bool((await self._ros.call(self._send, request, timeout_s)).accepted)

    async def result(self, goal: UUID, timeout_s: float) -> tuple[int, Any]:
        """The number of its GoalStatus, and the status of the behavior. It is answered when the
        goal has ended, or at once with STATUS_UNKNOWN.

        Raises:
            RosTimeoutError: no answer in time: it goes on, or nobody is there.
        """
        request = ExecuteBehavior.Impl.GetResultService.Request(goal_id=_message(goal))
        response = await self._ros.call(self._result, request, timeout_s)
        return response.status, response.result.status

    async def cancel(self, goal: UUID, timeout_s: float) -> int:
        """The return code of CancelGoal.

        Raises:
            RosTimeoutError: no answer in time.
        """
        request = action_services.CancelGoal.Request()
        request.goal_info.goal_id = _message(goal)
        response = await self._ros.call(self._cancel, request, timeout_s)
        return int(response.return_code)

    def _hear_statuses(self, message: Any) -> None:
        for status in message.status_list:
            self._listeners.status(_uuid(status.goal_info.goal_id), status.status)

    def _hear_feedback(self, message: Any) -> None:
        self._listeners.feedback(_uuid(message.goal_id), message.feedback.status)


def _message(goal: UUID) -> Any:
    return unique_identifier.UUID(uuid=list(goal.bytes))


def _uuid(message: Any) -> UUID:
    return UUID(bytes=bytes(message.uuid))
