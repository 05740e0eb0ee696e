"""MAVLink messages that are events of missions.

Those of vehicles come over m2pem's own links, which have checked signatures and whose the system id
is; a message that no rule names costs nothing.
"""

import asyncio
import logging
from collections.abc import Callable, Mapping, Sequence
from functools import partial

from m2pem.api import EventThrower, ResourceId
from m2pem.errors import M2pemError
from m2pem_plugin_mavlink.face.event_settings import ReceivedMessage
from m2pem_plugin_mavlink.face.message_fields import values_of
from m2pem_plugin_mavlink.link.hub import Hub
from m2pem_plugin_mavlink.link.vehicle_link import VehicleLink
from m2pem_plugin_mavlink.protocol.messages import Address, Message
from m2pem_plugin_mavlink.protocol.raw_frames import RawFrame

MESSAGES_PER_S = 200
"""Of each rule. Further messages of that second are skipped."""
LONGEST = 300

log = logging.getLogger("m2pem.face.events")


class MessageReceiver:
    """`vehicles`: those of the fleet, by the addresses of their autopilots."""

    def __init__(
        self,
        hub: Hub,
        received: Sequence[ReceivedMessage],
        vehicles: Mapping[Address, ResourceId],
        thrower: EventThrower,
    ) -> None:
        self._hub = hub
        self._vehicles = vehicles
        self._rules = [_Rule(each, thrower) for each in received]
        self._ends: list[Callable[[], None]] = []

    def open(self) -> None:
        """Listen to the vehicles, those whose links are opened later, too."""
        if any(rule.received.vehicles for rule in self._rules):
            for link in self._hub.links:
                self._listen(link)
            self._hub.link_watchers.append(self._listen)

    def close(self) -> None:
        """End it."""
        if self._listen in self._hub.link_watchers:
            self._hub.link_watchers.remove(self._listen)
        for end in self._ends:
            end()
        self._ends.clear()

    def from_station(self, frame: RawFrame) -> None:
        """Receive a frame of a ground station."""
        source = frame.source
        for rule in self._rules:
            received = rule.received
            if received.from_stations and received.type.id == frame.id:
                message = received.type.unpack(frame.payload)
                rule.hear(message, source, f"{source.system}/{source.component}")

    def _listen(self, link: VehicleLink) -> None:
        vehicle = self._vehicles.get(link.address)
        if vehicle is None:
            return
        for rule in self._rules:
            if vehicle in rule.received.vehicles:
                hear = partial(rule.hear, who=vehicle)
                self._ends.append(link.listen({rule.received.type.id}, hear))


class _Rule:
    def __init__(self, received: ReceivedMessage, thrower: EventThrower) -> None:
        self.received = received
        self._thrower = thrower
        self._loop = asyncio.get_running_loop()
        self._second = 0
        self._received = 0
        self._failed = False

    def hear(self, message: Message, sender: Address, who: str) -> None:
        """Throw an event if the message is one. `who`: for the records."""
        received = self.received
        if received.component not in (None, sender.component):
            return
        now_s = self._loop.time()
        if int(now_s) != self._second:
            self._second, self._received = int(now_s), 0
        self._received += 1
        if self._received > MESSAGES_PER_S:
            return
        try:
            data = received.rule.occurs(values_of(message, sender), now_s)
        except M2pemError as error:
            if not self._failed:
                self._failed = True
                log.warning(
                    "mavlink %s %s: %s: %s; further ones are not reported",
                    who,
                    received.type.name,
                    received.key,
                    str(error)[:LONGEST],
                )
            return
        if data is not None:
            self._thrower.put(received.rule, data, f"mavlink {who} {received.type.name}")
