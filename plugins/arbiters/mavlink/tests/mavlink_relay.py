"""A relay between a simulated autopilot and m2pem, over UDP.

It drops all frames while the link is cut, and notes the modes of the copter and what m2pem
commands.
"""

import select
import socket
import threading
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

MOVES = {"MISSION_COUNT", "MISSION_ITEM_INT", "SET_POSITION_TARGET_GLOBAL_INT"}
STARTS = {dialect.MAV_CMD_MISSION_START, dialect.MAV_CMD_DO_REPOSITION}


class Relay:
    """Between the copter, which sends to `port`, and m2pem at `ground`.

    `seen`: in order, ("mode", mode) of the copter, also while the link is cut, and ("sent", what)
    for each mode, motion or mission that m2pem sends and that reaches the copter.
    """

    def __init__(self, ground: int) -> None:
        self.cut = False
        self.seen: list[tuple[str, object]] = []
        self.ground = ground
        self._ground = ("127.0.0.1", ground)
        self._copter: Any = None
        self._inner = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._inner.bind(("127.0.0.1", 0))
        self._outer = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._outer.bind(("127.0.0.1", 0))
        self.port: int = self._inner.getsockname()[1]
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    @property
    def mode(self) -> object:
        """The mode of the copter now."""
        return next((value for what, value in reversed(self.seen) if what == "mode"), None)

    def close(self) -> None:
        self._ended.set()
        self._thread.join()
        self._inner.close()
        self._outer.close()

    def _run(self) -> None:
        down, up = dialect.MAVLink(None), dialect.MAVLink(None)
        down.robust_parsing = up.robust_parsing = True
        while not self._ended.is_set():
            ready, _, _ = select.select([self._inner, self._outer], [], [], 0.05)
            if self._inner in ready:
                frames, self._copter = self._inner.recvfrom(65536)
                for each in down.parse_buffer(frames) or []:
                    self._note_copter(each)
                if not self.cut:
                    self._outer.sendto(frames, self._ground)
            if self._outer in ready:
                try:
                    frames, _ = self._outer.recvfrom(65536)
                except ConnectionError:  # no executive listens now
                    continue
                if self.cut or self._copter is None:
                    continue
                for each in up.parse_buffer(frames) or []:
                    self._note_sent(each)
                self._inner.sendto(frames, self._copter)

    def _note_copter(self, message: Any) -> None:
        is_of_it = message.get_type() == "HEARTBEAT" and message.get_srcComponent() == 1
        if is_of_it and self.mode != message.custom_mode:
            self.seen.append(("mode", message.custom_mode))

    def _note_sent(self, message: Any) -> None:
        self.seen += [("sent", what) for what in moves_of(message)]


def moves_of(message: Any) -> list[object]:
    """The mode, motion or mission that a message of a ground station gives a vehicle, if any."""
    name = message.get_type()
    if name in MOVES:
        return [name]
    if name in ("COMMAND_LONG", "COMMAND_INT"):
        if message.command == dialect.MAV_CMD_DO_SET_MODE:
            return [f"mode {int(message.param2)}"]
        if message.command in STARTS:
            return [message.command]
    return []
