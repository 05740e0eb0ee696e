"""Face `prometheus`: `/metrics` as Prometheus' own parsers read it, and clients that misbehave."""

import asyncio
import socket
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import httpx
import pytest
from m2pem_plugin_opentelemetry import exposition, prometheus
from m2pem_plugin_opentelemetry.metrics import METRICS, Kind
from m2pem_plugin_opentelemetry.prometheus import CONNECTIONS, PAGE_EVERY_S, PrometheusFace
from otel_collector import free_port
from otel_condition import until
from prometheus_client.openmetrics.parser import (
    text_string_to_metric_families as open_metrics,
)
from prometheus_client.parser import text_string_to_metric_families as plain_text

from m2pem.api.control import MissionControl
from m2pem.api.face import FaceSettings
from m2pem.api.log_context import trace_ids
from m2pem.errors import PluginError
from m2pem.testing import scenarios, serve_face
from m2pem.testing.harness import run_executive, run_mission_on

FLEET = scenarios.fleet("sim", {"ugv1": {}, "ugv2": {}})
DRIVE = scenarios.in_parallel("drive_stop", "ugv1", "ugv2")
OPEN_METRICS = {"Accept": "application/openmetrics-text; version=1.0.0"}


@asynccontextmanager
async def scraped() -> AsyncIterator[tuple[MissionControl, httpx.AsyncClient, int]]:
    """An executive with the face, and a client of it."""
    port = free_port()
    async with (
        run_executive(FLEET) as control,
        serve_face(PrometheusFace, control, {"port": port}),
        httpx.AsyncClient(base_url=f"http://127.0.0.1:{port}", timeout=20) as client,
    ):
        await listens(port)
        yield control, client, port


async def listens(port: int) -> None:
    async with asyncio.timeout(20):
        while True:
            try:
                _, writer = await asyncio.open_connection("127.0.0.1", port)
            except OSError:
                await asyncio.sleep(0.01)
            else:
                writer.close()
                return


def values(families: Any, name: str) -> dict[tuple[str, ...], float]:
    """The samples of a name, by the values of their labels."""
    return {
        tuple(sample.labels.values()): sample.value
        for family in families
        for sample in family.samples
        if sample.name == name
    }


@pytest.mark.tried_with(
    "Prometheus' Python client",
    "parses the metrics in both formats",
    kind="Observability",
    result="all metrics, the right counts",
    package="prometheus_client",
)
async def test_both_formats_have_all_metrics_and_the_counts_of_the_executive() -> None:
    async with scraped() as (control, client, _):
        result = await run_mission_on(control, DRIVE)
        await until_measured(client)
        run = await control.start(scenarios.question("Road?"))
        await until(control.prompts)
        assert run not in trace_ids  # its trace is sent nowhere
        found = await control.statistics()
        plain = await client.get("/metrics")
        opened = await client.get("/metrics", headers=OPEN_METRICS)
        await control.stop(run)
    assert plain.headers["content-type"].startswith("text/plain; version=0.0.4")
    assert opened.headers["content-type"].startswith("application/openmetrics-text; version=1.0.0")
    assert opened.text.endswith("# EOF\n")
    for families in ([*plain_text(plain.text)], [*open_metrics(opened.text)]):
        assert {each.name for each in families} == {
            each.prometheus_name for each in METRICS.values()
        }
        assert values(families, "m2pem_records_total") == {(): found.records}
        assert values(families, "m2pem_runs") == {("running",): 1, ("paused",): 0}
        ended = values(families, "m2pem_runs_ended_total")
        assert ended.pop(("completed",)) == 1
        assert ended == {("failed",): 0, ("stopped",): 0, ("terminated",): 0}
        assert values(families, "m2pem_inbox_length") == {(run,): 0}
        assert values(families, "m2pem_prompts") == {(): 1}
        assert values(families, "m2pem_commit_duration_seconds_count") == {(): found.commits.count}
        assert values(families, "m2pem_link")["ugv1", "connected"] == 1
    assert result.summary.records <= found.records


async def until_measured(client: httpx.AsyncClient) -> None:
    async with asyncio.timeout(20):
        while True:
            text = (await client.get("/metrics")).text
            if "m2pem_behavior_duration_seconds_count" in text:
                return


