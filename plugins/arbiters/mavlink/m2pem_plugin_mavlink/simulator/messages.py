"""Messages of the simulated autopilot: their senders and receivers, and commands."""

import math
from collections.abc import Hashable
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, NamedTuple

from pymavlink.dialects.v20 import ardupilotmega as dialect

Peer = Hashable


class Sender(NamedTuple):
    """The origin of a message: the peer that delivered it, and the system and component that it
    names."""

    peer: Peer
    system: int
    component: int


class Outgoing(NamedTuple):
    """A message to send: to one peer, or (None) to all."""

    message: Any
    to: Peer | None
    component: int = 1


class Result(IntEnum):
    """The result of a command (MAV_RESULT)."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4
    IN_PROGRESS = 5
    CANCELLED = 6


GLOBAL_FRAMES = frozenset({0, 3, 5, 6, 10, 11})
"""MAV_FRAME: latitude and longitude, in degrees or in 1e-7 degrees."""
RELATIVE_FRAMES = frozenset({3, 6})
"""MAV_FRAME: the altitude is above home."""
TERRAIN_FRAMES = frozenset({10, 11})
"""MAV_FRAME: the altitude is above the ground, which is level here: as relative."""


@dataclass(frozen=True, slots=True)
class Command:
    """A command. `latitude_deg` and `longitude_deg` are parameters 5 and 6, scaled if the frame is
    global; `frame` is MAV_FRAME, for COMMAND_LONG relative altitude, as ArduPilot has it."""

    id: int
    param1: float
    param2: float
    param3: float
    param4: float
    latitude_deg: float
    longitude_deg: float
    z: float
    frame: int
    was_long: bool
    confirmation: int
    sender: Sender

    @property
    def flags(self) -> int:
        """Parameter 5, of commands in which it is a whole number.

        Raises:
            ValueError: it is not a number.
        """
        scaled = not self.was_long and self.frame in GLOBAL_FRAMES
        return round(self.latitude_deg * 1e7) if scaled else int(self.latitude_deg)

    @property
    def has_position(self) -> bool:
        """Latitude and longitude are given, and are on Earth."""
        return (
            math.isfinite(self.latitude_deg)
            and math.isfinite(self.longitude_deg)
            and (self.latitude_deg != 0 or self.longitude_deg != 0)
            and abs(self.latitude_deg) <= 90
            and abs(self.longitude_deg) <= 180
        )


def command_of(message: Any, sender: Sender) -> Command:
    """From COMMAND_LONG or COMMAND_INT."""
    params = (message.param1, message.param2, message.param3, message.param4)
    if message.get_msgId() == dialect.MAVLINK_MSG_ID_COMMAND_LONG:
        place = (message.param5, message.param6, message.param7)
        return Command(message.command, *params, *place, 3, True, message.confirmation, sender)
    scale = 1e-7 if message.frame in GLOBAL_FRAMES else 1.0
    place = (message.x * scale, message.y * scale, message.z)
    return Command(message.command, *params, *place, message.frame, False, 0, sender)
