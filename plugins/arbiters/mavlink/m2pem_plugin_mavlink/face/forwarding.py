"""Vehicles' own frames to ground stations and back (https://mavlink.io/en/guide/routing.html).

Frames travel as they are: signatures, sequence numbers and unknown messages stay. m2pem is a system
of its own between two sides; frames do not pass from vehicle to vehicle. To a vehicle pass messages
that are known to be harmless; all others count as commands.
"""

import logging
from collections.abc import Callable, Collection, Mapping

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import ResourceId
from m2pem_plugin_mavlink.face.stations import Station, Stations
from m2pem_plugin_mavlink.link.endpoint import Endpoint
from m2pem_plugin_mavlink.link.hub import Hub
from m2pem_plugin_mavlink.link.route import Peer
from m2pem_plugin_mavlink.link.udp import UdpEndpoint
from m2pem_plugin_mavlink.protocol.frames import AROUND_V2, V2
from m2pem_plugin_mavlink.protocol.messages import types_by_id
from m2pem_plugin_mavlink.protocol.raw_frames import FrameSplitter, RawFrame

_logger = logging.getLogger(__name__)

SILENT_S = 2.5
"""Seconds of silence after which a vehicle's frames are taken from another of its links."""

MOST_SPLITTERS = 2_048

HARMLESS_MESSAGES = frozenset(
    getattr(dialect, f"MAVLINK_MSG_ID_{name}")
    for name in (
        "HEARTBEAT",
        "SYSTEM_TIME",
        "PING",
        "TIMESYNC",
        "PARAM_REQUEST_READ",
        "PARAM_REQUEST_LIST",
        "MISSION_REQUEST_LIST",
        "MISSION_REQUEST",
        "MISSION_REQUEST_INT",
    )
)
"""They only ask, or only say something about their sender. Not among them: MISSION_ACK, which may
cancel a transfer, and requests for streams, which m2pem's own telemetry needs."""

HARMLESS_COMMANDS = frozenset(
    getattr(dialect, f"MAV_CMD_{name}")
    for name in (
        "GET_HOME_POSITION",
        "GET_MESSAGE_INTERVAL",
        "REQUEST_MESSAGE",
        "REQUEST_PROTOCOL_VERSION",
        "REQUEST_AUTOPILOT_CAPABILITIES",
        "REQUEST_CAMERA_INFORMATION",
        "REQUEST_CAMERA_SETTINGS",
        "REQUEST_STORAGE_INFORMATION",
        "REQUEST_CAMERA_CAPTURE_STATUS",
        "REQUEST_FLIGHT_INFORMATION",
        "REQUEST_VIDEO_STREAM_INFORMATION",
        "REQUEST_VIDEO_STREAM_STATUS",
    )
)

COMMAND_LONG: int = dialect.MAVLINK_MSG_ID_COMMAND_LONG
COMMAND_INT: int = dialect.MAVLINK_MSG_ID_COMMAND_INT
MISSION_ACK: int = dialect.MAVLINK_MSG_ID_MISSION_ACK


def commands_vehicle(frame: RawFrame) -> bool:
    """Return whether a frame to a vehicle may change what it does."""
    if frame.id in (COMMAND_LONG, COMMAND_INT):
        return types_by_id()[frame.id].unpack(frame.payload).command not in HARMLESS_COMMANDS
    if frame.id == MISSION_ACK:  # the end of a download, which ground stations acknowledge
        return bool(types_by_id()[frame.id].unpack(frame.payload).type)
    return frame.id not in HARMLESS_MESSAGES


Refuse = Callable[[Station, RawFrame, int], None]
"""Called with a command that does not pass, and the system id of its vehicle."""


