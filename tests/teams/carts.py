"""Carts: vehicles that move by their own plain kinematics, and an arbiter that speaks to them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from m2pem.api.arbiter import ArbiterContext, BehaviorId, BehaviorRequest, Connection, ResolvedValue
from m2pem.api.capabilities import ArbiterCapabilities
from m2pem.api.goals import GoalArbiter
from m2pem.api.telemetry import GeoPosition, VehicleState
from m2pem.fleet.behaviors import SHARED
from m2pem.geo.local_frame import LocalFrame
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorSpec, BehaviorState, ResourceId
from m2pem.mission.geometry import Point, Route, VehiclePosition

ORIGIN = (38.1075, -77.3192, 60.0)
FRAME = LocalFrame((ORIGIN[0], ORIGIN[1]))
STEP_S = 0.1
_NEAR_M = 1e-6


@dataclass(slots=True)
class Cart:
    """Drives along `ahead`, not faster than `wished_m_s`; `halted`: it brakes to a stand."""

    place: tuple[float, float]
    yaw_rad: float = 0.0
    speed_m_s: float = 0.0
    wished_m_s: float = 5.0
    max_m_s: float = 15.0
    gain_m_s2: float = 1.5
    brake_m_s2: float = 3.0
    halted: bool = False
    ahead: list[tuple[float, float]] = field(default_factory=list)

    @property
    def stands(self) -> bool:
        return self.speed_m_s < 1e-9

    def step(self, seconds: float = STEP_S) -> None:
        left_m = math.fsum(
            math.dist(a, b) for a, b in zip([self.place, *self.ahead], self.ahead, strict=False)
        )
        aim = 0.0 if self.halted else min(self.wished_m_s, self.max_m_s)
        aim = min(aim, math.sqrt(2 * self.brake_m_s2 * left_m), left_m / seconds)
        self.speed_m_s = min(self.speed_m_s + self.gain_m_s2 * seconds, aim) if (
            aim > self.speed_m_s
        ) else max(self.speed_m_s - self.brake_m_s2 * seconds, aim)  # fmt: skip
        way_m = self.speed_m_s * seconds
        while self.ahead and way_m > 0:
            leg_m = math.dist(self.place, self.ahead[0])
            if leg_m <= way_m + _NEAR_M:
                self.place = self.ahead.pop(0)
                way_m -= leg_m
                continue
            part = way_m / leg_m
            to = self.ahead[0]
            self.yaw_rad = math.atan2(to[1] - self.place[1], to[0] - self.place[0])
            self.place = (
                self.place[0] + (to[0] - self.place[0]) * part,
                self.place[1] + (to[1] - self.place[1]) * part,
            )
            way_m = 0.0
        if not self.ahead:
            self.speed_m_s = 0.0


@dataclass(slots=True)
class Driven:
    """A cart with the goal that it pursues, and how its last one ended."""

    cart: Cart
    goal: str = ""
    became: BehaviorState | None = None
    code: str = ""
    target: str = ""
    offset_m: float = 0.0
    bearing_rad: float = 0.0
    mute: bool = False
    battery: float | None = None
    refuses: str = ""
    ending: str = ""


class Yard:
    """The carts themselves: they outlive every arbiter and executive."""

    def __init__(self, **places: tuple[float, float]) -> None:
        self.driven = {name: Driven(Cart(place)) for name, place in places.items()}
        self.commands: list[tuple[str, str]] = []
        self.crowd: list[dict[str, tuple[float, float]]] = []

    def __getitem__(self, name: str) -> Cart:
        return self.driven[name].cart

    def count(self, what: str, name: str | None = None) -> int:
        return sum(1 for each in self.commands if each[0] == what and name in (None, each[1]))


class CartArbiter(GoalArbiter):
    """Commands carts of a yard; they can go and stop."""

    capabilities = ArbiterCapabilities(one_vehicle=True)
    names: ClassVar[tuple[str, ...]] = ("single_vehicle_routing", "goto", "follow", "drive_stop")
    behaviors: ClassVar[tuple[BehaviorSpec, ...]] = tuple(
        SHARED[name, BehaviorType.VEHICLE] for name in names
    )
    yard: Yard

    def __init__(
        self, connections: Mapping[ResourceId, Connection], context: ArbiterContext
    ) -> None:
        super().__init__(connections, context)
        self.made: dict[BehaviorId, BehaviorRequest] = {}

    async def listen(self, resource: ResourceId) -> None:
        driven = self.yard.driven[resource]
        while True:
            if not driven.mute:
                self._step(resource, driven)
                cart = driven.cart
                latitude, longitude = FRAME.to_latlon(cart.place)
                state = VehicleState(
                    resource,
                    self.context.clock.now_us(),
                    GeoPosition(latitude, longitude, ORIGIN[2]),
                    velocity_enu_m_s=(
                        cart.speed_m_s * math.cos(cart.yaw_rad),
                        cart.speed_m_s * math.sin(cart.yaw_rad),
                        0.0,
                    ),
                    yaw_rad=cart.yaw_rad,
                    battery_fraction=driven.battery,
                )
                self.receive(state, driven.goal, driven.became, driven.code)
            await self.context.clock.sleep(STEP_S)

    def refusal(self, request: BehaviorRequest) -> str:
        return self.yard.driven[request.resources[0]].refuses

    async def begin(self, request: BehaviorRequest, goal: str) -> None:
        self.made[request.id] = request
        name = request.resources[0]
        self.yard.commands.append((request.behavior, name))
        driven = self.yard.driven[name]
        driven.goal, driven.became, driven.code, driven.target = goal, None, "", ""
        driven.ending = ""
        cart = driven.cart
        cart.halted = False
        speed = request.parameters.get("speed")
        cart.wished_m_s = speed if isinstance(speed, float) else 5.0
        match request.parameters:
            case {"route": Route(waypoints=waypoints)}:
                cart.ahead = [FRAME.to_local(each[:2]) for each in waypoints]
            case {"target": Point(position=position)}:
                cart.ahead = [FRAME.to_local(position[:2])]
            case {"target": VehiclePosition(vehicle=vehicle)}:
                driven.target = vehicle
                driven.offset_m = float(request.parameters.get("offset") or 0.0)  # type: ignore[arg-type]
                driven.bearing_rad = float(request.parameters.get("bearing") or 0.0)  # type: ignore[arg-type]
            case _:
                cart.ahead = []

    async def end(self, resource: ResourceId, goal: str) -> None:
        self.yard.commands.append(("cancel", resource))
        driven = self.yard.driven[resource]
        if driven.goal == goal and driven.became is None:
            driven.ending, driven.cart.halted = goal, True

    async def hold(self, resource: ResourceId) -> None:
        self.yard.commands.append(("hold", resource))
        self.yard[resource].halted = True

    async def resume(self, resource: ResourceId) -> None:
        self.yard.commands.append(("resume", resource))
        self.yard[resource].halted = False

    def held(self, resource: ResourceId) -> bool:
        return self.yard[resource].halted

    def fail(self, name: str, code: str) -> None:
        """Have a cart stop and give up what it does."""
        driven = self.yard.driven[name]
        driven.became, driven.code, driven.cart.ahead = BehaviorState.FAILED, code, []

    def _step(self, resource: ResourceId, driven: Driven) -> None:
        cart = driven.cart
        if driven.target and driven.became is None:
            state = self.context.bus.latest(ResourceId(driven.target))
            if isinstance(state, VehicleState) and state.position and state.yaw_rad is not None:
                east, north = FRAME.to_local(
                    (state.position.latitude_deg, state.position.longitude_deg)
                )
                way = state.yaw_rad - driven.bearing_rad
                cart.ahead = [
                    (
                        east + driven.offset_m * math.cos(way),
                        north + driven.offset_m * math.sin(way),
                    )
                ]
        cart.step()
        if driven.goal and driven.became is None:
            if driven.ending == driven.goal:
                if cart.stands:
                    driven.became, cart.ahead, cart.halted = BehaviorState.CANCELLED, [], False
            elif not cart.ahead and not driven.target:
                driven.became = BehaviorState.SUCCEEDED


class WillingCartArbiter(CartArbiter):
    """Commands carts that take another speed on the way."""

    capabilities = ArbiterCapabilities(one_vehicle=True, adjusts=True)

    async def adjust(
        self, behavior: BehaviorId, epoch: int, parameters: Mapping[str, ResolvedValue]
    ) -> None:
        speed = parameters.get("speed")
        request = self.made.get(behavior)
        if request is None:
            known = self._ledger.last(behavior).native_ref
            name = next((n for n, d in self.yard.driven.items() if d.goal == known), None)
        else:
            name = request.resources[0]
        if name is not None and isinstance(speed, float):
            self.yard.commands.append(("adjust", name))
            self.yard[name].wished_m_s = speed
