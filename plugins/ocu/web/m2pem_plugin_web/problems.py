"""Refusals and failures as `application/problem+json` (RFC 9457)."""

import logging
from collections.abc import Mapping
from dataclasses import asdict
from http import HTTPStatus
from pathlib import Path
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from pydantic import BaseModel, ConfigDict
from starlette.exceptions import HTTPException
from starlette.routing import Match

from m2pem.errors import (
    BusyError,
    ExpressionSyntaxError,
    FindingsError,
    InternalError,
    JournalError,
    M2pemError,
    NotApprovedError,
    NotDrivenError,
    OperatorError,
    PluginError,
    ScheduleError,
    StuckError,
)
from m2pem_plugin_web.missions.names import PathNames

METHODS = ("GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS")
MEDIA_TYPE = "application/problem+json"

log = logging.getLogger("m2pem.ocu.web")

STATUS_OF: tuple[tuple[type[M2pemError], int], ...] = (
    (FindingsError, 422),
    (ExpressionSyntaxError, 422),
    (NotDrivenError, 409),
    (OperatorError, 409),
    (PluginError, 502),
    (JournalError, 503),
    (InternalError, 500),
)


class ProblemModel(BaseModel):
    """A refusal or failure. `findings`: all problems of a file."""

    model_config = ConfigDict(extra="allow", title="Problem")

    type: str
    title: str
    status: int
    detail: str


RESPONSES: dict[int | str, dict[str, Any]] = {
    "default": {
        "description": "The request was refused, or it failed.",
        "content": {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/Problem"}}},
    }
}
"""The responses of every route for refusals and failures."""


class ProblemError(HTTPException):
    """A refusal; `more`: further fields of the answer."""

    def __init__(
        self, status: int, detail: str, *, headers: dict[str, str] | None = None, **more: Any
    ) -> None:
        super().__init__(status, detail, headers)
        self.more = more


def problem(
    status: int, detail: str, headers: Mapping[str, str] | None = None, **more: Any
) -> JSONResponse:
    """Return the response for a refusal or a failure."""
    content = {
        "type": "about:blank",
        "title": HTTPStatus(status).phrase,
        "status": status,
        "detail": detail,
        **more,
    }
    return JSONResponse(content, status, dict(headers or {}), media_type=MEDIA_TYPE)


def handle_problems(app: FastAPI, missions: Path = Path()) -> None:
    """Register the handlers of an app's exceptions. `missions`: the folder of missions."""
    called = PathNames(missions)

    @app.exception_handler(M2pemError)
    def refused(_: Request, error: M2pemError) -> JSONResponse:
        status = next((s for kind, s in STATUS_OF if isinstance(error, kind)), 500)
        if isinstance(error, FindingsError):
            findings = [asdict(each) for each in called.findings(error.findings)]
            return problem(status, called.text(error.what), findings=findings)
        if isinstance(error, BusyError):
            return problem(status, str(error), busy=error.holders)
        if isinstance(error, NotApprovedError):
            return problem(status, str(error), missing=error.missing)
        if isinstance(error, ScheduleError):
            return problem(status, str(error), field=error.field)
        if isinstance(error, StuckError):
            return problem(status, str(error), stuck=True)
        if status == 500:
            log.error("a request failed: %s", error)
        return problem(status, called.text(str(error)))

    @app.exception_handler(HTTPException)
    def said(request: Request, error: HTTPException) -> JSONResponse:
        more = error.more if isinstance(error, ProblemError) else {}
        headers = error.headers
        if error.status_code == 405:
            headers = {"Allow": ", ".join(_methods_at(app, request))}
        return problem(error.status_code, str(error.detail), headers, **more)

    @app.exception_handler(RequestValidationError)
    def malformed(_: Request, error: RequestValidationError) -> JSONResponse:
        wrong = [
            {"where": ".".join(map(str, each["loc"])), "what": each["msg"]}
            for each in error.errors()
        ]
        text = "; ".join(f"{each['where']}: {each['what']}" for each in wrong)
        return problem(422, text, wrong=wrong)

    @app.exception_handler(Exception)
    def broke(_: Request, error: Exception) -> JSONResponse:
        return problem(500, "the server failed; its log has the error")


def _methods_at(app: FastAPI, request: Request) -> list[str]:
    """Return the methods of all routes at an address; a router names those of one route only."""
    scope = {key: value for key, value in request.scope.items() if key in ("type", "path")}
    return [
        method
        for method in METHODS
        if any(
            route.matches({**scope, "method": method, "headers": []})[0] is Match.FULL
            for route in app.router.routes
        )
    ]
