"""Many MAVLink vehicles over UDP: what it costs to hear them, and how soon one is spoken to.

python -m bench.programs.mavlink_gateway load|signed|latency <vehicles> <messages a second> <s>

The vehicles are a process of their own: a socket each, a datagram a message, evenly spread. `load`:
what was lost, and CPU and memory of the hub; eleven kinds of messages are decoded. `signed`: the
same, all frames are signed, and checked. `latency`: the
milliseconds between the wish to send a command, which a thread gives to the event loop, and the
moment at which the vehicle's socket has it, by the kernel's time stamp. Needs Linux.
"""

import asyncio
import json
import multiprocessing
import random
import socket
import struct
import sys
import threading
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from multiprocessing.connection import Connection
from pathlib import Path
from statistics import quantiles
from tempfile import TemporaryDirectory
from typing import Any

from m2pem_plugin_mavlink.link.hub import shared_hub
from m2pem_plugin_mavlink.link.routed_link import RoutedLink, open_link
from m2pem_plugin_mavlink.link.udp import UdpEndpoint
from m2pem_plugin_mavlink.protocol.frames import encode
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.url import parse_url
from m2pem_plugin_mavlink.signing.key_file import read_key, write_new_key
from m2pem_plugin_mavlink.signing.policy import SigningPolicy
from m2pem_plugin_mavlink.signing.signature import Signer, Signing

from bench.measured import Stopwatch, peak_kb
from bench.programs.mavlink_frames import RATES_HZ, WANTED
from m2pem.api.clock import SystemClock

URL = "udpin://127.0.0.1:0"
SYSTEMS = 250
"""System ids that there are; more vehicles than that are components of them."""

COMMAND = message_type("COMMAND_LONG")
FRAME = struct.Struct("<xBxxBBBHB")
SO_TIMESTAMPNS = getattr(socket, "SO_TIMESTAMPNS", 35)
COMMANDS_PER_S = 100
TICK_S = 0.001


