"""The log as JSON: one object a line, with the run, its trace and the resource."""

import json
import logging
import sys
from typing import Any

import pytest

from m2pem.api.arbiter import BehaviorRequest
from m2pem.api.clock import SystemClock
from m2pem.api.log_context import trace_ids
from m2pem.cli.log_format import JsonFormatter
from m2pem.executive.executive import Executive
from m2pem.journal import MemoryJournal
from m2pem.mission.catalogue import BehaviorState
from m2pem.plugins import PluginManager
from m2pem.testing import scenarios
from m2pem.testing.fake_arbiter import FakeArbiter
from tests.cli.conftest import Invoke
from tests.command_line import FLEET

log = logging.getLogger("m2pem.arbiter")


class Lines(logging.Handler):
    """Keeps what is logged, as JSON."""

    def __init__(self) -> None:
        super().__init__()
        self.setFormatter(JsonFormatter(tracebacks=False))
        self.lines: list[dict[str, Any]] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.lines.append(json.loads(self.format(record)))


@pytest.fixture
def lines(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    handler = Lines()
    monkeypatch.setattr(log, "handlers", [handler])
    return handler.lines


def test_what_is_known_of_a_line_is_in_its_fields(lines: list[dict[str, Any]]) -> None:
    log.warning("%s: no fix\nsince 3 s", "ugv1", extra={"resource": "ugv1"})
    (line,) = lines
    assert line.pop("time").endswith("Z")
    assert line == {
        "level": "warning",
        "logger": "m2pem.arbiter",
        "message": "ugv1: no fix\nsince 3 s",
        "resource": "ugv1",
    }


def test_fields_of_other_libraries_are_no_errors(lines: list[dict[str, Any]]) -> None:
    log.warning("started", extra={"run": ["a", 1], "resource": {"x": 1}})
    (line,) = lines
    assert (line["run"], line["resource"]) == ("['a', 1]", "{'x': 1}")


def test_what_was_raised_has_its_traceback_only_if_asked_for() -> None:
    try:
        raise ValueError("no radio")
    except ValueError:
        record = logging.LogRecord("m2pem", logging.ERROR, "", 0, "lost", (), sys.exc_info())
    short, full = (
        json.loads(JsonFormatter(tracebacks=each).format(record)) for each in (False, True)
    )
    assert short["error"] == "ValueError: no radio"
    assert "traceback" not in short
    assert full["traceback"].startswith("Traceback")


async def test_what_a_run_commands_is_logged_with_the_run_and_its_trace(
    lines: list[dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    class Talking(FakeArbiter):
        async def start(self, request: BehaviorRequest) -> None:
            log.error("started")
            await super().start(request)
            self.report(request.id, BehaviorState.SUCCEEDED)

    class OwnPlugins(PluginManager):
        def arbiter(self, name: str) -> Any:
            return Talking

    fleet = scenarios.fleet("sim", {"ugv1": {}})
    monkeypatch.setitem(trace_ids, "r1", "0af7651916cd43dd8448eb211c80319c")
    async with Executive(fleet, MemoryJournal(), OwnPlugins(), SystemClock()) as executive:
        log.error("before")
        run = await executive.control.start(scenarios.one_behavior("drive_stop", "ugv1"))
        await executive.control.wait(run)
    said = [(each["message"], each.get("run"), each.get("trace_id")) for each in lines]
    assert ("before", None, None) in said
    assert ("started", "r1", "0af7651916cd43dd8448eb211c80319c") in said


def test_notes_and_errors_of_the_command_line_are_lines_of_the_log(invoke: Invoke) -> None:
    words = ["--log-format", "json", "run", "missing.bpmn", "--fleet", FLEET]
    status, out, err = invoke(*words)
    assert (status, out) == (2, "")
    (line,) = [json.loads(each) for each in err.splitlines()]
    assert line["level"] == "error"
    assert line["message"].startswith("missing.bpmn")


def test_without_the_option_lines_are_for_people(invoke: Invoke) -> None:
    _, _, err = invoke("run", "missing.bpmn", "--fleet", FLEET)
    assert err.startswith("m2pem: missing.bpmn")
