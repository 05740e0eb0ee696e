"""The live server, from the side of a viewer that speaks Foxglove's protocol over WebSockets."""

import asyncio
import socket
import struct
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from typing import Any

import msgspec
import pytest
import websockets
from foxglove_schemas_protobuf.LocationFix_pb2 import LocationFix
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from m2pem_plugin_recorder.faces import FoxgloveFace
from recording_world import DRIVE, ROAD, simulated_fleet

from m2pem.api import FaceSettings, MissionControl
from m2pem.errors import PluginError
from m2pem.testing import run_executive
from m2pem.testing.harness import run_mission_on
from m2pem.testing.scenarios import drawn, question

PROTOCOL = websockets.Subprotocol("foxglove.sdk.v1")
MESSAGE_DATA = 1
ASK = b"""
<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" id="d" targetNamespace="d">
<process id="ASK" isExecutable="true"><startEvent id="s"/><userTask id="u"/><endEvent id="e"/>
<sequenceFlow id="su" sourceRef="s" targetRef="u"/>
<sequenceFlow id="ue" sourceRef="u" targetRef="e"/></process></definitions>
"""


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


@asynccontextmanager
async def served(control: MissionControl, port: int, **settings: Any) -> AsyncIterator[None]:
    face = FoxgloveFace(control, FaceSettings("foxglove", {"port": port, **settings}))
    task = asyncio.create_task(face.serve())
    try:
        yield
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


def entities(updates: Sequence[bytes]) -> set[str]:
    """The ids of the entities of the scene after these updates."""
    shown: set[str] = set()
    for each in map(SceneUpdate.FromString, updates):
        shown -= {deleted.id for deleted in each.deletions}
        shown |= {entity.id for entity in each.entities}
    return shown


class Viewer:
    """Subscribes to all channels, or to `only` one; `data` has what came, by topic."""

    def __init__(self, port: int, only: str = "") -> None:
        self._port = port
        self._only = only
        self.channels: dict[int, dict[str, Any]] = {}
        self.server: dict[str, Any] = {}
        self.status: list[str] = []
        self.data: dict[str, list[bytes]] = {}
        self.changed = asyncio.Condition()

    async def run(self) -> None:
        while True:
            try:
                async with websockets.connect(
                    f"ws://127.0.0.1:{self._port}", subprotocols=[PROTOCOL], max_size=None
                ) as self.socket:
                    async for message in self.socket:
                        await self.take(message)
                        async with self.changed:
                            self.changed.notify_all()
            except OSError:  # it is not there yet
                await asyncio.sleep(0.05)

    async def take(self, message: str | bytes) -> None:
        if isinstance(message, bytes):
            kind, subscription = struct.unpack_from("<BI", message)
            if kind == MESSAGE_DATA:
                topic = self.channels[subscription]["topic"]
                self.data.setdefault(topic, []).append(message[13:])
            return
        told = msgspec.json.decode(message)
        match told["op"]:
            case "serverInfo":
                self.server = told
            case "advertise":
                new = {each["id"]: each for each in told["channels"]}
                self.channels |= new
                asked = [
                    {"id": each, "channelId": each}
                    for each, channel in new.items()
                    if self._only in ("", channel["topic"])
                ]
                await self.send({"op": "subscribe", "subscriptions": asked})
            case "status":
                self.status.append(told["message"])

    async def send(self, message: dict[str, Any]) -> None:
        await self.socket.send(msgspec.json.encode(message).decode())

    async def until(self, condition: Any) -> None:
        async with asyncio.timeout(30.0), self.changed:
            await self.changed.wait_for(condition)


@asynccontextmanager
async def viewing(port: int, only: str = "") -> AsyncIterator[Viewer]:
    viewer = Viewer(port, only)
    task = asyncio.create_task(viewer.run())
    try:
        yield viewer
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


