"""The members' poses and capabilities, and the plan of a team behavior from them."""

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import partial

from m2pem.api.arbiter import Arbiter, BehaviorRequest, sights
from m2pem.api.behavior_parameters import BehaviorParameters
from m2pem.api.bus import FleetBus
from m2pem.api.clock import Clock
from m2pem.api.telemetry import VehicleState
from m2pem.fleet.endurance import lasts_s
from m2pem.fleet.fence import fence_of
from m2pem.fleet.fleet import Fleet
from m2pem.geo.local_frame import LatLon, LocalFrame
from m2pem.mission.catalogue import ResourceId
from m2pem.teams.areas import escort, observe, survey
from m2pem.teams.capabilities import Capabilities
from m2pem.teams.columns import march, one_by_one
from m2pem.teams.plan import Leg, MemberPose, Plan, PlanningContext, TeamRefusedError

PLANS: Mapping[str, Callable[[PlanningContext], Plan]] = {
    "formation": partial(march, default_shape="wedge"),
    "road_following_formation": partial(march, default_shape="column"),
    "road_sweep": partial(march, default_shape="line"),
    "bridge_crossing": one_by_one,
    "area_survey": survey,
    "area_observe": observe,
    "escort": escort,
}
"""Planners by the behavior's name. Each raises TeamRefusedError if no plan is possible."""


def alike(request: BehaviorRequest) -> Plan:
    """Return the plan of a vehicle behavior with several vehicles: each carries it out."""
    return Plan(
        tuple(Leg(each, request.behavior, request.parameters) for each in request.resources)
    )


SEEN_WITHIN_S = 1.5
LOOK_EVERY_S = 0.1
STANDS_M_S = 0.3
"""A vehicle that is slower than this has no direction of motion."""


@dataclass(frozen=True, slots=True)
class TeamPlan:
    """A plan, and the local frame of its places."""

    plan: Plan
    frame: LocalFrame


class TeamSituation:
    """Reads poses from the fleet's bus, and from arbiters that need not wait for telemetry."""

    def __init__(
        self,
        fleet: Fleet,
        capabilities: Capabilities,
        bus: FleetBus,
        arbiter_of: Callable[[ResourceId], Arbiter],
    ) -> None:
        self._fleet = fleet
        self._capabilities = capabilities
        self._bus = bus
        arbiters = ((vehicle, arbiter_of(vehicle)) for vehicle in fleet.vehicles)
        self._sighted = {vehicle: arbiter for vehicle, arbiter in arbiters if sights(arbiter)}

    def scheme(
        self,
        request: BehaviorRequest,
        *,
        begun: bool,
        split: tuple[float, ...] = (),
        lost: Collection[ResourceId] = (),
    ) -> TeamPlan:
        """Plan a request. `split`: the members' shares from before a restart, if there are any.
        `lost`: members that were lost before it: nothing of their parts begins any more.

        Raises:
            TeamRefusedError: no plan is possible; the text says why.
        """
        if not request.resources:
            raise TeamRefusedError(f"{request.behavior} has no members")
        if request.behavior not in PLANS:
            return TeamPlan(alike(request), LocalFrame((0.0, 0.0)))
        known = {each: state for each in request.resources if (state := self._state(each))}
        unknown = [each for each in request.resources if each not in known]
        if missing := [each for each in unknown if not known or each not in lost]:
            raise TeamRefusedError(f"the position of {missing[0]} is not known")
        first = next(iter(known.values()))
        states = {each: known.get(each, first) for each in request.resources}
        frame = LocalFrame(position_of(first))
        parameters = BehaviorParameters(request.parameters)
        seen = None
        if parameters.target_vehicle is not None:
            target = self._state(ResourceId(parameters.target_vehicle))
            seen = None if target is None else pose_of(frame, target)
        vehicles = {each: self._fleet.vehicles[each] for each in request.resources}
        context = PlanningContext(
            request.resources,
            {each: vehicle.domain.value for each, vehicle in vehicles.items()},
            {each: self._capabilities.alone(each) for each in request.resources},
            parameters,
            frame,
            {each: pose_of(frame, state) for each, state in states.items()},
            seen,
            begun,
            {each: v.cruise_speed_m_s for each, v in vehicles.items() if v.cruise_speed_m_s},
            {
                each: lasts_s(vehicle.endurance_s, states[each].battery_fraction)
                for each, vehicle in vehicles.items()
                if vehicle.endurance_s
            },
            split,
            {each: fence_of(self._fleet, vehicle.domain) for each, vehicle in vehicles.items()},
        )
        return TeamPlan(PLANS[request.behavior](context), frame)

    async def until_seen(self, request: BehaviorRequest, clock: Clock) -> None:
        """Wait at most `SEEN_WITHIN_S` for the first positions of the members."""
        vehicles = request.resources if request.behavior in PLANS else ()
        waited_s = 0.0
        while waited_s < SEEN_WITHIN_S and not all(self._state(each) for each in vehicles):
            await clock.sleep(LOOK_EVERY_S)
            waited_s += LOOK_EVERY_S

    def present(self, member: ResourceId, frame: LocalFrame) -> MemberPose | None:
        """Return the present pose of a member; None: nothing is received of it."""
        state = self._state(member, on_bus=member not in self._sighted)
        return None if state is None else pose_of(frame, state)

    def _state(self, vehicle: ResourceId, *, on_bus: bool = True) -> VehicleState | None:
        """Return the last state with a position. `on_bus`: telemetry counts without a sight."""
        sighted = self._sighted.get(vehicle)
        state = None if sighted is None else sighted.sight(vehicle)
        latest = self._bus.latest(vehicle) if on_bus and state is None else state
        if not isinstance(latest, VehicleState) or latest.position is None:
            return None
        return latest


def position_of(state: VehicleState) -> LatLon:
    """Return a vehicle's latitude and longitude, which must be known."""
    if state.position is None:
        raise ValueError(f"the position of {state.resource} is not known")
    return state.position.latlon


def pose_of(frame: LocalFrame, state: VehicleState) -> MemberPose:
    """Return a vehicle's pose in the local frame; its position must be known."""
    place = frame.to_local(position_of(state))
    east, north, _ = state.velocity_enu_m_s or (0.0, 0.0, 0.0)
    speed_m_s = math.hypot(east, north)
    course_rad = math.atan2(north, east) if speed_m_s > STANDS_M_S else None
    return MemberPose(place, state.yaw_rad, speed_m_s, course_rad)
