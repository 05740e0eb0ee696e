"""Reserves the operational volumes of a behavior, and its places in shared space, before it starts.

The reservation waits until the positions of the vehicles are known.
"""

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

from m2pem.api.allocation import SharedSpaceState, SpaceHolder, WaitingTask
from m2pem.api.arbiter import BehaviorRequest
from m2pem.api.clock import Clock
from m2pem.api.telemetry import VehicleState
from m2pem.fleet.fleet import Fleet
from m2pem.mission.catalogue import BehaviorSpec
from m2pem.units import US_PER_S

if TYPE_CHECKING:
    from m2pem.deconfliction.conflicts import Refusal
    from m2pem.deconfliction.reservations import Reservation, Reservations

SEEN_WITHIN_S = 1.5
"""How long the start of a behavior waits for vehicles that have not said where they are: for those
of the behavior, and once for all that there are."""

LOOK_EVERY_S = 0.1


class VehicleSeparation:
    """Reserves volumes and places in `reservations`, which it updates from telemetry."""

    def __init__(self, reservations: "Reservations", clock: Clock) -> None:
        self.reservations = reservations
        self._clock = clock
        self._waited_for_all = False
        self._asked_us: int | None = None

    def on_telemetry(self, state: object) -> None:
        """A vehicle published its state."""
        if isinstance(state, VehicleState):
            self.reservations.received(state)

    async def refusal(self, request: BehaviorRequest, spec: BehaviorSpec) -> str:
        """Why the behavior cannot have its space; "": it has it from now on."""
        reservations = self.reservations
        own = [each for each in request.resources if each in reservations.participants]
        if not own:
            return ""
        first, self._waited_for_all = not self._waited_for_all, True
        awaited = reservations.participants if first else own
        waited_s = 0.0
        while reservations.unseen(awaited) and waited_s < SEEN_WITHIN_S:
            await self._clock.sleep(LOOK_EVERY_S)
            waited_s += LOOK_EVERY_S
        takes_altitude = "altitude" in spec.by_name
        now_us = self._clock.now_us()
        return reservations.reserve(request, spec.type, now_us, takes_altitude=takes_altitude)

    def shared_space(self, waiting: Sequence[WaitingTask] = ()) -> list[SharedSpaceState]:
        """Return who has places in the shared spaces of the fleet. `waiting`: all tasks that wait,
        for whatever."""
        return [
            SharedSpaceState(
                space.name,
                space.capacity,
                tuple(SpaceHolder(each.vehicle, each.behavior, each.lost) for each in holders),
                tuple(each for each in waiting if space.name in each.holders),
            )
            for space, holders in self.reservations.places(self._clock.now_us())
        ]

    # --- for tasks that wait for space ------------------------------------------------------------

    def awaited(self) -> Sequence[str]:
        """Return vehicles whose positions a first choice waits for, for a while; (): it need not
        wait."""
        if self._waited_for_all:
            return ()
        unseen = self.reservations.unseen(self.reservations.participants)
        now_us = self._clock.now_us()
        if self._asked_us is None:
            self._asked_us = now_us
        if not unseen or now_us >= self._asked_us + SEEN_WITHIN_S * US_PER_S:
            self._waited_for_all = True
            return ()
        return unseen

    def propose(self, request: BehaviorRequest, spec: BehaviorSpec) -> "Reservation | None":
        """Return what a behavior that starts now would reserve; None: nothing."""
        return self.reservations.propose(request, spec.type, self._clock.now_us())

    def conflict(
        self,
        wanted: "Reservation",
        ahead: "Sequence[Reservation]",
        spec: BehaviorSpec,
        ended: Collection[str] = (),
    ) -> "Refusal | None":
        """Return why a behavior may not start now; None: it may. `ahead`: what others are to
        reserve before it. `ended`: behaviors that will have ended before it starts."""
        return self.reservations.refusal(
            wanted,
            self._clock.now_us(),
            ahead,
            takes_altitude="altitude" in spec.by_name,
            ended=ended,
        )


def separation_for(fleet: Fleet, clock: Clock) -> VehicleSeparation | None:
    """None: the fleet keeps no vehicles apart and has no shared space."""
    apart = fleet.vertical_separation_m is not None or fleet.surface_separation_m
    if not apart and not fleet.shared_space:
        return None
    # Few fleets need it.
    from m2pem.deconfliction.reservations import reservations_for  # noqa: PLC0415

    found = reservations_for(fleet)
    return None if found is None else VehicleSeparation(found, clock)
