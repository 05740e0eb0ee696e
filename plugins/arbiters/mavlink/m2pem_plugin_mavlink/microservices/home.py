"""The home of a vehicle, and the origin of its local frame (HOME_POSITION,
GPS_GLOBAL_ORIGIN; mavlink.io, messages/common.html)."""

from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.microservices.commands import Command, CommandPosition
from m2pem_plugin_mavlink.microservices.message_requests import RequestMessage
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import (
    RETRIES,
    ExchangeError,
    NoAnswerError,
    Transaction,
)

_DEG_TO_1E7 = 1e7
_MM_PER_M = 1000.0

_ORIGIN = message_type("GPS_GLOBAL_ORIGIN")
_SET_ORIGIN = message_type("SET_GPS_GLOBAL_ORIGIN")


@dataclass(frozen=True, slots=True)
class GroundPlace:
    """WGS-84 degrees, and metres above mean sea level."""

    latitude_deg: float
    longitude_deg: float
    altitude_amsl_m: float


class ReadHome(RequestMessage[GroundPlace]):
    """Reads the home; the vehicle refuses before it has a position."""

    def __init__(self, target: Address) -> None:
        super().__init__(target, "HOME_POSITION", place_of)


class ReadOrigin(RequestMessage[GroundPlace]):
    """Reads the origin of the local frame; the vehicle refuses before it has a position."""

    def __init__(self, target: Address) -> None:
        super().__init__(target, "GPS_GLOBAL_ORIGIN", place_of)


class SetOrigin(Transaction[GroundPlace]):
    """Sets the origin of the local frame (SET_GPS_GLOBAL_ORIGIN). A vehicle accepts it once, before
    it has a position. The result is the origin that the vehicle reports, which may be another
    one."""

    wants = frozenset({_ORIGIN.id})

    def __init__(self, target: Address, place: GroundPlace) -> None:
        super().__init__(("origin", target))
        self.target, self.place = target, place
        self._tries = 0

    def begin(self, now_s: float) -> None:
        """Send the origin, if it is a position."""
        place = self.place
        is_place = abs(place.latitude_deg) <= 90.0 and abs(place.longitude_deg) <= 180.0
        if not (is_place and abs(place.altitude_amsl_m) < 1e6):
            self.fail(ExchangeError(f"{place} is not a position"))
            return
        self._tries += 1
        self.outbox.append(
            _SET_ORIGIN.make(
                latitude=round(place.latitude_deg * _DEG_TO_1E7),
                longitude=round(place.longitude_deg * _DEG_TO_1E7),
                altitude=round(place.altitude_amsl_m * _MM_PER_M),
                target_system=self.target.system,
            )
        )
        self.deadline_s = now_s + RETRIES.answer_s

    def receive(self, message: Message, sender: Address, now_s: float) -> None:
        """Process the origin that the vehicle reports."""
        if sender == self.target:
            self.succeed(place_of(message))

    def expire(self, now_s: float) -> None:
        """Repeat the request, or fail."""
        if self._tries < RETRIES.tries:
            self.begin(now_s)
        else:
            asked = f"no answer after {self._tries} requests"
            self.fail(NoAnswerError(f"setting the origin: {asked}"))


def set_home(target: Address, place: GroundPlace | None) -> Command:
    """Set the home; None: to the present position."""
    command = dialect.MAV_CMD_DO_SET_HOME
    if place is None:
        return Command(target, command, (1,))
    at = CommandPosition(
        place.latitude_deg,
        place.longitude_deg,
        place.altitude_amsl_m,
        dialect.MAV_FRAME_GLOBAL,
    )
    return Command(target, command, (0,), place=at)


def place_of(message: Message) -> GroundPlace:
    """Return the place in a HOME_POSITION or GPS_GLOBAL_ORIGIN."""
    return GroundPlace(
        message.latitude / _DEG_TO_1E7,
        message.longitude / _DEG_TO_1E7,
        message.altitude / _MM_PER_M,
    )
