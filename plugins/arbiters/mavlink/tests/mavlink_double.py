"""Vehicles without a network: they move as they are told, in the time of the clock they are lent.

What they are told is kept in `calls`, so that a test sees what was sent. A `Body` outlives the
arbiter, as a vehicle outlives a restart.
"""

import asyncio
import logging
import math

from m2pem_plugin_mavlink.behaviors.behavior import BehaviorContext
from m2pem_plugin_mavlink.protocol.messages import Address
from m2pem_plugin_mavlink.protocol.transaction import NoAnswerError, RefusedError
from m2pem_plugin_mavlink.vehicle.driver import FlightMode, Readiness, TargetPosition
from m2pem_plugin_mavlink.vehicle.failsafe import FailsafeFinding
from m2pem_plugin_mavlink.vehicle.identity import Firmware, Identity, Kind
from m2pem_plugin_mavlink.vehicle.state import AutopilotState, CommandedState
from m2pem_plugin_mavlink.vehicle.takeover_monitor import TakeoverMonitor
from m2pem_plugin_mavlink.vehicle.vehicle import ConditionWaiters
from mavlink_body import HOME, SPEED_M_S, Body

from m2pem.api import (
    ArbiterContext,
    Connection,
    GeoPosition,
    LinkState,
    LocalFrame,
    ResourceId,
    VehicleState,
)

HOME_ALTITUDE_M = 488.0
STEP_S = 0.1
TELLS_S = 0.05

MODES = list(FlightMode)


class DoubleDriver:
    """Tells a body what to do; each call takes a moment, or never ends if it is `stuck`."""

    home_items = 0

    def __init__(self, vehicle: "DoubleVehicle") -> None:
        self.vehicle = vehicle
        self.body = vehicle.body
        self.name = str(self.body.firmware)

    def mode_name(self, custom_mode: int) -> str:
        return MODES[custom_mode].upper()

    def flight_mode(self, custom_mode: int) -> FlightMode:
        return MODES[custom_mode]

    def readiness(self) -> Readiness:
        return Readiness(True)

    async def _tell(self, name: str, *args: object) -> None:
        self.body.calls.append((name, *args))
        if name in self.body.stuck:
            await asyncio.Event().wait()
        await self.vehicle.sleep(TELLS_S)
        if not self.body.heard_by_us:
            await self.vehicle.sleep(5.0)
            raise NoAnswerError("no answer")
        if name in self.body.refuses:
            raise RefusedError(self.body.refuses[name], 4)

    def _enter(self, mode: FlightMode) -> None:
        self.body.mode = mode
        self.vehicle.commanded.custom_mode = MODES.index(mode)
        self.vehicle.hear()

    async def set_mode(self, mode: FlightMode) -> None:
        await self._tell("set_mode", mode)
        self._enter(mode)

    async def arm(self) -> None:
        await self._tell("arm")
        self.body.armed = True
        self.vehicle.hear()

    async def disarm(self) -> None:
        await self._tell("disarm")
        self.vehicle.commanded.disarming = True
        self.body.armed = False

    async def take_off(self, altitude_m: float) -> None:
        await self._tell("take_off", altitude_m)
        self.body.armed, self.body.begun = True, self.body.begun + 1
        self.body.target = (self.body.east, self.body.north, altitude_m)
        self._enter(FlightMode.GUIDED)

    async def go_to(self, place: TargetPosition, speed_m_s: float | None = None) -> None:
        await self._tell("go_to", place, speed_m_s)
        self.body.armed = True
        level = LocalFrame(HOME).to_local((place.latitude_deg, place.longitude_deg))
        up = self.body.up if place.altitude_m is None else place.altitude_m
        if place.altitude_frame == "amsl" and place.altitude_m is not None:
            up -= HOME_ALTITUDE_M
        self.body.target, self.body.begun = (*level, up), self.body.begun + 1
        self.body.speed = speed_m_s or SPEED_M_S
        if place.heading_rad is not None:
            self.body.yaw = math.pi / 2 - place.heading_rad
        holds = self.body.firmware is Firmware.PX4
        self._enter(FlightMode.HOLD if holds else FlightMode.GUIDED)
        if holds:
            self.body.mode = FlightMode.GUIDED  # it moves; what is heard says HOLD

    async def orbit(self, center: TargetPosition, radius_m: float, speed_m_s: float | None) -> bool:
        if not self.body.circles:
            return False
        await self._tell("orbit", center, radius_m, speed_m_s)
        level = LocalFrame(HOME).to_local((center.latitude_deg, center.longitude_deg))
        self.body.center = (*level, center.altitude_m, radius_m)
        self._enter(FlightMode.ORBIT)
        return True

    async def set_speed(self, speed_m_s: float) -> None:
        await self._tell("set_speed", speed_m_s)
        self.body.speed = speed_m_s

    async def command(self, command: int, *params: float) -> None:
        await self._tell("command", command, *params)

    async def upload(self, items) -> None:
        await self._tell("upload", len(items))
        self.body.mission = self.vehicle.commanded.mission = tuple(items)
        self.body.reached = None

    async def downloaded(self):
        await self._tell("downloaded")
        return self.body.mission

    async def rally_points(self):
        return self.body.rally

    async def start_mission(self, first: int = 0) -> None:
        await self._tell("start_mission", first)
        self.body.armed, self.body.begun = True, self.body.begun + 1
        self.body.current, self.body.reached = first, None
        self._enter(FlightMode.MISSION)

    @property
    def current_item(self) -> int | None:
        return self.body.current

    @property
    def reached_item(self) -> int | None:
        return self.body.reached

    async def stop(self) -> None:
        await self._tell("stop")
        if self.body.armed:
            self._enter(FlightMode.HOLD)

    async def return_home(self) -> None:
        await self._tell("return_home")
        self.body.armed, self.body.begun = True, self.body.begun + 1
        self._enter(FlightMode.RETURN)

    async def land(self) -> None:
        await self._tell("land")
        self.body.begun += 1
        self._enter(FlightMode.LAND)


