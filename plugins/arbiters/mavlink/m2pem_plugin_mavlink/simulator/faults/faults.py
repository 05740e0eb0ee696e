"""The faults of one vehicle: to be switched on and off while it runs.

sim[1].faults.set_link(drop=every(7))
sim[1].faults.cut_link(seconds=30)
sim[1].faults.after_arming(40, lambda faults: faults.lose_gps(10))
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from enum import StrEnum
from random import Random
from typing import Any

from m2pem.api.faults import FaultSchedule
from m2pem_plugin_mavlink.simulator.faults.link import NO_FAULTS, FaultyWire
from m2pem_plugin_mavlink.simulator.interfaces import CommandRefusal
from m2pem_plugin_mavlink.simulator.messages import Result
from m2pem_plugin_mavlink.simulator.missions.plan import MISSION, Item
from m2pem_plugin_mavlink.simulator.server import VehiclePort

Action = Callable[["Faults"], object]

LOW = 0.069
"""So full is a low battery: below ArduPilot's threshold, and critical for PX4."""


class Direction(StrEnum):
    """Which frames: those that the vehicle sends, those that it gets."""

    SENT = "sent"
    RECEIVED = "received"
    BOTH = "both"


class Faults:
    """All that can go wrong with a vehicle. Times are in seconds of simulated time."""

    def __init__(self, port: VehiclePort, seed: int = 0) -> None:
        system = port.autopilot.spec.system
        self.autopilot = port.autopilot
        self._sent = FaultyWire(port.outward.deliver, Random(f"{seed}/{system}/sent"))
        self._received = FaultyWire(port.inward.deliver, Random(f"{seed}/{system}/received"))
        port.outward, port.inward = self._sent, self._received
        self._schedule = FaultSchedule()
        self._after_arming: list[tuple[float, Action]] = []
        self._armed_s: float | None = None

    # --- the link ---------------------------------------------------------------------------------

    def _wires(self, direction: Direction) -> Sequence[FaultyWire]:
        wires = {Direction.SENT: (self._sent,), Direction.RECEIVED: (self._received,)}
        return wires.get(direction, (self._sent, self._received))

    def set_link(self, direction: Direction = Direction.BOTH, **faults: Any) -> None:
        """Make the link bad: any of the fields of `LinkFaults`; the others stay as they are."""
        for wire in self._wires(direction):
            wire.faults = replace(wire.faults, **faults)

    def repair_link(self, direction: Direction = Direction.BOTH) -> None:
        """Make it good again."""
        for wire in self._wires(direction):
            wire.faults = NO_FAULTS
            wire.cut_until_s = -math.inf

    def cut_link(self, seconds: float | None = None, direction: Direction = Direction.BOTH) -> None:
        """Nothing comes through, for a while or (None) until it is repaired."""
        until_s = math.inf if seconds is None else self.autopilot.now_s + seconds
        for wire in self._wires(direction):
            wire.cut_until_s = until_s

    def restore_link(self, direction: Direction = Direction.BOTH) -> None:
        """The cut has an end; the link is as bad as it was before."""
        for wire in self._wires(direction):
            wire.cut_until_s = -math.inf

    @property
    def lost_frames(self) -> int:
        """How many frames, or datagrams of a link that was cut, did not come through."""
        return self._sent.lost + self._received.lost

    # --- the vehicle ------------------------------------------------------------------------------

    def lose_gps(self, seconds: float | None = None) -> None:
        """No satellites, for a while or for good."""
        self.autopilot.injected_faults.gps_lost = True
        if seconds is not None:
            self.after(seconds, Faults.find_gps)

    def find_gps(self) -> None:
        """There are satellites again."""
        self.autopilot.injected_faults.gps_lost = False

    def set_battery(self, left: float = LOW) -> None:
        """From now on it drains from there; 1 is full."""
        self.autopilot.battery.left = min(1.0, max(0.0, left))

    def refuse_arming(self, text: str = "Motors: Check frame class and type") -> None:
        """It is not armed, and says that."""
        self.autopilot.injected_faults.arming = text

    def allow_arming(self) -> None:
        """It is armed as ever."""
        self.autopilot.injected_faults.arming = None

    def refuse_command(
        self,
        command: int,
        result: Result | None = Result.FAILED,
        text: str = "",
        times: int | None = None,
    ) -> None:
        """A command (MAV_CMD) is not obeyed, but answered so (None: not answered at all)."""
        self.autopilot.injected_faults.commands[command] = CommandRefusal(result, text, times)

    def allow_command(self, command: int) -> None:
        """It is obeyed as ever."""
        self.autopilot.injected_faults.commands.pop(command, None)

    # --- another ground station -------------------------------------------------------------------

    @property
    def modes(self) -> Mapping[str, int]:
        """The vehicle's modes by their names."""
        return {each.name: each.number for each in self.autopilot.modes.by_number.values()}

    def take_over(self, mode: str) -> None:
        """Another ground station, or a pilot, changes the mode.

        Raises:
            ValueError: the vehicle has no such mode.
        """
        if mode not in self.modes:
            raise ValueError(f"there is no mode {mode!r}; there are: {', '.join(self.modes)}")
        self.autopilot.modes.switch(self.modes[mode])

    def replace_mission(self, items: Sequence[Item]) -> None:
        """Another ground station uploads another mission."""
        self.autopilot.plans[MISSION] = tuple(items)

    # --- time -------------------------------------------------------------------------------------

    def after(self, seconds: float, action: Action) -> None:
        """Do something later."""
        self._schedule.at(self.autopilot.now_s + seconds, lambda: action(self))

    def after_arming(self, seconds: float, action: Action) -> None:
        """Do something so long after the vehicle was armed for the first time."""
        if self._armed_s is None:
            self._after_arming.append((seconds, action))
        else:
            self._schedule.at(self._armed_s + seconds, lambda: action(self))

    def step(self) -> None:
        """Do what is due."""
        autopilot = self.autopilot
        if self._armed_s is None and autopilot.log.counts["armed"]:
            events = autopilot.log.events
            first_s = next((each.at_s for each in events if each.kind == "armed"), autopilot.now_s)
            self._armed_s = first_s
            for seconds, action in self._after_arming:
                self.after_arming(seconds, action)
            self._after_arming.clear()
        self._schedule.run_until(autopilot.now_s)
