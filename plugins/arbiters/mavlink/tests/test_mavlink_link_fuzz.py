"""Whatever comes, nothing breaks, nothing grows, and no vehicle gets what is for another.

The long test goes on for M2PEM_FUZZ_S seconds (300).
"""

import asyncio
import gc
import os
import random
import socket
import sys
import time
from collections.abc import Iterator

import pytest
from m2pem_plugin_mavlink.link.hub import shared_hub
from m2pem_plugin_mavlink.link.routed_link import RoutedLink, open_link
from m2pem_plugin_mavlink.link.udp import UdpEndpoint
from m2pem_plugin_mavlink.protocol.frames import clean, encode, read, right
from m2pem_plugin_mavlink.protocol.inbound import MOST_SENDERS, Inbound, Sender, Wanted
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type, types_by_id
from m2pem_plugin_mavlink.protocol.url import parse_url
from mavlink_memory import held_bytes
from mavlink_wire import HandClock, until

FORGED_IN = 10_000
LONG_S = float(os.environ.get("M2PEM_FUZZ_S", "300"))
SHORT_ROUNDS = 150
GROWTH_BLOCKS = 2_000
MOST_UNFINISHED_BYTES = 1_000
"""The rest of a stream, less than one frame, and the object that keeps it."""
"""Objects that may be more at the end than after the first rounds: caches that fill late."""

EVERY = list(types_by_id().values())
COMMAND = message_type("COMMAND_LONG")
URL = "udpin://127.0.0.1:0"


def rounds(seconds: float | None) -> Iterator[int]:
    number = 0
    end_s = time.monotonic() + (seconds or 0.0)
    while number < SHORT_ROUNDS or (seconds is not None and time.monotonic() < end_s):
        yield number
        number += 1


def any_frame(rng: random.Random, source: Address) -> bytes:
    type_ = rng.choice(EVERY)
    message: Message = type_.unpack(rng.randbytes(rng.choice([0, 1, type_.struct.size])))
    return encode(message, rng.randrange(256), source)


def mutated(rng: random.Random, frame: bytes) -> bytes:
    made = bytearray(frame)
    for _ in range(rng.choice([1, 1, 2, 5])):
        match rng.randrange(6):
            case 0:
                made[rng.randrange(len(made))] = rng.randrange(256)
            case 1 if len(made) > 1:
                del made[rng.randrange(len(made)) :]
            case 2 if len(made) > 1:
                made[1] = rng.choice([0, 1, 254, 255])
            case 3:
                made[rng.randrange(len(made)) : 0] = rng.randbytes(rng.randrange(9))
            case 4:
                made += rng.choice([b"\xfd", b"\xfe", b"\xfd\xff", bytes(made), b"\xfe" * 300])
            case 5 if len(made) > 2:
                made[2] = rng.choice([1, 2, 255])
        if not made:
            break
    return bytes(made)


def hostile(rng: random.Random, source: Address) -> bytes:
    """A datagram, or a piece of a stream."""
    match rng.randrange(5):
        case 0:
            return rng.randbytes(rng.randrange(600))
        case 1:
            return bytes(rng.choices([0xFD, 0xFE, 0, 255], k=rng.randrange(600)))
        case 2:
            return any_frame(rng, source)
        case 3:
            return b"".join(any_frame(rng, source) for _ in range(rng.randrange(1, 5)))
        case _:
            return mutated(rng, any_frame(rng, source))


def blocks() -> int:
    gc.collect()
    return sys.getallocatedblocks()


def listen_to_frames(seconds: float | None) -> None:
    """Datagrams and a stream, without I/O; between the hostile ones are right ones."""
    rng = random.Random(8 if seconds is None else None)
    heard: list[int] = []
    source = Address(77, 7)
    heartbeat = message_type("HEARTBEAT")
    # Everything is wanted of everybody, so that everything is decoded.
    wanted = {
        each.id: Wanted(each, (lambda message, _: heard.append(message.custom_mode),))
        if each is heartbeat
        else Wanted(each, (lambda message, _: None,))
        for each in EVERY
    }

    def meet(sender: Sender) -> bool:
        sender.wanted = wanted
        return True

    datagrams, stream = Inbound(meet), Inbound(meet)
    now_s = 0.0
    before = missed = 0
    for number in rounds(seconds):
        for _ in range(20):
            now_s += rng.choice([0.001, 0.1, 2.0])
            anybody = Address(rng.randrange(16), rng.randrange(4))
            datagrams.datagram(hostile(rng, anybody), now_s)
            stream.stream(hostile(rng, anybody), now_s)
        assert held_bytes(stream) - held_bytes(stream.senders) < MOST_UNFINISHED_BYTES
        mode = 10_000_000 + number
        sent = encode(heartbeat.make(custom_mode=mode), number & 255, source)
        heard.clear()
        datagrams.datagram(sent, now_s)
        assert heard == [mode]
        # What looks like the beginning of a frame may hide others for as long as it is waited for.
        for _ in range(3):
            stream.stream(sent, now_s)
            now_s += 1.1
        missed += mode not in heard[1:]
        # Of hostile bytes that look like a frame and take others for their own, one in 65,536 has
        # the right checksum by chance.
        assert missed <= 1 + number // FORGED_IN
        assert max(len(datagrams.senders), len(stream.senders)) <= MOST_SENDERS
        if number == SHORT_ROUNDS // 2:
            before = blocks()
    assert blocks() - before < GROWTH_BLOCKS


