"""Requests of operators, read as parameters of the operations of `m2pem.api.OPERATIONS`.

Each function raises `M2pemError` if the request is refused; its text is then the answer.
"""

from typing import Any

import msgspec
from m2pem_interfaces import srv
from m2pem_plugin_ros import asker, bounded, decode_data, named

from m2pem.api import MAX_NAME_CHARACTERS, MAX_REASON_CHARACTERS, OPERATIONS, MissionControl, Value
from m2pem.errors import OperatorError
from m2pem_plugin_mocu import geometries

NAMELESS = "mocu"
"""Who asked, where a request does not say."""

FIELDS = {"message": "message_id", "resource": "vehicle"}
"""The fields of requests that are not called as the parameters of operations are."""

EXAMPLES = {
    "run": "r1",
    "prompt": "p1",
    "signal": "the UUID or the name of a signal of the mission",
    "message_id": "the id of a message of the mission",
    "vehicle": "evsg1 or evsg2/ptz",
    "entry": "s1",
}
"""What a request may say in fields that it must fill."""

ALL_RUNS = "all"


async def carry_out(
    control: MissionControl, operation_name: str, request: Any, **parameters: Any
) -> Any:
    """Call an operation; returns its result. `parameters`: those that have been read already."""
    operation = OPERATIONS[operation_name]
    for parameter in msgspec.structs.fields(operation.parameters):
        if parameter.name not in parameters:
            field = FIELDS.get(parameter.name, parameter.name)
            value = _read(field, getattr(request, field), is_required=parameter.required)
            parameters[parameter.name] = value
    return await operation.call(control, operation.parameters(**parameters))


def _read(field: str, sent: Any, *, is_required: bool) -> Any:
    match field:
        case "by":
            return asker(sent, NAMELESS)
        case "data":
            return decode_data(sent)
        case "decision" | "reason":
            return bounded(sent, field, MAX_REASON_CHARACTERS)
        case _ if is_required:
            return named(sent, field, EXAMPLES[field])
        case _:
            return _optional(sent, field)


def _optional(sent: str, field: str) -> str | None:
    return bounded(sent.strip(), field, MAX_NAME_CHARACTERS) or None


async def control_run(control: MissionControl, request: Any, _: Any) -> None:
    """Pause or resume a run; `stop_run` stops one."""
    verbs = srv.ControlRun.Request
    operation = {verbs.PAUSE: "pause", verbs.RESUME: "resume"}.get(request.verb)
    if operation is None:
        raise OperatorError(
            f"verb {request.verb} is not known; give one of: STOP ({verbs.STOP}), "
            f"PAUSE ({verbs.PAUSE}), RESUME ({verbs.RESUME})"
        )
    await carry_out(control, operation, request)


async def stop_run(control: MissionControl, request: Any, _: Any) -> None:
    """Stop a run, or all of them: a ControlRun request."""
    await carry_out(control, "stop_all" if request.run == ALL_RUNS else "stop", request)


async def control_schedule(control: MissionControl, request: Any, response: Any) -> None:
    """Hold, release, cancel or start an entry of the schedule, or hold or release all of it."""
    verbs = srv.ControlSchedule.Request
    match request.verb:
        case verbs.HOLD:
            await carry_out(control, "hold_schedule", request)
        case verbs.RELEASE:
            await carry_out(control, "release_schedule", request)
        case verbs.CANCEL:
            await carry_out(control, "unschedule", request)
        case verbs.START:
            response.run = await carry_out(control, "start_scheduled", request)
        case _:
            raise OperatorError(
                f"verb {request.verb} is not known; give one of: HOLD ({verbs.HOLD}), RELEASE "
                f"({verbs.RELEASE}), CANCEL ({verbs.CANCEL}), START ({verbs.START})"
            )


async def set_route(control: MissionControl, request: Any, _: Any) -> None:
    """Hand over a route."""
    await _hand_over(control, request, geometries.route(request), "route_alpha")


async def set_area(control: MissionControl, request: Any, _: Any) -> None:
    """Hand over an area."""
    await _hand_over(control, request, geometries.area(request), "search_area")


async def set_waypoints(control: MissionControl, request: Any, _: Any) -> None:
    """Hand over waypoints."""
    await _hand_over(control, request, geometries.waypoints(request), "rally_point")


async def _hand_over(
    control: MissionControl, request: Any, geometry: dict[str, Value], example: str
) -> None:
    name, run = named(request.name, "name", example), _optional(request.run, "run")
    if run is not None:
        await control.mission_time_s(run)  # one that has ended would take it, and never use it
    await carry_out(control, "set_geometry", request, name=name, geometry=geometry, run=run)
