"""The ways of vehicles that are known before a mission starts, for its verification.

`m2pem.deconfliction.reservations` computes volumes from telemetry when a behavior starts. Here the
same volumes are computed from the fleet file and the parameters of the tasks: from each place at
which a vehicle may then stand.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from m2pem.deconfliction.behavior_volumes import PLANS, SURFACE_PLANS, volume_of
from m2pem.deconfliction.operational_volume import Volume
from m2pem.deconfliction.participant import (
    ANY_HEIGHT,
    FlightParameters,
    Participant,
    Span,
    SurfaceParameters,
)
from m2pem.deconfliction.shared_space import SharedRegion, regions_of
from m2pem.deconfliction.team_volumes import TEAM_BEHAVIORS, end_of_member, member_volume
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.fleet import Domain, Fleet
from m2pem.fleet.parameters import ResolvedValue, examine_behavior
from m2pem.fleet.space import BY_HAND, STOPS
from m2pem.geo.geojson import GeometryError
from m2pem.geo.local_frame import EastNorth, LocalFrame
from m2pem.geo.polygon import Hull, middle_of
from m2pem.geo.positions import is_local, local_point
from m2pem.mission.behavior import Behavior, BehaviorType
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.expression import Expression
from m2pem.mission.geometry import Geometry, Point
from m2pem.verify.translate.ways import Way

_ON_THE_SPOT = frozenset({"takeoff", "change_altitude", "land"})
"""Where a vehicle does them it stands before and after."""

_STAYS = STOPS | {"set_speed", "deploy"}

_HEIGHTS = frozenset(
    {"altitude", "altitude_frame", "speed", "heading", "yaw", "duration", "timeout", "turns"}
)
"""Parameters on which it does not depend which areas a way enters."""

GROUND = Span(0.0, 0.0)
"""Heights do not matter: a shared space is one at all heights."""


@dataclass(frozen=True, slots=True)
class Stand:
    """Where a vehicle may stand: somewhere in a convex polygon; None: anywhere. `flies`: whether
    an aircraft is in the air."""

    hull: Hull | None
    flies: bool = False


class FleetWays:
    """The ways of the vehicles of a fleet (`m2pem.verify.translate.ways.KnownWays`)."""

    anywhere = Stand(None, flies=True)

    def __init__(self, fleet: Fleet, geometries: Mapping[str, Geometry] = {}) -> None:
        """`geometries`: those of the mission."""
        self._fleet = fleet
        self._geometries = {**fleet.geometries, **geometries}
        self._changeable = {*fleet.handed_over} - geometries.keys()
        self._frame = LocalFrame(fleet.origin)
        self._regions = regions_of(fleet, self._frame)
        self._known: dict[tuple[object, ...], Way] = {}
        self._parameters: dict[int, tuple[Behavior, Mapping[str, ResolvedValue] | None]] = {}

    def home(self, vehicle: ResourceId) -> Stand:
        """Where the fleet file says that a simulated vehicle stands."""
        place = self._place_of(self._fleet.vehicles[vehicle].settings.get("home"))
        return self.anywhere if place is None else Stand((place,))

    def inside(self, station: object, vehicle: ResourceId) -> Mapping[str, bool | None]:
        """Of a vehicle that stands anywhere, nothing is known. On the ground, an aircraft is in no
        space."""
        assert isinstance(station, Stand)
        found: dict[str, bool | None] = {}
        for shared in self._counting(vehicle):
            hull = station.hull
            if self._domain(vehicle) is Domain.AIR and not station.flies:
                found[shared.space.name] = False
            elif hull is None:
                found[shared.space.name] = None
            else:
                meets = shared.region.meets(hull)
                found[shared.space.name] = (True if len(hull) == 1 else None) if meets else False
        return found

    def moves(self, behavior: Behavior) -> bool:
        """Payloads, and what stops a vehicle or leaves it where it is, move none."""
        return behavior.type is not BehaviorType.PAYLOAD and behavior.name not in _STAYS

    def way(
        self,
        behavior: Behavior,
        vehicles: Sequence[ResourceId],
        indexes: Sequence[int],
        station: object,
    ) -> Way:
        """As of the first of the vehicles, with the homes of all."""
        assert isinstance(station, Stand)
        homes = tuple(dict.fromkeys(h for each in vehicles for h in self.home(each).hull or ()))
        if any(self.home(each).hull is None for each in vehicles):
            homes = ()
        key = (id(behavior), self._domain(vehicles[0]), homes, tuple(indexes), station)
        if key not in self._known:
            self._values(behavior)  # which keeps it
            ways = [self._way(behavior, vehicles[0], homes, each, station) for each in indexes]
            self._known[key] = _any_of(ways)
        return self._known[key]

    def _way(
        self,
        behavior: Behavior,
        vehicle: ResourceId,
        homes: tuple[EastNorth, ...],
        index: int,
        station: Stand,
    ) -> Way:
        regions = self._counting(vehicle)
        if behavior.name in BY_HAND:
            # It needs no place: it has one where it is seen.
            return Way({each.space.name: False for each in regions}, self.anywhere)
        flying = self._domain(vehicle) is Domain.AIR
        names = {*(PLANS if flying else SURFACE_PLANS), *TEAM_BEHAVIORS}
        values = self._values(behavior) if behavior.name in names else {}
        if values is None:
            return Way({each.space.name: None for each in regions}, self.anywhere)
        make = FlightParameters if flying else SurfaceParameters

        def parameters_at(stop: Hull) -> FlightParameters:
            span = GROUND if flying else ANY_HEIGHT
            at = Participant(vehicle, middle_of(stop), stop, span, 0.0, station.flies, True, homes)
            return make(values, at, self._frame, lambda _: None)

        def volume_from(stop: Hull) -> Volume:
            parameters = parameters_at(stop)
            if behavior.type is BehaviorType.TEAM:
                return member_volume(behavior.name, parameters, parameters.vehicle, index, 0.0)
            return volume_of(behavior.name, parameters, 0.0)

        first = _first_place(parameters_at(station.hull or ((0.0, 0.0),)), behavior, homes)
        whole = None if station.hull is None else volume_from(station.hull)
        several_homes = behavior.name == "return_to_launch" and len(homes) != 1
        exact = station.hull is not None and len(station.hull) == 1 and not several_homes
        sure = None if first is None or exact else volume_from((first,))
        enters: dict[str, bool | None] = {}
        for shared in regions:
            if whole is not None and not shared.entered_by(whole):
                enters[shared.space.name] = False
            elif exact or (sure is not None and not several_homes and shared.entered_by(sure)):
                enters[shared.space.name] = True
            else:
                everywhere = behavior.name not in names
                enters[shared.space.name] = True if everywhere else None
        after = self._after(behavior, parameters_at(station.hull or ((0.0, 0.0),)), index, station)
        ends_in = self.inside(after, vehicle)
        route = (whole or sure or Volume()).route
        early = not flying and len(route) > 1
        leaves = frozenset(s for s, inside in ends_in.items() if early and inside is False)
        ends = (r.space.name for r in regions if not route or r.region.meets(route[-1:]))
        return Way(enters, after, leaves, frozenset(ends))

    def _after(
        self, behavior: Behavior, parameters: FlightParameters, index: int, station: Stand
    ) -> Stand:
        """Where it stands after a success."""
        if behavior.name in _ON_THE_SPOT:
            return Stand(station.hull, flies=behavior.name != "land")
        if behavior.name == "return_to_launch":
            homes = parameters.vehicle.homes
            return Stand(homes) if len(homes) == 1 else self.anywhere
        team = behavior.type is BehaviorType.TEAM
        if team and behavior.name in TEAM_BEHAVIORS:
            end = end_of_member(behavior.name, parameters, index)
            return self.anywhere if end is None else Stand((end,), flies=True)
        if behavior.name == "single_vehicle_routing" and parameters.route is not None:
            waypoints = parameters.route.waypoints
            last = waypoints[0 if parameters.loop else -1]
            return Stand((parameters.to_local(last),), flies=True)
        if behavior.name == "goto" and isinstance(parameters.target, Point):
            return Stand((parameters.to_local(parameters.target.position),), flies=True)
        if behavior.name in ("area_survey", "orbit", "area_observe"):
            # From the first place of it, the whole volume is where it works.
            first = _first_place(parameters, behavior, ())
            if first is not None:
                return self._somewhere_in(behavior, parameters, first)
        return self.anywhere

    def _somewhere_in(
        self, behavior: Behavior, parameters: FlightParameters, first: EastNorth
    ) -> Stand:
        vehicle = parameters.vehicle
        at = Participant(vehicle.vehicle, first, (first,), vehicle.span, 0.0, True, True)
        there = type(parameters)(parameters.given, at, self._frame, lambda _: None)
        areas = [piece.area for piece in volume_of(behavior.name, there, 0.0).pieces]
        largest = max((each for each in areas if each is not None), key=len, default=None)
        return Stand(largest, flies=True)

    # --- what the files say -----------------------------------------------------------------------

    def _domain(self, vehicle: ResourceId) -> Domain:
        return self._fleet.vehicles[vehicle].domain

    def _counting(self, vehicle: ResourceId) -> list[SharedRegion]:
        return [each for each in self._regions if self._domain(vehicle) in each.space.domains]

    def _place_of(self, written: object) -> EastNorth | None:
        if isinstance(written, str) and is_local(written):
            try:
                return self._frame.to_local(local_point(written, self._fleet.origin).position[:2])
            except GeometryError:
                return None
        if isinstance(written, list | tuple) and len(written) in (2, 3):
            latitude, longitude = written[:2]
            if isinstance(latitude, int | float) and isinstance(longitude, int | float):
                return self._frame.to_local((latitude, longitude))
        return None

    def _values(self, behavior: Behavior) -> Mapping[str, ResolvedValue] | None:
        """The parameters of a behavior; None: not known, or wrong. What operators may hand over is
        not known."""
        if id(behavior) not in self._parameters:  # it is kept, so that its id stays its own
            self._parameters[id(behavior)] = behavior, self._read(behavior)
        return self._parameters[id(behavior)][1]

    def _read(self, behavior: Behavior) -> Mapping[str, ResolvedValue] | None:
        spec = SHARED.get((behavior.name, behavior.type)) or SHARED.get(
            (behavior.name, BehaviorType.VEHICLE)
        )
        if spec is None:
            return None
        late = {each.name for each in behavior.parameters if isinstance(each.value, Expression)}
        named = {each.value for each in behavior.parameters if isinstance(each.value, str)}
        if late - _HEIGHTS or not named.isdisjoint(self._changeable):
            return None
        values, problems = examine_behavior(behavior, spec, self._geometries.get, self._fleet)
        return None if problems else values


def _first_place(
    parameters: FlightParameters, behavior: Behavior, homes: Sequence[EastNorth]
) -> EastNorth | None:
    """The place to which a behavior goes first, wherever it begins; None: there is none."""
    if parameters.route is not None and parameters.route.waypoints:
        return parameters.to_local(parameters.route.waypoints[0])
    if parameters.area is not None:
        return parameters.to_local(parameters.area.rings[0][0])
    if isinstance(parameters.target, Point):
        return parameters.to_local(parameters.target.position)
    if parameters.target is not None or behavior.name not in {*PLANS, *TEAM_BEHAVIORS}:
        return 0.0, 0.0  # its way is everywhere
    return homes[0] if behavior.name == "return_to_launch" and len(homes) == 1 else None


def _any_of(ways: Sequence[Way]) -> Way:
    """What is known of one of several ways."""
    first = ways[0]
    if all(each == first for each in ways):
        return first
    enters = {name: _agreed(each.enters[name] for each in ways) for name in first.enters}
    after = first.after if all(each.after == first.after for each in ways) else FleetWays.anywhere
    leaves = frozenset[str]().union(*(each.leaves for each in ways))
    return Way(enters, after, leaves, frozenset[str]().union(*(each.stays for each in ways)))


def _agreed(answers: Iterable[bool | None]) -> bool | None:
    found = {*answers}
    return found.pop() if len(found) == 1 else None
