"""One peer: whose frames are heard, counted and handed over."""

import logging
import random
from collections.abc import Callable
from itertools import pairwise

import pytest
from m2pem_plugin_mavlink.protocol.frames import encode
from m2pem_plugin_mavlink.protocol.inbound import (
    MOST_SENDERS,
    NOTHING,
    UNFINISHED_S,
    Inbound,
    Listener,
    Sender,
    Wanted,
)
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from mavlink_memory import held_bytes

VEHICLE = Address(3, 1)
HEARTBEAT = message_type("HEARTBEAT")
ATTITUDE = message_type("ATTITUDE")


class Ear:
    """An inbound side that wants heartbeats of whoever it lets in."""

    def __init__(self, refused: int = 0, listener: Listener | None = None) -> None:
        self.received: list[tuple[Message, Address]] = []
        listeners = tuple(filter(None, (listener, lambda *heard: self.received.append(heard))))
        wanted = {HEARTBEAT.id: Wanted(HEARTBEAT, listeners)}

        def meet(sender: Sender) -> bool:
            sender.wanted = wanted
            return sender.address.system != refused

        self.inbound = Inbound(meet)

    def sender(self, address: Address = VEHICLE) -> Sender:
        return self.inbound.senders[address.system | address.component << 8]


Feed = Callable[[Ear, bytes], None]


def as_datagram(ear: Ear, data: bytes) -> None:
    ear.inbound.datagram(data, 1.0)


def as_stream(ear: Ear, data: bytes) -> None:
    ear.inbound.stream(data, 1.0)


def beat(sequence: int = 0, source: Address = VEHICLE, mode: int = 1) -> bytes:
    return encode(HEARTBEAT.make(custom_mode=mode, mavlink_version=3), sequence, source)


def attitude(sequence: int, source: Address = VEHICLE) -> bytes:
    return encode(ATTITUDE.make(roll=1.0), sequence, source)


def broken(frame: bytes) -> bytes:
    return frame[:-1] + bytes([frame[-1] ^ 1])


both = pytest.mark.parametrize("feed", [as_datagram, as_stream])


@both
def test_what_is_wanted_is_decoded_and_handed_over_with_its_sender(feed: Feed) -> None:
    ear = Ear()
    feed(ear, beat(0, mode=4))
    feed(ear, attitude(1))
    feed(ear, beat(2, Address(3, 154)))
    assert [(m.custom_mode, sender) for m, sender in ear.received] == [(4, VEHICLE), (1, (3, 154))]
    assert ear.sender().sent == 2


@both
def test_frames_of_others_in_the_same_bytes_are_told_apart(feed: Feed) -> None:
    ear = Ear()
    feed(ear, b"".join(beat(0, Address(system, 1)) for system in range(1, 9)))
    assert [sender.system for _, sender in ear.received] == [*range(1, 9)]


@both
def test_loss_is_counted_for_each_sender(feed: Feed) -> None:
    ear = Ear()
    for sequence in (0, 1, 4, 5):
        feed(ear, beat(sequence))
        feed(ear, beat(sequence * 2, Address(3, 2)))
    assert ear.sender().lost == 2
    assert ear.sender(Address(3, 2)).lost == 7


@both
def test_a_wanted_frame_with_a_wrong_checksum_is_nothing(feed: Feed) -> None:
    ear = Ear()
    feed(ear, beat(0))
    feed(ear, broken(beat(1)))
    feed(ear, beat(2))
    assert len(ear.received) == 2
    assert ear.sender().lost == 1


@both
def test_nobody_becomes_known_by_a_wrong_frame(feed: Feed) -> None:
    ear = Ear()
    feed(ear, broken(beat()))
    feed(ear, broken(attitude(0)))
    assert ear.inbound.senders == {}
    feed(ear, attitude(0))
    assert ear.sender().sent == 1


@both
def test_an_unknown_message_lets_nobody_in_but_counts_for_who_is(feed: Feed) -> None:
    ear = Ear()
    unknown = bytes.fromhex("fd010000010301ffff7f00aabb")
    feed(ear, unknown)
    assert ear.inbound.senders == {}
    feed(ear, beat(0))
    feed(ear, unknown)
    assert ear.sender().sent == 2


@both
def test_who_is_refused_is_not_heard(feed: Feed) -> None:
    ear = Ear(refused=3)
    for sequence in range(3):
        feed(ear, beat(sequence))
    assert (ear.received, ear.inbound.senders) == ([], {})


@both
def test_a_sender_of_whom_nothing_is_wanted_is_counted(feed: Feed) -> None:
    ear = Ear()
    feed(ear, beat(0))
    ear.sender().wanted = NOTHING
    feed(ear, beat(1))
    assert (len(ear.received), ear.sender().sent) == (1, 2)


