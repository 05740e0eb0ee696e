"""The goals of a simulated Nav2: its action servers, and the orders for the base."""

import asyncio
import logging
import math
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any
from uuid import UUID, uuid4

from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup

from m2pem.api import BehaviorRequest, BehaviorState, Point, ResolvedValue, ResourceId, Route, Value
from m2pem.api.latest_task import cancel_and_wait
from m2pem_plugin_ros.drivers.driver import Driver, DriverEvents, Order, Outcome
from m2pem_plugin_ros.frames import Origin, to_geodetic
from m2pem_plugin_ros.pose import Pose
from m2pem_plugin_ros.runtime import RosRuntime
from m2pem_plugin_ros.simulator.faults import Nav2Faults

LOOK_S = 0.02

logger = logging.getLogger(__name__)


class AbortedError(Exception):
    """The goal cannot be reached. `error_code` is one of the action."""

    def __init__(self, error_code: int = 0, error_msg: str = "") -> None:
        super().__init__(error_msg)
        self.error_code = error_code
        self.error_msg = error_msg


class GoalServer:
    """One action with one goal at a time. As in Nav2, a new goal preempts the old one, which is
    aborted without an error.

    `carry_out(handle)` returns the result, or raises `AbortedError`. It is cancelled with its goal.
    `is_active` tells whether goals are accepted.
    """

    def __init__(
        self,
        ros: RosRuntime,
        action: Any,
        name: str,
        carry_out: Callable[[Any], Awaitable[Any]],
        is_active: Callable[[], bool],
        faults: Nav2Faults,
    ) -> None:
        self.name = name
        self.action = action
        self._carry_out = carry_out
        self._is_active = is_active
        self._faults = faults
        self._current: Any = None
        ActionServer(
            ros.node,
            action,
            name,
            ros.coroutine(self._execute),
            goal_callback=self._answer,
            cancel_callback=self._answer_cancel,
            callback_group=ReentrantCallbackGroup(),
        )

    @property
    def busy(self) -> bool:
        return self._current is not None

    def drop(self) -> None:
        """Abort the current goal, as when Nav2 is deactivated."""
        self._current = None

    def _answer(self, _: Any) -> GoalResponse:
        accepts = self._is_active() and not self._faults.reject
        return GoalResponse.ACCEPT if accepts else GoalResponse.REJECT

    def _answer_cancel(self, _: Any) -> CancelResponse:
        return CancelResponse.REJECT if self._faults.hang else CancelResponse.ACCEPT

    async def _execute(self, handle: Any) -> Any:
        self._current = handle
        work = asyncio.ensure_future(self._do(handle))
        try:
            while not work.done() and not handle.is_cancel_requested and self._current is handle:
                await asyncio.wait([work], timeout=LOOK_S)
            return self._result(handle, work)
        finally:
            await cancel_and_wait(work)
            if self._current is handle:
                self._current = None

    async def _do(self, handle: Any) -> Any:
        if self._faults.hang:
            await asyncio.Event().wait()
        if self._faults.error_code:
            work = asyncio.ensure_future(self._carry_out(handle))
            try:
                await asyncio.wait([work], timeout=self._faults.abort_after_s)
            finally:
                await cancel_and_wait(work)
            raise AbortedError(self._faults.error_code, self._faults.error_msg)
        return await self._carry_out(handle)

    def _result(self, handle: Any, work: "asyncio.Future[Any]") -> Any:
        empty = self.action.Result()
        error = work.exception() if work.done() else None
        if work.done() and error is None:
            handle.succeed()
            return work.result()
        if handle.is_cancel_requested:
            handle.canceled()
            return empty
        handle.abort()
        if self._current is not handle:  # another goal has taken its place
            return empty
        if not isinstance(error, AbortedError):
            logger.error("%s failed", self.name, exc_info=error)
            return empty
        result = self.action.Result(error_code=error.error_code)
        if hasattr(result, "error_msg"):
            result.error_msg = error.error_msg
        return result


MakeDriver = Callable[[DriverEvents], Driver]

UNLIMITED_M_S = 100.0
"""Faster than any base, so that the driver uses its own bound."""


