"""Downloading a mission, a fence or rally points (mavlink.io, "Mission Protocol",
services/mission.html, "Download a Mission from the Vehicle"): one item after the other, each
requested until it is received."""

from m2pem_plugin_mavlink.microservices.mission_items import (
    ACCEPTED,
    CANCELLED,
    ITEM_FLOAT,
    ITEM_INT,
    REQUEST_INT,
    MissionExchange,
    MissionItem,
    MissionType,
    item_of,
    mission_result_words,
    refusal,
)
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import ExchangeError, NoAnswerError, RetryPolicy

COUNT_RETRIES = RetryPolicy(tries=5, answer_s=1.5)
ITEM_RETRIES = RetryPolicy(tries=8, answer_s=0.75)
"""mavlink.io has 0.25 s and five times, which is too short for most radios."""

PASSES = 3
"""Attempts, if the vehicle's mission changes or the vehicle cancels."""

BASE_S = 60.0
PER_ITEM_S = 3.0
MOST_ITEMS = 5000
"""Most items of a vehicle; autopilots store some hundreds."""

_LIST = message_type("MISSION_REQUEST_LIST")
_COUNT = message_type("MISSION_COUNT")
_ACK = message_type("MISSION_ACK")


class DownloadMission(MissionExchange[tuple[MissionItem, ...]]):
    """Downloads the stored items of a vehicle (ArduPilot: item 0 is home).

    Fails with `RefusedError` (a MAV_MISSION_RESULT), `NoAnswerError`, or `ExchangeError` for an
    impossible count; at the latest after `BASE_S` and `PER_ITEM_S` for each item.
    """

    wants = frozenset({_COUNT.id, ITEM_INT.id, ITEM_FLOAT.id, _ACK.id})

    def __init__(self, target: Address, mission_type: MissionType = MissionType.MISSION) -> None:
        super().__init__(target, mission_type)
        self._began_s = 0.0
        self._passes_left = PASSES
        self._tries = 0
        self._count: int | None = None
        self._items: dict[int, MissionItem] = {}

    def begin(self, now_s: float) -> None:
        """Request the number of items."""
        self._began_s = now_s
        self._pass(now_s)

    def receive(self, message: Message, sender: Address, now_s: float) -> None:
        """Process the count, an item, or a refusal."""
        if self.done or not self.is_expected(message, sender):
            return
        if message.TYPE is _COUNT:
            self._counted(message.count, now_s)
        elif message.TYPE is _ACK:
            self._acknowledged(message.type, now_s)
        elif self._count is not None and message.seq < self._count:
            self._items.setdefault(message.seq, item_of(message))
            if message.seq == self._next:
                self._tries = 0
                self._go_on(now_s)

    def expire(self, now_s: float) -> None:
        """Repeat the request, or fail."""
        if now_s >= self._ends_s:
            self._stop(NoAnswerError(f"{self._title}: not done in time"))
        elif self._count is None and self._tries >= COUNT_RETRIES.tries:
            asked = f"no answer after {self._tries} requests"
            self._stop(NoAnswerError(f"{self._title}: {asked}"))
        elif self._count is None:
            self._ask_count(now_s)
        elif self._tries >= ITEM_RETRIES.tries:
            asked = f"item {self._next} of {self._count} was not received"
            self._stop(NoAnswerError(f"{self._title}: {asked} after {self._tries} requests"))
        else:
            self._ask_item(now_s)

    @property
    def _title(self) -> str:
        return f"download of the {self.what}"

    @property
    def _ends_s(self) -> float:
        return self._began_s + BASE_S + PER_ITEM_S * (self._count or 0)

    def _pass(self, now_s: float) -> None:
        self._passes_left -= 1
        self._count, self._tries = None, 0
        self._items.clear()
        self._next = 0
        self._ask_count(now_s)

    def _counted(self, count: int, now_s: float) -> None:
        if count == self._count:
            return
        if count > MOST_ITEMS:
            self._stop(ExchangeError(f"{self._title}: {count} items are impossible"))
        elif self._count is not None and not self._passes_left:
            changed = f"{self._count} items, then {count}"
            self._stop(
                ExchangeError(f"{self._title}: the mission changes during the download: {changed}")
            )
        else:
            if self._count is not None:  # the first count may be from an earlier exchange
                self._passes_left -= 1
            self._count, self._tries, self._next = count, 0, 0
            self._items.clear()
            self._go_on(now_s)

    def _acknowledged(self, result: int, now_s: float) -> None:
        if result == ACCEPTED:  # from an earlier upload
            return
        if result == CANCELLED and self._passes_left:
            self._pass(now_s)
            return
        at = "" if self._count is None else f", at item {self._next} of {self._count}"
        reason = f"{self._title}: {mission_result_words(result)}{at}"
        self.fail(refusal(reason, result))

    def _go_on(self, now_s: float) -> None:
        while self._next in self._items:
            self._next += 1
        if self._next != self._count:
            self._ask_item(now_s)
            return
        self._end(ACCEPTED)
        self.succeed(tuple(self._items[sequence] for sequence in range(self._next)))

    def _ask_count(self, now_s: float) -> None:
        self._tries += 1
        self.send(_LIST)
        self.deadline_s = min(now_s + COUNT_RETRIES.answer_s, self._ends_s)

    def _ask_item(self, now_s: float) -> None:
        self._tries += 1
        self.send(REQUEST_INT, seq=self._next)
        self.deadline_s = min(now_s + ITEM_RETRIES.answer_s, self._ends_s)

    def _stop(self, error: ExchangeError) -> None:
        self._end(CANCELLED)
        self.fail(error)

    def _end(self, result: int) -> None:
        """Send an acknowledgement, so that the vehicle stops waiting for requests."""
        self.send(_ACK, type=result)