@pytest.mark.tried_with(
    "Foxglove's WebSocket protocol",
    "a viewer connects to the live view",
    kind="Recordings and analysis",
    result="records, positions and the scene",
    package="websockets",
    note="a client of the tests that speaks the protocol, not Foxglove",
)
async def test_a_viewer_gets_records_positions_and_the_scene() -> None:
    port = free_port()
    async with (
        run_executive(simulated_fleet(), speed=5.0) as control,
        served(control, port),
        viewing(port) as viewer,
    ):
        await viewer.until(lambda: "/ugv1/location" in viewer.data)
        result = await run_mission_on(control, DRIVE)
        records = viewer.data["/m2pem/records"]
        await viewer.until(lambda: len(records) == result.summary.records)
        await viewer.until(lambda: "/m2pem/scene" in viewer.data)
        run = await control.start(drawn(question(), lane=ROAD))
        await viewer.until(lambda: "r2/lane" in entities(viewer.data["/m2pem/scene"]))
        await control.stop(run)
        await viewer.until(lambda: "r2/lane" not in entities(viewer.data["/m2pem/scene"]))
    seen = [msgspec.json.decode(each) for each in records[: result.summary.records]]
    assert [each["seq"] for each in seen] == [each.seq for each in result.stamped]
    assert [each["record"] for each in seen] == [type(each).__name__ for each in result.records]
    fix = LocationFix.FromString(viewer.data["/ugv1/location"][-1])
    assert fix.frame_id == "ugv1/base_link"
    assert fix.latitude == pytest.approx(38.1075, abs=1e-3)
    assert "/ugv1/fix" not in viewer.data  # ROS's schemas are off unless they are asked for


async def test_viewers_only_read() -> None:
    port = free_port()
    async with (
        run_executive(simulated_fleet(), speed=5.0) as control,
        served(control, port),
        viewing(port) as viewer,
    ):
        await viewer.until(lambda: viewer.server)
        assert viewer.server["capabilities"] == []
        await viewer.send(
            {
                "op": "advertise",
                "channels": [{"id": 1, "topic": "/cmd", "encoding": "json", "schemaName": ""}],
            }
        )
        await viewer.until(lambda: viewer.status)
    assert "clientPublish" in viewer.status[0] or "publish" in viewer.status[0].lower()


async def test_a_viewer_that_never_reads_delays_nothing() -> None:
    port = free_port()
    async with (
        run_executive(simulated_fleet(), speed=20.0) as control,
        served(control, port, rate_hz=1000.0, ros=True, backlog=16),
        viewing(port) as viewer,
    ):
        await viewer.until(lambda: "/ugv1/location" in viewer.data)
        stalled = await websockets.connect(
            f"ws://127.0.0.1:{port}", subprotocols=[PROTOCOL], max_queue=1
        )
        every = [{"id": each, "channelId": each} for each in viewer.channels]
        await stalled.send(
            msgspec.json.encode({"op": "subscribe", "subscriptions": every}).decode()
        )
        stalled.transport.pause_reading()
        result = await run_mission_on(control, DRIVE)
        before = len(viewer.data["/ugv1/location"])
        await viewer.until(lambda: len(viewer.data["/ugv1/location"]) > before)
        stalled.transport.abort()
    assert result.summary.status == "completed"


async def test_a_port_that_is_taken_is_named() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        async with run_executive(simulated_fleet()) as control:
            face = FoxgloveFace(control, FaceSettings("foxglove", {"port": port}))
            with pytest.raises(PluginError, match=f"faces.foxglove.port: 127.0.0.1:{port}"):
                await face.serve()


@pytest.mark.parametrize(
    ("settings", "problem"),
    [
        ({"prot": 1}, "faces.foxglove.prot: there is no such setting; did you mean 'port'"),
        ({"port": "x"}, "faces.foxglove.port: 'x' is not a whole number"),
    ],
)
async def test_settings_are_checked(settings: dict[str, Any], problem: str) -> None:
    async with run_executive(simulated_fleet()) as control:
        with pytest.raises(PluginError, match=problem):
            FoxgloveFace(control, FaceSettings("foxglove", settings))


async def test_a_viewer_that_never_reads_does_not_keep_the_executive_from_its_end() -> None:
    port = free_port()
    async with asyncio.timeout(60.0):
        async with (
            run_executive(simulated_fleet(), speed=5.0) as control,
            served(control, port),
            viewing(port) as viewer,
        ):
            await viewer.until(lambda: "/ugv1/location" in viewer.data)
            stalled = await websockets.connect(f"ws://127.0.0.1:{port}", subprotocols=[PROTOCOL])
            stalled.transport.pause_reading()
    stalled.transport.abort()


async def test_questions_reach_a_viewer_that_subscribes_to_nothing_else() -> None:
    port = free_port()
    async with (
        run_executive(simulated_fleet(), speed=5.0) as control,
        served(control, port),
        viewing(port, "/m2pem/prompts") as viewer,
    ):
        await viewer.until(lambda: viewer.channels)
        await (await viewer.socket.ping())  # answered after the subscription was taken
        run = await control.start(ASK)
        await viewer.until(lambda: "/m2pem/prompts" in viewer.data)
        (prompt,) = control.prompts()
        await control.answer(run, prompt.prompt, "done")
        await viewer.until(lambda: len(viewer.data["/m2pem/prompts"]) == 2)
    assert [*viewer.data] == ["/m2pem/prompts"]
