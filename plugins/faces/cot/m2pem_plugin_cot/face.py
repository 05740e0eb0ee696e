"""The face `cot`: the fleet as events of Cursor on Target, and their markers as geometries."""

import asyncio
import logging
import time
from collections.abc import Mapping
from typing import ClassVar

from m2pem.api import (
    Area,
    FaceCapabilities,
    FaceSettings,
    LinkState,
    MissionControl,
    PayloadState,
    Point,
    ResourceId,
    Route,
    Value,
    VehicleState,
    as_geojson,
    shown_geometries,
)
from m2pem.errors import M2pemError
from m2pem_plugin_cot.contact import CONTACT_EVERY_S, Chat
from m2pem_plugin_cot.events import (
    TYPES,
    deletion_event,
    detection_event,
    geometry_event,
    vehicle_event,
)
from m2pem_plugin_cot.link import Link
from m2pem_plugin_cot.received import EventError, Received, read_event
from m2pem_plugin_cot.settings import read_settings

log = logging.getLogger("m2pem.cot")

GEOMETRY_STALE_S = 600.0
GEOMETRIES_EVERY_S = 60.0
"""Geometries are sent again, as a map that was just opened has none."""
DELETIONS = 3
"""How many times a map reads that a geometry is gone: a datagram may be lost."""
MAX_WAITING = 100
"""Received events that wait; more are dropped."""
RECEIVED_PER_S = 20
CHANGES_EVERY_S = 1.0
SAY_EVERY_S = 60.0
FROM_MAP = "cot "
"""How names begin of those who have handed over what a map has sent."""


