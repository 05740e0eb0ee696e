"""What a vehicle said lately."""

from collections import deque

from m2pem_plugin_mavlink.protocol.messages import Message

KEPT = 50
CHUNK_CHARACTERS = 50


class Texts:
    """The last texts of a vehicle with when they came, put together of their chunks."""

    def __init__(self) -> None:
        self._texts: deque[tuple[float, str]] = deque(maxlen=KEPT)
        self._chunks: dict[int, dict[int, str]] = {}

    def take(self, message: Message, now_s: float) -> None:
        """A STATUSTEXT has come."""
        text = message.text.decode("utf-8", "replace").strip()
        self._texts.append((now_s, text))

    def since(self, from_s: float) -> tuple[str, ...]:
        """The texts that came since then, newest last."""
        return tuple(text for at_s, text in self._texts if at_s >= from_s)
