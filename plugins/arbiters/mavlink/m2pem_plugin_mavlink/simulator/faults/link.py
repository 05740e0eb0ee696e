"""The frames in a datagram, and which message each has, without decoding them."""

import heapq
import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from random import Random

from m2pem_plugin_mavlink.simulator.server import Address, Deliver, Wire

V1, V2 = 0xFE, 0xFD
SIGNED = 0x01
"""In the incompatibility flags of MAVLink 2: a signature of 13 bytes follows."""


def frames_in(datagram: bytes) -> Iterator[bytes]:
    """One by one; what is no frame stays together."""
    start = 0
    while start < len(datagram):
        end = start + _length(datagram, start)
        yield datagram[start:end]
        start = end


def _length(datagram: bytes, start: int) -> int:
    rest = len(datagram) - start
    if datagram[start] == V2 and rest >= 12:
        signature = 13 if datagram[start + 2] & SIGNED else 0
        return min(rest, datagram[start + 1] + 12 + signature)
    if datagram[start] == V1 and rest >= 8:
        return min(rest, datagram[start + 1] + 8)
    return rest


def message_id(frame: bytes) -> int | None:
    """The id of its message; None: it is no frame."""
    if len(frame) >= 12 and frame[0] == V2:
        return int.from_bytes(frame[7:10], "little")
    if len(frame) >= 8 and frame[0] == V1:
        return frame[5]
    return None


SWAPPED_WITHIN_S = 0.5
"""A frame that is to be overtaken is delivered after that, if no other comes."""


@dataclass(frozen=True, slots=True)
class Rate:
    """How often: each frame with a chance of `share`; of `every` frames the one with number
    `first`."""

    share: float = 0.0
    every: int = 0
    first: int = 0

    def hits(self, number: int, chance: float) -> bool:
        """Whether the frame with that number, for which that chance was drawn, is concerned."""
        return chance < self.share or (self.every > 0 and number % self.every == self.first)


NEVER = Rate()


def every(frames: int, first: int = 0) -> Rate:
    """One of so many frames.

    Raises:
        ValueError: there is no such frame.
    """
    if frames < 1:
        raise ValueError(f"one of every how many frames? Of 1 or more, not of {frames}")
    if not 0 <= first < frames:
        raise ValueError(f"of {frames} frames there is none with number {first}")
    return Rate(every=frames, first=first)


def share(component: float) -> Rate:
    """A part of the frames, from 0 to 1, at random.

    Raises:
        ValueError: it is not from 0 to 1.
    """
    if not 0 <= component <= 1:
        raise ValueError(f"a share is from 0 to 1, not {component}")
    return Rate(component)


@dataclass(frozen=True, slots=True)
class LinkFaults:
    """What a link does to frames, in seconds of simulated time. `only`: ids of the messages that
    are concerned; None: all."""

    drop: Rate = NEVER
    duplicate: Rate = NEVER
    reorder: Rate = NEVER
    corrupt: Rate = NEVER
    delay_s: float = 0.0
    jitter_s: float = 0.0
    only: Collection[int] | None = None


NO_FAULTS = LinkFaults()


class FaultyWire(Wire):
    """One direction of a link. `faults` may be replaced at any time; `lost` counts frames."""

    def __init__(self, deliver: Deliver, random: Random) -> None:
        super().__init__(deliver)
        self.faults = NO_FAULTS
        self.cut_until_s = -math.inf
        self.lost = 0
        self._random = random
        self._number = 0
        self._order = 0
        self._waiting: list[tuple[float, int, bytes, Address]] = []
        self._overtaken: tuple[float, bytes, Address] | None = None

    def carry(self, data: bytes, peer: Address, now_s: float) -> None:
        """Take a datagram to its end, or what is left of it."""
        untouched = self.faults == NO_FAULTS and not self._waiting and self._overtaken is None
        if now_s < self.cut_until_s:
            self.lost += 1
        elif untouched:
            self.deliver(data, peer)
        else:
            for frame in frames_in(data):
                self._carry(frame, peer, now_s)

    def _carry(self, frame: bytes, peer: Address, now_s: float) -> None:
        faults, number = self.faults, self._number
        if faults.only is not None and message_id(frame) not in faults.only:
            self._send(frame, peer, now_s, 0.0)
            return
        self._number += 1
        # All chances are drawn for each frame, so that one fault does not change the others.
        chances = [self._random.random() for _ in range(5)]
        if faults.drop.hits(number, chances[0]):
            self.lost += 1
            return
        if faults.corrupt.hits(number, chances[1]):
            frame = self._spoiled(frame)
        if faults.reorder.hits(number, chances[2]) and self._overtaken is None:
            self._overtaken = (now_s + SWAPPED_WITHIN_S, frame, peer)
            return
        delay_s = faults.delay_s + faults.jitter_s * chances[3]
        self._send(frame, peer, now_s, delay_s)
        if faults.duplicate.hits(number, chances[4]):
            self._send(frame, peer, now_s, delay_s)
        self._release(now_s)

    def _release(self, now_s: float) -> None:
        if self._overtaken is not None:
            _, frame, peer = self._overtaken
            self._overtaken = None
            self._send(frame, peer, now_s, self.faults.delay_s)

    def _send(self, frame: bytes, peer: Address, now_s: float, delay_s: float) -> None:
        if delay_s <= 0:
            self.deliver(frame, peer)
        else:
            self._order += 1
            heapq.heappush(self._waiting, (now_s + delay_s, self._order, frame, peer))

    def _spoiled(self, frame: bytes) -> bytes:
        """One bit is wrong."""
        place = self._random.randrange(len(frame))
        bit = 1 << self._random.randrange(8)
        return frame[:place] + bytes([frame[place] ^ bit]) + frame[place + 1 :]

    def step(self, now_s: float) -> None:
        """Deliver what is due; what is due while the link is cut is lost."""
        if self._overtaken is not None and now_s >= self._overtaken[0]:
            self._release(now_s)
        while self._waiting and self._waiting[0][0] <= now_s:
            _, _, frame, peer = heapq.heappop(self._waiting)
            if now_s < self.cut_until_s:
                self.lost += 1
            else:
                self.deliver(frame, peer)
