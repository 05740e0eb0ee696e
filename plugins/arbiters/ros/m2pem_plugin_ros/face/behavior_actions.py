"""Every behavior of every vehicle and payload as the action m2pem_interfaces/ExecuteBehavior."""

import asyncio
import json
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from m2pem_interfaces.action import ExecuteBehavior

from m2pem.api import (
    BehaviorSpec,
    BehaviorState,
    MissionControl,
    ParameterKind,
    ResourceId,
    RunId,
    RunStatus,
    RunSummary,
    StampedRecord,
    Value,
)
from m2pem.api import records as r
from m2pem.errors import M2pemError, OperatorError
from m2pem_plugin_ros.face.goals import (
    LONGEST_REASON,
    STOPPED,
    Goal,
    GoalServer,
    ended,
    refusal,
    stop_when_cancelled,
)
from m2pem_plugin_ros.face.run_watcher import RunWatcher
from m2pem_plugin_ros.face.settings import Options
from m2pem_plugin_ros.interfaces.behavior_command import Verb
from m2pem_plugin_ros.interfaces.behavior_status import Status, write_status
from m2pem_plugin_ros.interfaces.data_values import decode_data
from m2pem_plugin_ros.interfaces.texts import bounded, named, sendable
from m2pem_plugin_ros.runtime import RosRuntime

ADMITTED_AT_ONCE = 2
"""Goals that are checked at once: each takes a thread, of those that the journal needs, too."""

LONGEST_NAME = 200
PAGE = 1000

_ANGLES = (ParameterKind.ANGLE, ParameterKind.ANGULAR_SPEED)
_UNITS = {ParameterKind.ANGLE: "rad", ParameterKind.ANGULAR_SPEED: "rad/s"}


class BehaviorActions:
    """Serves the action of each vehicle and payload."""

    def __init__(
        self, ros: RosRuntime, control: MissionControl, watcher: RunWatcher, options: Options
    ) -> None:
        self._ros = ros
        self._control = control
        self._watcher = watcher
        self._options = options
        self._catalogue = control.catalogue()
        self._admission = asyncio.Semaphore(ADMITTED_AT_ONCE)
        self._servers: list[GoalServer] = []
        self._prefix = f"ros {ros.node.get_fully_qualified_name()}"
        """Of the names of all who command through this face."""

    def serve(self, resource: ResourceId, name: str) -> None:
        """Serve the action of a vehicle or payload under its full name."""

        async def carry_out(goal: Goal) -> Any:
            return await self._carry_out(resource, goal)

        node = self._ros.node
        self._servers.append(GoalServer(self._ros, node, ExecuteBehavior, name, carry_out))

    async def _carry_out(self, resource: ResourceId, goal: Goal) -> Any:
        id_ = sendable(goal.request.command.id)[:LONGEST_NAME]
        try:
            spec, run, by = await self._begin(resource, goal)
        except M2pemError as error:
            code, reason = refusal(error)
            state = BehaviorState.REJECTED
            if cancelled := await goal.is_canceling():
                code, state = "", BehaviorState.CANCELLED
            goal.end(succeeded=False, cancelled=cancelled)
            return _result(Status(id_, 1, state, code, reason))
        stopping = asyncio.create_task(stop_when_cancelled(self._control, goal, run, by))
        following = asyncio.create_task(self._follow(goal, run, id_))
        try:
            summary = await self._control.wait(run)
            records = await self._records(run)
        finally:
            await ended(stopping)
            await ended(following)
        cancelled = summary.status is RunStatus.STOPPED and await goal.is_canceling()
        status = _last_status(id_, summary, records, spec.writes, cancelled=cancelled)
        goal.end(succeeded=status.state is BehaviorState.SUCCEEDED, cancelled=cancelled)
        return _result(status)

    # --- how it begins --------------------------------------------------------------------------

    async def _begin(self, resource: ResourceId, goal: Goal) -> tuple[BehaviorSpec, RunId, str]:
        """Begin a run; returns the behavior, the run, and in whose name it is.

        Raises:
            M2pemError: it is refused; the text says why.
        """
        command = goal.request.command
        if not self._options.takes_commands(resource):
            raise OperatorError(why_no_commands(resource))
        if command.verb != Verb.START:
            raise OperatorError(f"the verb of a goal is {command.verb}; it must be START (1)")
        behavior = named(command.behavior, "behavior", "goto")
        spec = self._spec(resource, behavior)
        raw = decode_data(command.parameters, "parameters")
        parameters = {name: _as_in_missions(spec, name, value) for name, value in raw.items()}
        self._check_allocation(resource, command)
        async with self._admission:
            by = await self._asker(resource, goal)
            goal.check_not_cancelled()
            run = await self._control.execute_behavior(resource, behavior, parameters, by=by)
        return spec, run, by

    def _spec(self, resource: ResourceId, behavior: str) -> BehaviorSpec:
        specs = {spec.name: spec for spec in self._catalogue.get(resource, ())}
        if behavior not in specs:
            raise OperatorError(
                f"{resource} has no behavior '{behavior}'; it has {', '.join(specs) or 'none'}"
            )
        return specs[behavior]

    def _check_allocation(self, resource: ResourceId, command: Any) -> None:
        for allocation in command.allocation:
            for each in allocation.resources:
                if each != resource:
                    raise OperatorError(
                        f"this action is that of {resource}, but the goal is for "
                        f"{bounded(each, 'a resource', LONGEST_NAME)}"
                    )

    async def _asker(self, resource: ResourceId, goal: Goal) -> str:
        """Return in whose name a goal commands: who has taken the resource through this face may,
        and whoever sends goals then does it for them. ROS does not say who sends a goal."""
        holder = (await self._control.holders()).get(resource, "")
        return holder if holder.startswith(f"{self._prefix} ") else goal.client

    # --- how it goes on -------------------------------------------------------------------------

    async def _follow(self, goal: Goal, run: RunId, id_: str) -> None:
        """Publish each status of the behavior as feedback."""
        with self._watcher.watch(run) as coming:
            last, number = 0, 0
            for stamped in await self._control.records(run, limit=PAGE):
                last = stamped.seq
                number = self._publish(goal, id_, number, stamped)
            while True:
                new = await coming.get()
                if new is not None and new.seq > last:
                    last = new.seq
                    number = self._publish(goal, id_, number, new)

    def _publish(self, goal: Goal, id_: str, number: int, stamped: StampedRecord) -> int:
        record = stamped.record
        if not isinstance(record, r.BehaviorProgressed) or record.state.terminal:
            return number
        status = Status(
            id_,
            number + 1,
            record.state,
            native_ref=sendable(record.native_ref or ""),
            remaining=record.remaining,
        )
        goal.publish(ExecuteBehavior.Feedback(status=write_status(status)))
        return number + 1

    async def _records(self, run: RunId) -> list[r.Record]:
        """Return all records of a run."""
        found: list[StampedRecord] = []
        while page := await self._control.records(run, found[-1].seq if found else 0, PAGE):
            found += page
        return [each.record for each in found]


