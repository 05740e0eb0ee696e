"""Frames are found, checked and made as pymavlink's own encoder and parser do it."""

import math
import random
import struct
from itertools import pairwise
from typing import Any

import pytest
from m2pem_plugin_mavlink.protocol.frames import EXTRA, Frame, clean, encode, read, right, scan
from m2pem_plugin_mavlink.protocol.messages import Address, message_type, types_by_id
from pymavlink.dialects.v20 import ardupilotmega as dialect

SOURCE = Address(7, 154)
EVERY_MESSAGE = sorted(types_by_id())


def field_value(rng: random.Random, type_: str, length: int) -> Any:
    def one() -> Any:
        match type_:
            case "char":
                return rng.randbytes(1)
            case "float":
                return rng.choice([0.0, -1.5, 3.25e7, math.inf, rng.randrange(-(2**20), 2**20) / 8])
            case "double":
                return rng.uniform(-1e9, 1e9)
        bits = int(type_.removesuffix("_t").lstrip("uint"))
        low, high = (
            (0, 2**bits - 1) if type_[0] == "u" else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
        )
        return rng.choice([0, low, high, rng.randint(low, high)])

    if type_ == "char":
        return rng.randbytes(rng.randint(0, max(length, 1))).replace(b"\0", b"x")
    return tuple(one() for _ in range(length)) if length else one()


def random_fields(rng: random.Random, id_: int) -> dict[str, Any]:
    source = dialect.mavlink_map[id_]
    lengths = dict(zip(source.ordered_fieldnames, source.array_lengths, strict=True))
    types = dict(zip(source.fieldnames, source.fieldtypes, strict=True))
    return {name: field_value(rng, type_, lengths[name]) for name, type_ in types.items()}


def theirs(id_: int, fields: dict[str, Any]) -> Any:
    return dialect.mavlink_map[id_](
        **{
            name: list(value) if isinstance(value, tuple) else value
            for name, value in fields.items()
        }
    )


def writer(source: Address = SOURCE, sequence: int = 0) -> Any:
    mav = dialect.MAVLink(None, srcSystem=source.system, srcComponent=source.component)
    mav.seq = sequence
    mav.robust_parsing = True
    return mav


def heartbeat(sequence: int = 0, source: Address = SOURCE) -> bytes:
    return encode(message_type("HEARTBEAT").make(type=2, mavlink_version=3), sequence, source)


def text(severity: int, words: bytes) -> bytes:
    return encode(message_type("STATUSTEXT").make(severity=severity, text=words), 9, SOURCE)


def unpacked(frame: Frame) -> Any:
    return types_by_id()[frame.id].unpack(frame.payload)


@pytest.mark.parametrize("id_", EVERY_MESSAGE)
def test_what_is_made_is_what_pymavlink_makes_and_each_reads_the_other(id_: int) -> None:
    rng = random.Random(id_)
    for sequence in range(8):
        fields = random_fields(rng, id_)
        ours = encode(types_by_id()[id_].make(**fields), sequence, SOURCE)
        mav = writer(sequence=sequence)
        assert ours == bytes(theirs(id_, fields).pack(mav))
        (parsed,) = mav.parse_buffer(ours)
        assert parsed.get_type() == types_by_id()[id_].name
        (frame,) = [read(each) for each in clean(ours) or ()]
        assert frame is not None and right(ours, id_)
        assert frame[:3] == (sequence, 7 | 154 << 8, id_)
        assert unpacked(frame)._asdict() == fields


@pytest.mark.parametrize("id_", [each for each in EVERY_MESSAGE if each < 256])
def test_frames_of_version_1_are_read(id_: int) -> None:
    fields = random_fields(random.Random(id_), id_)
    sent = bytes(theirs(id_, fields).pack(writer(sequence=200), force_mavlink1=True))
    assert sent[0] == 0xFE
    (frame,), junk, _ = scan(sent)
    assert (frame[:3], junk) == ((200, 7 | 154 << 8, id_), 0)
    parsed = writer().decode(bytearray(sent))
    expected = {name: getattr(parsed, name) for name in fields}
    got = unpacked(frame)._asdict()
    for name, value in expected.items():
        if isinstance(fields[name], bytes):
            assert got[name] == parsed.__dict__[f"_{name}_raw"].partition(b"\0")[0]
        else:
            assert got[name] == (tuple(value) if isinstance(value, list) else value)


def test_every_message_of_the_dialect_can_be_checked() -> None:
    assert len(EXTRA) == len(EVERY_MESSAGE) == len(dialect.mavlink_map)


def test_a_frame_of_zeros_keeps_one_byte() -> None:
    frame = encode(message_type("PING").make(), 0, SOURCE)
    assert len(frame) == 10 + 1 + 2
    assert right(frame, message_type("PING").id)


def test_a_value_that_does_not_fit_is_an_error() -> None:
    with pytest.raises(struct.error):
        encode(message_type("HEARTBEAT").make(type=256), 0, SOURCE)


