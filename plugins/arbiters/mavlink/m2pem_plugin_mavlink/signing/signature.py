"""Signing frames, and checking the signatures of received ones.

pymavlink has a class for this. It is not used here: it moves a stream's timestamp on before it has
checked the signature, so that a forged frame shuts the real sender out; it passes messages that its
dialect does not know without a check; and it says of no frame why it is refused.
"""

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass, field
from enum import StrEnum
from hashlib import sha256
from hmac import compare_digest
from pathlib import Path

from m2pem_plugin_mavlink.signing.key_file import fingerprint
from m2pem_plugin_mavlink.signing.timestamps import UNITS_PER_S, Timestamps, TimestampStore

NEWEST_STREAM = 60 * UNITS_PER_S
"""The first frame of a stream may be older by so much."""

MOST_STREAMS = 8_192
"""Of one key: only those who have it add streams. A large fleet may have one, with several
components and links for each vehicle."""

ANSWER_EVERY_S = 1.0


class Refusal(StrEnum):
    """Why a frame is refused."""

    NOT_SIGNED = "not signed"
    WRONGLY_SIGNED = "wrongly signed"
    REPLAYED = "replayed"
    TOO_OLD = "too old"


class Signer:
    """One key: signs and checks frames. A frame has its checksum. A signature is the link id (1
    byte), the timestamp (6), and the first 6 bytes of the hash."""

    def __init__(self, key: bytes, store: TimestampStore | None) -> None:
        self._started = sha256(key)
        self.timestamps = Timestamps(store, fingerprint(key))

    def signature(self, frame: bytes, link_id: int) -> bytes:
        """Return the signature to append to a frame."""
        stamped = bytes((link_id,)) + self.timestamps.next().to_bytes(6, "little")
        return stamped + self._hash(frame + stamped)

    def refusal(self, frame: bytes, sender: int) -> Refusal | None:
        """Return why a signed frame is refused; None: it is accepted, and from now on refused as
        replayed. `sender`: system + 256 * component."""
        if not compare_digest(self._hash(frame[:-6]), frame[-6:]):
            return Refusal.WRONGLY_SIGNED
        stamp = int.from_bytes(frame[-12:-6], "little")
        times = self.timestamps
        stream = sender, frame[-13]
        last = times.received.get(stream)
        if last is None:
            if stamp + NEWEST_STREAM < times.now() or len(times.received) >= MOST_STREAMS:
                return Refusal.TOO_OLD
        elif stamp <= last:
            return Refusal.REPLAYED
        times.received[stream] = stamp
        times.latest = max(times.latest, stamp)
        return None

    def _hash(self, data: bytes) -> bytes:
        made = self._started.copy()
        made.update(data)
        return made.digest()[:6]


@dataclass(frozen=True, slots=True, eq=False)
class Signing:
    """How frames to a vehicle are signed."""

    signer: Signer
    key_file: Path
    link_id: int

    def sign(self, frame: bytes) -> bytes:
        """Return the signature to append to a frame."""
        return self.signer.signature(frame, self.link_id)


@dataclass(frozen=True, slots=True)
class RefusedFrames:
    """Frames of a vehicle that were refused at `url`; `last_s`: the last one, by the link's
    clock."""

    url: str
    refusal: Refusal
    count: int
    last_s: float


@dataclass(slots=True)
class SignatureCheck:
    """Checks the frames of one system on one endpoint, and counts those that are refused.

    `accept_unsigned`: ids of messages that are read without a signature; `unsigned_components`:
    components that do not sign. `last_s`: when the last frame was refused, by the reason.
    """

    signing: Signing
    accept_unsigned: Collection[int] = ()
    unsigned_components: Collection[int] = ()
    refused: Counter[Refusal] = field(default_factory=Counter)
    last_s: dict[Refusal, float] = field(default_factory=dict)
    _answered_s: float = -ANSWER_EVERY_S

    def accepts(self, frame: bytes, sender: int, now_s: float) -> bool:
        """Return whether a signed frame is accepted; count it otherwise."""
        refusal = self.signing.signer.refusal(frame, sender)
        if refusal is None:
            return True
        self.refuse(refusal, now_s)
        return False

    def accepts_unsigned(self, id_: int, now_s: float) -> bool:
        """Return whether an unsigned message is read; count it otherwise. It is no sign of life of
        its sender, which may be anyone."""
        if id_ in self.accept_unsigned:
            return True
        self.refuse(Refusal.NOT_SIGNED, now_s)
        return False

    def refuse(self, refusal: Refusal, now_s: float) -> None:
        """Count a refused frame."""
        self.refused[refusal] += 1
        self.last_s[refusal] = now_s

    def must_answer(self, now_s: float) -> bool:
        """Return whether to send a heartbeat to a sender of which a frame was too old just now: a
        vehicle without a clock takes the time from it. At most once a second."""
        if self.last_s.get(Refusal.TOO_OLD) != now_s or now_s - self._answered_s < ANSWER_EVERY_S:
            return False
        self._answered_s = now_s
        return True
