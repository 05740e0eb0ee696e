"""STATUSTEXT: what the autopilot says to people. Long texts go in chunks of 50 characters."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.sim.part import MessageHandler, Part
from m2pem_plugin_mavlink.sim.peers import Heard, Peer

if TYPE_CHECKING:
    from m2pem_plugin_mavlink.sim.autopilot import Autopilot

CHUNK = 50
"""Bytes of text in one message (MAVLink common, STATUSTEXT)."""
RECENT_S = 2.5
"""For how long a heartbeat of a ground station counts (PX4: HEARTBEAT_TIMEOUT_US)."""


class Texts(Part):
    """Says texts to all peers, or to those with a ground station, as the firmware does."""

    def __init__(self, autopilot: "Autopilot") -> None:
        super().__init__(autopilot)
        self._next_id = 1
        self._heard_s: dict[Peer, float] = {}

    def messages(self) -> Mapping[str, MessageHandler]:
        """Heartbeats of ground stations."""
        return {"HEARTBEAT": self._heard}

    def _heard(self, message: Any, sender: Heard) -> None:
        if message.type == dialect.MAV_TYPE_GCS:
            self._heard_s[sender.peer] = self.autopilot.now_s

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
        if not self.autopilot.firmware.texts_need_heartbeats:
            self.autopilot.send(message)
            return
        for peer, heard_s in self._heard_s.items():
            if self.autopilot.now_s - heard_s <= RECENT_S:
                self.autopilot.send(message, peer)
