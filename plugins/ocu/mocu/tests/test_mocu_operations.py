"""The ROS services and the table of operations agree."""

from collections.abc import Awaitable, Callable
from inspect import signature
from types import SimpleNamespace
from typing import Any
from unittest.mock import AsyncMock, Mock

import pytest
from m2pem_interfaces import msg, srv
from m2pem_plugin_mocu.services import Services

from m2pem.api import OPERATIONS, MissionControl

POINT = msg.GeoPoint(latitude_deg=51.0, longitude_deg=7.0, altitude_m=2.0)
DATA = [msg.KeyValue(key="a", value="1")]
CONTROL = srv.ControlRun.Request
SCHEDULE = srv.ControlSchedule.Request

COMMANDS: dict[str, tuple[str, dict[str, Any]]] = {
    "answer": ("answer_prompt", {"run": "r1", "prompt": "p1", "decision": "go"}),
    "signal": ("send_signal", {"signal": "s", "run": "r1", "data": DATA}),
    "message": ("send_message", {"message_id": "m", "run": "r1", "data": DATA}),
    "stop": ("control_run", {"verb": CONTROL.STOP, "run": "r1", "reason": "rain"}),
    "stop_all": ("control_run", {"verb": CONTROL.STOP, "run": "all", "reason": "rain"}),
    "pause": ("control_run", {"verb": CONTROL.PAUSE, "run": "r1"}),
    "resume": ("control_run", {"verb": CONTROL.RESUME, "run": "r1"}),
    "unschedule": ("control_schedule", {"verb": SCHEDULE.CANCEL, "entry": "s1"}),
    "start_scheduled": ("control_schedule", {"verb": SCHEDULE.START, "entry": "s1"}),
    "hold_schedule": (
        "control_schedule",
        {"verb": SCHEDULE.HOLD, "entry": "s1", "reason": "rain"},
    ),
    "release_schedule": ("control_schedule", {"verb": SCHEDULE.RELEASE, "entry": "s1"}),
    "set_geometry": ("set_waypoints", {"name": "gate", "waypoints": [POINT], "run": "r1"}),
    "take": ("take_vehicle", {"vehicle": "ugv1/camera"}),
    "give_back": ("give_back_vehicle", {"vehicle": "ugv1/camera"}),
}
SENT = {
    "run": "r1",
    "prompt": "p1",
    "decision": "go",
    "signal": "s",
    "message": "m",
    "data": {"a": 1},
    "reason": "rain",
    "name": "gate",
    "geometry": {
        "type": "Feature",
        "properties": {"altitude_frame": "relative"},
        "geometry": {"type": "Point", "coordinates": [7.0, 51.0, 2.0]},
    },
    "resource": "ugv1/camera",
    "entry": "s1",
    "by": "anna",
}
"""What the requests of `COMMANDS` say, by the parameter of the operation."""

UNSAID = {"give_back": {"reason": ""}}
"""What no request can say: operators over ROS give back only what they have, without a reason."""

SERVED_OTHERWISE = {
    "start": "service start_mission brings the BPMN, or names a file of the executive's machine",
    "shared_space": "topic shared_spaces",
    "scheduled": "service list_schedule, and topic schedule",
    "runs": "service list_runs, and topic status",
    "mission_time_s": "a field of the runs of list_runs and of topic status",
    "prompts": "topic prompts",
    "incidents": "topic prompts: an incident is a question there",
    "resolve_incident": "service answer_prompt, with the incident in place of a prompt",
    "subscribe": "topics events, prompt_events, active_elements",
    "telemetry": "topics payloads, teams and /diagnostics",
    "mission": "topic active_elements has the labels of its elements",
    "fleet": "/diagnostics names its vehicles and payloads",
}
NOT_SERVED = {
    "versions": "m2pem runs --versions and the page list them",
    "version_files": "m2pem runs --versions and the page list them",
    "plan_revision": "m2pem revise shows the plan: an operator must read it before",
    "revise": "m2pem revise: an operator must read the plan before",
    "request_control": "operators over ROS take what is free; take_vehicle names the holder",
    "answer_control": "operators over ROS give back what they have",
    "control_requests": "topic events says who asks whom",
    "announce_presence": "no node of an operator says who looks at it",
    "end_presence": "no node of an operator says who looks at it",
    "operators": "the page and m2pem operators list them",
    "set_breakpoints": "missions are debugged on the command line and the page",
    "step": "missions are debugged on the command line and the page",
    "set_data": "missions are debugged on the command line and the page",
    "data": "missions are debugged on the command line and the page",
    "evaluate": "missions are debugged on the command line and the page",
    "add_note": "notes are written on the page, or with m2pem note; topic events has them",
    "approval": "start_mission answers with who must approve",
    "approve": "persons approve on the page, or with m2pem approve",
    "withdraw_approval": "persons do it on the page, or with m2pem approve --withdraw",
    "note_edit": "editors note who saves",
    "execute_behavior": "the ROS face has an action for each vehicle",
    "preview_incident": "answer_prompt refuses a choice after which the mission cannot complete",
    "alerts": "the command line and the page have the list; what was said is in /rosout",
    "acknowledge_alert": "the command line and the page acknowledge alerts",
    "delete_geometry": "the page deletes drawings",
    "geometry_versions": "the page lists the versions of drawings",
    "geometry_users": "the page asks before a drawing is handed over again",
    "own_alert": "the command line and the page note who takes care",
    "check": "start_mission answers with the findings",
    "schedule": "the command line and the page schedule missions",
    "missions": "start_mission names a file, or brings one",
    "preview_start": "start_mission answers with what speaks against the start",
    "preview_take": "no message has its effects",
    "holders": "no message has them; a refused take_vehicle names the holder",
    "holder_labels": "no message has them; topic events says what each task has",
    "unavailable": "no message has it; diagnostics say why a vehicle is not ready",
    "waiting": "no message has them; topic events says what a task waits for",
    "records": "a client has them from topic events on; older ones are in the journal",
    "wait": "topic status shows that a run has ended",
    "catalogue": "operators over ROS start missions that are drawn elsewhere",
    "simulated": "settings of DDS depend on it; operators do not see it",
    "speed": "missions with operators over ROS run in real time",
    "health": "m2pem doctor --running asks it on the executive's machine",
    "statistics": "faces prometheus and otlp have it",
    "standbys": "m2pem doctor --running asks it on the executive's machine",
    "switch_over": "m2pem switchover asks for it on the executive's machine",
    "journal_file": "a path of the executive's machine",
}


