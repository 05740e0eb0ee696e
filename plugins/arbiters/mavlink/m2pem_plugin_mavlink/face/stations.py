"""Ground stations: the peers of the face's endpoints, and what they may cost.

System ids are only claims, and any program may send: the number of stations, of messages that each
may send in a second, and of addresses that are kept for it have bounds.
"""

import asyncio
import logging
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from functools import partial

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.errors import PluginError
from m2pem_plugin_mavlink.face import modes
from m2pem_plugin_mavlink.link.endpoint import Endpoint
from m2pem_plugin_mavlink.link.hub import endpoint_kind
from m2pem_plugin_mavlink.link.route import Peer
from m2pem_plugin_mavlink.link.udp import UdpEndpoint
from m2pem_plugin_mavlink.protocol.messages import Address, Message
from m2pem_plugin_mavlink.protocol.raw_frames import FrameSplitter, RawFrame
from m2pem_plugin_mavlink.protocol.url import Url
from m2pem_plugin_mavlink.signing.signature import Signing

MOST_STATIONS = 16
MOST_ADDRESSES = 32
FRAMES_PER_S = 400.0
MOST_FRAMES_AT_ONCE = 800.0
MAINTAIN_S = 1.0
COMPANIONS = range(dialect.MAV_COMP_ID_ONBOARD_COMPUTER, dialect.MAV_COMP_ID_ONBOARD_COMPUTER4 + 1)
"""Components that may share the system id of a vehicle: MAVROS, and MAVSDK as a companion computer,
take the vehicle's."""

HEARTBEAT: int = dialect.MAVLINK_MSG_ID_HEARTBEAT

_logger = logging.getLogger(__name__)


class Station:
    """A peer: one ground station, or a router with several. `addresses`: those that send over it.
    `ignored`: its frames that were dropped, as there were too many. `ardupilot_modes`: it is sent
    ArduPilot's numbers of modes. `sends_targets`: as PX4 needs them before its Offboard mode.
    `systems`: of the vehicles that are on its link, None: all are.
    `intervals_s`: those that it has set itself, by the system and the message, and `queued`: the
    numbers of their entries in the queue of `Streams`."""

    def __init__(self, peer: Peer, now_s: float, systems: Set[int] | None = None) -> None:
        self.peer = peer
        self.systems = systems
        self.splitter = FrameSplitter()
        self.addresses: set[Address] = set()
        self.ignored = 0
        self.ardupilot_modes = False
        self.sends_targets = False
        self.intervals_s: dict[tuple[int, int], float] = {}
        self.queued: dict[tuple[int, int], int] = {}
        self._budget = MOST_FRAMES_AT_ONCE
        self._refilled_s = now_s

    @property
    def name(self) -> str:
        return self.peer.name

    def may_send(self, now_s: float) -> bool:
        """Count a frame; return whether it is within the station's bounds."""
        self._budget = min(
            MOST_FRAMES_AT_ONCE, self._budget + FRAMES_PER_S * (now_s - self._refilled_s)
        )
        self._refilled_s = now_s
        if self._budget < 1.0:
            self.ignored += 1
            return False
        self._budget -= 1.0
        return True

    def meet(self, address: Address) -> None:
        """An address has sent a frame over it."""
        if len(self.addresses) < MOST_ADDRESSES:
            self.addresses.add(address)

    def reaches(self, target: Address) -> bool:
        """Return whether a frame with this target is for this station (mavlink.io, "Routing")."""
        if not target.system:
            return True
        if not target.component:
            return any(each.system == target.system for each in self.addresses)
        return target in self.addresses

    def shows(self, system: int) -> bool:
        """Return whether a vehicle is on its link."""
        return self.systems is None or system in self.systems

    def send(self, message: Message, source: Address) -> None:
        """Send a message; a station that does not read loses it, and one on whose link its vehicle
        is not does not get it."""
        if not self.shows(source.system):
            return
        if self.ardupilot_modes and message.TYPE.id == HEARTBEAT:
            message = modes.renumbered(message)
        self.peer.send(message, source)


Receive = Callable[[Station, RawFrame], None]


