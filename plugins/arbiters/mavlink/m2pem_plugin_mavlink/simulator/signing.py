"""Message signing, as ArduPilot does it on every port but its first one: all frames are signed, and
unsigned or wrongly signed ones are ignored, but for those of radios.

It signs and checks with pymavlink's own classes, so that it shares no code with what it tests.
"""

import time
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.simulator.interfaces import Component, on_message
from m2pem_plugin_mavlink.simulator.messages import Sender

EPOCH_S = 1_420_070_400
UNITS_PER_S = 100_000
BOOT_AHEAD = 60 * UNITS_PER_S
"""ArduPilot stores its timestamp every 30 s, and goes on from a minute later at a boot."""

LINK_ID = 1
FROM_RADIOS = (dialect.MAVLINK_MSG_ID_RADIO_STATUS, dialect.MAVLINK_MSG_ID_RADIO)


class SigningState:
    """The key of a vehicle, in its permanent memory, and the streams that it has received. None of
    its text forms has the key."""

    def __init__(self, key: bytes | None = None) -> None:
        self.signing = dialect.MAVLinkSigning()
        self.signing.link_id = LINK_ID
        self.signing.allow_unsigned_callback = lambda _, id_: id_ in FROM_RADIOS
        if key is not None:
            self.set_up(key, int((time.time() - EPOCH_S) * UNITS_PER_S))

    def set_up(self, key: bytes, timestamp: int) -> None:
        """Use another key; zeros turn signing off."""
        on = any(key) or timestamp != 0
        self.signing.secret_key = key if on else None
        self.signing.sign_outgoing = on
        self.signing.timestamp = timestamp + BOOT_AHEAD if on else 0

    def boot(self) -> None:
        """Restart: the streams are forgotten."""
        self.signing.stream_timestamps.clear()
        self.signing.timestamp += BOOT_AHEAD

    def encoder(self, system: int, component: int) -> Any:
        """Return what makes frames."""
        made = dialect.MAVLink(None, system, component)
        made.signing = self.signing
        return made

    def parser(self) -> Any:
        """Return what reads frames; all parsers of a vehicle have the same streams."""
        made = _Parser(None)
        made.robust_parsing = True
        made.signing = self.signing
        return made


class _Parser(dialect.MAVLink):  # type: ignore[misc]  # pymavlink is not typed
    def check_signature(self, msgbuf: bytearray, *sender: int) -> bool:
        """Check it; a forged frame does not move the stream's timestamp on, as it does in
        pymavlink, and does not in ArduPilot."""
        times = self.signing.stream_timestamps
        stream = msgbuf[-13], *sender
        before = times.get(stream)
        good: bool = super().check_signature(msgbuf, *sender)
        if not good:
            times.pop(stream, None)
            if before is not None:
                times[stream] = before
        return good


class SigningSetup(Component):
    """Takes a key while the vehicle is disarmed."""

    @on_message("SETUP_SIGNING")
    def _set_up(self, message: Any, _: Sender) -> None:
        if self.autopilot.arming.armed:
            text = "ERROR: Won't setup signing when armed"
            self.autopilot.say(text, dialect.MAV_SEVERITY_WARNING)
            return
        self.autopilot.signing.set_up(bytes(message.secret_key), message.initial_timestamp)
