"""The exchanges that a vehicle is driven by, each in one call."""

from collections.abc import Sequence

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.link.vehicle_link import VehicleLink
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import NoAnswerError, RefusedError, Transaction

US_PER_S = 1_000_000


class _Command(Transaction[None]):
    wants = frozenset({message_type("COMMAND_ACK").id})

    def __init__(self, asked: Message, vehicle: Address) -> None:
        super().__init__(("command", asked.command))
        self.asked, self.vehicle, self.left = asked, vehicle, 3

    def begin(self, now_s: float) -> None:
        self.expire(now_s)

    def receive(self, message: Message, sender: Address, now_s: float) -> None:
        if message.command != self.asked.command or sender != self.vehicle:
            return
        if message.result == dialect.MAV_RESULT_ACCEPTED:
            self.succeed(None)
        elif message.result != dialect.MAV_RESULT_IN_PROGRESS:
            self.fail(RefusedError(f"refused: {message.result}", message.result))

    def expire(self, now_s: float) -> None:
        if not self.left:
            self.fail(NoAnswerError("no answer"))
            return
        self.left -= 1
        self.outbox.append(self.asked)
        self.deadline_s = now_s + 1.5


async def command(link: VehicleLink, command_id: int, *params: float) -> None:
    """COMMAND_LONG with its first parameters; the others are 0."""
    named = {f"param{number}": float(value) for number, value in enumerate(params, 1)}
    system, component = link.address
    asked = message_type("COMMAND_LONG").make(
        target_system=system, target_component=component, command=command_id, **named
    )
    await link.perform(_Command(asked, link.address))


async def command_int(
    link: VehicleLink,
    command_id: int,
    frame: int,
    params: tuple[float, float, float, float],
    latitude_deg: float,
    longitude_deg: float,
    altitude_m: float,
) -> None:
    """COMMAND_INT with a place; `frame`: a MAV_FRAME."""
    named = {f"param{number}": float(value) for number, value in enumerate(params, 1)}
    system, component = link.address
    asked = message_type("COMMAND_INT").make(
        target_system=system,
        target_component=component,
        frame=frame,
        command=command_id,
        **named,
        x=round(latitude_deg * 1e7),
        y=round(longitude_deg * 1e7),
        z=altitude_m,
    )
    await link.perform(_Command(asked, link.address))


async def message_interval(link: VehicleLink, message_id: int, interval_s: float) -> None:
    """Have a message sent so often, by the vehicle's clock."""
    await command(
        link, dialect.MAV_CMD_SET_MESSAGE_INTERVAL, float(message_id), interval_s * US_PER_S
    )


async def request_message(link: VehicleLink, message_id: int) -> None:
    """Have a message sent once."""
    await command(link, dialect.MAV_CMD_REQUEST_MESSAGE, float(message_id))


async def upload(link: VehicleLink, items: Sequence[MissionItem]) -> None:
    """Store a mission, as it is to be stored."""
    raise NotImplementedError


async def download(link: VehicleLink) -> tuple[MissionItem, ...]:
    """The mission that is stored, as it is stored."""
    raise NotImplementedError


async def clear(link: VehicleLink) -> None:
    """Store no mission."""
    raise NotImplementedError


async def set_current(link: VehicleLink, sequence: int) -> None:
    """Have the stored mission go on at an item."""
    await command(link, dialect.MAV_CMD_DO_SET_MISSION_CURRENT, float(sequence))


async def mission_item(link: VehicleLink, sequence: int) -> MissionItem:
    """One item of the stored mission, outside of a download."""
    raise NotImplementedError


async def parameter(link: VehicleLink, name: str) -> float:
    """The value of a parameter."""
    raise NotImplementedError
