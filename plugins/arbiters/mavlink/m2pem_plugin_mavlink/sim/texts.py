"""STATUSTEXT: what the autopilot says to people. Long texts go in chunks of 50 characters."""

from typing import TYPE_CHECKING

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.sim.part import Part

if TYPE_CHECKING:
    from m2pem_plugin_mavlink.sim.autopilot import Autopilot

CHUNK = 50
"""Bytes of text in one message (MAVLink common, STATUSTEXT)."""


class Texts(Part):
    """Says texts to all peers."""

    def __init__(self, autopilot: "Autopilot") -> None:
        super().__init__(autopilot)
        self._next_id = 1

    def say(self, text: str, severity: int) -> None:
        """A text; one that fits into a message has id 0."""
        data = text.encode("ascii", "replace")
        if len(data) < CHUNK:
            self._send(severity, data, 0, 0)
            return
        for number, start in enumerate(range(0, len(data) + 1, CHUNK)):
            self._send(severity, data[start : start + CHUNK], self._next_id, number)
        self._next_id = self._next_id % 0xFFFF + 1

    def _send(self, severity: int, data: bytes, id_: int, number: int) -> None:
        message = dialect.MAVLink_statustext_message(severity, data, id_, number)
        self.autopilot.send(message)
