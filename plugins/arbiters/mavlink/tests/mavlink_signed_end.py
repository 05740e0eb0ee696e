"""The other end of a signed link: pymavlink signs and checks, independently of m2pem."""

from pathlib import Path
from typing import Any

from m2pem_plugin_mavlink.signing.key_file import read_key
from m2pem_plugin_mavlink.signing.timestamps import clock_timestamp
from mavlink_wire import FarEnd
from pymavlink.dialects.v20 import ardupilotmega as dialect

KEY = bytes(range(1, 33))
OTHER_KEY = bytes(range(2, 34))


def write_key(folder: Path, name: str = "v1.key", key: bytes = KEY) -> Path:
    """A key file."""
    path = folder / name
    path.write_text(key.hex())
    path.chmod(0o600)
    assert read_key(path) == key
    return path


def sign_with(end: FarEnd, key: bytes | None = KEY, link_id: int = 0, **more: Any) -> FarEnd:
    """Let an end sign its frames, and accept only signed ones; None: neither. `ago_s`: its clock is
    behind by so much."""
    signing = dialect.MAVLinkSigning()
    signing.secret_key = key
    signing.sign_outgoing = key is not None
    signing.link_id = link_id
    signing.timestamp = clock_timestamp() - int(more.get("ago_s", 0) * 100_000)
    end.mav.signing = signing
    return end


class Recorded:
    """Records the frames that an end sends, to send them again."""

    def __init__(self, end: FarEnd) -> None:
        self.frames: list[bytes] = []
        self._write = end.write
        self._end = end

    def __enter__(self) -> list[bytes]:
        self._end.write = self._record  # type: ignore[method-assign]
        return self.frames

    def __exit__(self, *_: object) -> None:
        self._end.write = self._write  # type: ignore[method-assign]

    def _record(self, data: bytes) -> None:
        self.frames.append(bytes(data))
        self._write(data)
