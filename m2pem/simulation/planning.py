"""From a request to plans: which manoeuvre each resource does, or why it is refused."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from msgspec.structs import replace

from m2pem.api.arbiter import ArbiterContext, BehaviorRequest, Connection
from m2pem.api.behavior_parameters import refusal
from m2pem.api.remaining import RemainingWork
from m2pem.api.telemetry import GeoPosition, VehicleState
from m2pem.fleet.behaviors import FLOWN, SHARED, takeoff_first
from m2pem.geo.fence import Fence
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorSpec, ResourceId
from m2pem.simulation.course import RefusedError
from m2pem.simulation.executions import Aim, Body, Chase
from m2pem.simulation.fencing import breach_of
from m2pem.simulation.frame import FlatFrame
from m2pem.simulation.gimbals import GAZES, MAST_M, Shots
from m2pem.simulation.local_parameters import LocalParameters
from m2pem.simulation.manoeuvres import MANOEUVRES, Manoeuvre
from m2pem.simulation.payloads import SimPayload
from m2pem.simulation.pursuit import STEP_US, Pursuit
from m2pem.simulation.segments import Pose, along
from m2pem.simulation.trajectory import Plan
from m2pem.simulation.vehicles import SimVehicle, carrier_of
from m2pem.suggestions import suggest

_EVERYWHERE = (FLOWN - {"change_altitude"}) | {
    *("hold", "drive_stop", "return_to_launch", "teleop", "set_speed", "deploy")
}
_BY_DOMAIN: Mapping[str, frozenset[str]] = {
    "ground": _EVERYWHERE | {"reverse"},
    "air": _EVERYWHERE | {"takeoff", "land", "change_altitude"},
    "surface": _EVERYWHERE | {"reverse"},
    "subsurface": _EVERYWHERE | {"reverse", "change_altitude"},
}
_PICTURES = frozenset({"zoom", "take_picture", "record_video"})
_BY_KIND: Mapping[str, frozenset[str]] = {
    "camera": _PICTURES,
    "ptz": _PICTURES | {"ptz_point_at", "ptz_scan_polygon", "ptz_scan_sector", "ptz_track"},
    "gpr": frozenset(),
}


@cache
def vehicle_behaviors(domain: str) -> tuple[BehaviorSpec, ...]:
    """What a vehicle of the domain can do alone. Teams are made of that, as everywhere."""
    alone = _BY_DOMAIN.get(domain, _BY_DOMAIN["ground"])
    return tuple(
        dataclasses.replace(spec, keeps_speeds=name == "single_vehicle_routing")
        for (name, type_), spec in SHARED.items()
        if type_ is BehaviorType.VEHICLE and name in alone
    )


@cache
def payload_behaviors(kind: str) -> tuple[BehaviorSpec, ...]:
    """What a payload can do; of no kind: all that payloads can."""
    names = _BY_KIND.get(kind)
    return tuple(
        spec
        for (name, type_), spec in SHARED.items()
        if type_ is BehaviorType.PAYLOAD and (names is None or name in names)
    )


@dataclass(frozen=True, slots=True)
class Assignment:
    """What one body does: a plan (None: nothing, it is only kept busy), then a chase."""

    body: Body
    plan: Plan[Any] | None = None
    chase: Chase | None = None
    limit_s: float | None = None
    cruise_m_s: float | None = None
    shots: Shots | None = None
    work: RemainingWork | None = None

    def time_scaled(self, factor: float) -> "Assignment":
        return dataclasses.replace(
            self,
            plan=self.plan and self.plan.time_scaled(factor),
            limit_s=self.limit_s and self.limit_s * factor,
            shots=self.shots and self.shots.time_scaled(factor),
        )


@dataclass(eq=False)
class Planner:
    """Knows the bodies and where everybody is."""

    _connections: Mapping[ResourceId, Connection]
    _context: ArbiterContext
    _frame: FlatFrame
    _bodies: Mapping[ResourceId, Body]

    def pose_of(self, vehicle: str, now_us: int) -> Pose | None:
        """Return the pose of a vehicle: of a simulated one, or by its telemetry on the bus."""
        body = self._bodies.get(ResourceId(vehicle))
        if isinstance(body, SimVehicle):
            return body.pose(now_us)
        state = self._context.bus.latest(ResourceId(vehicle))
        if not isinstance(state, VehicleState) or state.position is None:
            return None
        try:
            level = self._frame.to_place(
                (state.position.latitude_deg, state.position.longitude_deg)
            )
        except ValueError:
            return None
        up = state.position.altitude_m - self._frame.origin[2]
        velocity = state.velocity_enu_m_s or (0.0, 0.0, 0.0)
        return Pose((*level, up), state.yaw_rad or 0.0, velocity)

    def payload_position(self, payload: ResourceId, now_us: int) -> GeoPosition | None:
        """Where a payload is; None: where its vehicle is, is not known."""
        pose = self.pose_of(carrier_of(payload), now_us)
        if pose is None:
            return None
        east, north, up = pose.place
        return self._frame.to_position((east, north, up + MAST_M))

    def assign(self, request: BehaviorRequest, now_us: int) -> list[Assignment]:
        """What each of the request's resources does.

        Raises:
            RefusedError: it cannot be done; the text names what is wrong.
        """
        bodies = [self._body(resource) for resource in request.resources]
        if not bodies:
            raise RefusedError(f"{request.behavior} has no resource")
        vehicles = [body for body in bodies if isinstance(body, SimVehicle)]
        payloads = [body for body in bodies if isinstance(body, SimPayload)]
        type_ = _type(request.behavior)
        acting: Sequence[Body] = payloads if type_ is BehaviorType.PAYLOAD else vehicles
        for body in acting or bodies:
            problem = refusal(self._spec(body, request.behavior, type_), request.parameters)
            if problem:
                raise RefusedError(problem)
        parameters = LocalParameters(
            request.parameters,
            self._frame,
            lambda vehicle: self.pose_of(vehicle, now_us),
            self._fence(bodies[0].id),
        )
        idle = [Assignment(body) for body in bodies if body not in acting]
        if type_ is BehaviorType.PAYLOAD:
            return [self._gaze(body, request, parameters, now_us) for body in payloads] + idle
        crafts = [vehicle.craft(now_us) for vehicle in vehicles]
        for craft, vehicle in zip(crafts, vehicles, strict=True):
            if vehicle.battery_at(now_us) <= 0:
                raise RefusedError(f"the battery of {craft.name} is empty", "BATTERY_LOW")
            if request.behavior in FLOWN and craft.flies and not craft.aloft:
                raise RefusedError(takeoff_first(craft.name))
        manoeuvre: Callable[..., Manoeuvre] = MANOEUVRES[request.behavior]
        made = [manoeuvre(craft, parameters) for craft in crafts]
        for craft, each in zip(crafts, made, strict=True):
            if breach := breach_of(request.behavior, parameters, craft, each):
                raise RefusedError(str(breach))
            fence = parameters.fence
            if request.behavior == "return_to_launch" and fence is not None:
                here, home = map(fence.frame.to_latlon, (craft.pose.place[:2], craft.home[:2]))
                if reason := fence.way_home(here, home)[1]:
                    self._context.logger.warning("%s returns: %s", craft.name, reason)
        return [_assignment(*each) for each in zip(vehicles, made, strict=True)] + idle

    def strays(self, body: Body, chase: Chase, now_us: int) -> str:
        """Return where a vehicle that stays with another one would leave the fence before it looks
        again, or when it stops then; "" if it does not."""
        fence = self._fence(body.id)
        if fence is None or not isinstance(chase, Pursuit) or not isinstance(body, SimVehicle):
            return ""
        here, halfway, then = (body.pose(now_us + part * STEP_US // 2) for part in range(3))
        place, target = self._frame.to_latlon(here.place[:2]), self.pose_of(chase.target, now_us)
        way = [] if target is None else [self._frame.to_latlon(chase.station(target)[:2])]
        stops_s = then.speed / (2 * body.kinematics.deceleration_m_s2)
        track = [here] if fence.outside_m(place) else [here, halfway, then]
        stop = along(then.place, then.velocity, stops_s)
        found = fence.find_breach(way, place, lambda _: "its station at the target")
        return str(found or fence.leaves([*(each.place[:2] for each in track), stop[:2]]) or "")

    def _fence(self, resource: ResourceId) -> Fence | None:
        fence = self._connections[resource].fence
        return None if fence is None else fence.in_frame(self._frame)

    def catalogue(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        body = self._body(resource)
        if isinstance(body, SimVehicle):
            return vehicle_behaviors(body.domain)
        return payload_behaviors(body.settings.kind)

    def _body(self, resource: ResourceId) -> Body:
        try:
            return self._bodies[resource]
        except KeyError:
            hint = suggest(resource, self._bodies, "resources")
            raise RefusedError(f"there is no simulated {resource}; {hint}") from None

    def _spec(self, body: Body, behavior: str, type_: BehaviorType | None) -> BehaviorSpec:
        allowed = self._connections[body.id].behaviors
        catalogue = self.catalogue(body.id)
        for spec in catalogue:
            if (spec.name, spec.type) == (behavior, type_):
                if allowed is None or behavior in allowed:
                    return spec
                raise RefusedError(f"the fleet does not allow {body.id} the behavior '{behavior}'")
        hint = suggest(behavior, [spec.name for spec in catalogue], "behaviors")
        raise RefusedError(f"{body.id} has no behavior '{behavior}'; {hint}")

    def _gaze(
        self, body: SimPayload, request: BehaviorRequest, parameters: LocalParameters, now_us: int
    ) -> Assignment:
        carrier = self._bodies.get(body.carrier)
        pose = self.pose_of(body.carrier, now_us)
        ground = carrier.home[2] if isinstance(carrier, SimVehicle) else 0.0
        gaze = GAZES[request.behavior](body.mount(now_us, pose, ground), parameters)
        chase = None
        if isinstance(gaze.aim, str):
            chase = Aim(gaze.aim)
        elif gaze.aim is not None:
            chase = Aim("", gaze.aim)
        shots = None if gaze.shots is None else replace(gaze.shots, began_us=now_us)
        return Assignment(body, gaze.plan, chase, gaze.limit_s, shots=shots)


def _type(behavior: str) -> BehaviorType | None:
    """Whether a behavior is a vehicle's or a payload's; None: it is in no catalogue."""
    if behavior in GAZES:
        return BehaviorType.PAYLOAD
    return BehaviorType.VEHICLE if behavior in MANOEUVRES else None


def _assignment(vehicle: SimVehicle, manoeuvre: Manoeuvre) -> Assignment:
    return Assignment(
        vehicle,
        manoeuvre.plan,
        manoeuvre.pursuit,
        cruise_m_s=manoeuvre.cruise_m_s,
        work=manoeuvre.work,
    )
