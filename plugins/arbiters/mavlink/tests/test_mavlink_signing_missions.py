"""Missions with signing vehicles: simulated autopilots and m2pem as processes, over real UDP."""

import asyncio
import json
import logging
import re
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from m2pem_plugin_mavlink.arbiter import MavlinkArbiter
from m2pem_plugin_mavlink.settings import read_settings
from m2pem_plugin_mavlink.signing import command_line
from m2pem_plugin_mavlink.signing.setup import SetupError, remove_key, set_up_key
from m2pem_plugin_mavlink.signing.timestamps import clock_timestamp
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_copters import simulated, task, write
from mavlink_signed_end import KEY, OTHER_KEY, write_key
from mavlink_simulated import specs
from mavlink_sitl import free_port

from m2pem.api import (
    ArbiterContext,
    Connection,
    LinkState,
    ResourceId,
    SystemClock,
    VehicleState,
)
from m2pem.errors import PluginError
from m2pem.telemetry.bus import Bus
from tests.executive.conftest import mission, sequence

V1 = ResourceId("v1")
SPEED = "10"
WITHIN_S = 120
MISSION = mission(sequence(task("Up", "takeoff", "vehicle='uav1'", altitude="20")))
SECRETS = (KEY.hex(), OTHER_KEY.hex(), KEY.decode("latin-1"))


class Run:
    """A run of `m2pem run`: its records, and what it printed to people."""

    def __init__(self, done: subprocess.CompletedProcess[str]) -> None:
        self.status = done.returncode
        self.text = done.stdout + done.stderr
        self.records = [json.loads(line) for line in done.stdout.splitlines()]

    def only(self, record: str) -> dict[str, Any]:
        (found,) = [each for each in self.records if each["record"] == record]
        return found


class World:
    """A copter that signs with a key, or not, and the fleet, whose key is KEY."""

    def __init__(self, folder: Path, port: int) -> None:
        self.folder = folder
        self._port = port
        self._started = ExitStack()
        write(folder, port, MISSION, lost_after="20s", rounds=1)
        key = write_key(folder)
        fleet = folder / "fleet.yaml"
        text = fleet.read_text(encoding="utf-8")
        fleet.write_text(text.replace("system_id: 1", f"system_id: 1, signing: {{key: {key}}}"))

    def simulate(self, key: bytes | None) -> None:
        words = simulated(self._port, SPEED)
        if key is not None:
            words = (*words, "--signing-key", str(write_key(self.folder, "its.key", key)))
        program = subprocess.Popen([sys.executable, "-m", "m2pem", *words], stdout=subprocess.PIPE)
        self._started.callback(program.communicate)
        self._started.callback(program.kill)

    def run(self, *words: object) -> Run:
        line = (*words, "--ocu", "none", "--format", "json")
        return Run(
            subprocess.run(
                [sys.executable, "-m", "m2pem", *map(str, line)],
                capture_output=True,
                text=True,
                check=False,
                timeout=WITHIN_S,
            )
        )

    def play(self) -> Run:
        return self.run(
            *("run", self.folder / "m.bpmn", "--fleet", self.folder / "fleet.yaml"),
            *("--speed", SPEED, "--journal", self.folder / "journal.db"),
        )

    def close(self) -> None:
        self._started.close()


@pytest.fixture
def world(tmp_path: Path) -> Iterator[World]:
    made = World(tmp_path, free_port())
    yield made
    made.close()


def test_a_mission_with_the_right_key_succeeds_and_the_key_is_nowhere(world: World) -> None:
    world.simulate(KEY)
    run = world.play()
    assert run.status == 0, run.text
    assert not any(secret in run.text for secret in SECRETS)
    for file in world.folder.iterdir():
        if file.is_file() and file.suffix != ".key":
            content = file.read_bytes()
            assert KEY not in content and KEY.hex().encode() not in content, file
    with sqlite3.connect(world.folder / "mavlink-signing.db") as database:
        assert database.execute("SELECT sender, link FROM received").fetchall() == [(257, 1)]