def signed(frame: bytes) -> bytes:
    key = dialect.MAVLinkSigning()
    key.secret_key, key.link_id, key.timestamp, key.sign_outgoing = b"k" * 32, 1, 1, True
    mav = writer()
    mav.signing = key
    (message,) = writer().parse_buffer(frame)
    return bytes(message.pack(mav))


def test_a_signature_is_passed_over() -> None:
    sent = signed(heartbeat()) + heartbeat(1)
    frames = clean(sent)
    assert frames is not None and [len(each) for each in frames] == [34, 21]
    header = read(frames[0])
    assert header is not None and header.id == 0
    assert header.signed == frames[0] and right(frames[0][:-13], 0)
    assert [frame.sequence for frame in scan(sent)[0]] == [0, 1]
    assert scan(sent)[1] == 0


def test_a_frame_with_an_unknown_incompatibility_flag_is_passed_over() -> None:
    odd = bytearray(heartbeat())
    odd[2] = 0x02
    assert read(bytes(odd)) is None
    found, _, _ = scan(bytes(odd) + heartbeat(5))
    assert [frame.sequence for frame in found] == [5]


UNKNOWN = bytes.fromhex("fd0300000b079a ffff7f 010203 aabb")


def test_a_frame_of_an_unknown_message_is_counted_and_not_checked() -> None:
    found, junk, _ = scan(UNKNOWN + heartbeat())
    assert [(each.id, each.sequence, each.checked) for each in found] == [
        (0x7FFFFF, 11, False),
        (0, 0, True),
    ]
    assert junk == 0


def test_an_unknown_message_that_nothing_follows_rightly_is_junk() -> None:
    found, junk, _ = scan(UNKNOWN + b"x" + heartbeat())
    assert [each.id for each in found] == [0]
    assert junk == len(UNKNOWN) + 1


def test_what_looks_like_an_unknown_message_does_not_hide_frames() -> None:
    found, junk, _ = scan(b"\xfd" * 7 + b"".join(map(heartbeat, range(40))))
    assert [each.sequence for each in found if each.checked] == [*range(40)]
    assert junk == 7


@pytest.mark.parametrize("damaged", range(21))
def test_a_damaged_frame_in_a_stream_does_not_hide_the_next(damaged: int) -> None:
    bad = bytearray(heartbeat(1))
    bad[damaged] ^= 0x10
    after = b"".join(heartbeat(sequence) for sequence in range(2, 30))
    found, _, _ = scan(heartbeat(0) + bytes(bad) + after)
    assert [each.sequence for each in found if each.checked] == [0, *range(2, 30)]


def test_a_frame_cut_short_does_not_hide_the_next() -> None:
    whole = text(6, b"the reason of a refusal")
    for size in range(len(whole)):
        found, _, end = scan(whole[:size] + heartbeat(3))
        assert [each.sequence for each in found if each.checked] == [3]
        assert end == size + 21


def test_a_clean_datagram_may_hold_frames_of_both_versions() -> None:
    first = bytes(theirs(0, random_fields(random.Random(1), 0)).pack(writer(), force_mavlink1=True))
    assert clean(first + heartbeat()) == [first, heartbeat()]


@pytest.mark.parametrize(
    "junk", [b"\0", b"\xfd", b"\xfe\xff", b"ArduPilot Ready\r\n", b"\xfd" * 40]
)
def test_a_datagram_with_junk_is_not_clean_and_its_frames_are_found(junk: bytes) -> None:
    for sent in (junk + heartbeat(), heartbeat() + junk):
        assert clean(sent) is None
        found, dropped, _ = scan(sent)
        assert [each.checked for each in found if each.id == 0] == [True]
        assert dropped == len(junk)


def test_a_stream_may_be_cut_anywhere() -> None:
    sent = text(1, b"a") + UNKNOWN + heartbeat(8) + signed(text(2, b"b"))
    for cut in range(len(sent) + 1):
        found, junk, end = scan(sent[:cut], 0)
        rest, more_junk, _ = scan(sent[end:], 0)
        assert [each.id for each in found + rest] == [253, 0x7FFFFF, 0, 253]
        assert junk + more_junk == 0


def test_random_streams_give_what_was_sent() -> None:
    rng = random.Random(4)
    frames = [
        encode(types_by_id()[id_].make(**random_fields(rng, id_)), number & 255, SOURCE)
        for number, id_ in enumerate(rng.choices(EVERY_MESSAGE, k=2_000))
    ]
    sent = b"".join(frames)
    cuts = sorted(rng.sample(range(len(sent)), 300))
    rest, got = b"", []
    for start, end in pairwise([0, *cuts, len(sent)]):
        found, junk, after = scan(rest + sent[start:end], 0)
        rest = (rest + sent[start:end])[after:]
        assert junk == 0
        got += found
    assert [each.sequence for each in got] == [number & 255 for number in range(2_000)]
    assert all(each.checked for each in got)