class DoubleLink:
    address = Address(1, 1)

    def __init__(self, clock) -> None:
        self._clock = clock

    def now_s(self) -> float:
        return self._clock.now_us() / 1e6

    def listen(self, ids, listener):
        return lambda: None

    async def perform(self, exchange):
        """It answers no question."""
        raise NoAnswerError(f"{exchange.name}: no answer")


class DoubleVehicle:
    """A body as it is heard ten times a second."""

    def __init__(self, resource: ResourceId, body: Body, clock) -> None:
        self.resource, self.body, self.domain = resource, body, body.domain
        kind = Kind.COPTER if body.domain == "air" else Kind.ROVER
        self._is = Identity(body.firmware, kind)
        self.link = DoubleLink(clock)
        self.state, self.commanded = AutopilotState(), CommandedState()
        self.driver = DoubleDriver(self)
        self._clock = clock
        self._waiters = ConditionWaiters(clock)
        self._watchers = []
        if body.heard_by_us:
            self.hear()

    def warn(self, text: str) -> None:
        logging.getLogger("m2pem.testing").warning("%s %s", self.resource, text)

    def hear(self) -> None:
        body, state = self.body, self.state
        if not body.heard_by_us:
            return
        latitude, longitude = LocalFrame(HOME).to_latlon((body.east, body.north))
        state.position = GeoPosition(latitude, longitude, HOME_ALTITUDE_M + body.up)
        state.home = GeoPosition(*HOME, HOME_ALTITUDE_M)
        state.altitude_above_home_m = state.altitude_above_terrain_m = body.up
        state.velocity_enu_m_s, state.yaw_rad = body.velocity, body.yaw
        mode = body.mode
        if body.firmware is Firmware.PX4 and mode is FlightMode.GUIDED:
            mode = FlightMode.HOLD
        state.mode, state.custom_mode = mode, MODES.index(mode)
        state.armed, state.landed = body.armed, body.landed
        state.boots, state.clock_s = body.boots, self.link.now_s()
        state.at_s = state.heartbeat_s = self.link.now_s()
        state.changes += 1
        self._waiters.check()
        for watcher in tuple(self._watchers):
            watcher()

    @property
    def identity(self) -> Identity | None:
        return None if self.state.at_s is None else self._is

    @property
    def silent_s(self) -> float | None:
        return None if self.state.at_s is None else self.link.now_s() - self.state.at_s

    @property
    def is_received(self) -> bool:
        return self.silent_s is not None and self.silent_s < 3.0

    @property
    def link_state(self) -> LinkState:
        return LinkState.CONNECTED if self.body.heard_by_us else LinkState.LOST

    def refused_frames(self) -> str:
        return ""

    def warn_of_refused_frames(self) -> bool:
        return False

    def telemetry(self) -> VehicleState:
        state = self.state
        return VehicleState(
            self.resource,
            self._clock.now_us(),
            state.position,
            state.altitude_above_home_m,
            state.velocity_enu_m_s,
            yaw_rad=state.yaw_rad,
            mode=state.mode.upper(),
            armed=state.armed,
            link=self.link_state,
        )

    def watch(self, watcher):
        self._watchers.append(watcher)
        return lambda: self._watchers.remove(watcher)

    async def identified(self, within_s: float) -> bool:
        return await self.until(lambda: self.state.at_s is not None, within_s)

    async def until(self, true, within_s: float | None = None) -> bool:
        return await self._waiters.wait(true, within_s)

    async def sleep(self, seconds: float) -> None:
        await self._clock.sleep(seconds)

    def recent_texts(self, within_s: float = 5.0) -> tuple[str, ...]:
        now_s = self.link.now_s()
        return tuple(text for at_s, text in self.body.texts if now_s - at_s <= within_s)


