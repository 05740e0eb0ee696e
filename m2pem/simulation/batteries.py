"""Watches batteries: somebody is told at every step that one loses."""

import math
from collections.abc import Callable

from m2pem.mission.catalogue import ResourceId
from m2pem.simulation.agenda import Agenda, Entry
from m2pem.simulation.vehicles import SimVehicle

STEP = 0.05
"""Of a full battery."""


class Batteries:
    """`drained` is called when a battery has lost a step, and when it is empty."""

    def __init__(self, agenda: Agenda, drained: Callable[[SimVehicle, int], None]) -> None:
        self._agenda = agenda
        self._drained = drained
        self._entries: dict[ResourceId, Entry] = {}

    def look(self, vehicle: SimVehicle, now_us: int) -> None:
        """The vehicle's motion has changed: work out when its next step is lost."""
        entry = self._entries.pop(vehicle.id, None)
        if entry is not None:
            entry.cancel()
        left = vehicle.battery_at(now_us)
        if left <= 0:
            return
        level = max(0.0, (math.ceil(left / STEP - 1e-9) - 1) * STEP)
        due = vehicle.drained_us(level, now_us)
        if due is not None:
            self._entries[vehicle.id] = self._agenda.at(
                due, lambda at_us: self._drained(vehicle, at_us), background=True
            )