async def test_exemplars_name_the_trace_and_the_record() -> None:
    async with scraped() as (control, client, _):
        result = await run_mission_on(control, DRIVE)
        await until_measured(client)
        opened = await client.get("/metrics", headers=OPEN_METRICS)
    exemplars = [
        sample.exemplar
        for family in open_metrics(opened.text)
        for sample in family.samples
        if sample.exemplar is not None
    ]
    requested = {each.seq for each in result.stamped if "BehaviorRequested" in str(each.record)}
    assert exemplars
    for each in exemplars:
        assert int(each.labels["seq"]) in requested
        assert len(each.labels["trace_id"]) == 32
        assert len(each.labels["span_id"]) == 16


@pytest.mark.parametrize(
    ("request_", "status"),
    [
        (b"GET / HTTP/1.1\r\nHost: x\r\n\r\n", b"404"),
        (b"POST /metrics HTTP/1.1\r\nHost: x\r\n\r\n", b"405"),
        (b"garbage\xff\x00\r\n\r\n", b"400"),
        (b"GET /metrics HTTP/1.1\r\n" + b"x: " + b"y" * 20_000 + b"\r\n\r\n", b"400"),
    ],
)
async def test_other_requests_are_refused(request_: bytes, status: bytes) -> None:
    async with scraped() as (_, client, port):
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(request_)
        async with asyncio.timeout(20):
            assert (await reader.readline()).split(b" ")[1] == status
        writer.close()
        assert (await client.get("/metrics")).status_code == 200


async def test_a_head_has_no_body() -> None:
    async with scraped() as (_, client, _):
        head = await client.head("/metrics")
    assert head.status_code == 200
    assert int(head.headers["content-length"]) > 1000
    assert head.content == b""


async def test_a_client_that_asks_without_a_pause_does_not_take_the_executives_time() -> None:
    async with scraped() as (_, client, _):
        begun_s = time.monotonic()
        pages = await asyncio.gather(*(client.get("/metrics") for _ in range(4)))
        assert time.monotonic() - begun_s >= 3 * PAGE_EVERY_S
    assert {each.status_code for each in pages} == {200}


async def test_clients_that_never_ask_or_never_read_are_bounded_and_let_go(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    huge = b"# " + b"x" * 30_000_000
    async with scraped() as (control, client, port):
        with monkeypatch.context() as patched:
            patched.setattr(exposition, "rendered", lambda *_: (huge, "text/plain"))
            patched.setattr(prometheus, "WITHIN_S", 0.5)
            stalled = []
            for number in range(2 * CONNECTIONS):
                client_end = socket.create_connection(("127.0.0.1", port))
                asks = b"GET /metrics HTTP/1.1\r\n\r\n" if number % 2 else b"GET"
                client_end.sendall(asks)
                stalled.append(client_end)
            result = await run_mission_on(control, DRIVE)
            assert result.summary.status.value == "completed"
            async with asyncio.timeout(60):
                while not await answers(client):
                    pass  # until those who hold all connections are let go
        for client_end in stalled:
            client_end.close()


async def answers(client: httpx.AsyncClient) -> bool:
    try:
        return (await client.get("/metrics")).status_code == 200
    except httpx.TransportError:
        return False


async def test_a_port_that_is_taken_is_named() -> None:
    async with scraped() as (control, _, port):
        second = PrometheusFace(control, FaceSettings("prometheus", {"port": port}))
        with pytest.raises(PluginError, match=rf"127\.0\.0\.1:{port} cannot be opened: "):
            await second.serve()


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"port": 0}, "faces.prometheus.port: 0 is not a whole number from 1 to 65535"),
        ({"prt": 1}, "faces.prometheus.prt: there is no such setting; did you mean 'port'?"),
    ],
)
async def test_a_wrong_setting_is_named(settings: dict[str, Any], says: str) -> None:
    async with run_executive(FLEET) as control:
        with pytest.raises(PluginError) as error:
            PrometheusFace(control, FaceSettings("prometheus", settings))
    assert says in str(error.value)


def test_names_are_those_of_prometheus() -> None:
    for metric in METRICS.values():
        assert metric.prometheus_name.startswith("m2pem_")
        assert not metric.prometheus_name.endswith(("_total", "_bucket"))
        assert (metric.unit == "s") == metric.prometheus_name.endswith("_seconds")
        assert metric.kind is not Kind.HISTOGRAM or metric.unit == "s"