def test_hostile_bytes_break_nothing() -> None:
    listen_to_frames(None)


@pytest.mark.long
@pytest.mark.timeout(LONG_S + 60)
def test_hostile_bytes_break_nothing_for_long() -> None:
    listen_to_frames(LONG_S / 2)


class End:
    """A UDP socket of a vehicle, or of who says to be one."""

    def __init__(self, port: int, system: int) -> None:
        self.system = system
        self.sequence = 0
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.connect(("127.0.0.1", port))
        self.socket.setblocking(False)

    def beat(self, mode: int = 0) -> None:
        message = message_type("HEARTBEAT").make(custom_mode=mode)
        self.socket.send(encode(message, self.sequence, Address(self.system, 1)))
        self.sequence = (self.sequence + 1) & 255

    def commands(self) -> list[Message]:
        """Those that have come since this was asked last."""
        found = []
        while True:
            try:
                data = self.socket.recv(65_535)
            except BlockingIOError:
                return found
            for frame in clean(data) or ():
                header = read(frame)
                assert header is not None and right(frame, header.id)
                if header.id == COMMAND.id:
                    found.append(COMMAND.unpack(header.payload))


async def command_vehicles(seconds: float | None) -> None:
    """Each is commanded all the time, while others say to be it."""
    rng = random.Random(9 if seconds is None else None)
    clock = HandClock()
    systems = range(1, 6)
    links = [await open_link(Address(system, 1), [URL], clock) for system in systems]
    endpoint = shared_hub().endpoint(parse_url(URL))
    assert isinstance(endpoint, UdpEndpoint)
    modes: dict[int, int] = {}
    for link in links:
        link.listen([0], lambda message, sender: modes.update({sender.system: message.custom_mode}))
    vehicles = [End(endpoint.port, system) for system in systems]
    await beaten(vehicles, modes, 1)
    liars = [End(endpoint.port, rng.choice(systems)) for _ in range(10)]
    before = 0
    for number in rounds(seconds):
        for _ in range(10):
            liar = rng.choice(liars)
            if rng.random() < 0.3:
                liar.beat(mode=0xFFFFFFFF)
            else:
                component = rng.choice([0, 1, 1, 154])
                liar.socket.send(hostile(rng, Address(rng.choice([*systems, 0]), component)))
        await beaten(vehicles, modes, 2 + number)
        for link in links:
            command(link, number)
        for vehicle in vehicles:
            (got,) = await commanded(vehicle)
            assert (got.target_system, got.param1) == (vehicle.system, number % 1_000)
        assert [liar.commands() for liar in liars] == [[]] * len(liars)
        await clock.turn(0.3)
        assert len(endpoint.peers) <= len(vehicles) + len(liars)
        if number == SHORT_ROUNDS // 2:
            before = blocks()
    assert blocks() - before < GROWTH_BLOCKS
    for link in links:
        await link.close()
    for end in (*vehicles, *liars):
        end.socket.close()


async def beaten(vehicles: list[End], modes: dict[int, int], mode: int) -> None:
    for vehicle in vehicles:
        vehicle.beat(mode)
    await until(lambda: modes == {vehicle.system: mode for vehicle in vehicles})


def command(link: RoutedLink, number: int) -> None:
    system, component = link.address
    link.send(COMMAND.make(target_system=system, target_component=component, param1=number % 1_000))


async def commanded(vehicle: End) -> list[Message]:
    found: list[Message] = []
    await until(lambda: found.extend(vehicle.commands()) or found)  # type: ignore[func-returns-value]
    return found


async def test_no_vehicle_gets_what_is_for_another() -> None:
    await command_vehicles(None)


@pytest.mark.long
@pytest.mark.timeout(LONG_S + 60)
def test_no_vehicle_gets_what_is_for_another_for_long() -> None:
    asyncio.run(command_vehicles(LONG_S / 2))
