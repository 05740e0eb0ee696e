"""Faces of the command line: which are served, their settings, and what becomes of broken ones."""

import signal
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

import pytest

from tests.command_line import CommandLine, install_plugin

CODE = '''
import asyncio, os, pathlib
from m2pem.errors import PluginError

class Echo:
    """Notes what it sees in a file."""
    def __init__(self, control, settings):
        self.control = control
        settings.refuse_others(("file", "breaks"))
        self.breaks = settings.flag("breaks", False)
        self.file = pathlib.Path(settings.text("file", "seen.txt"))

    async def serve(self):
        if self.breaks:
            async with asyncio.TaskGroup() as group:
                group.create_task(self.open())
        run = ""
        async for event in self.control.subscribe():
            if not run:
                run = await self.control.execute_behavior(
                    "ugv2", "goto", {"target": [38.1076, -77.3192]}, by="echo")
                summary = await self.control.wait(run)
                self.file.write_text(f"{summary.mission}: {summary.status}")

    async def open(self):
        raise PluginError("port 7 is taken")

@hookimpl
def m2pem_register_faces(register):
    register("echo", Echo)
'''

FLEET = """
version: 1
name: pair
origin: {lat: 38.1075, lon: -77.3192, alt: 60.0}
faces: {FACES}
vehicles:
  ugv1: {domain: ground, arbiter: sim, connection: {}}
  ugv2: {domain: ground, arbiter: sim, connection: {}}
"""

WAIT = """<?xml version="1.0"?>
<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="w">
<process id="W" isExecutable="true"><startEvent id="S"/>
<intermediateCatchEvent id="T"><timerEventDefinition><timeDuration>PT60S</timeDuration>
</timerEventDefinition></intermediateCatchEvent><endEvent id="E"/>
<sequenceFlow id="a" sourceRef="S" targetRef="T"/><sequenceFlow id="b" sourceRef="T" targetRef="E"/>
</process></definitions>"""


Words: TypeAlias = Callable[[str], list[str]]


@pytest.fixture
def words(m2pem: CommandLine, tmp_path: Path) -> Words:
    """Writes a fleet with these faces, and returns the words that run a mission of 60 s on it."""
    m2pem.environment |= install_plugin(tmp_path, "echo", CODE)
    (tmp_path / "wait.bpmn").write_text(WAIT)

    def written(faces: str) -> list[str]:
        fleet = tmp_path / "pair.yaml"
        fleet.write_text(FLEET.replace("{FACES}", faces))
        mission = str(tmp_path / "wait.bpmn")
        return ["run", mission, "--fleet", str(fleet), "--ocu", "none", "--speed", "60"]

    return written


def test_the_faces_of_the_fleet_file_are_served_and_may_command(
    m2pem: CommandLine, tmp_path: Path, words: Words
) -> None:
    seen = tmp_path / "noted.txt"
    status, _, errors = m2pem.run(*words(f"{{echo: {{file: {seen}}}}}"))
    assert status == 0, errors
    assert seen.read_text() == "goto of ugv2: completed"
    assert '"by":"echo"' in m2pem.run("replay", "r2", "--format", "json")[1].replace(" ", "")


def test_a_run_that_is_resumed_has_the_faces_of_its_fleet_file(
    m2pem: CommandLine, tmp_path: Path, words: Words
) -> None:
    seen = tmp_path / "noted.txt"
    program = m2pem.start(*words("{}")[:-1], "20", "--format", "json")
    program.until_record("EventAwaited")
    program.kill()
    words(f"{{echo: {{file: {seen}}}}}")
    status, _, errors = m2pem.run("resume", "r1", "--ocu", "none")
    assert status == 0, errors
    assert seen.read_text() == "goto of ugv2: completed"


def test_none_serves_none(m2pem: CommandLine, tmp_path: Path, words: Words) -> None:
    seen = tmp_path / "noted.txt"
    assert m2pem.run(*words(f"{{echo: {{file: {seen}}}}}"), "--face", "none")[0] == 0
    assert not seen.exists()


@pytest.mark.parametrize(
    ("faces", "more", "says"),
    [
        ("{echo: {fil: x}}", (), "pair.yaml: faces.echo.fil: there is no such setting; did you"),
        ("{ecko: {}}", (), "pair.yaml: faces: there is no face 'ecko'"),
        ("{}", ("--face", "ecko"), "there is no face 'ecko'"),
        ("{}", ("--face", "none,echo"), "name faces, or `none` alone"),
    ],
)
def test_what_is_wrong_is_said_before_anything_begins(
    m2pem: CommandLine, words: Words, faces: str, more: tuple[str, ...], says: str
) -> None:
    status, _, errors = m2pem.run(*words(faces), *more)
    assert status == 2
    assert says in errors
    assert "r1" not in m2pem.run("runs")[1]


def test_operators_read_that_a_face_is_broken_and_the_mission_goes_on(
    m2pem: CommandLine, words: Words
) -> None:
    status, output, errors = m2pem.run(*words("{echo: {breaks: true}}"))
    assert status == 0
    assert "the face echo does not serve any more: port 7 is taken" in output + errors


def test_a_gateway_needs_a_face(m2pem: CommandLine, tmp_path: Path, words: Words) -> None:
    words("{}")
    status, _, errors = m2pem.run("gateway", "--fleet", tmp_path / "pair.yaml")
    assert status == 2
    assert "has no `faces`" in errors


def test_a_gateway_serves_faces_until_it_is_stopped(
    m2pem: CommandLine, tmp_path: Path, words: Words
) -> None:
    words("{echo: {}}")
    program = m2pem.start("gateway", "--fleet", tmp_path / "pair.yaml")
    assert "operators: none; faces: echo" in program.until_said("serving pair")
    program.send(signal.SIGTERM)
    assert program.rest()[0] == 0
