"""Reservations of operational volumes and of places in shared space.

They are made before a behavior starts and released when it has ended. Pure: states of vehicles and
the time are arguments.
"""

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from m2pem.api.arbiter import BehaviorId, BehaviorRequest
from m2pem.api.telemetry import LinkState, VehicleState
from m2pem.deconfliction.behavior_volumes import volume_of
from m2pem.deconfliction.conflicts import Again, Conflict, Occupant, Refusal, conflict_text
from m2pem.deconfliction.operational_volume import Piece, Separation, Volume, too_near
from m2pem.deconfliction.participant import (
    FlightParameters,
    Participant,
    Span,
    SurfaceParameters,
    flies,
    participant_of,
    stands,
)
from m2pem.deconfliction.places import PlaceNames
from m2pem.deconfliction.shared_space import SharedRegion, SpaceConflict, occupants_of, regions_of
from m2pem.deconfliction.team_volumes import member_volume
from m2pem.fleet.fleet import Domain, Fleet, OnConflict, SharedSpace
from m2pem.fleet.space import BY_HAND, ONE_BY_ONE, STOPS, participants_of, separated_vehicles
from m2pem.geo.local_frame import EastNorth, LocalFrame
from m2pem.geo.polygon import hull_distance_m
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import ResourceId
from m2pem.units import US_PER_S

DISCERNIBLE_M = 1.0
"""Nearer than this, the direction in which two vehicles may part is not known."""


@dataclass(slots=True)
class Reservation:
    """The volumes of a behavior.

    `volumes`: of its vehicles that take part; None: not computed yet. `legs`: on which leg of its
    route each vehicle is. `late`: aircraft that are not where their volume says, if it says when.
    `over`: the behavior has ended, but nothing was received from one of its vehicles since.
    """

    request: BehaviorRequest
    kind: BehaviorType
    volumes: Mapping[ResourceId, Volume] | None = None
    legs: dict[ResourceId, int] = field(default_factory=dict)
    late: set[ResourceId] = field(default_factory=set)
    over: bool = False


