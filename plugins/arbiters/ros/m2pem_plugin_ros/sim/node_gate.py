"""What stands between an m2pem node and its topics: it can make a bad node of a good one."""

import itertools
from collections import deque
from typing import Any

from m2pem_interfaces.msg import BehaviorCommand, BehaviorStatus

from m2pem_plugin_ros.sim.clock import Pace
from m2pem_plugin_ros.sim.guard import Gate
from m2pem_plugin_ros.sim.troubles import Troubles

STATUS, COMMAND = "behavior_status", "command"
TERMINAL = range(BehaviorStatus.SUCCEEDED, BehaviorStatus.LOST + 1)
LIES = (
    BehaviorStatus.ACCEPTED,
    BehaviorStatus.RUNNING,
    BehaviorStatus.SUCCEEDED,
    BehaviorStatus.FAILED,
    BehaviorStatus.CANCELLED,
)
LIE_HZ = 2.0
MOST_AT_ONCE = 500
"""Of a flood: what is more than that is not made up for when the computer is slow."""


class NodeGate(Gate):
    """Lies, floods and does not hear, as the troubles say."""

    def __init__(self, troubles: Troubles) -> None:
        super().__init__(troubles)
        self._publisher: Any = None
        self._said: deque[Any] = deque(maxlen=10)
        self._numbers = itertools.count(1)
        self._pace = Pace(LIE_HZ)
        self._owed = 0.0

    def send(self, publisher: Any, leaf: str, message: Any) -> None:
        """Publish a message, and after a terminal status, while it lies, another one."""
        super().send(publisher, leaf, message)
        if leaf != STATUS:
            return
        self._said.append(message)
        if self.troubles.lies and message.state in TERMINAL:
            super().send(publisher, leaf, _contradiction(message))

    def hears(self, leaf: str, message: Any) -> bool:
        """Whether a message reaches the node."""
        if self.troubles.deaf and leaf == COMMAND and message.verb == BehaviorCommand.START:
            return False
        return super().hears(leaf, message)

    def made(self, publisher: Any, leaf: str) -> None:
        """With this it can lie before the node has said anything."""
        if leaf == STATUS:
            self._publisher = publisher

    def step(self, now_s: float, wall_dt_s: float) -> None:
        """Say what is due by now."""
        if self._publisher is None:
            return
        if self.troubles.lies and self._pace.is_due(now_s):
            self._say(self._invention(next(self._numbers)))
        if self.troubles.flood_per_s <= 0:
            self._owed = 0.0
            return
        self._owed = min(self._owed + self.troubles.flood_per_s * wall_dt_s, MOST_AT_ONCE)
        while self._owed >= 1:
            self._owed -= 1
            number = next(self._numbers)
            said = self._said[number % len(self._said)] if self._said and number % 2 else None
            self._say(said or self._invention(number))

    def _say(self, message: Any) -> None:
        super().send(self._publisher, STATUS, message)

    def _invention(self, number: int) -> Any:
        """A status of a behavior that nobody gave it."""
        return BehaviorStatus(
            id=f"never-given-{number}",
            number=1 + number % 7,
            state=LIES[number % len(LIES)],
            reason="a simulated lie",
        )


def _contradiction(message: Any) -> Any:
    """The same behavior has ended once more, and otherwise."""
    succeeded = message.state == BehaviorStatus.SUCCEEDED
    return BehaviorStatus(
        stamp=message.stamp,
        id=message.id,
        number=message.number + 1,
        state=BehaviorStatus.FAILED if succeeded else BehaviorStatus.SUCCEEDED,
        code="FAILED" if succeeded else "",
        reason="a simulated lie",
    )
