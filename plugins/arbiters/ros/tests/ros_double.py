"""Vehicles without ROS: they execute orders in the time of the clock that is lent.

A `Dynamics` outlives the arbiter and its driver, as a vehicle outlives a restart. Its orders are
kept in `calls`.
"""

import asyncio
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from uuid import UUID

from m2pem_plugin_ros.arbiter import RosArbiter
from m2pem_plugin_ros.connections import ConnectionsSetup, VehicleConnection
from m2pem_plugin_ros.drivers.driver import Driver, DriverSetup, Health, Order, Outcome
from m2pem_plugin_ros.frames import to_geodetic, to_local
from m2pem_plugin_ros.pose import Pose, Twist

from m2pem.api import (
    ArbiterContext,
    Area,
    BehaviorRequest,
    BehaviorState,
    Connection,
    GeoPosition,
    Point,
    ResolvedValue,
    ResourceId,
    Route,
    VehicleState,
)
from m2pem.geo.fence import Fence

ORIGIN = (38.1075, -77.3192, 60.0)
STEP_S = 0.1


def at(east_m: float, north_m: float) -> Point:
    position = to_geodetic(east_m, north_m, 0.0, ORIGIN)
    return Point((position.latitude_deg, position.longitude_deg, None))


@dataclass
class Dynamics:
    """It drives straight to where it is to go, and can be made to misbehave."""

    east: float = 0.0
    north: float = 0.0
    speed: float = 0.0
    begun: int = 0
    held: bool = False
    linked: bool = True
    answers_looks: bool = True
    stops: bool = True
    goal: UUID | None = None
    target: tuple[float, float] = (0.0, 0.0)
    ahead: list[tuple[float, float]] = field(default_factory=list)
    wished: float = 5.0
    driven_us: int = 0
    outcomes: dict[UUID, Outcome] = field(default_factory=dict)
    calls: list[tuple[object, ...]] = field(default_factory=list)
    raises: set[str] = field(default_factory=set)
    refuses: str = ""
    shown: list[VehicleState] = field(default_factory=list)
    driver: "DoubleDriver | None" = None
    health: Health = field(default_factory=lambda: Health("autonomous", True))
    battery: float | None = None
    errors: tuple[str, ...] = ()

    def events(self, what: str, *arguments: object) -> None:
        self.calls.append((what, *arguments))
        if what in self.raises:
            raise RuntimeError(f"{what} is broken")

    def called(self, what: str) -> list[tuple[object, ...]]:
        return [call for call in self.calls if call[0] == what]

    def drive(self, now_us: int) -> None:
        """Let the time until now pass."""
        passed_s, self.driven_us = (now_us - self.driven_us) / 1e6, now_us
        self.speed = 0.0
        if self.goal is None or self.held:
            return
        east, north = self.target[0] - self.east, self.target[1] - self.north
        distance = math.hypot(east, north)
        step = min(distance, self.wished * passed_s)
        if distance - step < 0.01:
            self.east, self.north = self.target
            if self.ahead:
                self.target = self.ahead.pop(0)
                return
            self.finish(Outcome(BehaviorState.SUCCEEDED))
        else:
            self.speed = self.wished
            self.east += east / distance * step
            self.north += north / distance * step

    def finish(self, outcome: Outcome) -> None:
        if self.goal is not None:
            self.outcomes[self.goal] = outcome
        self.goal, self.held = None, False