class Forwarder:
    """`vehicles`: those that are forwarded, by system id; `commanded`: those to which commands
    pass; `own_systems`: the system ids with which m2pem itself commands vehicles."""

    def __init__(
        self,
        hub: Hub,
        stations: Stations,
        vehicles: Mapping[int, ResourceId],
        commanded: Collection[ResourceId],
        own_systems: Collection[int],
        refuse: Refuse,
    ) -> None:
        self._hub = hub
        self._stations = stations
        self._vehicles = vehicles
        self._commanded = commanded
        self._own_systems = own_systems
        self._refuse = refuse
        self._splitters: dict[Peer, FrameSplitter] = {}
        self._used: dict[int, Peer] = {}
        self._passed: set[tuple[str, ResourceId]] = set()
        self._confused: set[str] = set()

    def open(self) -> None:
        """Begin to forward."""
        if self._vehicles:
            self._hub.taps.append(self._from_vehicle)

    def close(self) -> None:
        """End it."""
        if self._from_vehicle in self._hub.taps:
            self._hub.taps.remove(self._from_vehicle)

    def from_station(self, station: Station, frame: RawFrame) -> None:
        """Forward a frame of a station to vehicles and to other stations."""
        if not self._vehicles:
            return
        if frame.source.system in self._own_systems and station.name not in self._confused:
            self._confused.add(station.name)
            _logger.warning(
                "ground station %s has system id %d, which is m2pem's own: vehicles answer both "
                "alike, and what it does to a mission may stay unnoticed; give it another id",
                station.name,
                frame.source.system,
            )
        systems = [frame.target.system] if frame.target.system else list(self._vehicles)
        for system in systems:
            if system in self._vehicles and station.shows(system):
                self._to_vehicle(station, frame, system)
        for other in self._stations:
            if other is not station and other.reaches(frame.target):
                other.peer.write(frame.data)

    def _to_vehicle(self, station: Station, frame: RawFrame, system: int) -> None:
        vehicle = self._vehicles[system]
        if commands_vehicle(frame):
            if vehicle not in self._commanded:
                self._refuse(station, frame, system)
                return
            if (station.name, vehicle) not in self._passed:
                self._passed.add((station.name, vehicle))
                _logger.warning(
                    "%s: commands of mavlink %d/%d at %s pass to it, beside those of m2pem",
                    vehicle,
                    *frame.source,
                    station.name,
                )
        peers = self._hub.owners(system, frame.target.component or 1)
        peers = peers or self._hub.owners(system, 1)
        if peers:
            used = self._used.get(system)
            peer = used if used in peers else max(peers, key=lambda each: each.received_s)
            assert peer is not None
            peer.write(frame.data)

    def _from_vehicle(self, endpoint: Endpoint, peer: Peer, data: bytes) -> None:
        if isinstance(endpoint, UdpEndpoint):
            # Nearly all datagrams are one frame; those of other vehicles cost no more than this.
            one = len(data) > AROUND_V2 and data[0] == V2 and len(data) == data[1] + AROUND_V2
            if one and data[5] not in self._vehicles:
                return
            frames = self._splitter(peer).datagram(data)
        else:
            frames = self._splitter(peer).stream(data)
        for frame in frames:
            system = frame.source.system
            if system in self._vehicles and self._is_from_it(frame, peer):
                for station in self._stations:
                    if station.reaches(frame.target) and station.shows(system):
                        station.peer.write(frame.data)

    def _is_from_it(self, frame: RawFrame, peer: Peer) -> bool:
        """Return whether a peer owns the component, on the link of the vehicle that is in use: a
        vehicle with two links sends all twice."""
        system, component = frame.source
        owners = self._hub.owners(system, component)
        if peer not in owners:
            return False
        used = self._used.get(system)
        if component == 1 and (
            used is None or not used.open or peer.received_s - used.received_s > SILENT_S
        ):
            used = self._used[system] = peer
        return used is peer or used not in owners

    def _splitter(self, peer: Peer) -> FrameSplitter:
        splitter = self._splitters.get(peer)
        if splitter is None:
            if len(self._splitters) >= MOST_SPLITTERS:
                self._splitters = {
                    each: kept for each, kept in self._splitters.items() if each.open
                }
            splitter = self._splitters[peer] = FrameSplitter()
        return splitter
