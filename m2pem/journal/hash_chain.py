"""The hash chain over a run's entries, and the position_seal of its row in `standings`.

The hash of an entry covers the hash before it and its own content, so that the last hash identifies
the whole history. The chain begins with the hash of the run's header. Both hashes find damage, not
forgery: a writer of the file can compute them.
"""

import struct
from collections.abc import Sequence
from hashlib import blake2b
from typing import Any

import msgspec

HASH_BYTES = 16


def header_hash(row: Sequence[Any]) -> bytes:
    """Return the hash before a run's first entry, from the run's row of the table `runs`."""
    number, mission_name, mission, process, fleet, simulated, speed, created_us, library = row
    head = (number, mission_name, process, bool(simulated), float(speed), created_us)
    covered = blake2b(digest_size=HASH_BYTES, person=b"m2pem run")
    for part in (msgspec.json.encode(head), mission, fleet, library.encode()):
        covered.update(len(part).to_bytes(8, "big"))
        covered.update(part)
    return covered.digest()


def entry_hash(before: bytes, seq: int, epoch: int, at_us: int, t_us: int, body: bytes) -> bytes:
    """Return the hash of an entry; `before` is the hash of the entry before it."""
    numbers = struct.pack(">qqqq", seq, epoch, at_us, t_us)
    return blake2b(before + numbers + body, digest_size=HASH_BYTES, person=b"m2pem entry").digest()


def position_seal(row: Sequence[Any]) -> bytes:
    """Return the hash of a row of the table `standings`, without its last column, the seal."""
    return blake2b(msgspec.json.encode(row), digest_size=HASH_BYTES).digest()
