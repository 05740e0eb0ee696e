"""Where a vehicle is reached on one endpoint: `Peer` is an address, `Route` the choice among them.

System ids are only claims: a second autopilot with the same id, or a program that lies, would
misdirect messages. The first sender that speaks as a component of a system keeps that component
until it has been silent for `TAKEOVER_S` or its connection is gone.
"""

import logging
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import partial
from typing import TypeAlias

from m2pem_plugin_mavlink.link.vehicle_link import KeyedLock
from m2pem_plugin_mavlink.protocol.frames import encode
from m2pem_plugin_mavlink.protocol.inbound import NOTHING, Inbound, Listener, Sender, Wanted
from m2pem_plugin_mavlink.protocol.messages import Address, Message, types_by_id
from m2pem_plugin_mavlink.protocol.quality import LinkQuality
from m2pem_plugin_mavlink.protocol.url import Url

Meet: TypeAlias = Callable[["Peer", Sender], bool]
"""Is told of a new sender at a peer; False: it is not to be heard."""


class Peer:
    """A peer of an endpoint: a UDP address, a TCP connection, or what is at the end of a serial
    line. `name` is for people; `write` sends bytes at once, or drops them; `heard_s`: when anything
    came from it; `open`: it has not gone away."""

    __slots__ = ("_sequences", "heard_s", "inbound", "name", "open", "write")

    def __init__(
        self, name: str, write: Callable[[bytes], None], meet: Meet, heard_s: float
    ) -> None:
        self.name = name
        self.write = write
        self.heard_s = heard_s
        self.open = True
        self.inbound = Inbound(partial(meet, self))
        self._sequences: dict[Address, int] = {}

    def send(self, message: Message, source: Address) -> None:
        """Send a message as `source`, whose frames to each peer are numbered by themselves.

        Raises:
            struct.error: a field's value does not fit its type.
        """
        sequence = self._sequences.get(source, 0)
        self.write(encode(message, sequence, source))
        self._sequences[source] = (sequence + 1) & 255


_logger = logging.getLogger(__name__)

TAKEOVER_S = 5.0
FORGOTTEN_S = 60.0
MOST_RIVALS = 8


@dataclass(frozen=True, slots=True)
class _Claim:
    peer: Peer
    sender: Sender

    def live(self, now_s: float) -> bool:
        return self.peer.open and now_s - self.sender.heard_s <= TAKEOVER_S

    def forget(self) -> None:
        self.peer.inbound.forget(self.sender)


@dataclass(slots=True)
class _Seat:
    """A component: who is believed, and who else says to be it."""

    holder: _Claim
    rivals: list[_Claim] = field(default_factory=list)
    warned: bool = False


class Route:
    """`users`: links that use it; `autopilots`: the components that they command, of which there is
    mostly one; `turns`: of the exchanges with this vehicle."""

    def __init__(self, system: int, url: Url) -> None:
        self.system = system
        self.url = url
        self.users = 0
        self.autopilots: set[int] = set()
        self.locks = KeyedLock()
        self._wanted: dict[int, Wanted] = {}
        self._seats: dict[int, _Seat] = {}

    def listen(self, ids: Iterable[int], listener: Listener) -> None:
        """Hand messages with these ids to the listener; twice, if it listens twice.

        Raises:
            KeyError: the dialect has no message with such an id.
        """
        types = [types_by_id()[id_] for id_ in ids]
        for type_ in types:
            before = self._wanted.get(type_.id)
            listeners = before.listeners if before else ()
            self._wanted[type_.id] = Wanted(type_, (*listeners, listener))

    def unlisten(self, ids: Iterable[int], listener: Listener) -> None:
        """Take one `listen` back."""
        for id_ in ids:
            wanted = self._wanted[id_]
            listeners = list(wanted.listeners)
            listeners.remove(listener)
            if listeners:
                self._wanted[id_] = Wanted(wanted.type, tuple(listeners))
            else:
                del self._wanted[id_]

    def claim(self, peer: Peer, sender: Sender, now_s: float) -> bool:
        """A sender of this system is heard at a peer for the first time, or again after it was
        forgotten; False: it is one of too many that say to be the same."""
        claim = _Claim(peer, sender)
        seat = self._seats.get(sender.address.component)
        if seat is None:
            self._seats[sender.address.component] = _Seat(claim)
            sender.wanted = self._wanted
        elif seat.holder.peer is peer or not seat.holder.live(now_s):
            self._give(seat, claim)
        else:
            for rival in list(seat.rivals):
                if rival.peer is peer or not rival.live(now_s):
                    seat.rivals.remove(rival)
                    rival.forget()
            if len(seat.rivals) == MOST_RIVALS:
                return False
            seat.rivals.append(claim)
            self._warn(seat, claim)
        return True

    def judge(self, now_s: float) -> None:
        """Let who has been silent for too long lose its place to somebody who is heard; and forget
        components, but not autopilots: they may hear us though we don't hear them."""
        for component, seat in list(self._seats.items()):
            holder = seat.holder
            if holder.live(now_s):
                continue
            live = [rival for rival in seat.rivals if rival.live(now_s)]
            if live:
                self._give(seat, max(live, key=lambda rival: rival.sender.heard_s))
            elif component not in self.autopilots and now_s - holder.sender.heard_s > FORGOTTEN_S:
                for claim in (holder, *seat.rivals):
                    claim.forget()
                del self._seats[component]

    def holds(self, peer: Peer) -> bool:
        """Whether the vehicle, or a part of it, is reached at this peer."""
        return any(seat.holder.peer is peer for seat in self._seats.values())

    def peer_of(self, component: int, autopilot: int) -> Peer | None:
        """Where a component is reached: where it was heard, or else, where the autopilot was, which
        passes on what is for others. None: nowhere."""
        for each in (component, autopilot):
            seat = self._seats.get(each)
            if seat is not None and seat.holder.peer.open:
                return seat.holder.peer
        return None

    def sample(self, now_s: float) -> None:
        """To be called about once a second."""
        for seat in self._seats.values():
            seat.holder.sender.sample(now_s)

    def quality(self, component: int, now_s: float) -> LinkQuality | None:
        """How well a component is heard; None: it was never heard, or its connection is gone."""
        seat = self._seats.get(component)
        if seat is None or not seat.holder.peer.open:
            return None
        return seat.holder.sender.quality(now_s)

    def _give(self, seat: _Seat, claim: _Claim) -> None:
        before = seat.holder
        # Who is not believed is met anew when it is heard next: it may be believed another time.
        for other in (before, *seat.rivals):
            if other is not claim:
                other.sender.wanted = NOTHING
                other.forget()
        claim.sender.wanted = self._wanted
        seat.holder, seat.rivals, seat.warned = claim, [], False
        if before.peer is not claim.peer:
            _logger.info(
                "%s: component %d of system %d is silent at %s, and now at %s",
                self.url,
                claim.sender.address.component,
                self.system,
                before.peer.name,
                claim.peer.name,
            )

    def _warn(self, seat: _Seat, claim: _Claim) -> None:
        component = claim.sender.address.component
        if not seat.warned and component in self.autopilots:
            seat.warned = True
            _logger.warning(
                "%s: %s says to be component %d of system %d, as %s does, which is believed; "
                "do two vehicles have the same system id?",
                self.url,
                claim.peer.name,
                component,
                self.system,
                seat.holder.peer.name,
            )