class Stations:
    """The endpoints of the face. `receive` is called with each frame of a station; `own_systems`:
    the system ids of the fleet, whose frames no station may send but companion computers. `links`:
    those of the vehicles on a URL, of those URLs on which not all are."""

    def __init__(
        self,
        urls: Sequence[Url],
        own_systems: Set[int],
        receive: Receive,
        links: Mapping[Url, Set[int]],
    ) -> None:
        self._urls = urls
        self._links = links
        self._own_systems = own_systems
        self._receive = receive
        self._endpoints: list[Endpoint] = []
        self._stations: dict[Peer, Station] = {}
        self._full = False
        self._lied: set[Peer] = set()

    async def open(self) -> None:
        """Open the endpoints.

        Raises:
            PluginError: one of them cannot be opened; none stays open.
        """
        try:
            for url in self._urls:
                on_link = self._links.get(url)
                greet, tap = partial(self._greet, on_link), partial(self._tap, on_link)
                endpoint = endpoint_kind(url)(url, self._own_systems, self.now_s, greet, (tap,))
                endpoint.companions = COMPANIONS
                await endpoint.open()
                self._endpoints.append(endpoint)
        except PluginError:
            await self.close()
            raise

    async def close(self) -> None:
        """Close the endpoints."""
        for endpoint in self._endpoints:
            await endpoint.close()
        self._endpoints.clear()
        self._stations.clear()

    @staticmethod
    def now_s() -> float:
        """Return the seconds of the event loop's clock: ground stations live in real time."""
        return asyncio.get_running_loop().time()

    async def maintain(self) -> None:
        """Forget stations that are gone, until cancelled."""
        while True:
            await asyncio.sleep(MAINTAIN_S)
            for endpoint in self._endpoints:
                endpoint.maintain()
            for peer in [peer for peer in self._stations if not self._present(peer)]:
                station = self._stations.pop(peer)
                _logger.info(
                    "ground station %s is gone; %d messages to it were dropped, %d of its own",
                    station.name,
                    peer.unsent,
                    station.ignored,
                )
            self._lied &= self._stations.keys()
            self._full = self._full and len(self._stations) >= MOST_STATIONS

    def __iter__(self) -> Iterator[Station]:
        """The stations that are sent to."""
        return iter([station for peer, station in self._stations.items() if peer.open])

    def _present(self, peer: Peer) -> bool:
        return peer.open and any(peer in each.peers.values() for each in self._endpoints)

    def _greet(self, systems: Set[int] | None, peer: Peer, _: Iterable[Signing | None]) -> None:
        self._station(peer, systems)

    def _station(self, peer: Peer, systems: Set[int] | None) -> Station | None:
        station = self._stations.get(peer)
        if station is None and len(self._stations) < MOST_STATIONS:
            station = self._stations[peer] = Station(peer, self.now_s(), systems)
            _logger.info("ground station %s", peer.name)
        elif station is None and not self._full:
            self._full = True
            _logger.warning(
                "ground station %s is ignored: there are %d already", peer.name, MOST_STATIONS
            )
        return station

    def _tap(self, systems: Set[int] | None, endpoint: Endpoint, peer: Peer, data: bytes) -> None:
        station = self._station(peer, systems)
        if station is None:
            return
        splitter = station.splitter
        is_datagram = isinstance(endpoint, UdpEndpoint)
        frames = splitter.datagram(data) if is_datagram else splitter.stream(data)
        now_s = self.now_s()
        for frame in frames:
            if not station.may_send(now_s):
                continue
            system, component = frame.source
            if system in self._own_systems and component not in COMPANIONS:
                self._refuse(station, frame)
                continue
            station.meet(frame.source)
            try:
                self._receive(station, frame)
            except Exception:
                _logger.exception("a frame of ground station %s was not understood", station.name)

    def _refuse(self, station: Station, frame: RawFrame) -> None:
        if station.peer not in self._lied:
            self._lied.add(station.peer)
            _logger.warning(
                "%s sends as %d/%d, which is of a vehicle of the fleet: it is not listened to; "
                "give it another system id, or component 191 of a companion computer",
                station.name,
                *frame.source,
            )
