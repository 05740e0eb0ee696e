"""The picture of a simulated camera: a mosaic of the world around it, as a JPEG.

It is a baseline JPEG (ITU-T T.81) of one component, in which each block of 8 by 8 has one grey
value, so that it needs no library. A comment in it has the direction of the camera.
"""

import math
from collections.abc import Iterable, Iterator
from struct import pack

from m2pem_plugin_ptz.gimbal import PanTiltZoom

WIDTH, HEIGHT = 320, 176
BLOCK = 8
QUANTUM = 8
"""With it, the coded value is the grey of a block: 8 times its difference from 128, divided by
8."""

DC_LENGTHS = (0, 1, 5, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0)
"""Number of codes with 1 bit, 2 bits and so on, for differences of 0, 1, 2, ... bits."""

END_OF_BLOCK = "0"
SKY, GROUND, STRIPE = 200, 90, 40
STRIPE_RAD, STRIPE_EVERY_RAD = math.radians(2.0), math.radians(10.0)


def picture(ptz: PanTiltZoom, view_rad: tuple[float, float]) -> bytes:
    """Return a JPEG. The sky is light and the ground is dark, with a stripe every ten degrees of
    pan."""
    columns, rows = WIDTH // BLOCK, HEIGHT // BLOCK
    wide, high = (angle / ptz.zoom for angle in view_rad)
    greys = (
        _grey(
            ptz.pan_rad + wide * ((column + 0.5) / columns - 0.5),
            ptz.tilt_rad + high * (0.5 - (row + 0.5) / rows),
        )
        for row in range(rows)
        for column in range(columns)
    )
    direction = f"pan {math.degrees(ptz.pan_rad):.2f} tilt {math.degrees(ptz.tilt_rad):.2f}"
    return _jpeg(greys, f"{direction} zoom {ptz.zoom:.2f}")


def _grey(pan_rad: float, tilt_rad: float) -> int:
    if abs(math.remainder(pan_rad, STRIPE_EVERY_RAD)) < STRIPE_RAD / 2:
        return STRIPE
    return SKY if tilt_rad > 0 else GROUND


def _jpeg(greys: Iterable[int], comment: str) -> bytes:
    parts = [
        b"\xff\xd8",
        _segment(0xFE, comment.encode()),
        _segment(0xDB, bytes([0, *[QUANTUM] * 64])),
        _segment(0xC0, pack(">BHHB3B", 8, HEIGHT, WIDTH, 1, 1, 0x11, 0)),
        _segment(0xC4, bytes([0x00, *DC_LENGTHS, *range(12)])),
        _segment(0xC4, bytes([0x10, 1, *[0] * 15, 0])),
        _segment(0xDA, bytes([1, 1, 0, 0, 63, 0])),
        _bytes("".join(_blocks(greys))),
        b"\xff\xd9",
    ]
    return b"".join(parts)


def _segment(marker: int, content: bytes) -> bytes:
    return pack(">BBH", 0xFF, marker, len(content) + 2) + content


def _blocks(greys: Iterable[int]) -> Iterator[str]:
    codes = _codes()
    before = 128
    for grey in greys:
        difference, before = grey - before, grey
        size = abs(difference).bit_length()
        value = difference if difference > 0 else difference + (1 << size) - 1
        yield codes[size] + (f"{value:0{size}b}" if size else "") + END_OF_BLOCK


def _codes() -> list[str]:
    """Return the Huffman codes of differences, by their number of bits."""
    codes, code = [], 0
    for length, count in enumerate(DC_LENGTHS, 1):
        for _ in range(count):
            codes.append(f"{code:0{length}b}")
            code += 1
        code <<= 1
    return codes


def _bytes(bits: str) -> bytes:
    """Fill up with ones. A byte 0xFF is followed by a zero."""
    bits += "1" * (-len(bits) % 8)
    made = int(bits, 2).to_bytes(len(bits) // 8, "big")
    return made.replace(b"\xff", b"\xff\x00")
