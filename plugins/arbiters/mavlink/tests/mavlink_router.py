"""A router between simulated autopilots and executives, over UDP, as a telemetry radio and a
mavlink-router are: what each executive sends arrives, and each receives all, also one that has not
ended yet.
"""

import select
import socket
import threading
from typing import Any

from mavlink_relay import moves_of
from pymavlink.dialects.v20 import ardupilotmega as dialect

Address = tuple[str, int]


class Router:
    """Autopilots send to `port`, and executives connect to `ground` (udpout).

    `sent`: what moves a vehicle and has reached it, in order, with the executive's address.
    `cut`: it carries nothing; `cut_off`: nothing from and to these executives. `port` 0: any that
    is free.
    """

    def __init__(self, port: int = 0) -> None:
        self.cut = False
        self.cut_off: set[Address] = set()
        self.sent: list[tuple[Address, object]] = []
        self._vehicles: set[Address] = set()
        self._executives: dict[Address, Any] = {}
        self._sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2)]
        for each, number in zip(self._sockets, (port, 0), strict=True):
            each.bind(("127.0.0.1", number))
        self.port, self.ground = (int(each.getsockname()[1]) for each in self._sockets)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def senders(self) -> list[Address]:
        """The executives that have moved vehicles, in the order in which they first did."""
        return list(dict.fromkeys(sender for sender, _ in list(self.sent)))

    def close(self) -> None:
        self._ended.set()
        self._thread.join()
        for each in self._sockets:
            each.close()

    def _run(self) -> None:
        inner, outer = self._sockets
        while not self._ended.is_set():
            ready, _, _ = select.select(self._sockets, [], [], 0.05)
            for each in ready:
                try:
                    frames, sender = each.recvfrom(65536)
                except ConnectionError:  # an executive has ended
                    continue
                if each is inner:
                    self._vehicles.add(sender)
                    if not self.cut:
                        for executive in self._executives.keys() - self.cut_off:
                            outer.sendto(frames, executive)
                elif not self.cut and sender not in self.cut_off:
                    self._carry(frames, sender)

    def _carry(self, frames: bytes, sender: Address) -> None:
        parser = self._executives.get(sender)
        if parser is None:
            parser = self._executives[sender] = dialect.MAVLink(None)
            parser.robust_parsing = True
        for message in parser.parse_buffer(frames) or ():
            self.sent += [(sender, what) for what in moves_of(message)]
        for vehicle in self._vehicles:
            self._sockets[0].sendto(frames, vehicle)
