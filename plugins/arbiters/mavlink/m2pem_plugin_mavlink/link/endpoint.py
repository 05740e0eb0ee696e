"""An endpoint: a socket or a serial line, its peers, and the routes to vehicles over it."""

import logging
from abc import ABC, abstractmethod
from collections import defaultdict
from collections.abc import Callable, Collection, Hashable, Iterable, Mapping, Sequence, Set
from typing import TypeAlias

from m2pem_plugin_mavlink.link.route import Peer, Route
from m2pem_plugin_mavlink.protocol.inbound import Sender
from m2pem_plugin_mavlink.protocol.url import Url
from m2pem_plugin_mavlink.signing.signature import SignatureCheck, Signing

logger = logging.getLogger(__name__)

Tap: TypeAlias = Callable[["Endpoint", Peer, bytes], None]
"""Called with the bytes that a known peer has sent, after they were processed; must not raise."""

MAX_UNKNOWN_SENDERS = 64
"""Most senders without a route that one peer keeps."""

MOST_KEYS = 8
"""With more keys on an endpoint, frames to a peer from which no frame came are not signed."""


class Endpoint(ABC):
    """`own_systems`: the system ids of this process; frames that claim to come from them are
    dropped. `now_s`: seconds of the hub's clock. `greet` is called with each peer that must receive
    a frame first, and with how to sign it. `taps` get the bytes that arrive, as they are; they may
    change later."""

    def __init__(
        self,
        url: Url,
        own_systems: Set[int],
        now_s: Callable[[], float],
        greet: Callable[[Peer, Iterable[Signing | None]], None],
        taps: Sequence[Tap] = (),
    ) -> None:
        self.url = url
        self.now_s = now_s
        self.greet = greet
        self.taps = taps
        self.users = 0
        """The number of links that use it."""
        self.peers: dict[Hashable, Peer] = {}
        self._routes: dict[int, Route] = {}
        self._own_systems = own_systems
        self.companions: Collection[int] = ()
        """Components whose frames may come from `own_systems`."""

    @abstractmethod
    async def open(self) -> None:
        """Listen, or start to connect, repeatedly.

        Raises:
            PluginError: it is not possible, and will not be.
        """

    @abstractmethod
    async def close(self) -> None:
        """Close all connections."""

    def route(self, system: int) -> Route:
        """Return the route to a vehicle; create it if there is none."""
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

    def require_signatures(self, route: Route, check: SignatureCheck) -> None:
        """Sign the frames to a vehicle, and accept only signed ones.

        Raises:
            SigningError: they are signed in another way.
        """
        route.require_signatures(check)
        self.forget(route.system)

    def check_of(self, sender: int) -> SignatureCheck | None:
        """See `protocol.inbound.CheckOf`."""
        route = self._routes.get(sender & 255)
        return None if route is None else route.check_of(sender >> 8)

    def signings(self) -> Mapping[Peer, set[Signing | None]]:
        """Return how vehicles at each peer expect frames to be signed. A peer that is not in it has
        no vehicle in use: see `signings_of_unknown`."""
        found: defaultdict[Peer, set[Signing | None]] = defaultdict(set)
        for route in self._routes.values():
            for peer in route.holders():
                found[peer].add(route.signing)
        return found

    def signings_of_unknown(self, peer: Peer) -> set[Signing | None]:
        """Return how to sign frames to a peer that has no vehicle in use, as far as known."""
        own: set[Signing | None] = {route.signing for route in self._routes.values()}
        return {None} if peer.inbound.senders or not 0 < len(own) <= MOST_KEYS else own

    def forget(self, system: int) -> None:
        """Forget the senders of a system; they are admitted again at their next frame."""
        for peer in self.peers.values():
            for sender in list(peer.inbound.senders.values()):
                if sender.address.system == system:
                    peer.inbound.forget(sender)

    def admit(self, peer: Peer, sender: Sender) -> bool:
        """See `link.route.AdmitSender`."""
        system, component = sender.address
        if system in self._own_systems and component not in self.companions:
            return False
        route = self._routes.get(sender.address.system)
        if route is not None:
            return route.claim(peer, sender, self.now_s())
        return len(peer.inbound.senders) < MAX_UNKNOWN_SENDERS

    def owner(self, system: int, component: int) -> Peer | None:
        """Return the peer that owns a component of a system that links use; None: there is none."""
        route = self._routes.get(system)
        return route.peer_of(component, component) if route is not None else None

    def has_route(self, system: int) -> bool:
        """Return whether a link uses this system id here."""
        return system in self._routes

    def known_systems(self) -> set[int]:
        """Return the system ids that send frames, whether links use them or not."""
        senders = (each for peer in self.peers.values() for each in peer.inbound.senders.values())
        return {each.address.system for each in senders}

    def maintain(self) -> None:
        """Sample the quality of routes, and reassign silent ones. Call it about once a second."""
        now_s = self.now_s()
        for route in self._routes.values():
            route.sample(now_s)
            route.judge(now_s)

    def drop(self, key: Hashable) -> None:
        """A peer has closed its connection."""
        peer = self.peers.pop(key, None)
        if peer is not None:
            peer.open = False
        now_s = self.now_s()
        for route in self._routes.values():
            route.judge(now_s)

    def idle_peers(self, before_s: float) -> Iterable[Hashable]:
        """Yield peers that have sent nothing since `before_s` and reach no vehicle in use; the
        longest silent first."""
        idle = [
            (each.received_s, key) for key, each in self.peers.items() if each.received_s < before_s
        ]
        routes = self._routes.values()
        for _, key in sorted(idle, key=lambda each: each[0]):
            if not any(route.holds(self.peers[key]) for route in routes):
                yield key