class DoubleDriver:
    """Implements `Driver`."""

    def __init__(self, setup: DriverSetup, body: Dynamics) -> None:
        self.setup = setup
        self.body = body
        body.driver = self
        self.known: set[UUID] = set()
        self._task: asyncio.Task[None] | None = None

    async def open(self) -> None:
        self.body.events("open")
        self.body.driven_us = self.setup.context.clock.now_us()
        self._task = asyncio.get_running_loop().create_task(self._run())

    @property
    def health(self) -> Health:
        if "health" in self.body.raises:
            raise RuntimeError("health is broken")
        return self.body.health

    def refusal(self, request: BehaviorRequest) -> str:
        self.body.events("refusal")
        return self.body.refuses

    def begin(self, order: Order) -> None:
        self.body.events("begin", order)
        if order.goal in self.body.outcomes or order.goal == self.body.goal:
            return  # a vehicle does what it is given once
        target = order.request.parameters.get("target")
        if isinstance(target, Point):
            place = GeoPosition(target.position[0], target.position[1], ORIGIN[2])
            self.body.target, self.body.ahead = to_local(place, ORIGIN)[:2], []
        route = order.request.parameters.get("route")
        if isinstance(route, Route):
            places = [GeoPosition(*waypoint[:2], ORIGIN[2]) for waypoint in route.waypoints]
            self.body.target, *self.body.ahead = [to_local(each, ORIGIN)[:2] for each in places]
        self.body.wished = float(order.request.parameters.get("speed") or 5.0)
        self.body.goal, self.body.held = order.goal, False
        self.body.begun += 1
        self.known.add(order.goal)

    def end(self, goal: UUID) -> None:
        self.body.events("end", goal)
        self.known.add(goal)
        if self.body.goal == goal and self.body.stops:
            self.body.finish(Outcome(BehaviorState.CANCELLED))
        elif self.body.goal != goal:
            self.body.outcomes.setdefault(goal, Outcome(BehaviorState.CANCELLED))

    def adjust(self, goal: UUID, parameters: Mapping[str, ResolvedValue]) -> None:
        self.body.events("adjust", goal, dict(parameters))
        if goal == self.body.goal and isinstance(parameters.get("speed"), float):
            self.body.wished = float(parameters["speed"])

    def hold(self) -> None:
        self.body.events("hold")
        self.body.held = True

    def resume(self) -> None:
        self.body.events("resume")
        self.body.held = False

    async def query(self, order: Order) -> Outcome:
        self.body.events("look", order)
        if not self.body.answers_looks:
            await asyncio.Event().wait()
        if order.goal == self.body.goal:
            self.known.add(order.goal)
            return Outcome(BehaviorState.RUNNING, held=self.body.held)
        return self.body.outcomes.get(order.goal, Outcome(BehaviorState.UNKNOWN))

    def claim(self, run: UUID, epoch: int) -> None:
        self.body.events("claim", run, epoch)

    def abandon(self) -> None:
        self.body.events("forget")
        self.known.clear()

    async def close(self) -> None:
        self.body.events("close")
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    async def _run(self) -> None:
        clock, events = self.setup.context.clock, self.setup.events
        while True:
            self.body.drive(clock.now_us())
            if self.body.linked:
                events.alive()
                if self.body.goal in self.known:
                    events.progress(self.body.goal)
                for goal in self.known & set(self.body.outcomes):
                    events.ended(goal, self.body.outcomes[goal])
            await clock.sleep(STEP_S)


class DoubleSenses:
    """Implements `VehicleSensors` and, for the same body, `Localization`."""

    def __init__(self, body: Dynamics) -> None:
        self.body = body
        self.localization = self
        self.age_s = 0.0
        self.wrong_frame = ""
        self.problems = ()

    @property
    def pose(self) -> Pose:
        return Pose(self.body.east, self.body.north, 0.0)

    @property
    def twist(self) -> Twist:
        return Twist(self.body.speed)

    @property
    def position(self) -> GeoPosition:
        return to_geodetic(self.body.east, self.body.north, 0.0, ORIGIN)

    @property
    def battery_fraction(self) -> float | None:
        return self.body.battery

    @property
    def errors(self) -> tuple[str, ...]:
        return self.body.errors

    @property
    def changes(self) -> int:
        return len(self.body.calls)


class DoubleEndpoints:
    """Implements `Endpoints` of a vehicle that is there."""

    problem = absence = ""
    is_listed = True


class DoubleStation:
    """Implements `VehicleConnections`."""

    def __init__(
        self, bodies: Mapping[ResourceId, Dynamics], installation: ConnectionsSetup
    ) -> None:
        self.bodies = bodies
        self.installation = installation
        self.is_open = False

    async def open(self) -> dict[ResourceId, VehicleConnection]:
        self.is_open = True
        return {
            resource: VehicleConnection(
                None, DoubleSenses(body), DoubleEndpoints(), body.shown.append
            )
            for resource, body in self.bodies.items()
        }

    async def search(self, absent: Collection[ResourceId], within_s: float) -> None:
        pass

    def retry(self) -> None:
        pass

    async def close(self) -> None:
        self.is_open = False


def connections(
    bodies: Mapping[ResourceId, Dynamics],
    fence: Area | None = None,
    behaviors: tuple[str, ...] | None = None,
    carried: Sequence[ResourceId] = (),
    **settings: object,
) -> dict:
    """`carried`: payloads without a node of their own."""
    made = {}
    for resource in (*bodies, *carried):
        vehicle = resource.partition("/")[0]
        made[resource] = Connection(
            resource,
            "ground",
            {"namespace": f"/{vehicle}", **settings},
            fence=fence and Fence(fence),
            behaviors=behaviors,
        )
    return made


def arbiter(
    bodies: Mapping[ResourceId, Dynamics], context: ArbiterContext, **settings: object
) -> RosArbiter:
    def make_driver(setup: DriverSetup) -> Driver:
        return DoubleDriver(setup, bodies[setup.connection.resource])

    return RosArbiter(
        connections(bodies, **settings),
        context,
        make_driver,
        lambda installation: DoubleStation(bodies, installation),
    )
