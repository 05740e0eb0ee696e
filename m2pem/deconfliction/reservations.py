"""Reservations of operational volumes: made before a behavior starts, released when it has ended.

Pure: states of vehicles and the time are arguments.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace

from m2pem.api.arbiter import BehaviorId, BehaviorRequest
from m2pem.api.telemetry import LinkState, VehicleState
from m2pem.deconfliction.aircraft import Aircraft, FlightParameters, Span, aircraft_of, flies
from m2pem.deconfliction.behavior_volumes import volume_of
from m2pem.deconfliction.conflicts import Conflict, Occupant, refusal
from m2pem.deconfliction.operational_volume import Piece, Separation, Volume, too_near
from m2pem.deconfliction.team_volumes import member_volume
from m2pem.fleet.fleet import Domain, Fleet
from m2pem.geo.local_frame import EastNorth, LocalFrame
from m2pem.geo.polygon import hull_distance_m
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import ResourceId
from m2pem.units import US_PER_S

STOPS = frozenset({"hold", "drive_stop"})
"""Never refused: it is no safer not to stop."""

BY_HAND = frozenset({"teleop"})
"""Flown by a person, who sees to it: it counts where it is seen."""

DISCERNIBLE_M = 1.0
"""Nearer than this, the direction in which two vehicles may part is not known."""


@dataclass(slots=True)
class _Reservation:
    """The volumes of a behavior in execution.

    `volumes`: of its aircraft; None: not computed yet. `late`: aircraft that are not where their
    volume says, if it says when. `over`: the behavior has ended, but nothing was received from one
    of its vehicles since.
    """

    request: BehaviorRequest
    kind: BehaviorType
    volumes: Mapping[ResourceId, Volume] | None = None
    late: set[ResourceId] = field(default_factory=set)
    over: bool = False


class Airspace:
    """The reservations of all aircraft of a fleet with a separation."""

    def __init__(self, fleet: Fleet, policy: Separation) -> None:
        self.aircraft = tuple(v.id for v in fleet.vehicles.values() if v.domain is Domain.AIR)
        self._policy = policy
        self._frame: LocalFrame | None = None
        self._states: dict[ResourceId, VehicleState] = {}
        self._nominal_m: dict[ResourceId, float] = {}
        self._homes: dict[ResourceId, list[EastNorth]] = {}
        self._lost: set[ResourceId] = set()
        self._reservations: dict[BehaviorId, _Reservation] = {}

    # --- what is seen ---------------------------------------------------------------------------

    def received(self, state: VehicleState) -> None:
        """Take the state of a vehicle of any domain."""
        if state.position is None:
            return
        if self._frame is None:
            self._frame = LocalFrame(state.position.latlon)
        self._states[state.resource] = state
        if state.resource not in self.aircraft:
            return
        if not flies(state):
            self._note_home(state.resource, state)
        if state.link is not LinkState.LOST and state.resource in self._lost:
            self._lost.discard(state.resource)
            self._forget()

    def lost(self, vehicle: ResourceId) -> None:
        """The link to a vehicle is lost: it keeps its volume until something is received again."""
        self._lost.add(vehicle)

    def unseen(self, vehicles: Iterable[ResourceId]) -> list[ResourceId]:
        """Return those aircraft whose position was never received."""
        return [each for each in vehicles if each in self.aircraft and each not in self._states]

    # --- what is done ---------------------------------------------------------------------------

    def reserve(
        self,
        request: BehaviorRequest,
        kind: BehaviorType,
        now_us: int,
        *,
        takes_altitude: bool = False,
    ) -> str:
        """Reserve the volume of a behavior that starts now.

        Return "", or why it is refused and what would be right. `takes_altitude`: the behavior
        has a parameter for that.
        """
        flown = [each for each in request.resources if each in self.aircraft]
        if not flown or request.behavior in BY_HAND:
            return ""
        if unseen := self.unseen(flown):
            names = " and ".join(unseen)
            return f"the position of {names} is not known, nor so whether others are in its way"
        volumes = self._volumes(request, kind, now_us)
        conflict = None
        if request.behavior not in STOPS:
            conflict = self._conflict(request, kind, volumes, now_us)
        if conflict is None:
            self._reservations[request.id] = _Reservation(request, kind, volumes)
            self._note_ends(volumes)
            return ""

        def again(altitude_m: float, first: bool) -> Conflict | None:
            return self._conflict_at(request, kind, now_us, altitude_m, first)

        return refusal(conflict, self._policy, again if takes_altitude else None)

    def adopt(self, request: BehaviorRequest, kind: BehaviorType) -> None:
        """Reserve the volume of a behavior that goes on already, without a check."""
        if request.behavior not in BY_HAND:
            self._reservations[request.id] = _Reservation(request, kind)

    def has_reserved(self, behavior: BehaviorId) -> bool:
        """Whether volumes are reserved for a behavior."""
        return behavior in self._reservations

    def delay(self, vehicle: ResourceId) -> None:
        """A vehicle is held: the times of its volumes do not hold any more."""
        for reservation in self._reservations.values():
            reservation.late.add(vehicle)

    def release(self, behavior: BehaviorId) -> None:
        """A behavior has ended: free its volume, except where its vehicles are."""
        if behavior in self._reservations:
            self._reservations[behavior].over = True
            self._forget()

    # --- inside ---------------------------------------------------------------------------------

    def _forget(self) -> None:
        for name, reservation in list(self._reservations.items()):
            if reservation.over and not self._lost.intersection(reservation.request.resources):
                del self._reservations[name]

    def _note_home(self, vehicle: ResourceId, state: VehicleState) -> None:
        """Where it stood at first, and where it stood last: autopilots mean one or the other."""
        if state.position is None or self._frame is None:
            return
        place = self._frame.to_local(state.position.latlon)
        homes = self._homes.setdefault(vehicle, [place])
        homes[1:] = [place]

    def _note_ends(self, volumes: Mapping[ResourceId, Volume]) -> None:
        for vehicle, volume in volumes.items():
            if volume.end_m is not None:
                self._nominal_m[vehicle] = volume.end_m

    def _aircraft(self, vehicle: str) -> Aircraft | None:
        name = ResourceId(vehicle)
        state = self._states.get(name)
        if state is None or self._frame is None:
            return None
        homes = tuple(dict.fromkeys(self._homes.get(name, ())))
        return aircraft_of(state, self._frame, self._nominal_m.get(name), homes)

    def _conflict_at(
        self,
        request: BehaviorRequest,
        kind: BehaviorType,
        now_us: int,
        altitude_m: float,
        first: bool,
    ) -> Conflict | None:
        """What it would meet at another altitude above home. `first`: it changes to that before."""
        changed = {**request.parameters, "altitude": altitude_m, "altitude_frame": "relative"}
        then = replace(request, parameters=changed)
        if not first:
            return self._conflict(request, kind, self._volumes(then, kind, now_us), now_us)
        climb = replace(then, behavior="change_altitude")
        climbs = self._volumes(climb, BehaviorType.VEHICLE, now_us)
        met = self._conflict(request, kind, climbs, now_us)
        if met is not None:
            return met
        return self._conflict(request, kind, self._volumes(then, kind, now_us, altitude_m), now_us)

    def _volumes(
        self,
        request: BehaviorRequest,
        kind: BehaviorType,
        now_us: int,
        from_m: float | None = None,
    ) -> dict[ResourceId, Volume]:
        """`from_m`: the altitude above home that its aircraft have by then; None: the present."""
        volumes = {}
        lead = self._aircraft(request.resources[0])
        vehicles = [each for each in request.resources if "/" not in each]
        for index, vehicle in enumerate(vehicles):
            aircraft = self._aircraft(vehicle) if vehicle in self.aircraft else None
            if aircraft is None or self._frame is None:
                continue
            if from_m is not None and aircraft.home_m is not None:
                there_m = aircraft.home_m + from_m
                aircraft = replace(aircraft, span=Span(there_m, there_m), flies=True)
            parameters = FlightParameters(request.parameters, aircraft, self._frame, self._height_m)
            start_s, timed = now_us / US_PER_S, self._policy.time_s is not None
            if kind is BehaviorType.TEAM:
                volume = member_volume(request.behavior, parameters, lead, index, start_s)
            else:
                volume = volume_of(request.behavior, parameters, start_s, timed=timed)
            volumes[vehicle] = volume
        return volumes

    def _height_m(self, vehicle: str) -> float | None:
        aircraft = self._aircraft(vehicle)
        return None if aircraft is None else aircraft.span.high_m

    def _conflict(
        self,
        request: BehaviorRequest,
        kind: BehaviorType,
        volumes: Mapping[ResourceId, Volume],
        now_us: int,
    ) -> Conflict | None:
        """The first two who would come too near; those of one team see to it themselves."""
        for vehicle, volume in volumes.items():
            others = list(self._occupants(request.id, now_us))
            if kind is not BehaviorType.TEAM:
                others += [
                    Occupant(each, other, request.id, request.behavior)
                    for each, other in volumes.items()
                ]
            for occupant in others:
                together = kind is BehaviorType.TEAM and occupant.vehicle in request.resources
                if occupant.vehicle == vehicle or together:
                    continue
                aircraft, other = self._aircraft(vehicle), self._aircraft(occupant.vehicle)
                if aircraft is None:
                    continue
                met = None
                for policy in self._policies(aircraft, other):
                    met = too_near(volume, occupant.volume, policy)
                    if met is None:
                        break
                if met is not None:
                    return Conflict(vehicle, volume, aircraft.home_m, occupant, met[1])
        return None

    def _policies(self, aircraft: Aircraft, other: Aircraft | None) -> list[Separation]:
        """Of which one must be kept. Two that are too near already, after a march for example, must
        be able to part: they must not come nearer still."""
        policy = self._policy
        if other is None or not (aircraft.flies and other.flies):
            return [policy]
        far_m = hull_distance_m(aircraft.stop, other.stop)
        high_m = aircraft.span.apart_m(other.span)
        if far_m >= policy.horizontal_m or high_m >= policy.vertical_m:
            return [policy]
        kept = []
        if far_m >= DISCERNIBLE_M:
            kept.append(replace(policy, horizontal_m=far_m))
        if high_m >= DISCERNIBLE_M:
            kept.append(replace(policy, vertical_m=high_m))
        return kept or [policy]

    def _occupants(self, apart_from: BehaviorId, now_us: int) -> Iterator[Occupant]:
        """Everybody in the air, but for what a behavior itself reservations."""
        busy = set()
        for name, reservation in self._reservations.items():
            if name == apart_from:
                continue
            if reservation.volumes is None:
                reservation.volumes = self._volumes(reservation.request, reservation.kind, now_us)
            for vehicle, volume in reservation.volumes.items():
                busy.add(vehicle)
                seen = self._as_flown(reservation, vehicle, volume, now_us)
                lost = reservation.over
                yield Occupant(vehicle, seen, name, reservation.request.behavior, lost=lost)
        for vehicle in self.aircraft:
            aircraft = self._aircraft(vehicle)
            if vehicle not in busy and aircraft is not None and aircraft.flies:
                place = Piece(aircraft.stop, aircraft.span.low_m, aircraft.span.high_m)
                yield Occupant(vehicle, Volume((place,)))

    def _as_flown(
        self, reservation: _Reservation, vehicle: ResourceId, volume: Volume, now_us: int
    ) -> Volume:
        """A volume that says when, as long as the vehicle keeps to it."""
        limit_s = self._policy.time_s
        if not volume.timed or limit_s is None:
            return volume
        if vehicle not in reservation.late:
            ends_s = max(piece.to_s for piece in volume.pieces if piece.way is not None)
            late = now_us / US_PER_S > ends_s + limit_s
            if late or self._strays(vehicle, volume, limit_s):
                reservation.late.add(vehicle)
        return volume.at_any_time() if vehicle in reservation.late else volume

    def _strays(self, vehicle: ResourceId, volume: Volume, limit_s: float) -> bool:
        """Whether it was seen where it should be at no time near to that."""
        state, aircraft = self._states[vehicle], self._aircraft(vehicle)
        seen_s = state.time_us / US_PER_S
        if aircraft is None:
            return False
        return not volume.passes(aircraft.place, seen_s - limit_s / 2, seen_s + limit_s / 2)


def airspace_of(fleet: Fleet) -> Airspace | None:
    """None: the fleet does not say how far aircraft are to be apart, or has not two of them."""
    if fleet.vertical_separation_m is None:
        return None
    policy = Separation(
        fleet.vertical_separation_m, fleet.horizontal_separation_m, fleet.time_separation_s
    )
    airspace = Airspace(fleet, policy)
    return airspace if len(airspace.aircraft) > 1 else None
