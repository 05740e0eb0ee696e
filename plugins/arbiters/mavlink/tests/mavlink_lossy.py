"""A link in virtual time that loses, doubles, delays and reorders what it is told to.

`run` plays one exchange against a scripted vehicle; `fault_table` has the faults that every
exchange must bear: it succeeds or fails within its bound, and does nothing twice.
"""

import heapq
import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import count
from typing import Any, NamedTuple, Protocol, TypeVar

from m2pem_plugin_mavlink.protocol.messages import Address, Message
from m2pem_plugin_mavlink.protocol.transaction import ExchangeError, Transaction

T = TypeVar("T")

GROUND = Address(255, 190)
VEHICLE = Address(7, 1)
LATENCY_S = 0.02
TO_VEHICLE, TO_GROUND = 0, 1
DIRECTIONS = (TO_VEHICLE, TO_GROUND)
AFTERWARDS_S = 30.0
"""So long a vehicle and the link go on when the exchange is over."""

Fault = Callable[[int, int], Sequence[float]]
"""Of a direction and the number of a frame in it, from 0: how much later each copy of it arrives;
none: it is lost."""


class Peer(Protocol):
    """A scripted vehicle: what it answers, and says by itself at `next_s`."""

    next_s: float | None

    def hear(self, message: Message, now_s: float) -> Sequence[Message]: ...

    def wake(self, now_s: float) -> Sequence[Message]: ...


class Named(NamedTuple):
    name: str
    fault: Fault
    must_succeed: bool = False
    must_fail: bool = False


@dataclass
class Played:
    """What became of an exchange. `ended_s`: after so many seconds; `sent`: what it sent."""

    result: Any = None
    error: ExchangeError | None = None
    ended_s: float = 0.0
    sent: list[Any] = field(default_factory=list)


def no_fault(direction: int, number: int) -> Sequence[float]:
    return (0.0,)


def over_the_wire(message: Message) -> Any:
    """The message as it arrives: floats have lost digits, and arrays are tuples."""
    return message.TYPE.unpack(message.TYPE.pack(message))


def run(
    transaction: Transaction[Any],
    peer: Peer,
    fault: Fault = no_fault,
    *,
    sender: Address = VEHICLE,
    source: Address | None = GROUND,
    longest_s: float = 10_000.0,
) -> Played:
    """Play an exchange to its end, and the link until nothing is on its way any more."""
    order, numbers = count(), {TO_VEHICLE: count(), TO_GROUND: count()}
    coming: list[tuple[float, int, int, Any]] = []
    played = Played()
    now_s, ended_s = 0.0, None

    def send(direction: int, message: Message) -> None:
        for later_s in fault(direction, next(numbers[direction])):
            at_s = now_s + LATENCY_S + later_s
            heapq.heappush(coming, (at_s, next(order), direction, over_the_wire(message)))

    def flush() -> None:
        nonlocal ended_s
        outbox, transaction.outbox = transaction.outbox, []
        assert ended_s is None or not outbox, "it sends though it is over"
        played.sent += outbox
        for message in outbox:
            send(TO_VEHICLE, message)
        if transaction.done and ended_s is None:
            ended_s = now_s
            assert transaction.deadline_s is None
        assert transaction.done or transaction.deadline_s is not None, "it waits for nothing"

    transaction.source = source
    transaction.begin(now_s)
    flush()
    while True:
        times = [
            coming[0][0] if coming else None,
            transaction.deadline_s,
            peer.next_s,
        ]
        known = [each for each in times if each is not None]
        if not known or (ended_s is not None and min(known) > ended_s + AFTERWARDS_S):
            break
        now_s = max(now_s, min(known))
        assert now_s < longest_s, "it hangs"
        if coming and coming[0][0] <= now_s:
            _, _, direction, message = heapq.heappop(coming)
            if direction == TO_VEHICLE:
                for answer in peer.hear(message, now_s):
                    send(TO_GROUND, answer)
            elif message.TYPE.id in transaction.wants:
                transaction.receive(message, sender, now_s)
                flush()
        elif peer.next_s is not None and peer.next_s <= now_s:
            for answer in peer.wake(now_s):
                send(TO_GROUND, answer)
        else:
            transaction.expire(now_s)
            flush()
    assert ended_s is not None
    played.ended_s = ended_s
    try:
        played.result = transaction.outcome()
    except ExchangeError as error:
        played.error = error
    return played


