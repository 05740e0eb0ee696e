"""A part of an autopilot: what it answers, what it reports, what it does as time passes.

Everything that an `Autopilot` can do is in a part; adding a part is how the simulation grows
(a gimbal, a fence). A part names the commands and messages that it takes, and the messages that
may be streamed or asked for.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from m2pem_plugin_mavlink.sim.command import Command, Result
from m2pem_plugin_mavlink.sim.geometry import Point
from m2pem_plugin_mavlink.sim.peers import Heard

if TYPE_CHECKING:
    from m2pem_plugin_mavlink.sim.autopilot import Autopilot

CommandHandler = Callable[[Command], Result]
"""Does it; the result is sent as the acknowledgement."""
MessageHandler = Callable[[Any, Heard], None]
ReportMaker = Callable[[], Any]
"""Makes the message as of now; None: there is nothing to tell."""


class Part:
    """By itself it does nothing. `component`: to whom its messages and commands are sent."""

    component = 1

    def __init__(self, autopilot: "Autopilot") -> None:
        self.autopilot = autopilot

    def commands(self) -> Mapping[int, CommandHandler]:
        """What it does when it is told to, by MAV_CMD."""
        return {}

    def messages(self) -> Mapping[str, MessageHandler]:
        """Other messages that it takes, by their names."""
        return {}

    def reports(self) -> Mapping[int, ReportMaker]:
        """Messages that it can make at any time, by their ids."""
        return {}

    def step(self, dt_s: float) -> None:
        """Let `dt_s` of simulated time pass."""

    @property
    def failsafe(self) -> bool:
        """It does something against what has gone wrong (MAV_STATE_CRITICAL)."""
        return False

    def refusals(self) -> Iterable[str]:
        """Why the vehicle must not be armed, as ArduPilot words it."""
        return ()

    def forbids(self, point: Point) -> bool:
        """Whether the vehicle must not go to a point (a fence)."""
        return False
