"""Reserves the operational volume of an aircraft before its behavior starts.

The reservation waits until the positions of the aircraft are known.
"""

from typing import TYPE_CHECKING

from m2pem.api.arbiter import BehaviorRequest
from m2pem.api.clock import Clock
from m2pem.api.telemetry import VehicleState
from m2pem.fleet.fleet import Fleet
from m2pem.mission.catalogue import BehaviorSpec

if TYPE_CHECKING:
    from m2pem.deconfliction.reservations import Airspace

SEEN_WITHIN_S = 1.5
"""How long the start of a behavior waits for aircraft that have not said where they are: for those
of the behavior, and once for all that there are."""

LOOK_EVERY_S = 0.1


class AircraftSeparation:
    """Reserves volumes in `airspace`, which it updates from telemetry."""

    def __init__(self, airspace: "Airspace", clock: Clock) -> None:
        self.airspace = airspace
        self._clock = clock
        self._waited_for_all = False

    def on_telemetry(self, state: object) -> None:
        """A vehicle published its state."""
        if isinstance(state, VehicleState):
            self.airspace.received(state)

    async def refusal(self, request: BehaviorRequest, spec: BehaviorSpec) -> str:
        """Why the behavior cannot have its room; "": it has it from now on."""
        airspace = self.airspace
        own = [each for each in request.resources if each in airspace.aircraft]
        if not own:
            return ""
        first, self._waited_for_all = not self._waited_for_all, True
        awaited = airspace.aircraft if first else own
        waited_s = 0.0
        while airspace.unseen(awaited) and waited_s < SEEN_WITHIN_S:
            await self._clock.sleep(LOOK_EVERY_S)
            waited_s += LOOK_EVERY_S
        takes_altitude = "altitude" in spec.by_name
        now_us = self._clock.now_us()
        return airspace.reserve(request, spec.type, now_us, takes_altitude=takes_altitude)


def separation_for(fleet: Fleet, clock: Clock) -> AircraftSeparation | None:
    """None: the fleet does not say how far its aircraft are to be apart."""
    if fleet.vertical_separation_m is None:
        return None
    from m2pem.deconfliction.reservations import airspace_of  # noqa: PLC0415  # few fleets need it

    airspace = airspace_of(fleet)
    return None if airspace is None else AircraftSeparation(airspace, clock)
