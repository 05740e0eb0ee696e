"""The link to a vehicle over the hub: `await open_link(address, urls, clock)`."""

import logging
import math
from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

from m2pem.api import Clock
from m2pem.errors import PluginError
from m2pem_plugin_mavlink.link.hub import Hub, shared_hub
from m2pem_plugin_mavlink.link.route import Route
from m2pem_plugin_mavlink.link.vehicle_link import Listener, VehicleLink
from m2pem_plugin_mavlink.protocol.messages import Address, Message
from m2pem_plugin_mavlink.protocol.quality import LinkQuality
from m2pem_plugin_mavlink.protocol.transaction import Transaction
from m2pem_plugin_mavlink.protocol.url import parse_url
from m2pem_plugin_mavlink.signing.policy import SigningPolicy
from m2pem_plugin_mavlink.signing.signature import RefusedFrames
from m2pem_plugin_mavlink.signing.timestamps import clock_timestamp

T = TypeVar("T")

_logger = logging.getLogger(__name__)

GROUND_STATION = Address(255, 190)
"""The default address of this ground station, as MAVLink assigns it."""

SILENT_S = 2.5
"""Seconds of silence after which another endpoint is tried."""

WORSE_LOSS = 0.1
"""An endpoint is left for another one whose loss is smaller by this fraction."""


async def open_link(
    address: Address,
    urls: Sequence[str],
    clock: Clock,
    source: Address = GROUND_STATION,
    may_send: Callable[[], bool] = lambda: True,
    signing: SigningPolicy | None = None,
) -> "RoutedLink":
    """Open a link to a vehicle over one or more endpoints, the preferred one first; `source`: the
    address of this ground station. Nothing is sent while `may_send` is false. `signing`: how frames
    are signed; None: as another link to this vehicle says, or not.

    Return when listening: a silent vehicle, or a connection that is not made yet, is no error.

    Raises:
        PluginError: a URL is wrong, an endpoint cannot be opened, or a key cannot be used.
    """
    if not urls:
        raise PluginError("the vehicle needs a URL, such as udpin://127.0.0.1:14550")
    hub = shared_hub()
    parsed = [parse_url(url) for url in urls]
    routes = await hub.join(address.system, parsed, source, clock, signing)
    link = RoutedLink(hub, address, source, routes, clock, may_send)
    hub.add_link(link)
    return link


class RoutedLink(VehicleLink):
    """Sends over the endpoint with the best connection to the vehicle."""

    def __init__(
        self,
        hub: Hub,
        address: Address,
        source: Address,
        routes: Sequence[Route],
        clock: Clock,
        may_send: Callable[[], bool] = lambda: True,
    ) -> None:
        super().__init__(address, clock)
        self.source = source
        self._hub = hub
        self._routes = list(routes)
        self._may_send = may_send
        self._used = self._routes[0]
        for route in routes:
            route.autopilots.add(address.component)
        self._listening: list[tuple[frozenset[int], Listener]] = []

    def send(self, message: Message) -> None:
        """See `VehicleLink.send`. Nothing is sent to a vehicle that has never sent anything: its
        peer is unknown.

        Raises:
            struct.error: a field's value does not fit its type.
        """
        if self._closed or not self._may_send():
            return
        component = getattr(message, "target_component", 0)
        route = self._best()
        peer = route.peer_of(component, self.address.component)
        if peer is not None:
            peer.send(message, self.source, route.signing)

    def listen(self, ids: Iterable[int], listener: Listener) -> Callable[[], None]:
        """See `VehicleLink.listen`.

        Raises:
            KeyError: the dialect has no message with such an id.
        """
        wanted = frozenset(ids)
        entry = wanted, listener
        for route in self._routes:
            route.listen(wanted, listener)
        self._listening.append(entry)

        def end() -> None:
            if entry in self._listening:
                self._listening.remove(entry)
                for route in self._routes:
                    route.unlisten(wanted, listener)

        return end

    async def perform(self, transaction: Transaction[T]) -> T:
        """See `VehicleLink.perform`. Cancelling it ends the exchange: nothing more is sent."""
        transaction.source = self.source
        async with self._routes[0].locks.locked((self.source, transaction.key)):
            self._refuse_closed()
            await self._exchange(transaction)
        return transaction.outcome()

    def quality(self) -> LinkQuality | None:
        """Return the quality over the endpoint in use; None if the autopilot has never sent
        anything."""
        return self._quality(self._best())

    def qualities(self) -> dict[str, LinkQuality | None]:
        """The same for each endpoint, by its URL."""
        return {str(route.url): self._quality(route) for route in self._routes}

    def refused(self) -> list[RefusedFrames]:
        return [each for route in self._routes for each in route.refused()]

    def signing_time(self) -> int:
        """Return the present timestamp of signatures of this vehicle; see `signing.timestamps`."""
        signing = self._used.signing
        return clock_timestamp() if signing is None else signing.signer.timestamps.now()

    def known_systems(self) -> set[int]:
        """Return every system id that sends on its endpoints; for errors, when the vehicle's own
        does not."""
        systems = (self._hub.endpoint(route.url).known_systems() for route in self._routes)
        return set().union(*systems)

    async def close(self) -> None:
        """Release the vehicle, and endpoints without other users. Active exchanges fail."""
        if self._closed:
            return
        self._hub.links.remove(self)
        self._end_exchanges()
        for wanted, listener in self._listening:
            for route in self._routes:
                route.unlisten(wanted, listener)
        self._listening.clear()
        await self._hub.leave(self._routes, self.source)

    def _quality(self, route: Route) -> LinkQuality | None:
        return route.quality(self.address.component, self._hub.now_s())

    def _best(self) -> Route:
        used = self._used
        if len(self._routes) == 1:
            return used
        qualities = {route: self._quality(route) for route in self._routes}
        live = {
            route: each.loss for route, each in qualities.items() if each and each.age_s <= SILENT_S
        }
        if live:
            best = min(live, key=lambda route: live[route])
            if used in live and live[used] <= live[best] + WORSE_LOSS:
                best = used
        else:
            ages = {route: each.age_s if each else math.inf for route, each in qualities.items()}
            best = min(ages, key=lambda route: ages[route])
            if ages[best] == ages[used]:
                best = used
        if best is not used:
            _logger.info("system %d: now over %s, not %s", self.address.system, best.url, used.url)
            self._used = best
        return best