@both
def test_a_listener_that_fails_hinders_no_other(
    feed: Feed, caplog: pytest.LogCaptureFixture
) -> None:
    def fails(_: Message, __: Address) -> None:
        raise ValueError("no")

    ear = Ear(listener=fails)
    with caplog.at_level(logging.ERROR):
        feed(ear, beat(0) + beat(1))
    assert len(ear.received) == 2
    assert "a listener to HEARTBEAT" in caplog.text


def test_frames_in_a_datagram_with_junk_must_be_right() -> None:
    ear = Ear()
    as_datagram(ear, beat(0))
    as_datagram(ear, b"\1\2" + broken(attitude(1)) + attitude(2) + beat(3) + b"\xfd")
    assert ear.sender().sent == 4
    assert ear.sender().lost == 1
    assert len(ear.received) == 2
    assert ear.inbound.junk_bytes == 2 + len(attitude(1)), "the last byte may begin a frame"


@pytest.mark.parametrize("size", [1, 7, 16, 30])
def test_a_frame_that_is_cut_at_the_border_of_a_datagram_is_received(size: int) -> None:
    ear = Ear()
    frames = beat(0) + attitude(1) + beat(2) + attitude(3) + beat(4, mode=9)
    for start in range(0, len(frames), size):
        as_datagram(ear, frames[start : start + size])
    assert (len(ear.received), ear.sender().lost, ear.inbound.junk_bytes) == (3, 0, 0)


def test_what_is_missing_of_a_cut_frame_costs_no_other() -> None:
    ear = Ear()
    as_datagram(ear, beat(0) + attitude(1)[:9])
    as_datagram(ear, beat(2))
    as_datagram(ear, attitude(3)[9:] + beat(4))
    assert (len(ear.received), ear.sender().lost) == (3, 2)


@pytest.mark.parametrize("late_s", [1.4, 6.0, 25.0])
@pytest.mark.parametrize("loss", [0.0, 0.05])
def test_frames_that_come_late_over_a_second_way_are_not_handed_over(
    late_s: float, loss: float
) -> None:
    """50 frames a second, every tenth a heartbeat whose mode is its number."""
    ear, rng = Ear(), random.Random(4)
    coming = []
    for number in range(3000):
        frame = beat(number & 255, mode=number) if number % 10 == 0 else attitude(number & 255)
        coming.append((number * 0.02 + late_s, frame))
        if rng.random() >= loss or number < 100:
            coming.append((number * 0.02, frame))
    for now_s, frame in sorted(coming):
        ear.inbound.datagram(frame, now_s)
    modes = [message.custom_mode for message, _ in ear.received]
    back = sum(after < before for before, after in pairwise(modes))
    assert back <= len(modes) * 0.01 if loss else back == 0
    assert len(set(modes)) >= 300 * (1 - 2 * loss)


def test_a_slow_way_counts_when_the_fast_one_is_gone() -> None:
    ear = Ear()
    coming = [(n * 0.02 + 1.5, beat(n & 255, mode=n)) for n in range(600)]
    coming += [(n * 0.02, beat(n & 255, mode=n)) for n in range(300)]
    for now_s, frame in sorted(coming):
        ear.inbound.datagram(frame, now_s)
    modes = [message.custom_mode for message, _ in ear.received]
    assert modes == sorted(modes)
    assert modes[-1] == 599


def test_a_stream_may_come_byte_by_byte() -> None:
    ear = Ear()
    for byte in b"boot banner\n" + beat(0) + attitude(1) + beat(2):
        as_stream(ear, bytes([byte]))
    assert (len(ear.received), ear.sender().sent, ear.sender().lost) == (2, 3, 0)
    assert ear.inbound.junk_bytes == len("boot banner\n")


def test_what_only_looks_like_a_long_frame_does_not_hold_others_up_for_ever() -> None:
    ear = Ear()
    ear.inbound.stream(b"\xfd\xff\0", 0.0)
    ear.inbound.stream(beat(0), 0.1)
    assert ear.received == []
    ear.inbound.stream(beat(1), 0.2 + UNFINISHED_S)
    assert len(ear.received) == 2


def test_a_slow_frame_is_not_given_up_when_its_end_comes() -> None:
    ear = Ear()
    ear.inbound.stream(beat(0)[:9], 0.0)
    ear.inbound.stream(beat(0)[9:], 5.0)
    assert len(ear.received) == 1


def test_nothing_grows_with_what_comes() -> None:
    ear, sizes = Ear(), []
    for number in range(4 * MOST_SENDERS):
        as_stream(ear, b"\xfd" * 7 + beat(0, Address(number % 250 + 1, number // 250)))
        if number in (2 * MOST_SENDERS, 4 * MOST_SENDERS - 1):
            ear.received.clear()
            sizes.append(held_bytes(ear.inbound))
    assert len(ear.inbound.senders) == MOST_SENDERS
    early, late = sizes
    assert late == pytest.approx(early, rel=0.05)
