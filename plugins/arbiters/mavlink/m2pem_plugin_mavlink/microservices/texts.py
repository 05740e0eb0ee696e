"""The texts of a vehicle (STATUSTEXT; mavlink.io, "STATUSTEXT", messages/common.html).

Long texts come in chunks with an id of their own, which may be lost, doubled or out of order. A
text that is incomplete after `GIVE_UP_S` is shown with "..." in the gaps. The id 0 says that a
text has one chunk; but PX4 numbers its texts from 0 on (streams/STATUSTEXT.hpp), so that its first
text may be long and have the id 0, too.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.protocol.messages import Address, Message

CHUNK_BYTES = 50
KEPT_S = 60.0
KEPT = 100
GIVE_UP_S = 1.0
LATE_S = 5.0
"""Seconds for which late chunks of a finished text are ignored; after that the id may be that of a
new text, as of a vehicle that was restarted."""
AT_ONCE = 16
"""Most incomplete texts at one time; one more ends the oldest."""
MOST_CHUNKS = 20
GAP = "..."
ANY: int = dialect.MAV_SEVERITY_ENUM_END
"""For `worse_than`: texts of all severities."""


@dataclass(frozen=True, slots=True)
class Text:
    """A text. `severity`: a MAV_SEVERITY, 0 is the worst; `at_s`: when its first chunk came."""

    text: str
    severity: int
    sender: Address
    at_s: float


@dataclass(slots=True)
class _Pieces:
    severity: int
    at_s: float
    may_be_one_chunk: bool
    chunks: dict[int, bytes] = field(default_factory=dict)

    def end(self) -> int | None:
        """The number of chunks: the last one is not full."""
        return next((n + 1 for n, each in self.chunks.items() if len(each) < CHUNK_BYTES), None)

    def whole(self) -> bool:
        end = self.end()
        return end is not None and all(n in self.chunks for n in range(end))

    def text(self) -> str:
        """The received text, with "..." for missing chunks."""
        end = len(self.chunks) if self.may_be_one_chunk and list(self.chunks) == [0] else self.end()
        said, expected = b"", 0
        for n in sorted(self.chunks):
            said += (b"" if n == expected else GAP.encode()) + self.chunks[n]
            expected = n + 1
        return _decoded(said if end is not None and expected >= end else said + GAP.encode())


class StatusTexts:
    """Collects the texts of one vehicle. Pass each received STATUSTEXT to it; `read` is called
    with each text that is complete, or that stays incomplete."""

    def __init__(self, read: Callable[[Text], None] = lambda _: None) -> None:
        self._read = read
        self._texts: deque[Text] = deque(maxlen=KEPT)
        self._coming: dict[tuple[Address, int], _Pieces] = {}
        self._closed_s: dict[tuple[Address, int], float] = {}

    def take(self, message: Message, sender: Address, now_s: float) -> None:
        """Process a STATUSTEXT."""
        self.give_up(now_s - GIVE_UP_S)
        key = sender, message.id
        if message.id == 0 and message.chunk_seq == 0 and key in self._coming:
            self._close(key)
        late = message.id != 0 and now_s - self._closed_s.get(key, -inf) < LATE_S
        if message.chunk_seq >= MOST_CHUNKS or late:
            return
        if key not in self._coming:
            if len(self._coming) >= AT_ONCE:
                self._close(next(iter(self._coming)))
            self._coming[key] = _Pieces(message.severity, now_s, message.id == 0)
        pieces = self._coming[key]
        pieces.chunks.setdefault(message.chunk_seq, message.text)
        if pieces.whole():
            self._close(key)

    def give_up(self, begun_before_s: float) -> None:
        """End incomplete texts whose first chunk came before this time."""
        late = [key for key, each in self._coming.items() if each.at_s <= begun_before_s]
        for key in late:
            self._close(key)

    def recent(
        self, now_s: float, within_s: float = KEPT_S, worse_than: int = ANY
    ) -> tuple[Text, ...]:
        """Return the texts of the last seconds with a severity worse than a MAV_SEVERITY, the
        newest last."""
        self.give_up(now_s - GIVE_UP_S)
        kept_s = min(within_s, KEPT_S)
        found = (
            each
            for each in self._texts
            if now_s - each.at_s <= kept_s and each.severity < worse_than
        )
        return tuple(sorted(found, key=lambda each: each.at_s))

    def _close(self, key: tuple[Address, int]) -> None:
        pieces = self._coming.pop(key)
        text = Text(pieces.text(), pieces.severity, key[0], pieces.at_s)
        self._texts.append(text)
        self._read(text)
        self._closed_s.pop(key, None)
        self._closed_s[key] = pieces.at_s
        if len(self._closed_s) > KEPT:
            del self._closed_s[next(iter(self._closed_s))]


def _decoded(said: bytes) -> str:
    text = said.decode("utf-8", "replace").strip()
    return "".join(each if each.isprintable() else " " for each in text)
