"""A mosquitto of the tests' own, simulated vehicles in a process of their own, and a judge that
validates every message of both sides by the schemas of VDA 5050."""

import json
import os
import re
import shutil
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import paho.mqtt.client as mqtt
import pytest
from jsonschema import Draft202012Validator
from ruamel.yaml import YAML

REPOSITORY = Path(__file__).parents[4]
ORIGIN = {"lat": 38.1075, "lon": -77.3192, "alt": 60.0}
AMPLE_S = 60.0
TOPICS = ("order", "instantActions", "state", "visualization", "connection", "factsheet")
TIMESTAMP = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{2,6}Z")


def until(true: Callable[[], Any], what: Callable[[], object] = str) -> Any:
    """Wait until something is so, as another process decides when."""
    deadline_s = time.monotonic() + AMPLE_S
    while not (value := true()):
        assert time.monotonic() < deadline_s, f"not within {AMPLE_S:g} s: {what()}"
        time.sleep(0.02)
    return value


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def schemas() -> dict[str, Draft202012Validator]:
    """Return the schemas of the protocol: those of the folder `M2PEM_VDA5050` (json_schemas of
    VDA5050/VDA5050), else those in the package vda5050-sdk, which has copies of them."""
    folder = os.environ.get("M2PEM_VDA5050")
    if folder is not None:
        files = {topic: Path(folder) / f"{topic}.schema" for topic in TOPICS}
    else:
        spec = find_spec("vda5050")
        assert spec is not None and spec.submodule_search_locations, "vda5050-sdk has the schemas"
        package = Path(next(iter(spec.submodule_search_locations)))
        files = {topic: package / "validation" / "schemas" / f"{topic}.json" for topic in TOPICS}
    return {
        topic: Draft202012Validator(json.loads(file.read_text(encoding="utf-8")))
        for topic, file in files.items()
    }