def address(vehicle: int) -> Address:
    """Of its autopilot."""
    return Address(vehicle % SYSTEMS + 1, vehicle // SYSTEMS + 1)


def vehicles(
    port: int, count: int, rate_hz: int, seconds: float, key: bytes | None, pipe: Connection
) -> None:
    """The other process: makes all known, streams when it is told to, and then says how many
    messages it has sent, how many of them are wanted, and which commands came when (ns since the
    epoch)."""
    sign = None if key is None else Signing(Signer(key, None), Path(), 0).sign
    rng = random.Random(2)
    names = rng.choices([*RATES_HZ], weights=[*RATES_HZ.values()], k=64)
    types = [message_type(name) for name in names]
    messages: list[Message] = [each.unpack(rng.randbytes(each.struct.size)) for each in types]
    sockets = []
    for _ in range(count):
        made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        made.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
        made.setblocking(False)
        made.bind(("127.0.0.1", 0))
        made.connect(("127.0.0.1", port))
        sockets.append(made)
    beat = message_type("HEARTBEAT").make(type=2)
    for vehicle, made in enumerate(sockets):
        made.send(encode(beat, 0, address(vehicle), sign))
    pipe.send("known")
    pipe.recv()
    sent = wanted = 0
    began_s = time.monotonic()
    while (elapsed_s := time.monotonic() - began_s) < seconds:
        due = int(elapsed_s * rate_hz * count)
        while sent < due:
            turn, vehicle = divmod(sent, count)
            frame = encode(messages[turn % 64], (turn + 1) & 255, address(vehicle), sign)
            sockets[vehicle].send(frame)
            sent += 1
            wanted += names[turn % 64] in WANTED
        time.sleep(TICK_S)
    pipe.send((sent, wanted))
    pipe.recv()
    pipe.send([each for made in sockets for each in commands(made)])


def commands(made: socket.socket) -> list[tuple[int, int]]:
    """The commands that have come to a socket: their numbers, and when."""
    found: list[tuple[int, int]] = []
    while True:
        try:
            data, (stamp, *_), _, _ = made.recvmsg(2048, 256)
        except BlockingIOError:
            return found
        length, _, _, _, low, _ = FRAME.unpack_from(data)
        if low == COMMAND.id:
            seconds, nanoseconds = struct.unpack("qq", stamp[2])
            payload = data[10 : 10 + length]
            found.append((int(COMMAND.unpack(payload).param1), seconds * 10**9 + nanoseconds))


@asynccontextmanager
async def streaming(
    count: int, rate_hz: int, seconds: float, policy: SigningPolicy | None = None
) -> AsyncIterator[tuple[list[RoutedLink], list[int], Connection]]:
    """Links to all vehicles, how many messages were handed over, and the pipe to their process."""
    clock = SystemClock()
    heard = [0]
    ids = [message_type(name).id for name in WANTED]

    def hear(_: Message, __: Address) -> None:
        heard[0] += 1

    links = []
    for vehicle in range(count):
        links.append(await open_link(address(vehicle), [URL], clock, signing=policy))
        if vehicle < SYSTEMS:
            links[-1].listen(ids, hear)
    endpoint = shared_hub().endpoint(parse_url(URL))
    assert isinstance(endpoint, UdpEndpoint)
    context = multiprocessing.get_context("spawn")
    ours, pipe = context.Pipe()
    key = None if policy is None else read_key(policy.key)
    arguments = (endpoint.port, count, rate_hz, seconds, key, pipe)
    process = context.Process(target=vehicles, args=arguments)
    process.start()
    assert await asyncio.to_thread(ours.recv) == "known"
    while len(endpoint.peers) < count:  # noqa: ASYNC110  # nobody tells
        await asyncio.sleep(0.01)
    yield links, heard, ours
    process.join()
    for link in links:
        await link.close()


def counted() -> tuple[int, int]:
    """How many frames came from all vehicles, and how many were lost."""
    endpoint = shared_hub().endpoint(parse_url(URL))
    senders = [each for peer in endpoint.peers.values() for each in peer.inbound.senders.values()]
    return sum(each.sent - each.lost for each in senders), sum(each.lost for each in senders)


async def until_quiet() -> None:
    """Wait until nothing more comes."""
    before = -1
    while before != counted()[0]:
        before = counted()[0]
        await asyncio.sleep(0.1)


async def signed(count: int, rate_hz: int, seconds: float) -> dict[str, float]:
    """Hear them, and check their signatures; timestamps are kept in a file."""
    with TemporaryDirectory() as folder:
        policy = SigningPolicy(Path(folder) / "key", state_folder=Path(folder))
        write_new_key(policy.key)
        return await load(count, rate_hz, seconds, policy)


async def load(
    count: int, rate_hz: int, seconds: float, policy: SigningPolicy | None = None
) -> dict[str, float]:
    """Hear them."""
    async with streaming(count, rate_hz, seconds, policy) as (_, heard, pipe):
        watch = Stopwatch()
        before = counted()[0]
        with watch:
            pipe.send("go")
            sent, wanted = await asyncio.to_thread(pipe.recv)
        await until_quiet()
        received = counted()[0] - before
        pipe.send("stop")
        assert await asyncio.to_thread(pipe.recv) == []
    assert received < sent or heard[0] == wanted + count, "not all that was wanted was decoded"
    return {
        "lost": float(sent - received),
        "messages_per_s": received / watch.wall_s,
        "cpu_percent": 100 * watch.cpu_s / watch.wall_s,
        "peak_mb": peak_kb() / 1024,
    }


async def latency(count: int, rate_hz: int, seconds: float) -> dict[str, float]:
    """Command them meanwhile."""
    wished_ns: list[int] = []
    loop = asyncio.get_running_loop()
    async with streaming(count, rate_hz, seconds) as (links, _, pipe):
        over = threading.Event()

        def command(number: int) -> None:
            link = links[number % count]
            system, component = link.address
            made: Any = COMMAND.make(
                target_system=system, target_component=component, param1=float(number)
            )
            link.send(made)

        def wish() -> None:
            rng = random.Random(3)
            while not over.wait(rng.uniform(0, 2 / COMMANDS_PER_S)):
                wished_ns.append(time.time_ns())
                loop.call_soon_threadsafe(command, len(wished_ns) - 1)

        pipe.send("go")
        wishing = threading.Thread(target=wish)
        wishing.start()
        sent, _ = await asyncio.to_thread(pipe.recv)
        over.set()
        wishing.join()
        await until_quiet()
        assert counted() == (sent + count, 0), "frames were lost"
        pipe.send("stop")
        came = dict(await asyncio.to_thread(pipe.recv))
    assert len(came) == len(wished_ns), f"{len(came)} of {len(wished_ns)} commands came"
    took_ms = [(came[number] - at) / 1e6 for number, at in enumerate(wished_ns)]
    cuts = quantiles(took_ms, n=100)
    return {"p50_ms": cuts[49], "p99_ms": cuts[98], "commands": float(len(took_ms))}


def main() -> None:
    """The command."""
    kinds = {"load": load, "signed": signed, "latency": latency}
    kind, count, rate_hz, seconds = sys.argv[1:]
    print(json.dumps(asyncio.run(kinds[kind](int(count), int(rate_hz), float(seconds)))))


if __name__ == "__main__":
    main()