def test_every_operation_is_served_or_has_a_reason_why_not() -> None:
    assert {*COMMANDS, *SERVED_OTHERWISE, *NOT_SERVED} == set(OPERATIONS)


@pytest.mark.parametrize("operation", COMMANDS)
async def test_a_service_passes_every_parameter_of_its_operation(operation: str) -> None:
    services: dict[str, tuple[Any, Callable[[Any, Any], Awaitable[Any]]]] = {}

    def serve(service_type: Any, name: str, handler: Any) -> None:
        services[name] = service_type, handler

    control = Mock(spec=MissionControl, mission_time_s=AsyncMock())
    method = AsyncMock(spec=getattr(MissionControl, operation), return_value="r1")
    setattr(control, operation, method)
    Services(SimpleNamespace(serve=serve), control, Mock())
    name, fields = COMMANDS[operation]
    service_type, handler = services[name]
    response = await handler(service_type.Request(by="anna", **fields), service_type.Response())
    assert response.success, response.message
    sent = method.call_args
    bound = signature(getattr(MissionControl, operation)).bind(None, *sent.args, **sent.kwargs)
    names = OPERATIONS[operation].parameters.__struct_fields__
    said = {name: SENT[name] for name in names} | UNSAID.get(operation, {})
    assert bound.arguments == {"self": None} | said


@pytest.mark.parametrize(
    ("verb", "operation"),
    [(SCHEDULE.HOLD, "hold_schedule"), (SCHEDULE.RELEASE, "release_schedule")],
)
async def test_the_whole_schedule_is_held_and_released(verb: int, operation: str) -> None:
    services: dict[str, tuple[Any, Callable[[Any, Any], Awaitable[Any]]]] = {}

    def serve(service_type: Any, name: str, handler: Any) -> None:
        services[name] = service_type, handler

    method = AsyncMock(spec=getattr(MissionControl, operation))
    control = Mock(spec=MissionControl, **{operation: method})
    Services(SimpleNamespace(serve=serve), control, Mock())
    service_type, handler = services["control_schedule"]
    request = service_type.Request(verb=verb, by="anna")
    response = await handler(request, service_type.Response())
    assert response.success, response.message
    assert method.call_args.kwargs["entry"] is None


@pytest.mark.parametrize(
    ("decision", "chosen"),
    [
        ("retry", {"choice": "retry"}),
        ("skip!", {"choice": "skip", "even_if_stuck": True}),
        ("move:Home", {"choice": "move", "to": "Home"}),
        ("set_data:speed=3", {"choice": "set_data", "data": {"speed": 3}}),
        ("retry_with:scout=uav2", {"choice": "retry_with", "roles": {"scout": ["uav2"]}}),
        (
            "retry_with:scout=uav2;column=ugv1,ugv2",
            {"choice": "retry_with", "roles": {"scout": ["uav2"], "column": ["ugv1", "ugv2"]}},
        ),
    ],
)
async def test_an_incident_is_answered_as_a_prompt_is(
    decision: str, chosen: dict[str, Any]
) -> None:
    services: dict[str, tuple[Any, Callable[[Any, Any], Awaitable[Any]]]] = {}

    def serve(service_type: Any, name: str, handler: Any) -> None:
        services[name] = service_type, handler

    method = AsyncMock(spec=MissionControl.resolve_incident)
    control = Mock(spec=MissionControl, resolve_incident=method)
    Services(SimpleNamespace(serve=serve), control, Mock())
    service_type, handler = services["answer_prompt"]
    request = service_type.Request(run="r1", prompt="r1.i1", decision=decision, by="anna")
    response = await handler(request, service_type.Response())
    assert response.success, response.message
    sent = method.call_args.kwargs
    default = {"data": {}, "to": "", "roles": {}, "even_if_stuck": False}
    assert sent == {"run": "r1", "incident": "r1.i1", "by": "anna", **default, **chosen}


async def test_an_answer_that_lacks_what_its_choice_needs_is_refused() -> None:
    services: dict[str, tuple[Any, Callable[[Any, Any], Awaitable[Any]]]] = {}

    def serve(service_type: Any, name: str, handler: Any) -> None:
        services[name] = service_type, handler

    Services(SimpleNamespace(serve=serve), Mock(spec=MissionControl), Mock())
    service_type, handler = services["answer_prompt"]
    request = service_type.Request(run="r1", prompt="r1.i1", decision="set_data", by="anna")
    response = await handler(request, service_type.Response())
    assert not response.success
    assert "set_data:NAME=VALUE" in response.message
