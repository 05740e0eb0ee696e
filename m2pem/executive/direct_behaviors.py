"""Behaviors that are commanded from outside of a mission: by an operator, or through a face.

Each is a run of its own with a mission of one task. So it is checked, journaled, kept apart from
others, stopped and taken up again as every run is.
"""

import asyncio
import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field

from m2pem.api.authoring import MissionFiles
from m2pem.api.runs import RunId
from m2pem.bpmn.one_task import is_one_task, one_task
from m2pem.engine.state import RunStatus
from m2pem.errors import BusyError, OperatorError
from m2pem.executive.handover import UNNAMED_OPERATOR
from m2pem.executive.run_starter import RunStarter
from m2pem.executive.runner import Runner
from m2pem.executive.supervisor import Supervisor
from m2pem.fleet.allocation import resources_of_mission
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.values import Value

RELEASED_WITHIN_S = 10.0
AGAIN_S = 0.1


@dataclass(slots=True)
class _Commanded:
    """A resource. `latest`: the number of the last request that was well. `turn`: a request waits
    for the one before."""

    latest: int = 0
    turn: asyncio.Lock = field(default_factory=asyncio.Lock)


class DirectBehaviors:
    """Implements `MissionControl.execute_behavior`."""

    def __init__(self, supervisor: Supervisor, starter: RunStarter) -> None:
        self._supervisor = supervisor
        self._starter = starter
        self._requests = itertools.count(1)
        self._commanded: dict[ResourceId, _Commanded] = {}

    async def execute(
        self, name: str, behavior: str, parameters: Mapping[str, Value], by: str
    ) -> RunId:
        """Begin a run with one behavior, in place of the one that `by` had asked for before.

        Raises:
            MissionError: the resource cannot do it, or a parameter is wrong.
            BusyError: a run, or another operator, has the resource.
            OperatorError: the fleet has no such resource, or a later request came first.
        """
        by = by or UNNAMED_OPERATOR
        resource = self._supervisor.handover.known(name)
        kind = BehaviorType.PAYLOAD if "/" in resource else BehaviorType.VEHICLE
        try:
            source, data = one_task(kind, resource, behavior, parameters)
        except ValueError as error:  # a control character
            raise OperatorError(f"{behavior} of {resource}: {error}") from error
        files = MissionFiles(f"{behavior} of {resource}", source)
        request = next(self._requests)
        loaded, process = await asyncio.to_thread(self._starter.load, files, None, data)
        commanded = self._commanded.setdefault(resource, _Commanded())
        commanded.latest = max(commanded.latest, request)
        async with commanded.turn:
            holder = self._supervisor.handover.taken.get(resource)
            if request == commanded.latest and holder in (None, by):
                await self._end_earlier(resource, by)
            own = holder == by
            if own:
                await self._given_up(resource)
            if request != commanded.latest:
                raise OperatorError(f"{behavior} of {resource}: a later request came before it")
            return await self._starter.begin_if_free(
                loaded, process, data, by, lent=(resource,) if own else (), direct=True
            )

    async def take(self, name: str, by: str) -> None:
        """Give a resource to an operator. What it was asked for outside of a mission is stopped:
        that is what the operator wants, and no failure.

        Raises:
            OperatorError: there is no such resource, an operator has it, or the journal has not
                written yet that the behavior was stopped; the operator has the resource then.
        """
        supervisor, by = self._supervisor, by or UNNAMED_OPERATOR
        runner = self._earlier(supervisor.handover.known(name))
        others = [each for each in supervisor.runners.values() if each is not runner]
        await supervisor.handover.take(name, by, others)
        if runner is not None and runner.run.state.status is not RunStatus.ENDED:
            asked = supervisor.emergency.stop(runner, by, f"{name} was taken by {by}")
            await supervisor.emergency.written("stop", {runner.id: asked})

    async def _end_earlier(self, resource: ResourceId, by: str) -> None:
        """End the behavior that goes on by an earlier request.

        Raises:
            BusyError: it is that of another operator.
        """
        runner = self._earlier(resource)
        if runner is None:
            return
        run, other = runner.id, runner.run.state.by
        if other != by:
            raise BusyError(
                f"{resource} does for {other} what it was asked for ({run}): "
                f"stop {run}, or take {resource} first",
                {str(resource): run},
            )
        if runner.run.state.status is not RunStatus.ENDED:
            reason = "replaced by a later request"
            asked = self._supervisor.emergency.stop(runner, by, reason)
            await self._supervisor.emergency.written("stop", {run: asked})
        await runner.done.wait()

    def _earlier(self, resource: ResourceId) -> Runner | None:
        """Return the run of an earlier request that goes on; also one from before a restart."""
        fleet = self._supervisor.fleet
        for runner in self._supervisor.runners.values():
            mission = runner.run.state.mission
            is_request = not runner.done.is_set() and is_one_task(mission)
            if is_request and resource in resources_of_mission(mission, fleet):
                return runner
        return None

    async def _given_up(self, resource: ResourceId) -> None:
        """Wait until a mission has released what an operator took from it, or for 10 s."""
        left_s = RELEASED_WITHIN_S
        while left_s > 0 and self._supervisor.availability.holder(resource) is not None:
            await self._supervisor.clock.sleep(AGAIN_S)
            left_s -= AGAIN_S
