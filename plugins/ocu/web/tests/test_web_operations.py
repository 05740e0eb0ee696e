"""The REST interface and the table of operations agree."""

from inspect import signature
from typing import Any
from unittest.mock import AsyncMock, Mock

import httpx
import pytest
from fastapi import FastAPI
from m2pem_plugin_web.live.standbys import Standbys
from m2pem_plugin_web.rest import (
    alerts,
    debugging,
    incidents,
    people,
    revisions,
    schedule,
    standbys,
    steering,
)
from rest_world import As, app_of

from m2pem.api import (
    OPERATIONS,
    AlertSeverity,
    HandedOver,
    MissionControl,
    OperatorAlert,
    RunStatus,
    RunSummary,
    Schedule,
    ScheduledMission,
    ScheduledStatus,
    When,
)

COMMANDS: dict[str, tuple[str, str, Any]] = {
    "answer": ("POST", "/api/runs/r1/prompts/p1", {"decision": "go"}),
    "resolve_incident": (
        "POST",
        "/api/runs/r1/incidents/r1.i1",
        {
            "choice": "retry_with",
            "data": {"a": 1},
            "to": "Home",
            "roles": {"scout": ["uav2"]},
            "even_if_stuck": True,
        },
    ),
    "acknowledge_alert": ("POST", "/api/alerts/a1/acknowledge", None),
    "own_alert": ("POST", "/api/alerts/a1/own", {"owner": "otto"}),
    "signal": ("POST", "/api/runs/r1/signals", {"signal": "s", "data": {"a": 1}}),
    "message": ("POST", "/api/runs/r1/messages", {"message": "m", "data": {"a": 1}}),
    "stop": ("POST", "/api/runs/r1/stop", {"reason": "rain"}),
    "stop_all": ("POST", "/api/stop-all", {"reason": "rain"}),
    "pause": ("POST", "/api/runs/r1/pause", None),
    "set_breakpoints": (
        "PUT",
        "/api/runs/r1/breakpoints",
        {"elements": ["a"], "conditions": ["n > 3"]},
    ),
    "step": ("POST", "/api/runs/r1/step", None),
    "set_data": ("POST", "/api/runs/r1/data", {"data": {"a": 1}, "scope": 2}),
    "resume": ("POST", "/api/runs/r1/resume", None),
    "set_geometry": (
        "PUT",
        "/api/geometries/gate",
        {"geometry": {"type": "Point", "coordinates": [7.0, 51.0]}, "run": "r1"},
    ),
    "delete_geometry": ("DELETE", "/api/geometries/gate", None),
    "unschedule": ("POST", "/api/schedule/s1/cancel", None),
    "start_scheduled": ("POST", "/api/schedule/s1/start", None),
    "hold_schedule": ("POST", "/api/schedule/s1/hold", {"reason": "rain"}),
    "release_schedule": ("POST", "/api/schedule/s1/release", None),
    "request_control": ("POST", "/api/resources/ugv1/camera/request", None),
    "answer_control": ("POST", "/api/resources/ugv1/camera/hand-over", {"give": True}),
    "add_note": ("POST", "/api/runs/r1/notes", {"text": "windy"}),
    "take": ("POST", "/api/resources/ugv1/camera/take", None),
    "give_back": ("POST", "/api/resources/ugv1/camera/give-back", {"reason": "rain"}),
}
SENT = {
    "run": "r1",
    "prompt": "p1",
    "decision": "go",
    "incident": "r1.i1",
    "choice": "retry_with",
    "to": "Home",
    "roles": {"scout": ["uav2"]},
    "even_if_stuck": True,
    "signal": "s",
    "message": "m",
    "elements": ["a"],
    "conditions": ["n > 3"],
    "scope": 2,
    "data": {"a": 1},
    "reason": "rain",
    "name": "gate",
    "geometry": {"type": "Point", "coordinates": [7.0, 51.0]},
    "resource": "ugv1/camera",
    "entry": "s1",
    "alert": "a1",
    "owner": "otto",
    "give": True,
    "text": "windy",
    "by": "a commander",
}
"""What the requests of `COMMANDS` say, by the parameter of the operation."""