class DoubleFailsafes:
    """The failsafes of a body: its `findings`, which a test changes."""

    def __init__(self, vehicle: DoubleVehicle) -> None:
        self._vehicle, self._found = vehicle, ()

    async def findings(self):
        await self._vehicle.sleep(1.0)
        vehicle, self._found = self._vehicle, tuple(self._vehicle.body.findings)
        return [FailsafeFinding(vehicle.resource, "", text) for text in self._found]

    async def wait_for_change(self):
        await self._vehicle.until(lambda: tuple(self._vehicle.body.findings) != self._found)


class DoubleStation:
    """The station of an arbiter, over bodies that stay when it is closed."""

    def __init__(self, bodies: dict[ResourceId, Body], context: ArbiterContext) -> None:
        self.bodies, self._clock = bodies, context.clock
        self.vehicles: dict[ResourceId, DoubleVehicle] = {}
        self._task: asyncio.Task | None = None

    async def open(self):
        self.vehicles = {
            resource: DoubleVehicle(resource, body, self._clock)
            for resource, body in self.bodies.items()
        }
        self._task = asyncio.create_task(self._move())
        return self.vehicles

    def watch(self, vehicle):
        return TakeoverMonitor(vehicle)

    def failsafes(self, vehicle):
        return DoubleFailsafes(vehicle)

    async def _move(self) -> None:
        while True:
            await self._clock.sleep(STEP_S)
            for vehicle in self.vehicles.values():
                vehicle.body.step(STEP_S)
                vehicle.hear()

    async def close(self) -> None:
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)


class NoBus:
    def __init__(self) -> None:
        self.states = {}

    def latest(self, resource):
        return self.states.get(resource)

    def publish(self, state) -> None:
        self.states[state.resource] = state


def connections(bodies: dict[ResourceId, Body], **more) -> dict[ResourceId, Connection]:
    return {
        resource: Connection(
            resource,
            body.domain,
            {"url": "udpin://127.0.0.1:14550", "system_id": number},
            **more,
        )
        for number, (resource, body) in enumerate(bodies.items(), 1)
    }


def job(vehicle: DoubleVehicle, bus=None, **parameters) -> BehaviorContext:
    return BehaviorContext(vehicle, parameters, bus or NoBus(), (*HOME, 488.0), vehicle.link.now_s)


def at(east: float, north: float) -> tuple[float, float]:
    """A place so far from home, in metres."""
    return LocalFrame(HOME).to_latlon((east, north))


LOGGER = logging.getLogger("test")
