"""Runs by pages: filtered, sorted, and fast with ten thousand of them."""

from typing import Any
from unittest.mock import AsyncMock, Mock

import httpx
import pytest
from m2pem_plugin_web.rest import run_pages
from rest_world import As, app_of

from m2pem.api import MissionControl, RunStatus, RunSummary, StampedRecord
from m2pem.api import records as r

MANY = 10_000
ENDS = (RunStatus.COMPLETED, RunStatus.FAILED, RunStatus.STOPPED)


def run_of(number: int) -> RunSummary:
    """r1 ... r10000: one after the other; the last two go on."""
    began_us = number * 1_000_000
    names = ("patrol.bpmn", "survey.bpmn")
    if number > MANY - 2:
        return RunSummary(f"r{number}", names[number % 2], "P", RunStatus.RUNNING, began_us)
    ended_us = began_us + number % 7 * 1_000_000
    status = ENDS[number % 3]
    detail = "error ROUTE_BLOCKED" if status is RunStatus.FAILED else ""
    mission = names[number % 2]
    return RunSummary(f"r{number}", mission, "P", status, began_us, ended_us, 9, detail)


async def records_of(run: str, after: int, limit: int) -> list[StampedRecord]:
    """Every thousandth run had uav1, its detector's payload, or a vehicle whose name begins so."""
    number = int(run[1:])
    if number % 1000 or after:
        return []
    had = ("uav1", "uav1/radar", "uav10")[number // 1000 % 3]
    roles = {"vehicle": (had,)}
    task = r.BehaviorRequested(1, "P", "E", 0, f"{run}.b1", "goto", "vehicle", (had,), roles, {})
    return [StampedRecord(run, 1, 0.0, task)]


@pytest.fixture(scope="module")
def control() -> Mock:
    control = Mock(spec=MissionControl)
    control.runs = AsyncMock(return_value=[run_of(number) for number in range(1, MANY + 1)])
    control.fleet.return_value = Mock(vehicles={}, payloads={})
    control.mission_time_s = AsyncMock(return_value=4.0)
    control.holders = AsyncMock(
        return_value={"uav1": "", "uav1/camera": "r9999.b3", "uav2": "r10000.b1", "uav3": "anna"}
    )
    control.records = AsyncMock(side_effect=records_of)
    return control


async def page(control: Mock, query: str) -> Any:
    app = app_of(Mock(control=control), run_pages.router(control))
    transport = httpx.ASGITransport(As(app))
    async with httpx.AsyncClient(transport=transport, base_url="http://test") as http:
        answer = await http.get(f"/api/run-pages?{query}")
    assert answer.is_success, answer.text
    return answer.json()


def ids(found: Any) -> list[str]:
    return [each["run"] for each in found["runs"]]


async def test_a_page_has_those_that_go_on_first_then_the_newest(control: Mock) -> None:
    found = await page(control, "limit=3")
    assert ids(found) == ["r10000", "r9999", "r9998"]
    assert (found["total"], found["all"], found["runs"][0]["took_s"]) == (MANY, MANY, 4.0)
    assert ids(await page(control, "limit=2&offset=9998")) == ["r2", "r1"]
    assert ids(await page(control, "offset=10000")) == []


@pytest.mark.parametrize(
    ("query", "total"),
    [
        ("status=running", 2),
        ("status=running&status=failed", 2 + 3333),
        ("text=SURVEY", 5000),
        ("text=survey+blocked", 1667),
        ("text=r9999", 1),
        ("since_us=5000000&until_us=9000000", 5),
        ("vehicle=uav3&since_us=9998000000", 0),
        ("text=nowhere", 0),
    ],
)
async def test_runs_are_filtered(control: Mock, query: str, total: int) -> None:
    found = await page(control, query)
    assert (found["total"], found["all"]) == (total, MANY)


async def test_runs_are_found_by_a_vehicle_that_they_have_or_had(control: Mock) -> None:
    app = app_of(Mock(control=control), run_pages.router(control))
    transport = httpx.ASGITransport(As(app))
    async with httpx.AsyncClient(transport=transport, base_url="http://test") as http:

        async def asked(vehicle: str) -> Any:
            return (await http.get(f"/api/run-pages?vehicle={vehicle}&sort=began")).json()

        # An answer does not wait until all were read: it says how many are left.
        while (found := await asked("uav1"))["unread"]:
            assert found["total"] <= 8
        assert ids(found) == [
            f"r{number}" for number in (10000, 9999, 9000, 7000, 6000, 4000, 3000, 1000)
        ]
        control.records.reset_mock()
        assert ids(await asked("uav10")) == ["r8000", "r5000", "r2000"]
        assert ids(await asked("uav2")) == ["r10000"]
        # Only what goes on is read again.
        assert {each.args[0] for each in control.records.await_args_list} == {"r9999", "r10000"}


async def test_runs_are_sorted_either_way(control: Mock) -> None:
    assert ids(await page(control, "sort=began&descending=false&limit=2")) == ["r1", "r2"]
    took = await page(control, "sort=took&limit=1&status=completed")
    assert took["runs"][0]["took_s"] == 6.0
    assert (await page(control, "sort=mission&descending=false&limit=1"))["runs"][0][
        "mission"
    ] == "patrol.bpmn"


async def test_many_pages_read_the_journal_once(control: Mock) -> None:
    app = app_of(Mock(control=control), run_pages.router(control))
    control.runs.reset_mock()
    transport = httpx.ASGITransport(As(app))
    async with httpx.AsyncClient(transport=transport, base_url="http://test") as http:
        for offset in (0, 25, 50):
            await http.get(f"/api/run-pages?offset={offset}")
    assert control.runs.await_count == 1
