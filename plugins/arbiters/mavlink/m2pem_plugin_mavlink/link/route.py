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
from m2pem_plugin_mavlink.protocol.inbound import (
    NOTHING,
    CheckOf,
    Inbound,
    Listener,
    Sender,
    Wanted,
    unchecked,
)
from m2pem_plugin_mavlink.protocol.messages import Address, Message, types_by_id
from m2pem_plugin_mavlink.protocol.quality import LinkQuality
from m2pem_plugin_mavlink.protocol.url import Url
from m2pem_plugin_mavlink.signing.key_file import SigningError
from m2pem_plugin_mavlink.signing.signature import RefusedFrames, SignatureCheck, Signing

AdmitSender: TypeAlias = Callable[["Peer", Sender], bool]
"""Called with a new sender at a peer; returns False to drop its frames."""


class Peer:
    """A peer of an endpoint: a UDP address, a TCP connection, or the other end of a serial line.
    `name`: for messages; `write` sends bytes at once, or drops them; `received_s`: the time of its
    last data; `open`: it has not closed the connection; `unsent`: the writes that were dropped."""

    __slots__ = ("_sequences", "inbound", "name", "open", "received_s", "unsent", "write")

    def __init__(
        self,
        name: str,
        write: Callable[[bytes], None],
        admit: AdmitSender,
        received_s: float,
        check_of: CheckOf = unchecked,
    ) -> None:
        self.name = name
        self.write = write
        self.received_s = received_s
        self.open = True
        self.unsent = 0
        self.inbound = Inbound(partial(admit, self), check_of)
        self._sequences: dict[Address, int] = {}

    def send(self, message: Message, source: Address, signing: Signing | None = None) -> None:
        """Send a message as `source`, signed or (None) not; the frames of each source to each peer
        have their own sequence numbers.

        Raises:
            struct.error: a field's value does not fit its type.
        """
        sequence = self._sequences.get(source, 0)
        self.write(encode(message, sequence, source, None if signing is None else signing.sign))
        self._sequences[source] = (sequence + 1) & 255


_logger = logging.getLogger(__name__)

TAKEOVER_S = 5.0
FORGOTTEN_S = 60.0
MAX_COMPETITORS = 8


@dataclass(frozen=True, slots=True)
class _Claim:
    peer: Peer
    sender: Sender

    def live(self, now_s: float) -> bool:
        return self.peer.open and now_s - self.sender.received_s <= TAKEOVER_S

    def forget(self) -> None:
        self.peer.inbound.forget(self.sender)


@dataclass(slots=True)
class _ComponentOwner:
    """The sender that owns a component, and others that claim to be this component."""

    holder: _Claim
    competitors: list[_Claim] = field(default_factory=list)
    warned: bool = False


