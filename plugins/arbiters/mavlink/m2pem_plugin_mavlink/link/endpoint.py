"""An endpoint: a socket or a serial line, its peers, and the vehicles that are heard over it."""

import logging
from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Iterable, Set

from m2pem_plugin_mavlink.link.route import Peer, Route
from m2pem_plugin_mavlink.protocol.inbound import Sender
from m2pem_plugin_mavlink.protocol.url import Url

logger = logging.getLogger(__name__)

MOST_STRANGERS = 64
"""Senders at one peer that nobody asked for, of which something is kept."""


class Endpoint(ABC):
    """`own_systems`: ids that are ours; what says to come from them is not heard. `now_s`: seconds
    of the hub's clock. `greet` is called with each peer that must be spoken to first."""

    def __init__(
        self,
        url: Url,
        own_systems: Set[int],
        now_s: Callable[[], float],
        greet: Callable[[Peer], None],
    ) -> None:
        self.url = url
        self.now_s = now_s
        self.greet = greet
        self.peers: dict[Hashable, Peer] = {}
        self._routes: dict[int, Route] = {}
        self._own_systems = own_systems

    @abstractmethod
    async def open(self) -> None:
        """Listen, or begin to connect, again and again.

        Raises:
            PluginError: it is not possible, and will not be.
        """

    @abstractmethod
    async def close(self) -> None:
        """Let go of everything."""

    def route(self, system: int) -> Route:
        """The way to a vehicle; made where there is none."""
        if system not in self._routes:
            self._routes[system] = Route(system, self.url)
            self.forget(system)
        self._routes[system].users += 1
        return self._routes[system]

    def release(self, route: Route) -> None:
        """Undo one `route`."""
        route.users -= 1
        if not route.users:
            del self._routes[route.system]
            self.forget(route.system)

    def forget(self, system: int) -> None:
        """Meet its senders anew when they are heard next."""
        for peer in self.peers.values():
            for sender in list(peer.inbound.senders.values()):
                if sender.address.system == system:
                    peer.inbound.forget(sender)

    def meet(self, peer: Peer, sender: Sender) -> bool:
        """See `link.peer.Meet`."""
        if sender.address.system in self._own_systems:
            return False
        route = self._routes.get(sender.address.system)
        if route is not None:
            return route.claim(peer, sender, self.now_s())
        return len(peer.inbound.senders) < MOST_STRANGERS

    def leads_to(self, system: int) -> bool:
        """Whether somebody reaches a vehicle with this system id here."""
        return system in self._routes

    def heard_systems(self) -> set[int]:
        """The system ids that are heard, wanted or not."""
        senders = (each for peer in self.peers.values() for each in peer.inbound.senders.values())
        return {each.address.system for each in senders}

    def look_after(self) -> None:
        """To be called about once a second."""
        now_s = self.now_s()
        for route in self._routes.values():
            route.sample(now_s)
            route.judge(now_s)

    def drop(self, key: Hashable) -> None:
        """A peer has gone away."""
        peer = self.peers.pop(key, None)
        if peer is not None:
            peer.open = False
        now_s = self.now_s()
        for route in self._routes.values():
            route.judge(now_s)

    def idle_peers(self, before_s: float) -> Iterable[Hashable]:
        """Peers that were not heard since, and at which no vehicle is; longest silent first."""
        idle = [(each.heard_s, key) for key, each in self.peers.items() if each.heard_s < before_s]
        routes = self._routes.values()
        for _, key in sorted(idle, key=lambda each: each[0]):
            if not any(route.holds(self.peers[key]) for route in routes):
                yield key
