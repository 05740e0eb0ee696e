"""The quality of a connection from a sender: loss, rate and age.

Each sender numbers its frames 0..255, over and over, on each of its links (mavlink.io, "Packet
Serialization").
"""

from dataclasses import dataclass

WINDOW_S = 5.0
"""Loss and rate are measured over about this many seconds."""

RESTART_S = 1.0
"""A frame after this silence is new: no frame is late by so much."""

LATE = 128
"""A number that is behind by at most this is late; otherwise it is ahead."""

_LATE_BITS = (1 << LATE) - 1

RESTART_FRAMES = 32
"""A sender has restarted if this many successive frames seem to be late."""


@dataclass(frozen=True, slots=True)
class LinkQuality:
    """`loss`: lost frames of all sent, 0..1; `rate_hz`: frames received a second; `age_s`: since
    the last one."""

    loss: float
    rate_hz: float
    age_s: float


class Reception:
    """Counts the frames of one sender over one path, from the number `sequence` on.

    `expected`: the number of the next frame, counted on beyond 255; `lost`, `doubled`: so many
    frames; `received_s`: when the last one came.
    """

    __slots__ = (
        "_late",
        "_marked",
        "_missing",
        "_samples",
        "_start",
        "doubled",
        "expected",
        "lost",
        "received_s",
    )

    def __init__(self, sequence: int, now_s: float) -> None:
        self.expected = sequence
        self.received_s = now_s
        self.lost = 0
        self.doubled = 0
        self._start = sequence
        self._late = 0
        self._missing = 0  # bit n: the frame n + 1 before `_marked` is
        self._marked = sequence
        self._samples = [(now_s, 0, 0)]

    @property
    def sent(self) -> int:
        """The number of sent frames, by the sequence numbers."""
        return self.expected - self._start

    def count(self, sequence: int, now_s: float) -> None:
        """Count a frame."""
        if sequence == self.expected & 255:
            self.expected += 1
        else:
            self.astray(sequence, now_s)
        self.received_s = now_s

    def astray(self, sequence: int, now_s: float) -> None:
        """Count a frame out of sequence: some are missing, or it is late or doubled."""
        ahead = (sequence - self.expected) & 255
        missing = self._missing << min(self.expected - self._marked, LATE)
        self._marked = self.expected
        if ahead >= LATE and now_s - self.received_s < RESTART_S:
            bit = 1 << 255 - ahead
            self._missing = missing & ~bit & _LATE_BITS
            if missing & bit:
                self.lost -= 1
                self._late = 0
                return
            self._late += 1
            if self._late < RESTART_FRAMES:
                self.doubled += 1
                return
            self._start += ahead  # the sender skipped these numbers: the frames are not lost
            missing = 0
        else:
            self.lost += ahead
            missing = missing << ahead | (1 << ahead) - 1
        self._late = 0
        self.expected += ahead + 1
        self._missing = missing << 1 & _LATE_BITS
        self._marked = self.expected

    def sample(self, now_s: float) -> None:
        """Store the counts; call it about once a second."""
        samples = self._samples
        samples.append((now_s, self.sent, self.lost))
        while len(samples) > 2 and samples[1][0] <= now_s - WINDOW_S:
            del samples[0]

    def quality(self, now_s: float) -> LinkQuality:
        """Return the recent quality."""
        since_s, sent_before, lost_before = self._samples[0]
        sent = self.sent - sent_before
        lost = min(max(self.lost - lost_before, 0), sent)
        age_s = max(now_s - self.received_s, 0.0)
        loss = lost / sent if sent else float(age_s > WINDOW_S)
        rate_hz = (sent - lost) / (now_s - since_s) if now_s > since_s else 0.0
        return LinkQuality(loss, rate_hz, age_s)
