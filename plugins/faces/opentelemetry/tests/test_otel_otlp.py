"""Face `otlp` against a collector over HTTP: one tree a run, metrics, and collectors that fail."""

import subprocess
import sys
import time
from collections.abc import Sequence
from typing import Any

import pytest
from m2pem_plugin_opentelemetry.metrics import METRICS, SPANS
from m2pem_plugin_opentelemetry.otlp import OtlpFace
from opentelemetry.proto.trace.v1.trace_pb2 import Span, Status
from otel_collector import Collector, attributes, free_port
from otel_condition import until

from m2pem.api import records as r
from m2pem.api.control import MissionControl
from m2pem.api.face import FaceSettings
from m2pem.api.log_context import trace_ids
from m2pem.errors import PluginError
from m2pem.testing import scenarios, serve_face
from m2pem.testing.harness import run_executive, run_mission_on

FLEET = scenarios.fleet("sim", {"ugv1": {}, "ugv2": {}})
DRIVE = scenarios.in_parallel("drive_stop", "ugv1", "ugv2")


def assert_one_tree(spans: Sequence[Span]) -> dict[bytes, Span]:
    by_id = {each.span_id: each for each in spans}
    assert len({each.trace_id for each in spans}) == 1
    assert sum(not each.parent_span_id for each in by_id.values()) == 1
    for each in by_id.values():
        assert not each.parent_span_id or each.parent_span_id in by_id
    return by_id


def root(spans: Sequence[Span]) -> list[Span]:
    return [each for each in spans if not each.parent_span_id]


@pytest.mark.tried_with(
    "OpenTelemetry",
    "a collector of the tests decodes the OTLP spans of a run",
    kind="Observability",
    result="one tree, at the times of the records",
    package="opentelemetry-proto",
)
async def test_a_run_is_one_tree_at_the_collector_with_the_times_of_its_records() -> None:
    with Collector() as collector:
        async with (
            run_executive(FLEET) as control,
            serve_face(OtlpFace, control, {"endpoint": collector.endpoint}),
        ):
            result = await run_mission_on(control, DRIVE)
        by_id = assert_one_tree(collector.spans)
    assert len(by_id) == len(collector.spans)
    at = {each.seq: each.t_s for each in result.stamped}
    began = {
        each.record.behavior: each
        for each in result.stamped
        if isinstance(each.record, r.BehaviorRequested)
    }
    ended = {
        each.record.behavior: each
        for each in result.stamped
        if isinstance(each.record, r.BehaviorEnded)
    }
    behaviors = [each for each in by_id.values() if "m2pem.behavior.state" in attributes(each)]
    assert len(behaviors) == len(ended) == 2
    for span in behaviors:
        found = attributes(span)
        behavior = found["m2pem.behavior.id"]
        assert found["m2pem.record.seq"] == began[behavior].seq
        took_ns = round((at[ended[behavior].seq] - at[began[behavior].seq]) * 1e6) * 1000
        assert span.end_time_unix_nano - span.start_time_unix_nano == took_ns
    (top,) = root(collector.spans)
    assert top.start_time_unix_nano == result.summary.started_us * 1000
    assert top.end_time_unix_nano == (result.summary.ended_us or 0) * 1000
    assert attributes(top)["m2pem.run.outcome"] == "completed"
    (resource,) = {tuple(sorted(each.items())) for each in collector.resources}
    assert dict(resource)["service.name"] == "m2pem"


async def test_who_answered_and_what_failed_are_told() -> None:
    with Collector() as collector:
        async with (
            run_executive(FLEET) as control,
            serve_face(OtlpFace, control, {"endpoint": collector.endpoint}),
        ):
            run = await control.start(scenarios.question("Road?"), by="anna")
            await until(control.prompts)
            (prompt,) = control.prompts()
            await control.answer(run, prompt.prompt, "abort", by="ben")
            await control.wait(run)
    spans = {each.name: each for each in collector.spans}
    assert attributes(spans["prompt"])["m2pem.operator.name"] == "ben"
    assert attributes(spans["prompt"])["m2pem.prompt.decision"] == "abort"
    assert attributes(*root(collector.spans))["m2pem.operator.name"] == "anna"


async def test_a_run_that_is_stopped_when_all_ends_is_exported_with_its_root() -> None:
    with Collector() as collector:
        async with (
            run_executive(FLEET) as control,
            serve_face(OtlpFace, control, {"endpoint": collector.endpoint}),
        ):
            run = await control.start(scenarios.question("Road?"))
            await until(control.prompts)
            assert trace_ids[run]
            await control.stop(run, by="anna")
        assert_one_tree(collector.spans)
        (top,) = root(collector.spans)
    assert attributes(top)["m2pem.run.outcome"] == "stopped"
    assert top.status.code == Status.STATUS_CODE_UNSET
    assert run not in trace_ids


