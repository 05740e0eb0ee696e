"""Uploading a mission, a fence or rally points (mavlink.io, "Mission Protocol",
services/mission.html, "Upload a Mission to the Vehicle").

The vehicle requests the items, and requests a lost one again. If it falls silent before it has
acknowledged all of them, its stored items are not known; the upload then starts again, which stores
the same items again. It succeeds only by an acknowledgement after all items. After a failure, the
stored items must be read before they are used.
"""

from collections.abc import Sequence
from math import inf

from m2pem_plugin_mavlink.microservices.commands import command_name
from m2pem_plugin_mavlink.microservices.mission_items import (
    ACCEPTED,
    CANCELLED,
    OUT_OF_SEQUENCE,
    REQUEST_INT,
    MissionExchange,
    MissionItem,
    MissionType,
    is_of_one_item,
    item_message,
    mission_result_words,
    refusal,
)
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import ExchangeError, NoAnswerError, RetryPolicy

COUNT_RETRIES = RetryPolicy(tries=5, answer_s=1.5)
"""For the first request; mavlink.io: 1.5 s, five times."""

SILENCE_S = 5.0
"""Autopilots repeat a request after 0.25 to 1 s. After this silence, an item or the acknowledgement
was lost."""

TOO_SOON_S = 0.1
"""A request that is repeated sooner than this is a duplicate. An answer to it could be duplicated,
too, and so on."""

PASSES = 3
"""Most attempts of an upload."""

REPEATS = 20
"""Most times that one attempt sends an item."""

BASE_S = 60.0
PER_ITEM_S = 3.0
MOST_ITEMS = 0xFFFF

_COUNT = message_type("MISSION_COUNT")
_REQUEST = message_type("MISSION_REQUEST")
_ACK = message_type("MISSION_ACK")


class UploadMission(MissionExchange[None]):
    """Stores items in place of the stored ones.

    Fails with `RefusedError` (a MAV_MISSION_RESULT, and which item; `temporary` where it is busy or
    has cancelled) or `NoAnswerError`, at the latest after `bound_s`. Invalid items fail before
    anything is sent.
    """

    wants = frozenset({_REQUEST.id, REQUEST_INT.id, _ACK.id})

    def __init__(
        self,
        target: Address,
        items: Sequence[MissionItem],
        mission_type: MissionType = MissionType.MISSION,
    ) -> None:
        super().__init__(target, mission_type)
        self.items = tuple(items)
        self.bound_s = BASE_S + PER_ITEM_S * len(self.items)
        self._ends_s = 0.0
        self._passes_left = PASSES
        self._counts_sent = 0
        self._last: int | None = None
        self._sent = [0] * len(self.items)
        self._sent_s = [-inf] * len(self.items)
        self._never_sent = set(range(len(self.items)))
        self._oddity = ""

    @property
    def all_sent(self) -> bool:
        """Whether each item was sent, so that the vehicle may have stored all of them."""
        return not self._never_sent

    def begin(self, now_s: float) -> None:
        """Send the number of items, if all are valid."""
        self._ends_s = now_s + self.bound_s
        problem = self._problem()
        if problem:
            self.fail(ExchangeError(f"{self.what} not sent: {problem}"))
        else:
            self._pass(now_s)

    def receive(self, message: Message, sender: Address, now_s: float) -> None:
        """Process a request for an item, or the acknowledgement."""
        if self.done or not self.is_expected(message, sender):
            return
        if message.TYPE is _ACK:
            self._acknowledged(message.type, now_s)
        else:
            self._wanted(message.seq, now_s)

    def expire(self, now_s: float) -> None:
        """Send the number of items again; start the upload again; or fail."""
        if now_s >= self._ends_s:
            self._give_up(f"not done within {self.bound_s:g} s")
        elif self._last is None and self._counts_sent < COUNT_RETRIES.tries:
            self._send_count(now_s)
        elif self._last is None:
            self._give_up(f"no answer after {self._counts_sent} attempts")
        elif self._passes_left:
            self._pass(now_s)
        else:
            self._give_up(f"no answer after item {self._last}; the stored items are not known")

    def _pass(self, now_s: float) -> None:
        self._passes_left -= 1
        self._counts_sent, self._last = 0, None
        self._sent = [0] * len(self.items)
        self._sent_s = [-inf] * len(self.items)
        self._send_count(now_s)

    def _send_count(self, now_s: float) -> None:
        self._counts_sent += 1
        self.send(_COUNT, count=len(self.items))
        self._wait(COUNT_RETRIES.answer_s, now_s)

    def _wanted(self, sequence: int, now_s: float) -> None:
        if sequence >= len(self.items):
            self._oddity = f"the vehicle requested item {sequence} of {len(self.items)}"
            return
        if now_s - self._sent_s[sequence] < TOO_SOON_S:
            return
        self._sent[sequence] += 1
        self._sent_s[sequence] = now_s
        if self._sent[sequence] > REPEATS:
            self._give_up(f"the vehicle requested item {sequence} {REPEATS} times")
            return
        self._last = sequence
        self._never_sent.discard(sequence)
        item = self.items[sequence]
        self.outbox.append(item_message(item, sequence, self.target, self.mission_type))
        self._wait(SILENCE_S, now_s)

    def _acknowledged(self, result: int, now_s: float) -> None:
        if result == ACCEPTED:
            if not self._never_sent:  # or the acknowledgement of an earlier upload
                self.succeed(None)
        elif (
            result == OUT_OF_SEQUENCE
        ):  # an item came twice, or too late: the vehicle requests the right one
            self._oddity = "the vehicle reported an item out of sequence"
        elif result == CANCELLED and self._passes_left:
            self._oddity = "the vehicle cancelled the upload"
            self._pass(now_s)
        else:
            self._refuse(result)

    def _refuse(self, result: int) -> None:
        reason = mission_result_words(result)
        if self._last is not None and is_of_one_item(result):
            name = command_name(self.items[self._last].command)
            reason = f"item {self._last} ({name}): {reason}"
        elif self._last is not None:
            reason = f"{reason}, at item {self._last}"
        self.fail(refusal(f"{self.what} refused: {reason}", result))

    def _give_up(self, reason: str) -> None:
        """Make the vehicle stop waiting for items, and fail."""
        self.send(_ACK, type=CANCELLED)
        odd = f" ({self._oddity})" if self._oddity else ""
        self.fail(NoAnswerError(f"upload of the {self.what}: {reason}{odd}"))

    def _wait(self, seconds: float, now_s: float) -> None:
        self.deadline_s = min(now_s + seconds, self._ends_s)

    def _problem(self) -> str:
        if len(self.items) > MOST_ITEMS:
            return f"{len(self.items)} items; at most {MOST_ITEMS} are possible"
        problems = ((n, item.problem()) for n, item in enumerate(self.items))
        return next((f"item {n}: {problem}" for n, problem in problems if problem), "")
