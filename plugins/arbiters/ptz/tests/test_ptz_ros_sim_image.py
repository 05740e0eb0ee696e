"""The pictures of a simulated camera, read with a decoder of their own."""

import math
from struct import unpack

from m2pem_plugin_ptz.gimbal import PanTiltZoom
from m2pem_plugin_ptz.simulator.ros.image import GROUND, SKY, STRIPE, picture

VIEW = (math.radians(60.0), math.radians(34.0))


def segments(content: bytes) -> tuple[dict[int, list[bytes]], bytes]:
    """By marker; and the coded data."""
    assert content[:2] == b"\xff\xd8"
    assert content[-2:] == b"\xff\xd9"
    found: dict[int, list[bytes]] = {}
    at = 2
    while True:
        ff, marker, length = unpack(">BBH", content[at : at + 4])
        assert ff == 0xFF
        found.setdefault(marker, []).append(content[at + 4 : at + 2 + length])
        at += 2 + length
        if marker == 0xDA:
            return found, content[at:-2]


def decoded(content: bytes) -> tuple[int, int, list[int]]:
    """Width and height in blocks, and the grey of each block."""
    found, data = segments(content)
    height, width = unpack(">HH", found[0xC0][0][1:5])
    table = found[0xC4][0]
    assert table[0] == 0
    codes, code, values = {}, 0, iter(table[17:])
    for length, count in enumerate(table[1:17], 1):
        for _ in range(count):
            codes[f"{code:0{length}b}"] = next(values)
            code += 1
        code <<= 1
    assert found[0xC4][1] == bytes([0x10, 1, *[0] * 16])
    quantum = found[0xDB][0][1]
    bits = "".join(f"{byte:08b}" for byte in data.replace(b"\xff\x00", b"\xff"))
    greys, at, level = [], 0, 0
    for _ in range(width // 8 * (height // 8)):
        end = at + 1
        while bits[at:end] not in codes:
            end += 1
        size = codes[bits[at:end]]
        value = int(bits[end : end + size] or "0", 2)
        if size and value < 1 << (size - 1):
            value -= (1 << size) - 1
        level += value
        assert bits[end + size] == "0"  # the end of the block
        at = end + size + 1
        greys.append(128 + level * quantum // 8)
    assert set(bits[at:]) <= {"1"}
    return width // 8, height // 8, greys


def rows(ptz: PanTiltZoom) -> list[list[int]]:
    width, height, greys = decoded(picture(ptz, VIEW))
    assert len(greys) == width * height
    return [greys[start : start + width] for start in range(0, len(greys), width)]


def test_the_horizon_is_where_the_camera_looks() -> None:
    level, up, down = (rows(PanTiltZoom(0.05, tilt)) for tilt in (0.0, 1.0, -1.0))
    assert {grey for row in level for grey in row} == {SKY, GROUND, STRIPE}
    assert SKY in level[0]
    assert GROUND not in level[0]
    assert GROUND in level[-1]
    assert {grey for row in up for grey in row} == {SKY, STRIPE}
    assert {grey for row in down for grey in row} == {GROUND, STRIPE}


def test_what_it_passes_moves_to_the_left_when_it_pans_clockwise() -> None:
    def stripe(pan_deg: float) -> float:
        row = rows(PanTiltZoom(math.radians(pan_deg), 0.3, 6.0))[0]
        dark = [column for column, grey in enumerate(row) if grey == STRIPE]
        return sum(dark) / len(dark)

    assert stripe(8.5) > stripe(10.0) > stripe(11.5)


def test_zoom_makes_things_wider() -> None:
    wide, narrow = (rows(PanTiltZoom(0.0, 0.3, zoom))[0].count(STRIPE) for zoom in (1.0, 12.0))
    assert narrow > wide


def test_a_comment_says_where_it_looked() -> None:
    found, _ = segments(picture(PanTiltZoom(math.radians(30.0), math.radians(-5.5), 2.0), VIEW))
    assert found[0xFE] == [b"pan 30.00 tilt -5.50 zoom 2.00"]
