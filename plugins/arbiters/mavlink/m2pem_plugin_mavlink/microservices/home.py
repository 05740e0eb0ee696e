"""Where a vehicle returns to, and the origin of its local frame (HOME_POSITION,
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
    """Where the vehicle returns to; refused before it has a position."""

    def __init__(self, target: Address) -> None:
        super().__init__(target, "HOME_POSITION", place_of)


class ReadOrigin(RequestMessage[GroundPlace]):
    """Where its local frame begins; refused before it has a position."""

    def __init__(self, target: Address) -> None:
        super().__init__(target, "GPS_GLOBAL_ORIGIN", place_of)


class SetOrigin(Transaction[GroundPlace]):
    """Let its local frame begin at a place (SET_GPS_GLOBAL_ORIGIN), which it does only once, before
    it has a position. The result is what it says then, which may be another place."""

    wants = frozenset({_ORIGIN.id})

    def __init__(self, target: Address, place: GroundPlace) -> None:
        super().__init__(("origin", target))
        self.target, self.place = target, place
        self._tries = 0

    def begin(self, now_s: float) -> None:
        """Ask, if there is such a place."""
        place = self.place
        is_place = abs(place.latitude_deg) <= 90.0 and abs(place.longitude_deg) <= 180.0
        if not (is_place and abs(place.altitude_amsl_m) < 1e6):
            self.fail(ExchangeError(f"there is no place {place}"))
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
        """It says where its origin is."""
        if sender == self.target:
            self.succeed(place_of(message))

    def expire(self, now_s: float) -> None:
        """Ask again, or give up."""
        if self._tries < RETRIES.tries:
            self.begin(now_s)
        else:
            asked = f"no answer, though asked {self._tries} times"
            self.fail(NoAnswerError(f"setting the origin: {asked}"))


def set_home(target: Address, place: GroundPlace | None) -> Command:
    """Return to a place from now on; None: to where it is."""
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
    """What a HOME_POSITION or GPS_GLOBAL_ORIGIN says."""
    return GroundPlace(
        message.latitude / _DEG_TO_1E7,
        message.longitude / _DEG_TO_1E7,
        message.altitude / _MM_PER_M,
    )
