"""Says before it is too late that a battery is too low for what is left of a behavior.

Only of vehicles whose `endurance` the fleet file states, and whose role has another one do the rest
(`onLoss`). What is left is what was reported last, from where the vehicle is now; home is where it
was received first. `m2pem.fleet.endurance` decides.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from m2pem.api.runs import RunId
from m2pem.api.telemetry import VehicleState
from m2pem.engine.inputs import ResourceFault
from m2pem.engine.state import Behavior, BehaviorPhase, RunStatus
from m2pem.executive.dispatcher import Geometries
from m2pem.executive.fleet_connections import FleetArbiters
from m2pem.executive.runner import Runner
from m2pem.fleet.allocation import Availability
from m2pem.fleet.endurance import BatteryReading, too_low_for_rest, use_per_s
from m2pem.fleet.fleet import Vehicle
from m2pem.fleet.parameters import ParameterError, ResolvedValue, resolve
from m2pem.geo.local_frame import EastNorth, LocalFrame
from m2pem.geo.survey_tracks import SURVEY_SPACING_M
from m2pem.mission.behavior import Behavior as BehaviorOfTask
from m2pem.mission.behavior import BehaviorType, OnLoss
from m2pem.mission.catalogue import BehaviorSpec, ResourceId
from m2pem.mission.geometry import Area, Point, Route
from m2pem.mission.losses import BATTERY_LOW
from m2pem.units import US_PER_S

LOOK_EVERY_S = 2.0


@dataclass(slots=True)
class _Use:
    """The use of a battery by one behavior. `said`: that it is too low was said."""

    behavior: str
    begin: BatteryReading
    looked_s: float
    said: bool = False


class BatteryForecast:
    """Looks at the batteries of vehicles as their telemetry arrives. `fault`: takes what it finds;
    `runners`: the runs that are driven here."""

    def __init__(
        self,
        arbiters: FleetArbiters,
        availability: Availability,
        geometries: Geometries,
        runners: Mapping[RunId, Runner],
        fault: Callable[[ResourceFault], None],
    ) -> None:
        self._arbiters = arbiters
        self._availability = availability
        self._geometries = geometries
        self._runners = runners
        self._fault = fault
        self._frame = LocalFrame(arbiters.fleet.origin)
        self._homes: dict[ResourceId, EastNorth] = {}
        self._uses: dict[ResourceId, _Use] = {}

    def on_telemetry(self, state: object, now_us: int) -> None:
        """A vehicle published its state."""
        if not isinstance(state, VehicleState) or state.position is None:
            return
        vehicle = self._arbiters.fleet.vehicles.get(state.resource)
        if vehicle is None or vehicle.endurance_s is None or state.battery_fraction is None:
            return
        place = self._frame.to_local(state.position.latlon)
        home = self._homes.setdefault(vehicle.id, place)
        behavior = self._behavior(vehicle.id)
        if behavior is None:
            self._uses.pop(vehicle.id, None)
            return
        now = BatteryReading(now_us / US_PER_S, state.battery_fraction)
        use = self._uses.get(vehicle.id)
        if use is None or use.behavior != behavior.id:
            self._uses[vehicle.id] = _Use(behavior.id, now, now.at_s)
        elif not use.said and now.at_s - use.looked_s >= LOOK_EVERY_S:
            use.looked_s = now.at_s
            self._look(vehicle, vehicle.endurance_s, behavior, use, now, (place, home))

    def _behavior(self, vehicle: ResourceId) -> Behavior | None:
        """Return the behavior that a vehicle does, if another may do its rest."""
        holder = self._availability.holder(vehicle)
        runner = self._runners.get(holder.partition(".")[0]) if holder is not None else None
        if holder is None or runner is None or runner.run.state.status is not RunStatus.RUNNING:
            return None
        found = runner.run.state.behaviors.get(holder)
        if found is None or found.phase is not BehaviorPhase.ACTIVE:
            return None
        task = getattr(runner.run.state.tokens[found.token].node, "behavior", None)
        roles = task.roles if isinstance(task, BehaviorOfTask) else ()
        fills = [role for role in roles if vehicle in found.roles.get(role.name, ())]
        return found if any(role.on_loss is not OnLoss.FAIL for role in fills) else None

    def _look(
        self,
        vehicle: Vehicle,
        endurance_s: float,
        behavior: Behavior,
        use: _Use,
        now: BatteryReading,
        places: tuple[EastNorth, EastNorth],
    ) -> None:
        parameters = self._rest(behavior)
        if parameters is None:
            return
        speed = parameters.get("speed")
        speed_m_s = float(speed) if isinstance(speed, int | float) else vehicle.cruise_speed_m_s
        if not speed_m_s or speed_m_s <= 0:
            return
        place, home = places
        length_m, end = rest_of(parameters, self._frame, place)
        rate = use_per_s(endurance_s, use.begin, now)
        home_after_s = math.dist(end, home) / speed_m_s
        home_now_s = math.dist(place, home) / speed_m_s
        if too_low_for_rest(now.charge, rate, length_m / speed_m_s, home_after_s, home_now_s):
            use.said = True
            rest = "without an end" if math.isinf(length_m) else f"{length_m:.0f} m"
            reason = (
                f"battery at {now.charge:.0%}: not enough for what is left ({rest}) and the way "
                f"home ({math.dist(end, home):.0f} m)"
            )
            self._fault(ResourceFault(vehicle.id, BATTERY_LOW, reason))

    def _rest(self, behavior: Behavior) -> Mapping[str, ResolvedValue] | None:
        """Return the parameters of what is left, with SI numbers and geometries."""
        spec = self._spec(behavior)
        if spec is None:
            return None
        fleet, run = self._arbiters.fleet, behavior.id.partition(".")[0]
        raw = {**behavior.parameters, **(behavior.left or {})}
        try:
            return resolve(
                spec,
                raw,
                lambda name: self._geometries(run, name),
                fleet.vehicles,
                fleet.origin,
            )
        except ParameterError:
            return None

    def _spec(self, behavior: Behavior) -> BehaviorSpec | None:
        kind, first = BehaviorType(behavior.type), ResourceId(behavior.resources[0])
        return self._arbiters.graph.spec(first, behavior.name, kind)


def rest_of(
    parameters: Mapping[str, ResolvedValue], frame: LocalFrame, place: EastNorth
) -> tuple[float, EastNorth]:
    """Return how long what is left is in metres, from a place on, and where it ends.

    A route that is repeated has no end; a survey has its area, in tracks at its spacing. What has
    no length ends where the vehicle is.
    """
    for value in parameters.values():
        match value:
            case Route(waypoints=waypoints):
                way = [place, *(frame.to_local(each[:2]) for each in waypoints)]
                length_m = math.inf if parameters.get("loop") else _length_m(way)
                return length_m, way[-1]
            case Area(rings=rings):
                ring = [frame.to_local(corner[:2]) for corner in rings[0]]
                spacing = parameters.get("spacing")
                spacing_m = spacing if isinstance(spacing, int | float) else SURVEY_SPACING_M
                nearest = min(ring, key=lambda corner: math.dist(corner, place))
                return math.dist(place, nearest) + _area_m2(ring) / spacing_m, nearest
            case Point(position=position):
                end = frame.to_local(position[:2])
                return math.dist(place, end), end
            case _:
                pass
    return 0.0, place


def _length_m(way: Sequence[EastNorth]) -> float:
    return sum(math.dist(a, b) for a, b in pairwise(way))


def _area_m2(ring: Sequence[EastNorth]) -> float:
    twice = sum(a[0] * b[1] - b[0] * a[1] for a, b in pairwise(ring))
    return abs(twice) / 2.0
