"""From a vehicle of one protocol to a program of the other: how late a position is.

python -m bench.programs.face_latency mavlink_ros|ros_mavlink|udp|ros <s>

`mavlink_ros`: from a MAVLink vehicle's `send` to the callback of a node in plain rclpy that
subscribes to `/v0/odom` of the face, whose rate is the highest (100 Hz). `ros_mavlink`: from
`publish` of a ROS rover's odometry to a ground station's socket, which has GLOBAL_POSITION_INT at
the highest rate (20 Hz: of up to 50 ms, half is the wait for the next message). `udp`, `ros`: the
raw paths: the same programs of one protocol, without m2pem between. A vehicle tells its position
ten times a second, at random times, so that each has a place of its own.
"""

import asyncio
import json
import multiprocessing
import random
import selectors
import socket
import sys
import threading
import time
from contextlib import ExitStack, suppress
from multiprocessing.connection import Connection
from pathlib import Path
from statistics import quantiles
from typing import Any

from m2pem_plugin_mavlink.protocol.messages import message_type
from m2pem_plugin_ros.testing import Peer

from bench.programs.face_load import udp_port
from bench.programs.face_readers import face
from bench.programs.mavlink_frames import RATES_HZ
from bench.programs.mavlink_gateway import FRAME
from bench.programs.mavlink_rovers import HOME, Rover
from bench.programs.ros_stage import own_domain
from m2pem.api.clock import SystemClock
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet import Domain, Fleet, Vehicle
from m2pem.journal import MemoryJournal
from m2pem.mission.catalogue import ResourceId
from m2pem.plugins import PluginManager

RATE_HZ = 10.0
STEP_E7 = 90
"""Of latitude: a metre."""
METRES_PER_E7 = 111_195e-7
WARM_S = 3.0
POSITIONS = Path(__file__).with_name("ros_positions.py")
POSITION = message_type("GLOBAL_POSITION_INT")

Times = dict[int, int]
"""When (ns since the epoch) a position was sent, or first came, by its number."""


def rover(port: int, pipe: Connection) -> None:
    """A process: a MAVLink rover that moves until it is told to stop, and then says when."""
    moving = Rover(0, port)
    latitude = round(HOME[0] * 1e7)
    longitude = round(HOME[1] * 1e7)
    sent: Times = {}
    rng = random.Random(6)
    others = [name for name in RATES_HZ if name != "GLOBAL_POSITION_INT"]
    next_s = other_s = time.monotonic()
    with selectors.DefaultSelector() as selector:
        selector.register(moving.socket, selectors.EVENT_READ)
        while not pipe.poll():
            selector.select(0.002)
            with suppress(ConnectionRefusedError):  # the executive has ended
                moving.hear(pipe)
                now_s = time.monotonic()
                if now_s >= other_s:
                    other_s += 0.02
                    moving.tell(others[rng.randrange(len(others))])
                if now_s >= next_s:
                    next_s += rng.uniform(0.5, 1.5) / RATE_HZ
                    number = len(sent) + 1
                    place = POSITION.make(lat=latitude + number * STEP_E7, lon=longitude)
                    sent[number] = time.time_ns()
                    moving.send(place)
    pipe.recv()
    pipe.send(sent)


class Station:
    """A ground station's socket, which reads in a thread."""

    def __init__(self) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.port: int = self.socket.getsockname()[1]
        self.came: Times = {}
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        while True:
            data, _ = self.socket.recvfrom(2048)
            at_ns = time.time_ns()
            length, _, _, _, low, high = FRAME.unpack_from(data)
            if low | high << 16 == POSITION.id:
                place: Any = POSITION.unpack(data[10 : 10 + length])
                number = round((place.lat - HOME[0] * 1e7) / STEP_E7)
                self.came.setdefault(number, at_ns)


def read(peer: Peer, times: Times, metres: float) -> None:
    """Take what a node prints, from now on, in a thread. `metres`: from a place to the next."""

    def take() -> None:
        assert peer.process.stdout is not None
        for line in peer.process.stdout:
            north, at_ns = line.split()
            times.setdefault(round(float(north) / metres), int(at_ns))

    threading.Thread(target=take, daemon=True).start()


def percentiles(sent: Times, came: Times) -> dict[str, float]:
    """Of those that came."""
    took_ms = [(at_ns - sent[number]) / 1e6 for number, at_ns in came.items() if number in sent]
    cuts = quantiles(took_ms, n=100)
    return {"p50_ms": cuts[49], "p99_ms": cuts[98], "positions": float(len(took_ms))}


async def shown(vehicle: Vehicle, name: str, settings: dict[str, Any], seconds: float) -> None:
    """An executive with a face, for a while."""
    fleet = Fleet("bench", "bench.yaml", {vehicle.id: vehicle}, origin=(*HOME, 0.0))
    async with Executive(fleet, MemoryJournal(), PluginManager(), SystemClock()) as running:
        serving = asyncio.create_task(face(name, running.control, settings).serve())
        await asyncio.sleep(WARM_S + seconds)
        serving.cancel()
        await asyncio.gather(serving, return_exceptions=True)


def started(port: int, stack: ExitStack) -> Connection:
    """The rover, and the pipe to it."""
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=rover, args=(port, theirs), daemon=True)
    process.start()
    stack.callback(process.join)
    return ours


def moved(pipe: Connection) -> Times:
    """Stop the rover; when it told its positions."""
    pipe.send("stop")
    while True:
        found: Any = pipe.recv()
        if isinstance(found, dict):
            return found


def measure(kind: str, domain: int, seconds: float, stack: ExitStack) -> dict[str, float]:
    """Measure one of the paths."""
    published: Times = {}
    came: Times = {}
    v0 = ResourceId("v0")

    def peer(what: str) -> Peer:
        arguments = (what, "/v0/odom", str(RATE_HZ))
        return stack.enter_context(Peer(POSITIONS, domain, arguments, forked=False))

    if kind == "udp":
        station = Station()
        pipe = started(station.port, stack)
        time.sleep(WARM_S + seconds)
        return percentiles(moved(pipe), station.came)
    if kind == "mavlink_ros":
        read(peer("read"), came, STEP_E7 * METRES_PER_E7)
        port = udp_port()
        pipe = started(port, stack)
        connection = {"url": f"udpin://127.0.0.1:{port}", "system_id": 1}
        vehicle = Vehicle(v0, Domain.GROUND, "mavlink", connection, sitl=True)
        options = {"domain_id": domain, "rate": "100 Hz"}
        asyncio.run(shown(vehicle, "ros", options, seconds))
        return percentiles(moved(pipe), came)
    if kind == "ros":
        read(peer("read"), came, 1.0)
    read(peer("publish"), published, 1.0)
    if kind == "ros":
        time.sleep(WARM_S + seconds)
        return percentiles(published, came)
    station = Station()
    vehicle = Vehicle(
        v0, Domain.GROUND, "ros", {"namespace": "/v0", "domain_id": domain}, sitl=True
    )
    options = {
        "url": f"udpout://127.0.0.1:{station.port}",
        "rates": {"GLOBAL_POSITION_INT": "20 Hz"},
    }
    asyncio.run(shown(vehicle, "mavlink", options, seconds))
    return percentiles(published, station.came)


def main() -> None:
    """The command."""
    with own_domain() as domain, ExitStack() as stack:
        answer = measure(sys.argv[1], domain, float(sys.argv[2]), stack)
    print(json.dumps(answer))


if __name__ == "__main__":
    main()