QUERIES = {
    "scheduled": "/api/schedule",
    "runs": "/api/runs",
    "records": "/api/runs/{run}/records",
    "data": "/api/runs/{run}/data",
    "evaluate": "/api/runs/{run}/value",
    "mission": "/api/runs/{run}/mission",
    "versions": "/api/runs/{run}/versions",
    "version_files": "/api/runs/{run}/mission",
    "mission_time_s": "/api/runs/{run}",
    "prompts": "/api/prompts",
    "incidents": "/api/incidents",
    "alerts": "/api/alerts",
    "operators": "/api/operators",
    "control_requests": "/api/operators",
    "holders": "/api/resources",
    "holder_labels": "/api/resources",
    "unavailable": "/api/resources",
    "waiting": "/api/resources",
    "shared_space": "/api/resources",
    "fleet": "/api/fleet",
    "catalogue": "/api/behaviors",
    "standbys": "/api/standbys",
    "geometry_versions": "/api/geometries/{name}/versions",
}
NOT_SERVED = {
    "announce_presence": "the WebSocket of a page announces its user",
    "end_presence": "the WebSocket of a page announces its user",
    "approval": "GET /api/missions/{name}/approval is of a mission of the server's folder",
    "approve": "POST /api/missions/{name}/approval",
    "withdraw_approval": "POST /api/missions/{name}/approval/withdraw",
    "note_edit": "PUT /api/missions/{name} notes who saves",
    "plan_revision": "POST /api/runs/{run}/revision/plan names a mission of the server's folder",
    "revise": "POST /api/runs/{run}/revision names a mission of the server's folder",
    "execute_behavior": "programs command vehicles through faces; the page starts missions",
    "switch_over": "m2pem switchover asks for it on the executive's machine",
    "preview_incident": "POST .../incidents/{incident}/preview",
    "start": "POST /api/runs names a mission of the server's folder, or brings its BPMN",
    "schedule": "POST /api/schedule names a mission of the server's folder",
    "check": "POST /api/checks brings the BPMN of a draft",
    "missions": "GET /api/missions lists the server's folder",
    "preview_start": "POST /api/checks has the findings",
    "geometry_users": "PUT /api/geometries/{name} is refused with them",
    "preview_take": "no page takes a vehicle, so that there is nothing to warn of",
    "wait": "a page follows the end of a run over its WebSocket",
    "subscribe": "the WebSocket sends what is committed, folded into views of runs",
    "telemetry": "the WebSocket sends the latest states, as fast as the browser takes them",
    "simulated": "a field of the session",
    "speed": "a field of the session",
    "health": "GET /readyz says whether all is well, without a session",
    "journal_file": "a path of the executive's machine",
    "statistics": "face prometheus has it, as /metrics",
}


@pytest.fixture(scope="module")
def control() -> Mock:
    control = Mock(spec=MissionControl)
    for name in COMMANDS:
        setattr(control, name, AsyncMock(spec=getattr(MissionControl, name), return_value=[]))
    control.start_scheduled.return_value = "r1"
    control.fleet = Mock(return_value=Mock(vehicles={}, payloads={}))
    control.waiting = AsyncMock(return_value=[])
    entry = ScheduledMission(SENT["entry"], "M", "P", When(), "", ScheduledStatus.SCHEDULED)
    control.scheduled = AsyncMock(return_value=Schedule((entry,)))
    control.holders = AsyncMock(return_value={SENT["resource"]: ""})
    control.geometries.return_value = {"gate": HandedOver(SENT["geometry"], "anna", 0)}
    control.geometry_versions = AsyncMock(return_value=[])
    alert = OperatorAlert(SENT["alert"], AlertSeverity.WARNING, "QUESTION", "asks: Go?", 0, 0)
    control.alerts = AsyncMock(return_value=[alert])
    control.runs = AsyncMock(return_value=[RunSummary("r1", "M", "P", RunStatus.RUNNING, 0)])
    return control


@pytest.fixture(scope="module")
def app(control: Mock) -> FastAPI:
    return app_of(
        Mock(control=control),
        steering.router(control, Mock()),
        steering.prompt_router(control, Mock()),
        debugging.router(control),
        steering.resource_router(control),
        schedule.router(control, Mock()),
        incidents.router(control),
        alerts.router(control),
        people.router(control),
        standbys.router(Standbys(control)),
        revisions.router(control, Mock()),
    )


def test_every_operation_has_a_route_or_a_reason_why_not() -> None:
    assert {*COMMANDS, *QUERIES, *NOT_SERVED} == set(OPERATIONS)


@pytest.mark.parametrize("operation", COMMANDS)
async def test_a_route_passes_every_parameter_of_its_operation(
    operation: str, app: FastAPI, control: Mock
) -> None:
    method, path, body = COMMANDS[operation]
    getattr(control, operation).reset_mock()
    transport = httpx.ASGITransport(As(app))
    async with httpx.AsyncClient(transport=transport, base_url="http://test") as http:
        answer = await http.request(method, path, json=body)
    assert answer.is_success, answer.text
    sent = getattr(control, operation).call_args
    bound = signature(getattr(MissionControl, operation)).bind(None, *sent.args, **sent.kwargs)
    fields = OPERATIONS[operation].parameters.__struct_fields__
    assert bound.arguments == {"self": None} | {name: SENT[name] for name in fields}


def test_the_routes_of_queries_are_there(app: FastAPI) -> None:
    assert set(QUERIES.values()) <= set(app.openapi()["paths"])
