"""Frames that are kept whole: signatures, unknown messages, garbage; and taps of endpoints."""

import asyncio

from hypothesis import given
from hypothesis import strategies as st
from m2pem_plugin_mavlink.link.hub import shared_hub
from m2pem_plugin_mavlink.link.routed_link import open_link
from m2pem_plugin_mavlink.protocol.messages import Address
from m2pem_plugin_mavlink.protocol.raw_frames import EVERYONE, FrameSplitter, target_offsets
from mavlink_mavsdk_world import free_port, scripted
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import SystemClock

STATION = Address(254, 190)


def command(seq: int = 7, signed: bool = False, v1: bool = False) -> bytes:
    mav = dialect.MAVLink(None, *STATION)
    mav.seq = seq
    if signed:
        mav.signing.secret_key = b"k" * 32
        mav.signing.link_id = 3
        mav.signing.sign_outgoing = True
    message = dialect.MAVLink_command_long_message(3, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0)
    return bytes(message.pack(mav, force_mavlink1=v1))


UNKNOWN = b"\xfd\x02\x00\x00\x05\x03\x01\xff\xff\x05\x03\x01\x00\x00"
"""Message 393,215, which no dialect has."""


def test_frames_are_returned_with_their_bytes_sender_and_target() -> None:
    for data in (command(), command(signed=True), command(v1=True)):
        (frame,) = FrameSplitter().datagram(data)
        assert frame.data == data
        assert (frame.source, frame.target) == (STATION, Address(3, 1))
        assert frame.id == dialect.MAVLINK_MSG_ID_COMMAND_LONG


def test_unknown_messages_pass_and_are_for_everyone() -> None:
    (frame,) = FrameSplitter().datagram(UNKNOWN)
    assert (frame.data, frame.source, frame.target) == (UNKNOWN, Address(3, 1), EVERYONE)


def test_damaged_frames_are_left_out_and_those_behind_them_are_found() -> None:
    damaged = bytearray(command())
    damaged[12] ^= 1
    frames = FrameSplitter().datagram(bytes(damaged) + command(8))
    assert [frame.data for frame in frames] == [command(8)]


@given(st.lists(st.integers(1, 60), max_size=20))
def test_a_stream_gives_the_same_frames_wherever_it_is_cut(cuts: list[int]) -> None:
    sent = [command(), b"noise", command(8, signed=True), UNKNOWN, command(9, v1=True)]
    data, splitter = b"".join(sent), FrameSplitter()
    found = []
    for cut in [*cuts, len(data)]:
        found += splitter.stream(data[:cut])
        data = data[cut:]
    assert [frame.data for frame in found] == [each for each in sent if each != b"noise"]


@given(st.binary(max_size=600))
def test_garbage_raises_nothing(data: bytes) -> None:
    splitter = FrameSplitter()
    splitter.datagram(data)
    splitter.stream(data)


def test_targets_are_where_the_dialect_has_them() -> None:
    for id_ in (dialect.MAVLINK_MSG_ID_HEARTBEAT, dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT):
        assert target_offsets(id_) == (None, None)
    assert target_offsets(dialect.MAVLINK_MSG_ID_COMMAND_LONG) == (30, 31)


def test_taps_of_the_hub_get_the_bytes_of_known_peers() -> None:
    async def main() -> None:
        port, tapped, got = free_port(), [], asyncio.Event()

        def tap(endpoint: object, peer: object, data: bytes) -> None:
            tapped.append(data)
            got.set()

        link = await open_link(Address(1, 1), [f"udpin://127.0.0.1:{port}"], SystemClock())
        shared_hub().taps.append(tap)
        async with scripted(port), asyncio.timeout(20):
            await got.wait()
            assert [peer.name for peer in shared_hub().owners(1, 1)]
        assert shared_hub().owners(2, 1) == []
        shared_hub().taps.remove(tap)
        await link.close()
        (frame,) = FrameSplitter().datagram(tapped[0])
        assert frame.source == Address(1, 1)

    asyncio.run(main())
