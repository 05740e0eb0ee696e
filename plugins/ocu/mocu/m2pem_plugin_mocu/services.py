"""What operators may ask for: the services of docs/ros-operators.md."""

from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from typing import Any

from m2pem_interfaces import srv
from m2pem_plugin_ros import RosRuntime, messages, sendable

from m2pem.api import MissionControl
from m2pem.errors import M2pemError, OperatorError
from m2pem_plugin_mocu import incidents, requests
from m2pem_plugin_mocu.schedule import list_schedule
from m2pem_plugin_mocu.starting import start_mission
from m2pem_plugin_mocu.topics import Topics

Handler = Callable[[MissionControl, Any, Any], Awaitable[None]]

SEVERAL = 20
"""Requests of a service at once."""

STARTING = 2
"""Missions that are read at once: each takes a thread, of those that the journal needs, too."""

LISTING = 4
STOPPING = 100
"""STOP has places of its own: it waits for nothing."""


class ConcurrencyLimit:
    """Refuses requests beyond `at_once` at once, so that none wait behind one that hangs."""

    def __init__(self, at_once: int) -> None:
        self._at_once = at_once
        self.active = 0
        self.refused = 0

    @contextmanager
    def slot(self) -> Iterator[None]:
        """Count a request while it is handled.

        Raises:
            OperatorError: too many are being handled.
        """
        if self.active >= self._at_once:
            self.refused += 1
            raise OperatorError(
                f"{self.active} requests of this kind are being handled, and more are not taken "
                "at once: wait for their answers, then ask again"
            )
        self.active += 1
        try:
            yield
        finally:
            self.active -= 1


class Services:
    """Offers the services while the ROS runtime runs."""

    def __init__(self, ros: RosRuntime, control: MissionControl, topics: Topics) -> None:
        self._ros = ros
        self._control = control
        self._topics = topics
        self.limits: dict[str, ConcurrencyLimit] = {}
        self._offer(srv.StartMission, "start_mission", start_mission, STARTING)
        self._offer(srv.ListRuns, "list_runs", self._list_runs, LISTING)
        self._offer_stopping("control_run", srv.ControlRun, requests.control_run)
        self._offer_stopping("control_schedule", srv.ControlSchedule, requests.control_schedule)
        self._offer(srv.ListSchedule, "list_schedule", list_schedule, LISTING)
        for service_type, name, handler in (
            (srv.SendSignal, "send_signal", _operation("signal")),
            (srv.SendMessage, "send_message", _operation("message")),
            (srv.SetRoute, "set_route", requests.set_route),
            (srv.SetArea, "set_area", requests.set_area),
            (srv.SetWaypoints, "set_waypoints", requests.set_waypoints),
            (srv.TakeVehicle, "take_vehicle", _operation("take")),
            (srv.GiveBackVehicle, "give_back_vehicle", _operation("give_back", reason="")),
            (srv.AnswerPrompt, "answer_prompt", self._answer_prompt),
        ):
            self._offer(service_type, name, handler, SEVERAL)

    def _offer(self, service_type: Any, name: str, handler: Handler, at_once: int) -> None:
        limit = self.limits[name] = ConcurrencyLimit(at_once)

        async def serve(request: Any, response: Any) -> Any:
            return await self._handle(limit, handler, request, response)

        self._ros.serve(service_type, name, serve)

    def _offer_stopping(self, name: str, service_type: Any, handler: Handler) -> None:
        """Offer a service with verbs; those that only end or hold something have more places."""
        limit = self.limits[name] = ConcurrencyLimit(SEVERAL)
        stop = self.limits.setdefault("stop", ConcurrencyLimit(STOPPING))

        async def serve(request: Any, response: Any) -> Any:
            verbs = type(request)
            if service_type is srv.ControlRun and request.verb == verbs.STOP:
                return await self._handle(stop, requests.stop_run, request, response)
            holds = service_type is srv.ControlSchedule and request.verb in (
                verbs.HOLD,
                verbs.CANCEL,
            )
            return await self._handle(stop if holds else limit, handler, request, response)

        self._ros.serve(service_type, name, serve)

    async def _handle(
        self, limit: ConcurrencyLimit, handler: Handler, request: Any, response: Any
    ) -> Any:
        try:
            with limit.slot():
                await handler(self._control, request, response)
        except M2pemError as refusal:
            response.success = False
            response.message = sendable(str(refusal))
        else:
            response.success = True
        return response

    async def _answer_prompt(self, control: MissionControl, request: Any, response: Any) -> None:
        if incidents.is_incident(request.prompt):
            chosen = incidents.choice_of(request.decision)
            await requests.carry_out(
                control, "resolve_incident", request, incident=request.prompt, **chosen
            )
            return
        try:
            await requests.carry_out(control, "answer", request)
        except OperatorError as refusal:
            # A run that has ended since cannot say who was first.
            closed = self._topics.closed_prompts.get((request.run, request.prompt))
            if closed is None or not closed.decision or closed.by in str(refusal):
                raise
            raise OperatorError(
                f"prompt {closed.prompt} was answered by {closed.by}: {closed.decision}; {refusal}"
            ) from refusal

    async def _list_runs(self, control: MissionControl, request: Any, response: Any) -> None:
        for summary in await control.runs():
            if summary.status.ended and request.open_only:
                continue
            time_s = await self._topics.mission_time_s(summary)
            response.runs.append(messages.run_status(summary, time_s))


def _operation(name: str, **parameters: Any) -> Handler:
    async def handler(control: MissionControl, request: Any, _: Any) -> None:
        await requests.carry_out(control, name, request, **parameters)

    return handler