class BaseOrders:
    """Orders for the driver of the base, one at a time. `codes` maps error codes of the driver to
    those of Nav2."""

    def __init__(self, make_driver: MakeDriver, vehicle: str, origin: Origin) -> None:
        self.driver = make_driver(self)
        self._vehicle = ResourceId(vehicle)
        self._origin = origin
        self._waiting: dict[UUID, asyncio.Future[Outcome]] = {}
        self._run = uuid4()
        self._limit_m_s: float | None = None

    # --- what the driver tells ------------------------------------------------------------------

    def alive(self) -> None: ...

    def progress(self, goal: UUID) -> None: ...

    def remains(self, goal: UUID, remaining: Mapping[str, Value]) -> None: ...

    def superseded(self, run: str, newest: int) -> None: ...

    def ended(self, goal: UUID, outcome: Outcome) -> None:
        waiting = self._waiting.get(goal)
        if waiting is not None and not waiting.done():
            waiting.set_result(outcome)

    # --- what the base is to do -----------------------------------------------------------------

    def limit_speed(self, speed_m_s: float) -> None:
        """Set the highest speed; 0 is that of the base."""
        self._limit_m_s = speed_m_s or None
        for goal in self._waiting:
            self.driver.adjust(goal, {"speed": self._limit_m_s or UNLIMITED_M_S})

    async def go_to(self, pose: Pose, codes: Mapping[str, int]) -> None:
        """Drive to a pose. A base that cannot turn on the spot may arrive with another heading.

        Raises:
            AbortedError: it cannot be reached.
        """
        target = self._point(pose)
        turned = self._request("goto", target=target, heading=math.pi / 2 - pose.yaw_rad)
        if self.driver.refusal(turned):
            turned = self._request("goto", target=target)
        await self._do(turned, codes)

    async def go_along(self, poses: Sequence[Pose], codes: Mapping[str, int]) -> None:
        """Drive through poses to the last one.

        Raises:
            AbortedError: they cannot be reached.
        """
        places = tuple(self._point(pose).position for pose in poses)
        await self._do(self._request("single_vehicle_routing", route=Route(places)), codes)

    async def back_up(self, distance_m: float, speed_m_s: float, codes: Mapping[str, int]) -> None:
        """Drive straight backwards.

        Raises:
            AbortedError: it cannot.
        """
        request = self._request("reverse", distance=distance_m, speed=speed_m_s)
        await self._do(request, codes, limited=False)

    async def _do(
        self, request: BehaviorRequest, codes: Mapping[str, int], *, limited: bool = True
    ) -> None:
        if limited and self._limit_m_s is not None:
            parameters = {**request.parameters, "speed": self._limit_m_s}
            request = replace(request, parameters=parameters)
        if reason := self.driver.refusal(request):
            raise AbortedError(codes[""], reason)
        goal = uuid4()
        outcome: asyncio.Future[Outcome] = asyncio.get_running_loop().create_future()
        # The driver tells no more of what another order takes the place of.
        for before in self._waiting.values():
            if not before.done():
                before.set_result(Outcome(BehaviorState.CANCELLED))
        self._waiting[goal] = outcome
        try:
            self.driver.begin(Order(request, goal, self._run))
            ended = await outcome
        finally:
            del self._waiting[goal]
            if not outcome.done() or outcome.cancelled():
                self._stop_unless_replaced(goal)
        if ended.state is not BehaviorState.SUCCEEDED:
            raise AbortedError(codes.get(ended.code, codes[""]), ended.reason)

    def _stop_unless_replaced(self, goal: UUID) -> None:
        """Stop the base, unless another goal takes over the moving base."""
        if not self._waiting:
            asyncio.get_running_loop().call_soon(self._stop_if_idle, goal)

    def _stop_if_idle(self, goal: UUID) -> None:
        if not self._waiting:
            self.driver.end(goal)

    def _request(self, behavior: str, **parameters: ResolvedValue) -> BehaviorRequest:
        return BehaviorRequest(f"nav2.{behavior}", 1, behavior, parameters, (self._vehicle,))

    def _point(self, pose: Pose) -> Point:
        position = to_geodetic(pose.east_m, pose.north_m, 0.0, self._origin)
        return Point((position.latitude_deg, position.longitude_deg, None))
