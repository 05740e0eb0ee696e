"""What missions throw, as MAVLink messages to vehicles and ground stations.

A message reaches a vehicle over m2pem's own link, and only while nobody but the run that threw it
commands the vehicle.
"""

import asyncio
import logging
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from m2pem.api import Fields, MissionControl, ResourceId, RunId, ThrownEvents
from m2pem.errors import M2pemError, OperatorError
from m2pem_plugin_mavlink.face.event_settings import STATUSTEXT, SentMessage
from m2pem_plugin_mavlink.face.message_fields import made
from m2pem_plugin_mavlink.face.stations import Stations
from m2pem_plugin_mavlink.face.texts import TextSeverity, status_texts
from m2pem_plugin_mavlink.link.hub import Hub
from m2pem_plugin_mavlink.link.vehicle_link import VehicleLink
from m2pem_plugin_mavlink.microservices.commands import Command
from m2pem_plugin_mavlink.protocol.messages import Address, Message
from m2pem_plugin_mavlink.protocol.transaction import ExchangeError, RefusedError

MOST_COMMANDS = 100
"""Commands that wait for their acknowledgement."""
LONGEST = 300
PARAMS = tuple(f"param{number}" for number in range(1, 8))

log = logging.getLogger("m2pem.face.events")


class MessageSender:
    """`autopilots`: the addresses of the vehicles' autopilots; `sources`: in whose name messages
    about a vehicle are sent to ground stations."""

    def __init__(
        self,
        hub: Hub,
        stations: Stations,
        control: MissionControl,
        autopilots: Mapping[ResourceId, Address],
        sources: Mapping[ResourceId, Address],
    ) -> None:
        self._hub = hub
        self._stations = stations
        self._control = control
        self._autopilots = autopilots
        self._sources = sources
        self._commands: set[asyncio.Task[None]] = set()

    async def run(self, thrown: ThrownEvents, sent: Mapping[Any, SentMessage]) -> None:
        """Send what is thrown, in its order, until cancelled."""
        try:
            async for rule, run, data in thrown:
                each = sent[rule]
                try:
                    if each.to_stations:
                        self._to_stations(each, data)
                    else:
                        await self._to_vehicle(each, run, data)
                except M2pemError as error:
                    await self._failed(each, run, str(error))
                except Exception as error:
                    log.exception("%s", each.key)
                    await self._failed(each, run, repr(error))
        finally:
            for task in self._commands.copy():
                task.cancel()
                with suppress(asyncio.CancelledError):
                    await task

    def _to_stations(self, sent: SentMessage, data: Fields) -> None:
        fields = sent.rule.filled(data)
        messages: list[Message] = []
        if sent.type.name == STATUSTEXT:
            text = fields.pop("text", "")
            severity = made(sent.type, {"severity": TextSeverity.INFO, **fields}).severity
            messages += status_texts(text if isinstance(text, str) else str(text), severity)
        else:
            messages.append(made(sent.type, fields))
        for message in messages:
            for station in self._stations:
                station.send(message, self._sources[sent.vehicle])

    async def _to_vehicle(self, sent: SentMessage, run: RunId, data: Fields) -> None:
        vehicle = sent.vehicle
        fields = sent.rule.filled(data)
        message = made(sent.type, fields)
        holder = (await self._control.holders()).get(vehicle, "")
        if holder and holder.partition(".")[0] != run:
            raise OperatorError(f"{vehicle} is commanded by {holder}")
        link = self._link(vehicle)
        target = Address(self._autopilots[vehicle].system, sent.component)
        if sent.answer is not None:
            if len(self._commands) >= MOST_COMMANDS:
                raise OperatorError(f"{MOST_COMMANDS} commands wait for answers already")
            params = [getattr(message, each) for each in PARAMS]
            command = Command(target, message.command, params)
            task = asyncio.create_task(self._command(sent, run, link, command))
            self._commands.add(task)
            task.add_done_callback(self._commands.discard)
            return
        has = sent.type.make._fields
        fields |= {name: each for name, each in target.as_target.items() if name in has}
        link.send(made(sent.type, fields))

    def _link(self, vehicle: ResourceId) -> VehicleLink:
        address = self._autopilots[vehicle]
        link = next((each for each in self._hub.links if each.address == address), None)
        if link is None:
            raise OperatorError(f"m2pem has no link to {vehicle} here")
        return link

    async def _command(
        self, sent: SentMessage, run: RunId, link: VehicleLink, command: Command
    ) -> None:
        assert sent.answer is not None
        answer: dict[str, Any] | None = None
        problem = ""
        try:
            ack = await link.perform(command)
            answer = {"result": ack.result}
        except RefusedError as error:
            answer, problem = {"result": error.result}, error.reason
        except ExchangeError as error:
            problem = error.reason
        by = f"mavlink {sent.vehicle} {command.name}"
        await sent.answer.throw(self._control, run, answer, by, problem[:LONGEST])

    async def _failed(self, sent: SentMessage, run: RunId, problem: str) -> None:
        """Tell operators, and the mission if it waits for the answer."""
        problem = f"{sent.key}: {sent.rule.thrown} is not sent: {problem[:LONGEST]}"
        if sent.answer is not None:
            by = f"mavlink {sent.vehicle} {sent.type.name}"
            await sent.answer.throw(self._control, run, None, by, problem)
        else:
            log.warning("%s of run %s", problem, run)
