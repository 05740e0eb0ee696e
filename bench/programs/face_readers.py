"""Programs on the other side of faces that connect, ask for all there is, and never read."""

import os
import socket
import time
from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

from websockets.frames import Frame, Opcode

from m2pem.api import Face, FaceSettings, MissionControl

PATIENCE_S = 20.0
FEW_BYTES = 2048
"""Of what waits for a reader in the kernel."""
SCRAPES = 8
CHANNELS = range(1, 11)

HEARTBEAT_255 = bytes.fromhex("fd06000000ffbe0000000000000006083861")
"""Of a ground station, system 255."""


class Reader:
    """One of them. `settings`: of the face; `vehicles`: how many the fleet has, v0, v1 and so on.
    `connect` is called when the face is served."""

    def __init__(self, folder: Path) -> None:
        self.settings: Mapping[str, Any] = {}
        self.vehicles = 0
        self.open: list[socket.socket] = []

    def connect(self) -> None:
        """Connect, and ask. Blocks until the face answers."""

    def close(self) -> None:
        """Go away."""
        for each in self.open:
            each.close()

    def client(self, port: int) -> socket.socket:
        """A connection to a port that is opened soon."""
        until_s = time.monotonic() + PATIENCE_S
        while True:
            made = socket.socket()
            made.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, FEW_BYTES)
            try:
                made.connect(("127.0.0.1", port))
            except OSError:
                made.close()
                if time.monotonic() > until_s:
                    raise
                time.sleep(0.02)
            else:
                self.open.append(made)
                return made


class Listener(Reader):
    """Takes connections (the kernel does it), and nothing else."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        made = socket.create_server(("127.0.0.1", 0))
        made.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, FEW_BYTES)
        self.open.append(made)
        self.port: int = made.getsockname()[1]


class Collector(Listener):
    """Of OpenTelemetry."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self.settings = {"endpoint": f"http://127.0.0.1:{self.port}", "interval": 1.0}


class TakServer(Listener):
    """Of Cursor on Target."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self.settings = {"url": f"tcp://127.0.0.1:{self.port}", "rate": "20 Hz"}


class GroundStation(Reader):
    """Of MAVLink, over TCP."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self._port = free_port()
        self.settings = {"url": f"tcpin://127.0.0.1:{self._port}"}

    def connect(self) -> None:
        """See `Reader`."""
        self.client(self._port).send(HEARTBEAT_255)


class Scraper(Reader):
    """Of /metrics: several at once."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self._port = free_port()
        self.settings = {"port": self._port}

    def connect(self) -> None:
        """See `Reader`."""
        for _ in range(SCRAPES):
            self.client(self._port).send(b"GET /metrics HTTP/1.1\r\n\r\n")


class FoxgloveViewer(Reader):
    """Subscribes to all channels."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self._port = free_port()
        self.settings = {"port": self._port}

    def connect(self) -> None:
        """See `Reader`."""
        connected = self.client(self._port)
        connected.send(
            b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
            b"Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n"
        )
        assert connected.recv(12) == b"HTTP/1.1 101"
        asked = ",".join(f'{{"id":{each},"channelId":{each}}}' for each in CHANNELS)
        text = f'{{"op":"subscribe","subscriptions":[{asked}]}}'
        connected.send(Frame(Opcode.TEXT, text.encode()).serialize(mask=True))


class Disk(Reader):
    """Of recordings; it takes everything."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self.settings = {"folder": str(folder / "recordings"), "min_free_mb": 0}


class RosSubscriber(Reader):
    """A process that subscribes to all topics of vehicles, and is stopped (SIGSTOP) when the first
    messages have come."""

    def connect(self) -> None:
        """See `Reader`."""
        from m2pem_plugin_ros.testing import Peer  # noqa: PLC0415  # ROS is not always there

        program, domain = Path(__file__).with_name("ros_reader.py"), os.environ["ROS_DOMAIN_ID"]
        self._peer = Peer(program, int(domain), ("stop", str(self.vehicles)), forked=False)
        self._peer.wait_for("stopped")

    def close(self) -> None:
        """See `Reader`."""
        self._peer.kill()


READERS: Mapping[str, Callable[[Path], Reader]] = {
    "otlp": Collector,
    "cot": TakServer,
    "mavlink": GroundStation,
    "prometheus": Scraper,
    "foxglove": FoxgloveViewer,
    "recorder": Disk,
    "ros": RosSubscriber,
}


CLASSES: Mapping[str, tuple[str, str]] = {
    "otlp": ("m2pem_plugin_opentelemetry.otlp", "OtlpFace"),
    "prometheus": ("m2pem_plugin_opentelemetry.prometheus", "PrometheusFace"),
    "cot": ("m2pem_plugin_cot.face", "CotFace"),
    "foxglove": ("m2pem_plugin_recorder.faces", "FoxgloveFace"),
    "recorder": ("m2pem_plugin_recorder.faces", "RecorderFace"),
    "mavlink": ("m2pem_plugin_mavlink.face.face", "MavlinkFace"),
    "ros": ("m2pem_plugin_ros.face.face", "RosFace"),
}
"""Where each face is: not all plugins are installed wherever ROS is."""


def face(name: str, control: MissionControl, settings: Mapping[str, Any]) -> Face:
    """Make a face."""
    module, kind = CLASSES[name]
    made: Face = getattr(import_module(module), kind)(control, FaceSettings(name, settings))
    return made


def free_port() -> int:
    """A port that is free now."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])