def fault_table(frames: int = 24) -> Iterator[Named]:
    """Every n-th frame lost (n = 1..20), beginning at each position, in each direction and both;
    one of the first `frames` frames lost, doubled, late by 2 s or overtaken, and all of them."""
    for n in range(1, 21):
        for first in range(n):
            for where in (*DIRECTIONS, None):
                name = f"every {n}. lost from {first}, direction {where}"
                yield Named(name, _every(n, first, where, ()), must_fail=n == 1)
    for what, copies in (
        ("lost", ()),
        ("doubled", (0.0, 0.0)),
        ("doubled late", (0.0, 1.3)),
        ("2 s late", (2.0,)),
        ("overtaken", (0.05,)),
    ):
        for where in DIRECTIONS:
            for position in range(frames):
                name = f"frame {position} {what}, direction {where}"
                yield Named(name, _one(position, where, copies), must_succeed=True)
            if copies:
                every = _every(1, 0, where, copies)
                yield Named(f"all {what}, direction {where}", every, must_succeed=True)
        if copies:
            yield Named(f"all {what}", _every(1, 0, None, copies))
    for seed in range(40):
        yield Named(f"chaos {seed}", _chaos(seed))


def play_table(
    make: Callable[[], tuple[Transaction[Any], Peer]],
    check: Callable[[Played, Any], None],
    bound_s: Callable[[Any], float],
    *,
    frames: int = 24,
    recovers: bool = True,
) -> None:
    """Play the whole table; `check` is given each outcome and the vehicle after it. `recovers`: a
    single fault is made good."""
    succeeded = 0
    for name, fault, must_succeed, must_fail in fault_table(frames):
        transaction, peer = make()
        try:
            played = run(transaction, peer, fault)
            assert played.ended_s <= bound_s(transaction) + 1e-6, "too late"
            assert not (must_succeed and recovers and played.error), played.error
            assert not (must_fail and played.error is None)
            check(played, peer)
        except AssertionError as error:
            raise AssertionError(f"{name}: {error}") from error
        succeeded += played.error is None
    assert succeeded > 300


def _one(position: int, where: int, copies: Sequence[float]) -> Fault:
    return lambda direction, number: copies if (direction, number) == (where, position) else (0.0,)


def _every(n: int, first: int, where: int | None, copies: Sequence[float]) -> Fault:
    def fault(direction: int, number: int) -> Sequence[float]:
        hit = number >= first and (number - first) % n == 0
        return copies if hit and where in (None, direction) else (0.0,)

    return fault


def _chaos(seed: int) -> Fault:
    dice = random.Random(seed)

    def fault(direction: int, number: int) -> Sequence[float]:
        copies = dice.choice((0, 1, 1, 1, 1, 1, 1, 2))
        return [dice.choice((0.0, 0.0, 0.01, 0.05, 0.4, 2.0)) for _ in range(copies)]

    return fault


class Silent:
    """A vehicle that says nothing."""

    next_s: float | None = None

    def hear(self, message: Message, now_s: float) -> Sequence[Message]:
        return ()

    def wake(self, now_s: float) -> Sequence[Message]:
        return ()


class Answers(Silent):
    """A vehicle that gives prepared answers, one list for each message that it hears."""

    def __init__(self, *answers: Sequence[Message]) -> None:
        self.answers = list(answers)
        self.received: list[Any] = []

    def hear(self, message: Message, now_s: float) -> Sequence[Message]:
        self.received.append(message)
        return self.answers.pop(0) if self.answers else ()
