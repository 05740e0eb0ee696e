"""Missions as the action m2pem_interfaces/ExecuteMission."""

import asyncio
import math
from typing import Any

from m2pem_interfaces.action import ExecuteMission

from m2pem.api import Follower, MissionControl, RunId, RunStatus, RunSummary, StampedRecord
from m2pem.api import records as r
from m2pem.errors import M2pemError, MissionError, OperatorError
from m2pem_plugin_ros.face.goals import Goal, GoalServer, ended, refusal, stop_when_cancelled
from m2pem_plugin_ros.face.run_watcher import RunWatcher
from m2pem_plugin_ros.face.settings import Options
from m2pem_plugin_ros.interfaces import messages
from m2pem_plugin_ros.interfaces.data_values import URL_CHARACTERS, decode_data, mission_of
from m2pem_plugin_ros.interfaces.texts import asker, bounded, sendable
from m2pem_plugin_ros.runtime import RosRuntime

MOST_FINDINGS = 200

FEEDBACK_AFTER_S = 0.1
FEEDBACK_EVERY_S = 1.0
"""Feedback is published so long after a change, and so long after the last one without a change."""

NO_MISSIONS = (
    "the fleet does not let ROS start missions, which command any vehicle: write in the fleet file "
    "faces: {ros: {commands: all}}"
)


class MissionAction:
    """Serves the action `~/execute_mission`."""

    def __init__(
        self,
        ros: RosRuntime,
        control: MissionControl,
        follower: Follower,
        watcher: RunWatcher,
        options: Options,
    ) -> None:
        self._control = control
        self._follower = follower
        self._watcher = watcher
        self._options = options
        self._admission = asyncio.Semaphore(1)
        self._prefix = f"ros {ros.node.get_fully_qualified_name()}"
        self._server = GoalServer(
            ros, ros.node, ExecuteMission, "~/execute_mission", self._carry_out
        )

    async def _carry_out(self, goal: Goal) -> Any:
        try:
            run, by = await self._begin(goal)
        except M2pemError as error:
            goal.end(succeeded=False, cancelled=await goal.is_canceling())
            return _refused(error)
        stopping = asyncio.create_task(stop_when_cancelled(self._control, goal, run, by))
        following = asyncio.create_task(self._follow(goal, run))
        try:
            summary = await self._control.wait(run)
            code, reason = await self._error_of(summary)
        finally:
            await ended(stopping)
            await ended(following)
        goal.end(
            succeeded=summary.status in (RunStatus.COMPLETED, RunStatus.TERMINATED),
            cancelled=summary.status is RunStatus.STOPPED and await goal.is_canceling(),
        )
        return ExecuteMission.Result(
            run=run,
            outcome=messages.run_status(summary).status,
            code=sendable(code),
            reason=sendable(reason),
        )

    async def _begin(self, goal: Goal) -> tuple[RunId, str]:
        """Start a mission; returns the run, and in whose name.

        Raises:
            M2pemError: it is refused.
        """
        request = goal.request
        if not self._options.missions:
            raise OperatorError(NO_MISSIONS)
        mission = mission_of(request)
        process = bounded(request.process.strip(), "process", URL_CHARACTERS) or None
        data = decode_data(request.data)
        name = asker(request.by, "")
        by = f"{self._prefix} {name}" if name else goal.client
        async with self._admission:
            goal.check_not_cancelled()
            return await self._control.start(mission, process=process, data=data, by=by), by

    async def _error_of(self, summary: RunSummary) -> tuple[str, str]:
        """Return the code and the reason of a run that failed; the detail of any other."""
        if summary.status is not RunStatus.FAILED:
            return "", summary.detail
        code, last = "", 0
        while page := await self._control.records(summary.run, last):
            last = page[-1].seq
            code = _uncaught(page) or code
        return code, summary.detail

    async def _follow(self, goal: Goal, run: RunId) -> None:
        """Publish feedback after changes, and each second."""
        with self._watcher.watch(run) as coming:
            while True:
                await self._publish(goal, run)
                await asyncio.sleep(FEEDBACK_AFTER_S)
                coming.clear()
                try:
                    async with asyncio.timeout(FEEDBACK_EVERY_S - FEEDBACK_AFTER_S):
                        await coming.get()
                except TimeoutError:
                    continue

    async def _publish(self, goal: Goal, run: RunId) -> None:
        view = self._follower.views.get(run)
        if view is None:
            return
        try:
            time_s = await self._control.mission_time_s(run)
        except M2pemError:  # it has just ended
            time_s = math.nan
        completed, total = view.progress()
        prompts = [each for each in self._control.prompts() if each.run == run]
        goal.publish(
            ExecuteMission.Feedback(
                status=messages.run_status(view.summary, time_s),
                elements=messages.active_elements([view], 0).elements,
                completed=completed,
                total=total,
                prompts=[messages.open_prompt(each, 0) for each in prompts],
            )
        )


def _uncaught(page: Any) -> str:
    codes = [
        each.record.code
        for each in page
        if isinstance(each, StampedRecord)
        and isinstance(each.record, r.ErrorThrown)
        and not each.record.caught_by
    ]
    return codes[-1] if codes else ""


def _refused(error: M2pemError) -> Any:
    code, reason = refusal(error)
    result = ExecuteMission.Result(code=code, reason=reason)
    if isinstance(error, MissionError):
        result.findings = [messages.finding(each) for each in error.findings[:MOST_FINDINGS]]
    return result