class Reservations:
    """The reservations of all vehicles of a fleet that take part in deconfliction.

    `participants`: those that are kept apart from each other, and those that count in a shared
    space.
    """

    def __init__(self, fleet: Fleet) -> None:
        self.participants = participants_of(fleet)
        self._fleet = fleet
        self._domains = {vehicle.id: vehicle.domain for vehicle in fleet.vehicles.values()}
        self._separated = frozenset(separated_vehicles(fleet))
        self._time_s = fleet.time_separation_s
        self._frame: LocalFrame | None = None
        self._regions: tuple[SharedRegion, ...] = ()
        if fleet.shared_space:  # there is a geometry, and so an origin
            self._frame = LocalFrame(fleet.origin)
            self._regions = regions_of(fleet, self._frame)
        self._names = PlaceNames(fleet)
        self._states: dict[ResourceId, VehicleState] = {}
        self._nominal_m: dict[ResourceId, float] = {}
        self._homes: dict[ResourceId, list[EastNorth]] = {}
        self._lost: set[ResourceId] = set()
        self._reservations: dict[BehaviorId, Reservation] = {}

    # --- what is seen ---------------------------------------------------------------------------

    def received(self, state: VehicleState) -> None:
        """Take the state of a vehicle of any domain."""
        if state.position is None:
            return
        if self._frame is None:
            self._frame = LocalFrame(state.position.latlon)
        self._states[state.resource] = state
        if state.resource not in self.participants:
            return
        airborne = self._domains[state.resource] is Domain.AIR
        if not flies(state) if airborne else not state.armed and stands(state):
            self._note_home(state.resource, state)
        if state.link is LinkState.LOST:
            return
        self._note_progress(state.resource)
        if state.resource in self._lost:
            self._lost.discard(state.resource)
            self._forget()

    def lost(self, vehicle: ResourceId) -> None:
        """The link to a vehicle is lost: it keeps its volume until something is received again."""
        self._lost.add(vehicle)

    def unseen(self, vehicles: Iterable[ResourceId]) -> list[ResourceId]:
        """Return those that take part and whose position was never received."""
        return [each for each in vehicles if each in self.participants and each not in self._states]

    # --- what is done ---------------------------------------------------------------------------

    def propose(
        self, request: BehaviorRequest, kind: BehaviorType, now_us: int
    ) -> Reservation | None:
        """Return what a behavior that starts now would reserve; None: nothing."""
        part = any(each in self.participants for each in request.resources)
        if not part or request.behavior in BY_HAND:
            return None
        return Reservation(request, kind, self._volumes(request, kind, now_us))

    def refusal(
        self,
        wanted: Reservation,
        now_us: int,
        ahead: Sequence[Reservation] = (),
        *,
        takes_altitude: bool = False,
        ended: Collection[str] = (),
    ) -> Refusal | None:
        """Return why a behavior may not start now; None: it may.

        `ahead`: what others are to reserve before it. `takes_altitude`: the behavior has a
        parameter for that, so that another one may be proposed. `ended`: behaviors that will have
        ended before it starts, and whose vehicles stand then where they are now.
        """
        request = wanted.request
        if request.behavior in STOPS:
            return None
        if unseen := self.unseen(request.resources):
            reason = (
                f"the position of {' and '.join(unseen)} is not known, nor so whether others are "
                "in its way"
            )
            return Refusal(reason, unseen[0], lacking=0, wait_s=self._unseen_wait_s())
        occupants = list(self._occupants({request.id, *ended}, now_us, ahead))
        if (space := self._space_conflict(wanted, occupants)) is not None:
            return space.refusal(self._where(space.place))
        volumes = wanted.volumes or {}
        conflict = self._conflict(request, wanted.kind, volumes, occupants)
        if conflict is None:
            return None

        def again(altitude_m: float, first: bool) -> Conflict | None:
            return self._conflict_at(wanted, occupants, now_us, altitude_m, first)

        airborne = self._domains[conflict.vehicle] is Domain.AIR
        return Refusal(
            self._text(conflict, again if takes_altitude and airborne else None),
            conflict.vehicle,
            (conflict.other,),
            wait_s=self._wait_s(),
        )

    def commit(self, reservation: Reservation) -> None:
        """Reserve what was proposed."""
        self._reservations[reservation.request.id] = reservation
        for vehicle, volume in (reservation.volumes or {}).items():
            if volume.end_m is not None:
                self._nominal_m[vehicle] = volume.end_m

    def reserve(
        self,
        request: BehaviorRequest,
        kind: BehaviorType,
        now_us: int,
        *,
        takes_altitude: bool = False,
    ) -> str:
        """Reserve what a behavior that starts now needs.

        Return "", or why it is refused and what would be right. `takes_altitude`: as in `refusal`.
        """
        wanted = self.propose(request, kind, now_us)
        if wanted is None:
            return ""
        refusal = self.refusal(wanted, now_us, takes_altitude=takes_altitude)
        if refusal is not None:
            return refusal.reason
        self.commit(wanted)
        return ""

    def hand_on(self, request: BehaviorId, behavior: BehaviorId) -> None:
        """Give what is reserved for a request to the behavior that was requested for it."""
        reservation = self._reservations.pop(request, None)
        if reservation is not None:
            reservation.request = replace(reservation.request, id=behavior)
            self._reservations[behavior] = reservation

    def withdraw(self, request: BehaviorId) -> None:
        """A request has ended without a behavior: free what is reserved for it."""
        self._reservations.pop(request, None)

    def adopt(self, request: BehaviorRequest, kind: BehaviorType) -> None:
        """Reserve the volume of a behavior that goes on already, without a check."""
        if request.behavior not in BY_HAND:
            self._reservations[request.id] = Reservation(request, kind)

    def has_reserved(self, behavior: BehaviorId) -> bool:
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

    def _note_progress(self, vehicle: ResourceId) -> None:
        """A vehicle was received: note on which leg of its route it is now."""
        place = None
        for reservation in self._reservations.values():
            volume = (reservation.volumes or {}).get(vehicle)
            if volume is None or not volume.route:
                continue
            if place is None:
                participant = self._participant(vehicle)
                if participant is None:
                    return
                place = participant.place
            leg = reservation.legs.get(vehicle, 0)
            reservation.legs[vehicle] = volume.leg_at(place, leg)

    def _participant(self, vehicle: str, *, airborne: bool = False) -> Participant | None:
        """`airborne`: with its height, though it does not fly."""
        name = ResourceId(vehicle)
        state = self._states.get(name)
        if state is None or self._frame is None:
            return None
        homes = tuple(dict.fromkeys(self._homes.get(name, ())))
        airborne = airborne or self._domains[name] is Domain.AIR
        nominal_m = self._nominal_m.get(name)
        return participant_of(state, self._frame, nominal_m, homes, airborne=airborne)

    def _conflict_at(
        self,
        wanted: Reservation,
        occupants: Sequence[Occupant],
        now_us: int,
        altitude_m: float,
        first: bool,
    ) -> Conflict | None:
        """What it would meet at another altitude above home. `first`: it changes to that before."""
        request, kind = wanted.request, wanted.kind
        changed = {**request.parameters, "altitude": altitude_m, "altitude_frame": "relative"}
        then = replace(request, parameters=changed)
        if not first:
            volumes = self._volumes(then, kind, now_us)
            return self._conflict(request, kind, volumes, occupants)
        climb = replace(then, behavior="change_altitude")
        climbs = self._volumes(climb, BehaviorType.VEHICLE, now_us)
        met = self._conflict(request, kind, climbs, occupants)
        if met is not None:
            return met
        volumes = self._volumes(then, kind, now_us, altitude_m)
        return self._conflict(request, kind, volumes, occupants)

    def _volumes(
        self, request: BehaviorRequest, kind: BehaviorType, now_us: int, from_m: float | None = None
    ) -> dict[ResourceId, Volume]:
        """`from_m`: the altitude above home that its aircraft have by then; None: the present."""
        volumes = {}
        lead = self._participant(request.resources[0])
        vehicles = [each for each in request.resources if "/" not in each]
        for index, vehicle in enumerate(vehicles):
            participant = self._participant(vehicle) if vehicle in self.participants else None
            if participant is None or self._frame is None:
                continue
            airborne = self._domains[vehicle] is Domain.AIR
            if airborne and from_m is not None and participant.home_m is not None:
                there_m = participant.home_m + from_m
                participant = replace(participant, span=Span(there_m, there_m), flies=True)
            kind_of = FlightParameters if airborne else SurfaceParameters
            parameters = kind_of(request.parameters, participant, self._frame, self._height_m)
            start_s, timed = now_us / US_PER_S, airborne and self._time_s is not None
            if kind is BehaviorType.TEAM:
                volume = member_volume(request.behavior, parameters, lead, index, start_s)
            else:
                volume = volume_of(request.behavior, parameters, start_s, timed=timed)
            volumes[vehicle] = volume
        return volumes

    def _height_m(self, vehicle: str) -> float | None:
        participant = self._participant(vehicle, airborne=True)
        return None if participant is None else participant.span.high_m

    # --- distances ------------------------------------------------------------------------------

    def _conflict(
        self,
        request: BehaviorRequest,
        kind: BehaviorType,
        volumes: Mapping[ResourceId, Volume],
        occupants: Sequence[Occupant],
    ) -> Conflict | None:
        """The first two who would come too near; those of one team see to it themselves."""
        own = [
            Occupant(each, volume, request.id, request.behavior) for each, volume in volumes.items()
        ]
        for vehicle, volume in volumes.items():
            participant = self._participant(vehicle)
            if participant is None or vehicle not in self._separated:
                continue
            others = occupants if kind is BehaviorType.TEAM else [*occupants, *own]
            for occupant in others:
                together = kind is BehaviorType.TEAM and occupant.vehicle in request.resources
                if occupant.vehicle == vehicle or together:
                    continue
                if self._domains[occupant.vehicle] is not self._domains[vehicle]:
                    continue
                other = self._participant(occupant.vehicle)
                met = None
                for policy in self._policies(participant, other):
                    met = too_near(volume, occupant.volume, policy)
                    if met is None:
                        break
                if met is not None:
                    home_m, policy = participant.home_m, self._policy_of(vehicle)
                    return Conflict(vehicle, volume, home_m, occupant, *met, policy)
        return None

    def _policy_of(self, vehicle: ResourceId) -> Separation:
        """How far a vehicle that is kept apart is from others of its domain."""
        fleet, domain = self._fleet, self._domains[vehicle]
        if domain is Domain.AIR:
            assert fleet.vertical_separation_m is not None
            return Separation(
                fleet.vertical_separation_m, fleet.horizontal_separation_m, self._time_s
            )
        return Separation(math.inf, fleet.surface_separation_m[domain])

    def _policies(self, vehicle: Participant, other: Participant | None) -> list[Separation]:
        """Of which one must be kept. Two that are too near already, after a march for example, must
        be able to part: they must not come nearer still."""
        policy = self._policy_of(vehicle.vehicle)
        if other is None or not (vehicle.flies and other.flies):
            return [policy]
        far_m = hull_distance_m(vehicle.stop, other.stop)
        high_m = vehicle.span.apart_m(other.span)
        if far_m >= policy.horizontal_m or high_m >= policy.vertical_m:
            return [policy]
        kept = []
        if far_m >= DISCERNIBLE_M:
            kept.append(replace(policy, horizontal_m=far_m))
        if high_m >= DISCERNIBLE_M:
            kept.append(replace(policy, vertical_m=high_m))
        return kept or [policy]

    def _text(self, conflict: Conflict, again: Again | None) -> str:
        return conflict_text(conflict, self._where(conflict.place), again)

    def _where(self, place: EastNorth | None) -> str:
        return "" if place is None or self._frame is None else self._names.at(place, self._frame)

    def _wait_s(self) -> float | None:
        fleet = self._fleet
        return fleet.conflict_wait_s if fleet.on_conflict is OnConflict.WAIT else None

    def _unseen_wait_s(self) -> float | None:
        """How long a task waits until the positions of its vehicles are known."""
        waits = [space.wait_s for space in self._fleet.shared_space.values() if space.waits]
        own = self._wait_s()
        return max(waits, default=None) if own is None else own

    # --- shared space ---------------------------------------------------------------------------

    def _space_conflict(
        self, wanted: Reservation, occupants: Sequence[Occupant]
    ) -> SpaceConflict | None:
        """The first shared space that has no place for all vehicles of a behavior. A vehicle that
        is in it already has a place, and one whose place is reserved for this behavior keeps it:
        another that leaves may have swerved since then."""
        one_by_one = wanted.kind is BehaviorType.TEAM and wanted.request.behavior in ONE_BY_ONE
        reserved = self._reservations.get(wanted.request.id)
        for shared in self._regions:
            if reserved is not None and _has_places(reserved, wanted, shared):
                continue
            own = {}
            for vehicle, volume in (wanted.volumes or {}).items():
                participant = self._participant(vehicle)
                if participant is not None and self._domains[vehicle] in shared.space.domains:
                    own[vehicle] = participant.stop, volume
            counting = self._counting(shared.space, occupants)
            others = occupants_of(shared, counting, wanted.request.resources)
            conflict = shared.conflict(own, others, one_by_one=one_by_one)
            if conflict is not None:
                return conflict
        return None

    def places(self, now_us: int) -> list[tuple[SharedSpace, tuple[Occupant, ...]]]:
        """Return the shared spaces, and who has a place in each."""
        occupants = list(self._occupants((), now_us, ()))
        return [
            (each.space, occupants_of(each, self._counting(each.space, occupants), ()))
            for each in self._regions
        ]

    def _counting(self, space: SharedSpace, occupants: Sequence[Occupant]) -> list[Occupant]:
        """Return those whose vehicles count in a shared space."""
        return [each for each in occupants if self._domains[each.vehicle] in space.domains]

    # --- who is in the way ----------------------------------------------------------------------

    def _occupants(
        self, apart_from: Collection[str], now_us: int, ahead: Sequence[Reservation]
    ) -> Iterator[Occupant]:
        """All that take part, but for what some behaviors reserve. `ahead`: as in `refusal`."""
        busy = set()
        for name, reservation in self._reservations.items():
            if name in apart_from:
                continue
            for vehicle, volume in self._volumes_of(reservation, now_us).items():
                busy.add(vehicle)
                lost = reservation.over
                left = self._left_of(reservation, vehicle, volume, now_us)
                yield Occupant(vehicle, left, name, reservation.request.behavior, lost=lost)
        for reservation in ahead:
            behavior = reservation.request.behavior
            for vehicle, volume in (reservation.volumes or {}).items():
                yield Occupant(vehicle, volume, reservation.request.id, behavior)
        for vehicle in self.participants:
            participant = self._participant(vehicle)
            if vehicle not in busy and participant is not None and participant.flies:
                span = participant.span
                place = Piece(participant.stop, span.low_m, span.high_m)
                lost = vehicle in self._lost and self._domains[vehicle] is not Domain.AIR
                yield Occupant(vehicle, Volume((place,)), lost=lost)

    def _volumes_of(self, reservation: Reservation, now_us: int) -> Mapping[ResourceId, Volume]:
        """The volumes of a behavior. After a restart they are computed when its vehicles have said
        where they are."""
        known = reservation.volumes or {}
        late = (
            each
            for each in reservation.request.resources
            if each in self.participants and each in self._states and each not in known
        )
        if reservation.volumes is None or any(late):
            found = self._volumes(reservation.request, reservation.kind, now_us)
            reservation.volumes = {**found, **known}
        return reservation.volumes

    def _left_of(
        self, reservation: Reservation, vehicle: ResourceId, volume: Volume, now_us: int
    ) -> Volume:
        """What a behavior still needs of a volume that it has reserved for a vehicle."""
        if self._domains[vehicle] is Domain.AIR:
            return self._as_flown(reservation, vehicle, volume, now_us)
        participant = self._participant(vehicle)
        if participant is None or not volume.route or vehicle in self._lost:
            return volume
        return volume.after(participant.place, participant.stop, reservation.legs.get(vehicle, 0))

    def _as_flown(
        self, reservation: Reservation, vehicle: ResourceId, volume: Volume, now_us: int
    ) -> Volume:
        """A volume that says when, as long as the vehicle keeps to it."""
        limit_s = self._time_s
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
        state, participant = self._states[vehicle], self._participant(vehicle)
        seen_s = state.time_us / US_PER_S
        if participant is None:
            return False
        return not volume.passes(participant.place, seen_s - limit_s / 2, seen_s + limit_s / 2)


def _has_places(reserved: Reservation, wanted: Reservation, shared: SharedRegion) -> bool:
    """Whether all vehicles that would enter a shared space have places in it reserved."""
    before = reserved.volumes or {}
    entering = [name for name, each in (wanted.volumes or {}).items() if shared.entered_by(each)]
    return all(name in before and shared.entered_by(before[name]) for name in entering)


def reservations_for(fleet: Fleet) -> Reservations | None:
    """None: the fleet keeps no vehicles apart and has no shared space."""
    found = Reservations(fleet)
    return found if found.participants else None