class Mosquitto:
    """A broker on a free port of 127.0.0.1, without persistence. `lines`: more of its settings."""

    def __init__(self, folder: Path, lines: Sequence[str] = (), anonymous: bool = True) -> None:
        self.port = free_port()
        self._config = folder / "mosquitto.conf"
        self._log = folder / "mosquitto.log"
        allow = "true" if anonymous else "false"
        text = [f"listener {self.port} 127.0.0.1", f"allow_anonymous {allow}", "persistence false"]
        if os.geteuid() == 0:
            text.append("user root")  # of files that only root may read
        self._config.write_text("\n".join([*text, *lines]) + "\n")
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def url(self) -> str:
        return f"mqtt://127.0.0.1:{self.port}"

    def start(self) -> None:
        program = shutil.which("mosquitto", path=f"{os.environ['PATH']}:/usr/sbin")
        if program is None:
            pytest.fail("mosquitto is not installed: make setup installs it (Debian: mosquitto)")
        with self._log.open("ab") as log:
            words = [program, "-c", str(self._config)]
            self._process = subprocess.Popen(words, stdout=log, stderr=log)
        until(self._listens, self._log.read_text)

    def stop(self) -> None:
        """End it, as a crash would."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None

    def _listens(self) -> bool:
        assert self._process is not None and self._process.poll() is None, self._log.read_text()
        with socket.socket() as probe:
            return probe.connect_ex(("127.0.0.1", self.port)) == 0


class Judge:
    """Hears everything at the broker. `problems`: what is not VDA 5050."""

    def __init__(self, port: int) -> None:
        self.heard: list[tuple[str, dict[str, Any]]] = []
        self.qos: dict[str, set[int]] = {}
        self.problems: list[str] = []
        self._schemas = schemas()
        self._subscribed = threading.Event()
        self._client = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2, "judge")
        self._client.reconnect_delay_set(1, 1)
        self._client.on_connect = self._connect
        self._client.on_subscribe = lambda *_: self._subscribed.set()
        self._client.on_message = self._hear
        self._client.connect_async("127.0.0.1", port)
        self._client.loop_start()
        assert self._subscribed.wait(AMPLE_S)

    def close(self) -> None:
        self._client.disconnect()
        self._client.loop_stop()

    def publish(self, topic: str, payload: str | bytes, retain: bool = False) -> None:
        self._client.publish(topic, payload, retain=retain).wait_for_publish(AMPLE_S)

    def of(self, topic: str, vehicle: str = "") -> list[dict[str, Any]]:
        """Return the messages on a topic, in order; `vehicle`: the serial number."""
        end = f"{vehicle}/{topic}" if vehicle else f"/{topic}"
        return [message for name, message in list(self.heard) if name.endswith(end)]

    def until(self, topic: str, vehicle: str, true: Callable[[dict[str, Any]], bool]) -> Any:
        """Wait for a message, also one that was heard before."""
        return until(
            lambda: next(filter(true, self.of(topic, vehicle)), None),
            lambda: self.of(topic, vehicle)[-3:],
        )

    def _connect(self, client: mqtt.Client, *_: Any) -> None:
        client.subscribe("#", qos=1)

    def _hear(self, _client: Any, _data: Any, message: mqtt.MQTTMessage) -> None:
        topic = message.topic.rpartition("/")[2]
        if topic not in self._schemas or not message.payload:  # empty: what was retained is cleared
            return
        self.qos.setdefault(topic, set()).add(message.qos)
        try:
            body = json.loads(message.payload)
        except (ValueError, RecursionError) as error:
            self.problems.append(f"{message.topic}: {error}")
            return
        if not isinstance(body, dict):
            self.problems.append(f"{message.topic}: it is no object")
            return
        for error in self._schemas[topic].iter_errors(body):
            place = "/".join(map(str, error.absolute_path))
            self.problems.append(f"{message.topic}: {place}: {error.message[:300]}")
        if topic != "visualization" and not TIMESTAMP.fullmatch(str(body.get("timestamp"))):
            self.problems.append(f"{message.topic}: timestamp {body.get('timestamp')!r}")
        self.heard.append((message.topic, body))


def connection(url: str, name: str, **more: Any) -> dict[str, Any]:
    """Return the connection of a simulated vehicle, as a fleet file has it."""
    return {
        "url": url,
        "manufacturer": "m2pem",
        "serial_number": name,
        "map": {"id": "hall", "rotation": "30 deg"},
        **more,
    }


def write_fleet(file: Path, connections: Mapping[str, Mapping[str, Any]], **more: Any) -> Path:
    """Write a fleet of simulated vehicles; `more`: keys of every vehicle."""
    fleet = {
        "version": 1,
        "name": "hall",
        "origin": ORIGIN,
        "vehicles": {
            name: {
                "domain": "ground",
                "arbiter": "vda5050",
                "sitl": True,
                "connection": dict(each),
                **more,
            }
            for name, each in connections.items()
        },
    }
    with file.open("w", encoding="utf-8") as stream:
        YAML().dump(fleet, stream)
    return file


def child_environment(folder: Path) -> dict[str, str]:
    """Return the environment of programs: the modules of these tests, and a home of their own."""
    more = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    modules = os.pathsep.join([str(REPOSITORY), *filter(None, more)])
    return {**os.environ, "HOME": str(folder), "PYTHONPATH": modules}


class SimProcess:
    """`m2pem sim vda5050` in a process of its own; what it prints is in `lines`."""

    def __init__(self, fleet: Path, speed: float = 1.0) -> None:
        words = [sys.executable, "-m", "m2pem", "sim", "vda5050", "--fleet", str(fleet)]
        self._errors = fleet.with_suffix(".sim.log")
        with self._errors.open("ab") as errors:
            self._process = subprocess.Popen(
                [*words, "--speed", f"{speed:g}"],
                env=child_environment(fleet.parent),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=errors,
                text=True,
            )
        self.lines: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self.until_line("ready")

    def until_line(self, text: str, after: int = 0) -> str:
        """Wait until it has printed a line with this text."""
        return str(
            until(
                lambda: next((each for each in self.lines[after:] if text in each), ""),
                lambda: (self.lines[-10:], self._errors.read_text()),
            )
        )

    def fault(self, text: str) -> None:
        """Have something go wrong now."""
        before = len(self.lines)
        assert self._process.stdin is not None
        self._process.stdin.write(f"{text}\n")
        self._process.stdin.flush()
        self.until_line(f"fault: {text}", before)

    def count(self, text: str) -> int:
        return sum(text in line for line in self.lines)

    def kill(self) -> None:
        """End it as a power failure would."""
        self._process.kill()
        self._process.wait()

    def close(self) -> None:
        for pipe in (self._process.stdin,):
            if pipe is not None:
                pipe.close()
        if self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(10)
            except subprocess.TimeoutExpired:
                self.kill()
        self._reader.join(AMPLE_S)
        if self._process.stdout is not None:
            self._process.stdout.close()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self.lines.append(line.rstrip("\n"))
