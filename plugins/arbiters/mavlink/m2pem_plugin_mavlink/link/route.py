"""A vehicle as it is heard over one endpoint: at which peer, and what of it is wanted.

System ids are only claimed: a second autopilot with the same one, or a program that lies, would
make messages go astray. So whoever is heard first as a component of a system keeps it, until it has
been silent for `TAKEOVER_S` or its connection is gone.
"""

import logging
from collections.abc import Iterable
from dataclasses import dataclass, field

from m2pem_plugin_mavlink.link.peer import Peer
from m2pem_plugin_mavlink.link.turns import Turns
from m2pem_plugin_mavlink.protocol.inbound import NOTHING, Listener, Sender, Wanted
from m2pem_plugin_mavlink.protocol.messages import types_by_id
from m2pem_plugin_mavlink.protocol.quality import LinkQuality
from m2pem_plugin_mavlink.protocol.url import Url

_logger = logging.getLogger(__name__)

TAKEOVER_S = 5.0
MOST_RIVALS = 8


@dataclass(frozen=True, slots=True)
class _Claim:
    peer: Peer
    sender: Sender

    def live(self, now_s: float) -> bool:
        return self.peer.open and now_s - self.sender.heard_s <= TAKEOVER_S


@dataclass(slots=True)
class _Seat:
    """A component: who is believed, and who else says to be it."""

    holder: _Claim
    rivals: list[_Claim] = field(default_factory=list)
    warned: bool = False


class Route:
    """`users`: links that use it; `turns`: of the exchanges with this vehicle."""

    def __init__(self, system: int, url: Url) -> None:
        self.system = system
        self.url = url
        self.users = 0
        self.turns = Turns()
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

    def claim(self, peer: Peer, sender: Sender, now_s: float) -> None:
        """A sender of this system is heard at a peer for the first time."""
        claim = _Claim(peer, sender)
        seat = self._seats.get(sender.address.component)
        if seat is None:
            self._seats[sender.address.component] = _Seat(claim)
            sender.wanted = self._wanted
        elif seat.holder.peer is peer or not seat.holder.live(now_s):
            self._give(seat, claim)
        else:
            seat.rivals = [rival for rival in seat.rivals if rival.peer is not peer][
                1 - MOST_RIVALS :
            ]
            seat.rivals.append(claim)
            if not seat.warned:
                seat.warned = True
                _logger.warning(
                    "%s: %s says to be component %d of system %d, as %s does, which is believed; "
                    "do two vehicles have the same system id?",
                    self.url,
                    peer.name,
                    sender.address.component,
                    self.system,
                    seat.holder.peer.name,
                )

    def judge(self, now_s: float) -> None:
        """Let who has been silent for too long lose its place to somebody who is heard."""
        for seat in self._seats.values():
            if seat.rivals and not seat.holder.live(now_s):
                live = [rival for rival in seat.rivals if rival.live(now_s)]
                if live:
                    self._give(seat, max(live, key=lambda rival: rival.sender.heard_s))

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
        before.sender.wanted = NOTHING
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
