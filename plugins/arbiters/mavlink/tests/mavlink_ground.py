"""An independent ground station: pymavlink's mavutil on UDP, called from other threads."""

import os

os.environ["MAVLINK20"] = "1"  # mavutil looks at it when it is imported

import time
from collections.abc import Callable
from typing import Any

from pymavlink import mavutil

WAIT_S = 40.0


class Ground:
    """A blocking client. Each wait ends with what is waited for, or fails."""

    def __init__(self, url: str, system: int = 255) -> None:
        self.link = mavutil.mavlink_connection(url, source_system=system)
        self.link.robust_parsing = True
        self.texts: list[str] = []

    @property
    def port(self) -> int:
        """Where it listens."""
        return int(self.link.port.getsockname()[1])

    def close(self) -> None:
        """No more."""
        self.link.close()

    def wait(self, *types: str, that: Callable[[Any], bool] = lambda _: True) -> Any:
        """The next message of these types of which something is so."""
        until_s = time.monotonic() + WAIT_S
        while time.monotonic() < until_s:
            message = self.link.recv_match(blocking=True, timeout=0.2)
            if message is None:
                continue
            if message.get_type() == "STATUSTEXT":
                self.texts.append(message.text)
            if message.get_type() in types and that(message):
                return message
        raise AssertionError(f"no {' or '.join(types)} in {WAIT_S:g} s; texts: {self.texts}")

    def command(self, command: int, *params: float) -> int:
        """COMMAND_LONG, and the result."""
        padded = [*params, *[0.0] * (7 - len(params))]
        target = (self.link.target_system, self.link.target_component)
        self.link.mav.command_long_send(*target, command, 0, *padded)
        result: int = self.wait("COMMAND_ACK", that=lambda m: m.command == command).result
        return result

    def stream(self, *ids: int, hz: float = 10.0) -> None:
        """Ask for messages."""
        for id_ in ids:
            assert self.command(511, id_, 1e6 / hz) == 0

    def upload(self, *items: Any) -> int:
        """Upload a mission."""
        target = (self.link.target_system, self.link.target_component)
        self.link.mav.mission_count_send(*target, len(items))
        while True:
            message = self.wait("MISSION_REQUEST", "MISSION_ACK")
            if message.get_type() == "MISSION_ACK":
                result: int = message.type
                return result
            self.link.mav.send(items[message.seq])

    def ready(self, mode: int) -> None:
        """In a mode, and armed, as soon as it can be."""
        self.stream(193)
        self.wait("EKF_STATUS_REPORT", that=lambda m: m.flags & 0x10 and not m.flags & 0x80)
        assert self.command(176, 1, mode) == 0
        self.wait("HEARTBEAT", that=lambda m: m.custom_mode == mode)
        assert self.command(400, 1) == 0
        self.wait("HEARTBEAT", that=lambda m: bool(m.base_mode & 128))
