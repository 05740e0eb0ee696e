"""All endpoints of an event loop, shared by all links in it.

Equal URLs are one socket, whatever the number of vehicles and arbiters that use it. Each peer
receives a heartbeat once a second from each source in use: an autopilot takes ten seconds without
one as the loss of its ground station, and some radios and routers send nothing to a peer that has
not sent anything yet.
"""

import asyncio
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from weakref import WeakKeyDictionary

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import US_PER_S, Clock
from m2pem.errors import PluginError
from m2pem_plugin_mavlink.link.endpoint import Endpoint, Tap
from m2pem_plugin_mavlink.link.route import Peer, Route
from m2pem_plugin_mavlink.link.streams import SerialEndpoint, TcpInEndpoint, TcpOutEndpoint
from m2pem_plugin_mavlink.link.udp import UdpEndpoint
from m2pem_plugin_mavlink.link.vehicle_link import VehicleLink
from m2pem_plugin_mavlink.protocol.messages import Address, message_type
from m2pem_plugin_mavlink.protocol.url import SerialUrl, Url, Way
from m2pem_plugin_mavlink.signing.policy import SigningPolicy
from m2pem_plugin_mavlink.signing.registry import Signers
from m2pem_plugin_mavlink.signing.signature import Signing

HEARTBEAT_US = US_PER_S
PEERS_AT_ONCE = 64
"""Peers that receive heartbeats before other tasks run."""

_HEARTBEAT = message_type("HEARTBEAT").make(
    type=dialect.MAV_TYPE_GCS,
    autopilot=dialect.MAV_AUTOPILOT_INVALID,
    system_status=dialect.MAV_STATE_ACTIVE,
    mavlink_version=3,
)
_KINDS: dict[Way, type[Endpoint]] = {
    Way.UDP_IN: UdpEndpoint,
    Way.UDP_OUT: UdpEndpoint,
    Way.TCP_IN: TcpInEndpoint,
    Way.TCP_OUT: TcpOutEndpoint,
}


def endpoint_kind(url: Url) -> type[Endpoint]:
    """Return the class of the endpoints of a URL."""
    return SerialEndpoint if isinstance(url, SerialUrl) else _KINDS[url.way]


class Hub:
    """Heartbeats and silences are timed by the clock of the link that opened the first endpoint, so
    that they fit simulated vehicles that run faster than real time."""

    _clock: Clock

    def __init__(self) -> None:
        self.taps: list[Tap] = []
        """They get the bytes of all endpoints."""
        self.links: list[VehicleLink] = []
        """Those to vehicles that are open."""
        self.link_watchers: list[Callable[[VehicleLink], None]] = []
        """Called with each link that is opened."""
        self._opened: dict[Url, Endpoint] = {}
        self._sources: Counter[Address] = Counter()
        self._own_systems: set[int] = set()
        self._signers = Signers()
        self._changing = asyncio.Lock()
        self._beating: asyncio.Task[None] | None = None

    def now_s(self) -> float:
        """Return the seconds of the hub's clock."""
        return self._clock.now_us() / US_PER_S

    def endpoint(self, url: Url) -> Endpoint:
        """Return an open endpoint."""
        return self._opened[url]

    def add_link(self, link: VehicleLink) -> None:
        """A link was opened."""
        self.links.append(link)
        for watch in list(self.link_watchers):
            watch(link)

    def owners(self, system: int, component: int) -> list[Peer]:
        """Return the peers that own a component of a system, on all endpoints."""
        found = (each.owner(system, component) for each in self._opened.values())
        return [peer for peer in found if peer is not None]

    async def join(
        self,
        system: int,
        urls: Sequence[Url],
        source: Address,
        clock: Clock,
        signing: SigningPolicy | None = None,
    ) -> list[Route]:
        """Open the endpoints over which a vehicle is reached, and send heartbeats as `source`.
        `signing`: how frames are signed; None: as another link to this vehicle says, or not.

        Raises:
            PluginError: one of them cannot be opened, or the key cannot be used; nothing is left of
                the others.
        """
        async with self._changing:
            if not self._opened:
                self._clock = clock
            own_systems = (source.system, *(each.system for each in self._sources))
            taken = any(each.has_route(source.system) for each in self._opened.values())
            if taken or system in own_systems:
                clash = source.system if taken else system
                raise PluginError(
                    f"system id {clash} is that of a vehicle and of m2pem: change one of them"
                )
            own = list(dict.fromkeys(urls))
            checks = self._signers.checks(signing, len(own)) if signing is not None else ()
            self._add_source(source)
            joined: list[Url] = []
            routes: list[Route] = []
            try:
                for url in own:
                    await self._open(url)
                    joined.append(url)
                routes += [self._opened[url].route(system) for url in joined]
                for route, check in zip(routes, checks, strict=False):
                    self._opened[route.url].require_signatures(route, check)
            except BaseException:
                for route in routes:
                    self._opened[route.url].release(route)
                await self._leave(joined, source)
                raise
            return routes

    async def leave(self, routes: Sequence[Route], source: Address) -> None:
        """Undo one `join`."""
        async with self._changing:
            for route in routes:
                self._opened[route.url].release(route)
            await self._leave([route.url for route in routes], source)

    async def _open(self, url: Url) -> None:
        endpoint = self._opened.get(url)
        if endpoint is None:
            kind = endpoint_kind(url)
            endpoint = kind(url, self._own_systems, self.now_s, self._greet, self.taps)
            await endpoint.open()
            self._opened[url] = endpoint
        endpoint.users += 1
        if self._beating is None:
            self._beating = asyncio.create_task(self._beat())

    async def _leave(self, urls: Sequence[Url], source: Address) -> None:
        self._remove_source(source)
        for url in urls:
            endpoint = self._opened[url]
            endpoint.users -= 1
            if not endpoint.users:
                del self._opened[url]
                await endpoint.close()
        if not self._opened and self._beating is not None:
            self._beating.cancel()
            await asyncio.wait([self._beating])
            self._beating = None
            await self._signers.close()

    def _add_source(self, source: Address) -> None:
        self._sources[source] += 1
        if source.system not in self._own_systems:
            self._own_systems.add(source.system)
            for endpoint in self._opened.values():
                endpoint.forget(source.system)

    def _remove_source(self, source: Address) -> None:
        self._sources[source] -= 1
        if not self._sources[source]:
            del self._sources[source]
        self._own_systems.clear()
        self._own_systems.update(each.system for each in self._sources)

    def _greet(self, peer: Peer, signings: Iterable[Signing | None]) -> None:
        for signing in signings:
            for source in self._sources:
                peer.send(_HEARTBEAT, source, signing)

    async def _beat(self) -> None:
        at_us = self._clock.now_us()
        while True:
            at_us += HEARTBEAT_US
            now_us = self._clock.now_us()
            if at_us <= now_us:  # after a suspension of the machine, skip the missed heartbeats
                at_us = now_us + HEARTBEAT_US
            await self._clock.sleep_until(at_us)
            await self._signers.keep()
            for endpoint in list(self._opened.values()):
                endpoint.maintain()
                signings = endpoint.signings()
                for number, peer in enumerate(list(endpoint.peers.values())):
                    self._greet(peer, signings.get(peer) or endpoint.signings_of_unknown(peer))
                    if number % PEERS_AT_ONCE == PEERS_AT_ONCE - 1:
                        await asyncio.sleep(0)


_hubs: WeakKeyDictionary[asyncio.AbstractEventLoop, Hub] = WeakKeyDictionary()


def shared_hub() -> Hub:
    """Return the hub of the running event loop."""
    return _hubs.setdefault(asyncio.get_running_loop(), Hub())
