"""What a vehicle says in words, put together of its chunks."""

import random
from itertools import permutations

import pytest
from m2pem_plugin_mavlink.microservices.texts import (
    GIVE_UP_S,
    KEPT,
    KEPT_S,
    LATE_S,
    StatusTexts,
)
from m2pem_plugin_mavlink.protocol.messages import Address, Message
from mavlink_lossy import VEHICLE, over_the_wire
from mavlink_memory import held_bytes
from mavlink_peers import text
from pymavlink.dialects.v20 import ardupilotmega as dialect

LONG = "PreArm: " + "the board is too cold, " * 5 + "end"


def chunks(words: str = LONG, id_: int = 7) -> list[Message]:
    pieces = [words[n : n + 50] for n in range(0, len(words), 50)]
    return [text(each, id=id_, chunk_seq=n) for n, each in enumerate(pieces)]


def said(texts: StatusTexts, now_s: float = 0.0) -> list[str]:
    return [each.text for each in texts.recent(now_s)]


def test_a_short_text_is_there_at_once() -> None:
    texts = StatusTexts()
    texts.take(text("No such mode 99", dialect.MAV_SEVERITY_WARNING), VEHICLE, 3.0)
    (heard,) = texts.recent(3.0)
    assert (heard.text, heard.severity, heard.sender, heard.at_s) == (
        "No such mode 99",
        dialect.MAV_SEVERITY_WARNING,
        VEHICLE,
        3.0,
    )


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_chunks_come_in_any_order_and_twice(order: tuple[int, ...]) -> None:
    texts = StatusTexts()
    for n in order:
        for _ in range(2):
            texts.take(over_the_wire(chunks()[n]), VEHICLE, 0.0)
    texts.take(chunks()[order[0]], VEHICLE, LATE_S / 2)
    assert said(texts) == [LONG]
    assert said(texts, 10.0) == [LONG]


@pytest.mark.parametrize(
    ("lost", "shown"),
    [
        (0, "..." + LONG[50:]),
        (1, LONG[:50] + "..." + LONG[100:]),
        (2, LONG[:100] + "..."),
    ],
)
def test_what_is_lost_is_shown_as_a_gap_after_a_while(lost: int, shown: str) -> None:
    texts = StatusTexts()
    for n, each in enumerate(chunks()):
        if n != lost:
            texts.take(each, VEHICLE, 0.0)
    assert said(texts, GIVE_UP_S / 2) == []
    assert said(texts, GIVE_UP_S) == [shown]
    texts.take(chunks()[lost], VEHICLE, GIVE_UP_S + 0.1)  # too late: it is no text of its own
    assert said(texts, 3 * GIVE_UP_S) == [shown]


def test_a_vehicle_that_was_switched_on_again_may_use_an_id_anew() -> None:
    texts = StatusTexts()
    for at_s in (0.0, LATE_S):
        for each in chunks():
            texts.take(each, VEHICLE, at_s)
    assert said(texts, LATE_S) == [LONG, LONG]


def test_the_first_text_of_a_px4_is_long_and_has_the_id_of_short_ones() -> None:
    texts = StatusTexts()
    denied = "Arming denied: Resolve system health failures first"
    for each in chunks(denied, 0):
        texts.take(over_the_wire(each), VEHICLE, 0.0)
    assert said(texts) == [denied]
    texts.take(text("Preflight Fail: heading estimate not stable"), VEHICLE, 0.1)
    assert said(texts, 0.1) == [denied, "Preflight Fail: heading estimate not stable"]


def test_a_text_that_fills_one_message_has_come_whole() -> None:
    texts = StatusTexts()
    full, other = "PreArm: ".ljust(50, "x"), "PreArm: ".ljust(50, "y")
    texts.take(over_the_wire(text(full)), VEHICLE, 0.0)
    texts.take(over_the_wire(text(other)), VEHICLE, 0.1)
    assert said(texts, GIVE_UP_S + 0.1) == [full, other]


def test_components_are_told_apart() -> None:
    texts = StatusTexts()
    camera = Address(VEHICLE.system, 100)
    for one, other in zip(chunks(), chunks(LONG.upper()), strict=True):
        texts.take(one, VEHICLE, 0.0)
        texts.take(other, camera, 0.0)
    assert said(texts) == [LONG, LONG.upper()]


def test_recent_is_what_was_said_lately_and_is_bad_enough() -> None:
    texts = StatusTexts()
    texts.take(text("old"), VEHICLE, 0.0)
    texts.take(text("new"), VEHICLE, 8.0)
    texts.take(text("idle talk", dialect.MAV_SEVERITY_INFO), VEHICLE, 9.0)
    bad = texts.recent(10.0, 5.0, dialect.MAV_SEVERITY_INFO)
    assert [each.text for each in bad] == ["new"]
    assert said(texts, 10.0) == ["old", "new", "idle talk"]
    assert said(texts, KEPT_S + 8.5) == ["idle talk"]


def test_texts_are_fit_to_be_shown() -> None:
    texts = StatusTexts()
    message = text("x")._replace(text=b" \xff\x1b[31mred\n ")  # type: ignore[attr-defined]
    texts.take(message, VEHICLE, 0.0)
    assert said(texts) == ["\N{REPLACEMENT CHARACTER} [31mred"]


def test_a_torrent_takes_little_memory() -> None:
    dice = random.Random(1)
    texts, sizes = StatusTexts(), []
    for n in range(10_000):
        words = "x" * dice.choice((0, 10, 50))
        each = text(words, id=dice.randrange(65536), chunk_seq=dice.randrange(256))
        texts.take(each, Address(7, dice.randrange(256)), n / 1e6)
        if n in (5000, 9999):
            sizes.append(held_bytes(texts))
    assert len(said(texts)) <= KEPT
    early, late = sizes
    assert late == pytest.approx(early, rel=0.2)