class CotFace:
    """Implements `m2pem.api.Face`."""

    capabilities: ClassVar[FaceCapabilities] = FaceCapabilities(imports=("lxml.etree",))

    def __init__(self, control: MissionControl, settings: FaceSettings) -> None:
        self._control = control
        self._fleet = control.fleet()
        self._settings = read_settings(settings, self._fleet)
        self._link = Link(self._settings, self._received, self._connected)
        self._states: dict[str, VehicleState] = {}
        self._holders: Mapping[ResourceId, str] = {}
        self._waiting: asyncio.Queue[tuple[bytes, str]] = asyncio.Queue(MAX_WAITING)
        self._next: dict[str, tuple[Received, str]] = {}
        """What becomes of a geometry, by its name: the newest event."""
        self._given: dict[str, Point | Route | Area] = {}
        self._refused: dict[str, int] = {}
        self._contact = contact = self._settings.contact
        self._chat = (
            Chat(control, contact, self._link.send, self._now_us)
            if contact is not None and contact.chat
            else None
        )

    async def serve(self) -> None:
        """Send and receive until cancelled.

        Raises:
            PluginError: an address of this host cannot be used.
        """
        works = [self._link.run(), self._follow(), self._send(), self._send_geometries()]
        if self._contact is not None:
            works.append(self._stay_known())
        if self._chat is not None:
            works.append(self._chat.follow())
        if self._settings.receive or self._chat is not None:
            works += [self._take_in(), self._change()]
        works.append(self._say())
        tasks = [asyncio.create_task(work) for work in works]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    # --- out ------------------------------------------------------------------------------------

    async def _follow(self) -> None:
        number = 0
        async for state in self._control.telemetry(size=1000):
            if isinstance(state, VehicleState):
                self._states[state.resource] = state
            elif isinstance(state, PayloadState):
                for found in state.detections:
                    number += 1
                    uid = self._uid("detection", f"{found.source}.{found.time_us}.{number}")
                    self._link.send(detection_event(uid, found, GEOMETRY_STALE_S))

    def _connected(self) -> None:
        """Say who m2pem is, and what is asked now."""
        if self._contact is not None:
            self._link.send(self._contact.event(self._fleet.origin, self._now_us()))
        if self._chat is not None:
            self._chat.repeat()

    async def _stay_known(self) -> None:
        while self._contact is not None:
            await asyncio.sleep(CONTACT_EVERY_S)
            self._link.send(self._contact.event(self._fleet.origin, self._now_us()))

    async def _send(self) -> None:
        """Send the vehicles that were received since the last time; others become stale."""
        sent: dict[str, VehicleState] = {}
        while True:
            self._holders = await self._control.holders()
            labels = await self._control.holder_labels()
            for name, state in list(self._states.items()):
                if sent.get(name) is state or state.link is LinkState.LOST:
                    continue
                sent[name] = state
                domain = self._fleet.vehicles[state.resource].domain
                event = vehicle_event(
                    self._uid("vehicle", name),
                    self._settings.types.get(name, TYPES[domain]),
                    state,
                    self._settings.stale_s,
                    self._remarks(state, labels),
                )
                if event is not None:
                    self._link.send(event)
            await asyncio.sleep(self._settings.period_s)

    def _remarks(self, state: VehicleState, labels: Mapping[str, str]) -> str:
        holder = self._holders.get(state.resource, "")
        parts = [state.mode, labels.get(holder, f"with {holder}" if holder else "free")]
        if state.ready is False:
            parts.append(f"not ready: {'; '.join(state.not_ready_reasons)}")
        return ", ".join(part for part in parts if part)

    async def _send_geometries(self) -> None:
        """Send what is new or has changed, all of it again now and then, and what is gone."""
        sent: dict[str, Point | Route | Area] = {}
        gone: dict[str, int] = {}
        left_s = 0.0
        while True:
            geometries = self._own_geometries()
            again = left_s <= 0
            now_us = self._now_us()
            if self._states:
                for name, geometry in geometries.items():
                    if again or sent.get(name) != geometry:
                        uid = self._uid("geometry", name)
                        event = geometry_event(uid, name, geometry, now_us, GEOMETRY_STALE_S)
                        self._link.send(event)
                gone |= dict.fromkeys(sent.keys() - geometries.keys(), DELETIONS)
                gone = {name: left for name, left in gone.items() if name not in geometries}
                for name in gone:
                    self._link.send(deletion_event(self._uid("geometry", name), now_us))
                gone = {name: left - 1 for name, left in gone.items() if left > 1}
                sent, left_s = geometries, GEOMETRIES_EVERY_S if again else left_s
            await asyncio.sleep(self._settings.period_s)
            left_s -= self._settings.period_s

    def _own_geometries(self) -> dict[str, Point | Route | Area]:
        """Return what is shown, without what came from a map: it is there already."""
        given = self._control.geometries()
        return {
            name: geometry
            for name, geometry in shown_geometries(self._control).items()
            if name not in given or not given[name].by.startswith(FROM_MAP)
        }

    def _now_us(self) -> int:
        """Return the time of the executive's clock, which may be faster than that of the wall."""
        return max(
            (state.time_us for state in self._states.values()), default=time.time_ns() // 1000
        )

    # --- in -------------------------------------------------------------------------------------

    def _received(self, content: bytes, source: str) -> None:
        """Let an event wait; drop it if too many do. It never blocks."""
        if not (self._settings.receive or self._chat is not None):
            return
        if self._waiting.full():
            self._refuse("too many at once")
        else:
            self._waiting.put_nowait((content, source))

    async def _take_in(self) -> None:
        while True:
            content, source = await self._waiting.get()
            try:
                received = read_event(content)
            except EventError as error:
                self._refuse(f"{source.rpartition(':')[0]}: {error}")
                received = None
            if received is None or received.uid.startswith(self._uid("", "")):
                pass
            elif received.to and not (self._contact and self._contact.is_meant(received)):
                pass  # it is for others
            elif received.geometry is None:
                if self._chat is not None:
                    await self._chat.take(received, source)
            elif self._settings.receive:
                if received.name in self._fleet.handed_over:
                    self._next[received.name] = received, source
                else:
                    self._refuse(f"{received.name!r} is not among the fleet's handed_over")
            await asyncio.sleep(1 / RECEIVED_PER_S)

    async def _change(self) -> None:
        """Hand geometries over. Each change is in the journals of all runs, so that a sender could
        fill the disk: the newest one of a period counts."""
        while True:
            for name in list(self._next):
                await self._hand_over(name, *self._next.pop(name))
            await asyncio.sleep(CHANGES_EVERY_S)

    async def _hand_over(self, name: str, received: Received, source: str) -> None:
        drawn = received.geometry
        if drawn is None or self._given.get(name) == drawn:
            return
        by = f"{FROM_MAP}{received.uid} at {source}"
        geometry: dict[str, Value] = as_geojson(drawn)
        try:
            await self._control.set_geometry(name, geometry, by=by)
        except M2pemError as error:
            self._refuse(str(error))
        else:
            self._given[name] = drawn
            log.warning("%s was handed over by %s", name, by)

    def _refuse(self, why: str) -> None:
        if why in self._refused or len(self._refused) < MAX_WAITING:
            self._refused[why] = self._refused.get(why, 0) + 1

    # --- both -----------------------------------------------------------------------------------

    def _uid(self, kind: str, name: str) -> str:
        start = f"m2pem.{self._fleet.name}."
        return f"{start}{kind}.{name}" if kind else start

    async def _say(self) -> None:
        """Log now and then what was dropped and refused."""
        said = 0
        while True:
            await asyncio.sleep(SAY_EVERY_S)
            if self._link.dropped > said:
                log.warning("%d events were not sent", self._link.dropped - said)
                said = self._link.dropped
            for why, times in self._refused.items():
                log.warning("%d received events were not used: %s", times, why)
            self._refused.clear()
