"""What becomes of commands and behaviors while a vehicle is out of reach."""

from collections.abc import Callable

from m2pem.mission.catalogue import ResourceId
from m2pem.simulation.agenda import Agenda
from m2pem.simulation.conductor import Conductor
from m2pem.simulation.executions import Execution
from m2pem.simulation.links import Links
from m2pem.simulation.memory import Memory
from m2pem.simulation.track import US_PER_S


class Reach:
    """Commands wait for a broken link; when it is broken for `lost_after_s`, all is lost."""

    def __init__(
        self,
        links: Links,
        agenda: Agenda,
        memory: Memory,
        conductor: Conductor,
        lost_after_s: Callable[[ResourceId], float],
    ) -> None:
        self._links = links
        self._agenda = agenda
        self._memory = memory
        self._conductor = conductor
        self._lost_after_s = lost_after_s

    def command(
        self, execution: Execution, name: str, act: Callable[[int], None], now_us: int
    ) -> None:
        """Do something with a behavior, now or when its vehicles are heard again."""
        vehicle = self._links.broken_of(execution)
        if vehicle is None:
            act(now_us)
        elif self._links.lost(vehicle):
            self._conductor.abandon(execution, f"{vehicle} is not heard", now_us)
        else:
            # Another of its links may be broken still when this one is mended.
            self._links.defer(
                vehicle,
                f"{name} {execution.id}",
                lambda at_us: self.command(execution, name, act, at_us),
            )

    def lose(self, vehicle: ResourceId, now_us: int) -> None:
        """Cut the link to a vehicle; harmless when it is cut already."""
        if not self._links.up(vehicle):
            return
        self._links.cut(vehicle)
        cuts = self._links.cuts(vehicle)
        after_us = round(self._lost_after_s(vehicle) * US_PER_S)
        self._agenda.at(now_us + after_us, lambda at_us: self._give_up(vehicle, cuts, at_us))

    def _give_up(self, vehicle: ResourceId, cuts: int, now_us: int) -> None:
        if self._links.up(vehicle) or self._links.cuts(vehicle) != cuts:
            return  # it was mended in time
        self._links.give_up(vehicle)
        reason = f"{vehicle} was not heard for {self._lost_after_s(vehicle):g} s"
        for execution in list(self._memory.executions.values()):
            if vehicle in execution.carriers and not execution.reported_end:
                self._conductor.abandon(execution, reason, now_us)