async def test_every_metric_is_exported_and_exemplars_lead_to_spans() -> None:
    before = dict(SPANS)
    with Collector() as collector:
        async with (
            run_executive(FLEET) as control,
            serve_face(
                OtlpFace, control, {"endpoint": collector.endpoint, "interval": "0.1 s"}, "otlp"
            ),
        ):
            run = await control.start(scenarios.question("Road?"))
            await until(lambda: "m2pem.link" in collector.metrics)
            await until(lambda: "m2pem.inbox.length" in collector.metrics)
            await control.stop(run)
            await run_mission_on(control, DRIVE)
            found = await control.statistics()
    assert collector.metrics.keys() == METRICS.keys()
    (records,) = collector.metrics["m2pem.records"].sum.data_points
    assert records.as_int == found.records
    commits = collector.metrics["m2pem.commit.duration"].histogram.data_points[0]
    assert commits.count == sum(commits.bucket_counts) == found.commits.count
    durations = collector.metrics["m2pem.behavior.duration"].histogram.data_points
    exemplars = [each for point in durations for each in point.exemplars]
    spans = {each.span_id: each for each in collector.spans}
    assert sum(point.count for point in durations) == 2
    assert exemplars
    for each in exemplars:
        span = spans[each.span_id]
        assert span.trace_id == each.trace_id
        assert attributes(span)["m2pem.record.seq"] == attributes(each)["m2pem.record.seq"]
        took_s = (span.end_time_unix_nano - span.start_time_unix_nano) / 1e9
        assert each.as_double == pytest.approx(took_s)
    assert SPANS["exported"] - before["exported"] == len(collector.spans)


# --- collectors that fail -----------------------------------------------------------------------


async def answered(control: MissionControl) -> float:
    """Seconds that a mission with a question takes, which is answered at once."""
    began_s = time.monotonic()
    await run_mission_on(control, scenarios.question("Road?"))
    return time.monotonic() - began_s


async def test_spans_of_a_collector_that_is_not_there_are_lost_and_counted() -> None:
    before = SPANS["failed"] + SPANS["dropped"]
    endpoint = f"http://127.0.0.1:{free_port()}"
    async with (
        run_executive(FLEET) as control,
        serve_face(OtlpFace, control, {"endpoint": endpoint, "timeout": "0.2 s"}),
    ):
        await run_mission_on(control, DRIVE)
        found = await control.statistics()
    assert SPANS["failed"] + SPANS["dropped"] - before >= 5
    assert found.runs_ended == {"completed": 1}


async def test_a_collector_that_refuses_gets_the_spans_of_later() -> None:
    with Collector() as collector:
        async with (
            run_executive(FLEET) as control,
            serve_face(OtlpFace, control, {"endpoint": collector.endpoint}),
        ):
            collector.status = 400
            await answered(control)
            await until(lambda: collector.requests > 1)
            assert not collector.spans
            collector.status = 200
            await answered(control)
        assert {attributes(each)["m2pem.run.id"] for each in root(collector.spans)} == {"r2"}


async def test_a_slow_collector_delays_no_mission_and_the_queue_is_bounded() -> None:
    before = SPANS["dropped"]
    with Collector() as collector:
        collector.answers.clear()
        async with (
            run_executive(FLEET) as control,
            serve_face(
                OtlpFace,
                control,
                {"endpoint": collector.endpoint, "queue": 3, "metrics": False},
                "otlp",
            ),
        ):
            await answered(control)
            await until(lambda: collector.requests)
            for _ in range(3):
                await answered(control)
            await until(lambda: SPANS["dropped"] - before >= 3)
            collector.answers.set()
        assert collector.spans


# --- settings -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"endpoint": "collector:4318"}, "faces.otlp.endpoint: 'collector:4318' is no address"),
        ({"endpoint": "http://[::"}, "faces.otlp.endpoint: 'http://[::' is no address"),
        ({"interval": "10 m"}, "faces.otlp.interval: "),
        ({"que": 3}, "faces.otlp.que: there is no such setting; did you mean 'queue'?"),
        ({"queue": 0}, "faces.otlp.queue: 0 is not a whole number from 1 to 1000000"),
    ],
)
async def test_a_wrong_setting_is_named(settings: dict[str, Any], says: str) -> None:
    async with run_executive(FLEET) as control:
        with pytest.raises(PluginError) as error:
            OtlpFace(control, FaceSettings("otlp", settings))
    assert says in str(error.value)


def test_off_imports_nothing_of_opentelemetry() -> None:
    code = (
        "import sys, m2pem.cli.serve, m2pem.cli.session, m2pem.executive.executive\n"
        "import m2pem_plugin_opentelemetry\n"
        "m2pem_plugin_opentelemetry.m2pem_register_faces(lambda name, face: None)\n"
        "print([name for name in sys.modules if name.partition('.')[0] in"
        " ('opentelemetry', 'prometheus_client', 'google', 'requests')])"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert said.stdout.strip() == "[]"