class Route:
    """`users`: the number of links that use it; `autopilots`: the components that they command,
    mostly one; `locks`: serialize the exchanges with this vehicle; `check`: of the signatures of
    its frames; None: it does not sign."""

    def __init__(self, system: int, url: Url) -> None:
        self.system = system
        self.url = url
        self.users = 0
        self.autopilots: set[int] = set()
        self.locks = KeyedLock()
        self.check: SignatureCheck | None = None
        self._wanted: dict[int, Wanted] = {}
        self._owners: dict[int, _ComponentOwner] = {}

    @property
    def signing(self) -> Signing | None:
        """How frames to the vehicle are signed; None: they are not."""
        return None if self.check is None else self.check.signing

    def require_signatures(self, check: SignatureCheck) -> None:
        """From now on, sign frames and accept only signed ones; senders must show anew who they
        are.

        Raises:
            SigningError: the frames are signed in another way.
        """
        if self.check is None:
            self.check = check
            self._owners.clear()
        elif self.check.signing is not check.signing:
            raise SigningError(
                f"system {self.system} on {self.url} has another key or link id: that of "
                f"{self.check.signing.key_file}, link {self.check.signing.link_id}"
            )

    def refused(self) -> list[RefusedFrames]:
        """Return which frames were refused, and how many."""
        check = self.check
        if check is None:
            return []
        return [
            RefusedFrames(str(self.url), refusal, count, check.last_s[refusal])
            for refusal, count in check.refused.items()
        ]

    def check_of(self, component: int) -> SignatureCheck | None:
        """Return the check of the frames of a component; None: they need no signature."""
        if self.check is None or component in self.check.unsigned_components:
            return None
        return self.check

    def holders(self) -> set[Peer]:
        """Return the peers at which components of the vehicle are reached."""
        return {owner.holder.peer for owner in self._owners.values()}

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
        """Undo one `listen`."""
        for id_ in ids:
            wanted = self._wanted[id_]
            listeners = list(wanted.listeners)
            listeners.remove(listener)
            if listeners:
                self._wanted[id_] = Wanted(wanted.type, tuple(listeners))
            else:
                del self._wanted[id_]

    def claim(self, peer: Peer, sender: Sender, now_s: float) -> bool:
        """Add a sender of this system that has sent its first frame over a peer. Return False if
        too many senders claim to be the same component."""
        claim = _Claim(peer, sender)
        owner = self._owners.get(sender.address.component)
        if owner is None:
            self._owners[sender.address.component] = _ComponentOwner(claim)
            sender.wanted = self._wanted
        elif owner.holder.peer is peer or not owner.holder.live(now_s):
            self._give(owner, claim)
        else:
            for competitor in list(owner.competitors):
                if competitor.peer is peer or not competitor.live(now_s):
                    owner.competitors.remove(competitor)
                    competitor.forget()
            if len(owner.competitors) == MAX_COMPETITORS:
                return False
            owner.competitors.append(claim)
            self._warn(owner, claim)
        return True

    def judge(self, now_s: float) -> None:
        """Reassign the component of a silent owner to another sender. Forget other silent
        components, but not autopilots: they may receive although nothing is received from them."""
        for component, owner in list(self._owners.items()):
            holder = owner.holder
            if holder.live(now_s):
                continue
            live = [competitor for competitor in owner.competitors if competitor.live(now_s)]
            if live:
                self._give(owner, max(live, key=lambda competitor: competitor.sender.received_s))
            elif (
                component not in self.autopilots and now_s - holder.sender.received_s > FORGOTTEN_S
            ):
                for claim in (holder, *owner.competitors):
                    claim.forget()
                del self._owners[component]

    def holds(self, peer: Peer) -> bool:
        """Return whether a component of the vehicle is reached at this peer."""
        return any(owner.holder.peer is peer for owner in self._owners.values())

    def peer_of(self, component: int, autopilot: int) -> Peer | None:
        """Return the peer of a component or, if there is none, of the autopilot, which forwards
        messages. None: neither is known."""
        for each in (component, autopilot):
            owner = self._owners.get(each)
            if owner is not None and owner.holder.peer.open:
                return owner.holder.peer
        return None

    def sample(self, now_s: float) -> None:
        """Sample the quality. Call it about once a second."""
        for owner in self._owners.values():
            owner.holder.sender.sample(now_s)

    def quality(self, component: int, now_s: float) -> LinkQuality | None:
        """Return the quality of the connection to a component; None if it has never sent anything,
        or its connection is closed."""
        owner = self._owners.get(component)
        if owner is None or not owner.holder.peer.open:
            return None
        return owner.holder.sender.quality(now_s)

    def _give(self, owner: _ComponentOwner, claim: _Claim) -> None:
        before = owner.holder
        # Other senders are forgotten; their next frame makes them competitors again.
        for other in (before, *owner.competitors):
            if other is not claim:
                other.sender.wanted = NOTHING
                other.forget()
        claim.sender.wanted = self._wanted
        owner.holder, owner.competitors, owner.warned = claim, [], False
        if before.peer is not claim.peer:
            _logger.info(
                "%s: component %d of system %d is silent at %s, and now at %s",
                self.url,
                claim.sender.address.component,
                self.system,
                before.peer.name,
                claim.peer.name,
            )

    def _warn(self, owner: _ComponentOwner, claim: _Claim) -> None:
        component = claim.sender.address.component
        if not owner.warned and component in self.autopilots:
            owner.warned = True
            _logger.warning(
                "%s: %s claims to be component %d of system %d, as does %s, which is used; "
                "do two vehicles have the same system id?",
                self.url,
                claim.peer.name,
                component,
                self.system,
                owner.holder.peer.name,
            )
