"""The services that steer runs and vehicles, as calls of MissionControl.

Each fills its response, or raises `M2pemError`, whose text is then the refusal.
"""

from typing import Any

from m2pem_interfaces import srv

from m2pem.api import MissionControl, Value
from m2pem.errors import OperatorError
from m2pem_plugin_mocu import geometries
from m2pem_plugin_mocu.texts import NAME_CHARACTERS, REASON_CHARACTERS, asker, bounded, named
from m2pem_plugin_mocu.values import decode_data

RUN = "r1"
ALL_RUNS = "all"


async def control_run(control: MissionControl, request: Any, _: Any) -> None:
    """Pause or resume a run; `stop_run` stops one."""
    verbs = srv.ControlRun.Request
    run, by = named(request.run, "run", RUN), asker(request.by)
    match request.verb:
        case verbs.PAUSE:
            await control.pause(run, by=by)
        case verbs.RESUME:
            await control.resume(run, by=by)
        case _:
            raise OperatorError(
                f"verb {request.verb} is not known; give one of: STOP ({verbs.STOP}), "
                f"PAUSE ({verbs.PAUSE}), RESUME ({verbs.RESUME})"
            )


async def stop_run(control: MissionControl, request: Any, _: Any) -> None:
    """Stop a run, or all of them: a ControlRun request with this verb."""
    run, by = named(request.run, "run", RUN), asker(request.by)
    reason = bounded(request.reason, "reason", REASON_CHARACTERS)
    if run == ALL_RUNS:
        await control.stop_all(by=by, reason=reason)
    else:
        await control.stop(run, by=by, reason=reason)


async def send_signal(control: MissionControl, request: Any, _: Any) -> None:
    """Throw a signal, by its id or name, into one run or all."""
    signal = named(request.signal, "signal", "the UUID or the name of a signal of the mission")
    run = _run_or_all(request.run)
    data, by = decode_data(request.data), asker(request.by)
    await control.signal(signal, run=run, data=data, by=by)


async def send_message(control: MissionControl, request: Any, _: Any) -> None:
    """Send a message, by its id, to a run."""
    message = named(request.message_id, "message_id", "the id of a message of the mission")
    run = named(request.run, "run", RUN)
    data, by = decode_data(request.data), asker(request.by)
    await control.message(message, run=run, data=data, by=by)


async def answer_prompt(control: MissionControl, request: Any, _: Any) -> None:
    """Answer a prompt; a late one is refused, and told who was first."""
    run = named(request.run, "run", RUN)
    prompt = named(request.prompt, "prompt", "p1")
    decision = bounded(request.decision, "decision", REASON_CHARACTERS)
    await control.answer(run, prompt, decision, by=asker(request.by))


async def set_route(control: MissionControl, request: Any, _: Any) -> None:
    """Hand over a route."""
    await _hand_over(control, request, geometries.route(request), "route_alpha")


async def set_area(control: MissionControl, request: Any, _: Any) -> None:
    """Hand over an area."""
    await _hand_over(control, request, geometries.area(request), "search_area")


async def set_waypoints(control: MissionControl, request: Any, _: Any) -> None:
    """Hand over waypoints."""
    await _hand_over(control, request, geometries.waypoints(request), "rally_point")


async def take_vehicle(control: MissionControl, request: Any, _: Any) -> None:
    """Take a vehicle or payload from the missions."""
    resource = named(request.vehicle, "vehicle", "evsg1 or evsg2/ptz")
    await control.take(resource, by=asker(request.by))


async def give_back_vehicle(control: MissionControl, request: Any, _: Any) -> None:
    """Give a vehicle or payload back to the missions."""
    resource = named(request.vehicle, "vehicle", "evsg1 or evsg2/ptz")
    await control.give_back(resource, by=asker(request.by))


async def _hand_over(
    control: MissionControl, request: Any, geometry: dict[str, Value], example: str
) -> None:
    name = named(request.name, "name", example)
    run, by = _run_or_all(request.run), asker(request.by)
    if run is not None:
        await control.mission_time_s(run)  # one that has ended would take it, and never use it
    await control.set_geometry(name, geometry, run=run, by=by)


def _run_or_all(run: str) -> str | None:
    return bounded(run.strip(), "run", NAME_CHARACTERS) or None