@pytest.mark.parametrize(
    ("key", "reason"), [(None, "not signed"), (OTHER_KEY, "wrongly signed")], ids=["none", "other"]
)
def test_a_mission_without_it_fails_with_that_reason(
    world: World, key: bytes | None, reason: str
) -> None:
    world.simulate(key)
    run = world.play()
    assert run.status != 0
    found = re.search(r'"([^"]*LINK_LOST[^"]*|[^"]*refused: [^"]*)"', run.text)
    assert found is not None, run.text
    assert re.search(
        rf"no message of system 1 was accepted; frames of 1/1 on udpin://[\d.:]+ "
        rf"refused: {reason} \(\d+\)",
        run.text,
    )
    assert re.search(rf"uav1: frames of 1/1 on udpin\S+ refused: {reason} \(\d+\); ", run.text)
    assert not any(secret in run.text for secret in SECRETS)


async def test_operators_see_why_a_vehicle_is_not_received(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    port = free_port()
    key = write_key(tmp_path)
    values = {"url": f"udpin://127.0.0.1:{port}", "system_id": 1, "signing": {"key": str(key)}}
    context = ArbiterContext(SystemClock(), Bus(), logging.getLogger("test"), (47.4, 8.5, 488.0))
    async with rover(port) as simulator:
        arbiter = MavlinkArbiter({V1: Connection(V1, "ground", values)}, context)
        await arbiter.connect()
        try:
            async for state in arbiter.telemetry():
                assert isinstance(state, VehicleState)
                if state.not_ready_reasons:
                    break
            assert (state.link, state.ready, state.position) == (LinkState.LOST, False, None)
            assert "frames of 1/1 on udpin" in state.not_ready_reasons[0]
            assert "refused: not signed (" in state.not_ready_reasons[0]
            simulator[1].autopilot.signing.set_up(KEY, clock_timestamp())
            async for state in arbiter.telemetry():
                if state.link is LinkState.CONNECTED:  # type: ignore[union-attr]
                    break
        finally:
            await arbiter.close()
    (text,) = [each for each in caplog.messages if "refused" in each]
    assert text.endswith("; `m2pem mavlink signing setup` gives the vehicle the key")


# --- setting up ---------------------------------------------------------------------------------


def settings_of(port: int, key: Path) -> Any:
    """Timestamps are kept beside the key."""
    url = f"udpin://127.0.0.1:{port}"
    values = {"url": url, "system_id": 1, "signing": {"key": str(key)}}
    return read_settings({V1: Connection(V1, "ground", values)}, key.parent)[V1]


def rover(port: int) -> Simulator:
    return Simulator(specs(Kind.ROVER), speed=10, to=("127.0.0.1", port))


async def test_a_vehicle_gets_its_key_and_another_one_and_none(tmp_path: Path) -> None:
    port = free_port()
    first = settings_of(port, write_key(tmp_path))
    second = settings_of(port, write_key(tmp_path, "2.key", OTHER_KEY))
    async with rover(port) as simulator:
        signing = simulator[1].autopilot.signing.signing
        await set_up_key(first, first.signing, None)
        assert signing.secret_key == KEY
        with pytest.raises(SetupError, match=r"another key than .*2\.key: name it with --old-key"):
            await set_up_key(second, second.signing, None)
        assert signing.secret_key == KEY
        await set_up_key(second, second.signing, first.signing)
        assert signing.secret_key == OTHER_KEY
        with pytest.raises(SetupError, match="its messages are refused: wrongly signed"):
            await remove_key(first, first.signing)
        await remove_key(second, second.signing)
        assert signing.secret_key is None and not signing.sign_outgoing


async def test_an_armed_vehicle_does_not_take_a_key(tmp_path: Path) -> None:
    port = free_port()
    settings = settings_of(port, write_key(tmp_path))
    async with rover(port) as simulator:
        vehicle = simulator[1].autopilot
        await simulator.until(lambda: vehicle.estimator.ready)
        vehicle.modes.switch(15)
        assert vehicle.arming.arm()
        with pytest.raises(SetupError, match=r"it does not sign .* Won't setup signing when armed"):
            await set_up_key(settings, settings.signing, None)


async def test_a_vehicle_that_restarts_signs_on(tmp_path: Path) -> None:
    port = free_port()
    settings = settings_of(port, write_key(tmp_path))
    async with rover(port) as simulator:
        await set_up_key(settings, settings.signing, None)
        for _ in range(3):  # each time its timestamps go on a minute later
            simulator[1].autopilot.reboot()
            await simulator.until(lambda: not simulator[1].autopilot.silent)
            await set_up_key(settings, settings.signing, settings.signing)
        await remove_key(settings, settings.signing)
        await set_up_key(settings, settings.signing, None)


FLEET = """
version: 1
origin: {{lat: 38.1, lon: -77.3, alt: 60.0}}
vehicles:
  uav1: {{domain: air, arbiter: mavlink, connection: {{url: "{url}", system_id: 1 {more}}}}}
  sim1: {{domain: air, arbiter: sim}}
"""


def invoke(command: Any, *words: object, **more: Any) -> Any:
    return CliRunner().invoke(command, [*map(str, words)], **more)


@pytest.fixture(autouse=True)
def own_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The state folder of this user."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path / "state" / "m2pem"


def fleet(folder: Path, url: str = "udpout://192.0.2.1:14550", more: str = "") -> Path:
    path = folder / "fleet.yaml"
    path.write_text(FLEET.format(url=url, more=more), encoding="utf-8")
    return path


def test_setup_asks_and_warns_of_a_network(tmp_path: Path) -> None:
    key = write_key(tmp_path)
    file = fleet(tmp_path, more=f", signing: {{key: {key}}}")
    done = invoke(command_line.setup, "--fleet", file, "uav1", input="n\n")
    assert (
        "Warning: every program that reads what is sent over udpout://192.0.2.1:14550"
        in done.output
    )
    assert f"Send the key of {key} to uav1? [y/N]" in done.output
    assert done.exit_code == 1
    done = invoke(command_line.remove, "--fleet", file, "uav1", input="n\n")
    assert "Turn the signing of uav1 off?" in done.output and done.exit_code == 1


@pytest.mark.parametrize("vehicle", ["uav2", "sim1"])
def test_setup_names_the_vehicles_that_there_are(tmp_path: Path, vehicle: str) -> None:
    done = invoke(command_line.setup, "--fleet", fleet(tmp_path), vehicle)
    assert f"no MAVLink vehicle '{vehicle}'; it has: uav1" in done.output
    assert done.exit_code == 2


def test_setup_needs_a_key_in_the_fleet(tmp_path: Path) -> None:
    done = invoke(command_line.setup, "--fleet", fleet(tmp_path), "uav1")
    assert "uav1: connection.signing is missing" in done.output


def test_setup_says_when_the_vehicle_is_not_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("m2pem_plugin_mavlink.signing.setup.RECEIVED_WITHIN_S", 0.1)
    url = f"udpin://127.0.0.1:{free_port()}"
    file = fleet(tmp_path, url, f", signing: {{key: {write_key(tmp_path)}}}")
    done = invoke(command_line.setup, "--fleet", file, "uav1", "--yes")
    assert f"uav1: no message of system 1 arrives on {url}" in done.output
    assert "Warning" not in done.output and done.exit_code == 1


def test_setup_over_the_command_line(tmp_path: Path, own_state: Path) -> None:
    new = tmp_path / "new.key"
    done = invoke(command_line.keygen, new)
    assert done.exit_code == 0 and f"signing: {{key: {new}}}" in done.output
    assert new.read_text().strip() not in done.output
    again = invoke(command_line.keygen, new)
    assert isinstance(again.exception, PluginError)

    async def both() -> None:
        async with Simulator(specs(Kind.ROVER), speed=10, to=None) as simulator:
            host, port = simulator[1].address
            file = fleet(tmp_path, f"udpout://{host}:{port}", f", signing: {{key: {new}}}")
            for command, signs in ((command_line.setup, True), (command_line.remove, False)):
                done = await asyncio.to_thread(invoke, command, "--fleet", file, "uav1", "--yes")
                assert done.exit_code == 0, done.output
                assert simulator[1].autopilot.signing.signing.sign_outgoing == signs

    asyncio.run(both())
    assert [each.name for each in own_state.iterdir()] == ["mavlink-signing.db"]
