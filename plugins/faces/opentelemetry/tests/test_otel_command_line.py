"""The faces as `m2pem` serves them: across a crash, with logs, and both at once."""

import json
import os
import re
import signal
from collections.abc import Iterator
from importlib.metadata import entry_points
from pathlib import Path
from urllib.request import urlopen

import pytest
from otel_collector import Collector, attributes, free_port
from test_otel_otlp import assert_one_tree, root

from m2pem.testing import scenarios
from tests.command_line import CommandLine, Program, command_line, install_plugin

FLEET = """
version: 1
name: pair
origin: {lat: 38.1075, lon: -77.3192, alt: 60.0}
faces: {FACES}
vehicles:
  ugv1: {domain: ground, arbiter: sim, connection: {state: STATE}}
"""
HOOKS = "from m2pem_plugin_opentelemetry import m2pem_register_faces"
SERVED = ("--fleet", "fleet.yaml", "--journal", "journal.db", "--ocu", "none")


@pytest.fixture
def m2pem(tmp_path: Path) -> Iterator[CommandLine]:
    for m2pem in command_line(tmp_path):
        if "opentelemetry" not in entry_points(group="m2pem").names:
            install_plugin(tmp_path, "opentelemetry_here", HOOKS)
        paths = (str(tmp_path), os.environ.get("PYTHONPATH", ""), m2pem.environment["PYTHONPATH"])
        m2pem.environment["PYTHONPATH"] = os.pathsep.join(filter(None, paths))
        (tmp_path / "questions.bpmn").write_bytes(scenarios.two_questions())
        yield m2pem


def fleet_with(folder: Path, faces: str) -> None:
    text = FLEET.replace("{FACES}", faces).replace("STATE", str(folder / "vehicles.state"))
    (folder / "fleet.yaml").write_text(text)


def asked(program: Program, count: int) -> list[str]:
    """The ids of the next questions."""
    return [program.until_record("PromptOpened")["prompt"] for _ in range(count)]


def test_a_run_taken_up_after_a_crash_is_one_tree(m2pem: CommandLine, tmp_path: Path) -> None:
    with Collector() as collector:
        fleet_with(tmp_path, f"{{otlp: {{endpoint: '{collector.endpoint}'}}}}")
        first = m2pem.start("run", "questions.bpmn", *SERVED, "--format", "json")
        prompts = asked(first, 2)
        assert m2pem.run("answer", "r1", prompts[0], "yes", "--journal", "journal.db")[0] == 0
        while "prompt" not in {each.name for each in collector.spans}:
            assert first.process.poll() is None
        before = {each.span_id: each for each in collector.spans}
        first.kill()
        second = m2pem.start("serve", *SERVED, "--format", "json")
        second.until_record("RunClaimed")
        assert m2pem.run("answer", "r1", prompts[1], "yes", "--journal", "journal.db")[0] == 0
        second.until_record("RunEnded")
        second.send(signal.SIGTERM)
        assert second.rest()[0] == 0
        by_id = assert_one_tree(collector.spans)
    (top,) = {each.span_id: each for each in root(collector.spans)}.values()
    assert "run claimed" in [each.name for each in top.events]
    answered = [each for each in by_id.values() if each.name == "prompt"]
    assert {attributes(each)["m2pem.prompt.id"] for each in answered} == set(prompts)
    for span_id, span in before.items():
        again = by_id[span_id]
        assert again.start_time_unix_nano == span.start_time_unix_nano
        assert again.end_time_unix_nano == span.end_time_unix_nano


def test_a_line_of_the_log_has_the_trace_of_its_run(m2pem: CommandLine, tmp_path: Path) -> None:
    with Collector() as collector:
        fleet_with(tmp_path, f"{{otlp: {{endpoint: '{collector.endpoint}'}}}}")
        words = ("run", "questions.bpmn", *SERVED, "--format", "json")
        program = m2pem.start("--debug", "--log-format", "json", *words)
        asked(program, 2)
        program.send(signal.SIGTERM)
        _, errors = program.rest()
        (top,) = root(collector.spans)
    for line in filter(None, errors.splitlines()):
        assert {"time", "level", "logger", "message"} <= json.loads(line).keys(), line
    assert attributes(top)["m2pem.run.outcome"] == "stopped"


def test_both_faces_serve_one_executive(m2pem: CommandLine, tmp_path: Path) -> None:
    port = free_port()
    with Collector() as collector:
        faces = f"{{otlp: {{endpoint: '{collector.endpoint}'}}, prometheus: {{port: {port}}}}}"
        fleet_with(tmp_path, faces)
        program = m2pem.start("run", "questions.bpmn", *SERVED, "--format", "json")
        asked(program, 2)
        page = urlopen(f"http://127.0.0.1:{port}/metrics", timeout=20).read().decode()
        program.send(signal.SIGINT)
        program.rest()
        assert root(collector.spans)
    assert re.search(r'^m2pem_runs\{status="running"\} 1\.0$', page, re.MULTILINE)
    assert re.search(r'^m2pem_info\{fleet="pair",version="[^"]+"\} 1\.0$', page, re.MULTILINE)