def why_no_commands(resource: str) -> str:
    """Return why a vehicle takes no commands, and what is to be set."""
    vehicle = resource.partition("/")[0]
    return (
        f"the fleet does not let ROS command {vehicle}: write in the fleet file "
        f"faces: {{ros: {{commands: [{vehicle}]}}}}, or commands: all"
    )


def _as_in_missions(spec: BehaviorSpec, name: str, value: Value) -> Value:
    """Return a parameter as a mission file has it: goals have angles in radians, and a vehicle as
    {"vehicle": NAME}, also where a mission would name it."""
    parameter = spec.by_name.get(name)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if is_number and parameter is not None and parameter.kind in _ANGLES:
        return f"{value!r} {_UNITS[parameter.kind]}"
    if isinstance(value, dict) and set(value) == {"vehicle"}:
        return value["vehicle"]
    return value


def _last_status(
    id_: str,
    run: RunSummary,
    records: Sequence[r.Record],
    writes: Collection[str],
    *,
    cancelled: bool,
) -> Status:
    """Return how a behavior ended, which `writes` data of these names. As ExecuteBehavior.action
    says, CANCELLED is only what its client has cancelled."""
    code = reason = ""
    number, outputs, rejected = 1, dict[str, Value](), False
    for record in records:
        match record:
            case r.BehaviorProgressed():
                number += 1
            case r.BehaviorEnded(state=last, code=failed, reason=why) if failed:
                code, reason, rejected = failed, why, last is BehaviorState.REJECTED
            case r.ErrorThrown(code=thrown, reason=why):
                code, reason = thrown, why
            case r.DataWritten(key=key, value=value) if key in writes:
                outputs[key] = value
    if run.status is RunStatus.COMPLETED:
        state, code = BehaviorState.SUCCEEDED, ""
    elif cancelled:
        state, code = BehaviorState.CANCELLED, ""
    else:
        stopped = run.status is RunStatus.STOPPED
        state = BehaviorState.REJECTED if rejected and not stopped else BehaviorState.FAILED
        code = STOPPED if stopped else code
    text = sendable(reason or run.detail)[:LONGEST_REASON]
    return Status(id_, number, state, sendable(code), text, outputs=_sendable(outputs))


def _sendable(outputs: Mapping[str, Value]) -> dict[str, Value]:
    """Leave out what no JSON can say, such as NaN."""
    kept = {}
    for name, value in outputs.items():
        try:
            json.dumps(value, allow_nan=False)
        except (ValueError, TypeError, RecursionError):
            continue
        kept[sendable(name)] = value
    return kept


def _result(status: Status) -> Any:
    return ExecuteBehavior.Result(status=write_status(status))
