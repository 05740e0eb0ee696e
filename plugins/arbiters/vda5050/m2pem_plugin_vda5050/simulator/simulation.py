"""The simulated vehicles of a fleet, each with a client of its own at its MQTT broker."""

import asyncio
import logging
import math
import time
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any, Self

import aiomqtt

from m2pem.api import Connection, Dimension, Fleet, SystemClock, quantity
from m2pem.api.faults import FaultSchedule, PlannedFault
from m2pem.api.latest_task import cancel_and_wait
from m2pem.api.simulator_settings import coordinates, fraction
from m2pem.errors import PluginError
from m2pem.units import UnitError
from m2pem_plugin_vda5050.broker import Broker
from m2pem_plugin_vda5050.catalogue import Scope
from m2pem_plugin_vda5050.map_frame import MapFrame
from m2pem_plugin_vda5050.messages import (
    QOS,
    RETAINED,
    TO_VEHICLE,
    ConnectionMessage,
    Headers,
    encode,
)
from m2pem_plugin_vda5050.settings import ARBITER, Settings, read_settings
from m2pem_plugin_vda5050.simulator.agv import ACTION_S, NODE_ACTIONS, Agv, AgvSpec
from m2pem_plugin_vda5050.simulator.factsheet import factsheet
from m2pem_plugin_vda5050.simulator.motion import Chassis

STEP_S = 0.05
"""In simulated seconds, at a speed of 1; a faster simulation makes longer steps, up to 0.2 s."""

LONGEST_STEP_S = 0.2
STATE_EVERY_S = 1.0
VISUALIZATION_EVERY_S = 0.5
APART_M = 5.0
NORTH_RAD = math.pi / 2

_SIM_KEYS = (
    *("home", "heading", "max_speed", "acceleration", "battery", "actions"),
    *("stops_at_nodes", "state_interval"),
)


def read_specs(fleet: Fleet) -> list[tuple[AgvSpec, Settings, float]]:
    """Return the simulated vehicles of a fleet (arbiter `vda5050`, `sitl: true`): each with its
    settings and how often it sends its state, in seconds.

    Raises:
        PluginError: a connection is wrong; the text names the resource and the key.
    """
    vehicles = [each for each in fleet.vehicles.values() if each.arbiter == ARBITER and each.sitl]
    read = read_settings({each.id: Connection.of(fleet, each.id) for each in vehicles})
    return [
        _spec(each.id, read[each.id], number, fleet.origin) for number, each in enumerate(vehicles)
    ]


def _spec(
    name: str, settings: Settings, number: int, origin: tuple[float, float, float]
) -> tuple[AgvSpec, Settings, float]:
    sim = dict(settings.sim)
    for key in sim:
        if key not in _SIM_KEYS:
            known = ", ".join(_SIM_KEYS)
            raise PluginError(f"{name}: connection.sim.{key}: there is no such setting: {known}")
    place = settings.map.origin or origin[:2]
    frame = MapFrame((*place, origin[2]), settings.map.rotation_rad)
    try:
        if "home" in sim:
            at = coordinates(sim["home"])[:2]
        else:
            at = MapFrame(origin, 0.0).to_position(number * APART_M, 0.0).latlon
        start = frame.to_map(at)
        heading = quantity(sim["heading"], Dimension.ANGLE) if "heading" in sim else 0.0
        usual = Chassis()
        chassis = Chassis(
            quantity(sim.get("max_speed", usual.speed_m_s), Dimension.SPEED),
            quantity(sim.get("acceleration", usual.acceleration_m_s2), Dimension.ACCELERATION),
        )
        interval_s = quantity(sim.get("state_interval", STATE_EVERY_S), Dimension.DURATION)
        battery = fraction(sim.get("battery", 1.0))
        actions = _actions(settings, sim.get("actions", {}))
    except (ValueError, TypeError, UnitError) as error:
        raise PluginError(f"{name}: connection.sim: {error}") from error
    spec = AgvSpec(
        name,
        settings.manufacturer,
        settings.serial_number,
        settings.version,
        settings.map.id,
        start.x,
        start.y,
        frame.to_theta(heading),
        chassis,
        battery,
        actions,
        sim.get("stops_at_nodes") is True,
    )
    return spec, settings, interval_s


def _actions(settings: Settings, durations: Mapping[str, Any]) -> dict[str, float]:
    if not isinstance(durations, Mapping):
        raise TypeError("actions: write how long they take, such as {pick: 5 s}")
    own = [each.action for each in settings.own_behaviors if each.scope is Scope.NODE]
    actions = dict.fromkeys((*NODE_ACTIONS, *own), ACTION_S)
    return actions | {
        str(key): quantity(value, Dimension.DURATION) for key, value in durations.items()
    }


class SimulatedVehicle:
    """A vehicle and its client at the broker."""

    def __init__(
        self,
        spec: AgvSpec,
        settings: Settings,
        state_every_s: float,
        clock: SystemClock,
        say: Callable[[str], object],
    ) -> None:
        self.agv = Agv(spec, say)
        self._settings, self._clock = settings, clock
        self._state_every_s = state_every_s
        self._headers = Headers(spec.manufacturer, spec.serial_number, spec.version)
        self.is_cut = self.is_mute = self._is_offline = False
        self._state_s = self._visualization_s = -math.inf
        prefix = settings.prefix
        will = aiomqtt.Will(
            f"{prefix}/connection", encode(self._connection("CONNECTIONBROKEN")), 1, True
        )
        self._broker = Broker(
            settings.broker,
            f"sim-{spec.serial_number}-{time.monotonic_ns() % 10**8}",
            [(f"{prefix}/{topic}", 0) for topic in TO_VEHICLE],
            self._received,
            self._connected,
            logging.getLogger("m2pem.sim.vda5050"),
            will,
        )

    def open(self) -> None:
        self._broker.open()

    async def connected(self) -> None:
        """Wait until the vehicle has been connected to its broker once."""
        await self._broker.first_connected.wait()

    async def close(self) -> None:
        """Disconnect gracefully, as the standard says (6.14)."""
        self._publish("connection", self._connection("OFFLINE"))
        await self._broker.close()

    def step(self, now_s: float, dt_s: float) -> None:
        """Advance, and send what is due."""
        self.agv.step(dt_s)
        if self.agv.wants_factsheet and self._broker.is_connected:
            self.agv.wants_factsheet = False
            self._publish("factsheet", factsheet(self.agv.spec, self._header("factsheet")))
        if self.agv.news or now_s - self._state_s >= self._state_every_s:
            self._state_s = now_s
            self._publish("state", self.agv.state(self._headers, self._clock.now_us()))
        if now_s - self._visualization_s >= VISUALIZATION_EVERY_S:
            self._visualization_s = now_s
            self._publish("visualization", self.agv.visualization())

    # --- faults ---------------------------------------------------------------------------------

    def turn(self, name: str, on: bool) -> None:
        """Set `is_cut` or `is_mute`, and say so in the next state."""
        setattr(self, name, on)
        self.agv.news = True

    def go_offline(self) -> None:
        self._publish("connection", self._connection("OFFLINE"))
        self._is_offline = True

    def come_online(self) -> None:
        self._is_offline = False
        self._publish("connection", self._connection("ONLINE"))
        self.agv.news = True

    # --- inside ---------------------------------------------------------------------------------

    def _received(self, topic: str, payload: bytes) -> None:
        if not (self.is_cut or self._is_offline):
            self.agv.receive(topic.rpartition("/")[2], payload)

    def _connected(self) -> None:
        self._publish("connection", self._connection("ONLINE"))
        self.agv.news = self.agv.wants_factsheet = True

    def _header(self, topic: str) -> dict[str, Any]:
        return self._headers.of(topic, self._clock.now_us())

    def _connection(self, state: str) -> ConnectionMessage:
        return ConnectionMessage(**self._header("connection"), connection_state=state)

    def _publish(self, topic: str, message: Any) -> None:
        if self.is_cut or self.is_mute or self._is_offline:
            return
        payload = message if isinstance(message, bytes) else encode(message)
        name = f"{self._settings.prefix}/{topic}"
        self._broker.publish(name, payload, QOS.get(topic, 0), topic in RETAINED)


class Simulation:
    """Simulated vehicles, as a context. `speed`: simulated seconds per second."""

    def __init__(
        self,
        specs: Iterable[tuple[AgvSpec, Settings, float]],
        speed: float = 1.0,
        faults: Iterable[PlannedFault[SimulatedVehicle]] = (),
        say: Callable[[str], object] = lambda _: None,
    ) -> None:
        clock = SystemClock(speed)
        self.vehicles = {
            spec.name: SimulatedVehicle(spec, settings, every_s, clock, say)
            for spec, settings, every_s in specs
        }
        self._speed = speed
        self._now_s = 0.0
        self._schedule = FaultSchedule()
        self._task: asyncio.Task[None] | None = None
        for fault in faults:
            self.plan(fault)

    def plan(self, fault: PlannedFault[SimulatedVehicle]) -> None:
        """Plan a fault; without a time, it begins now.

        Raises:
            FaultError: one of its vehicles is not known.
        """
        for name in fault.targets_among(self.vehicles.keys()):
            vehicle = self.vehicles[name]
            if fault.at_s is None:
                fault.start(vehicle, self._after)
            else:
                begin = partial(fault.start, vehicle, self._after)
                self._schedule.at(fault.at_s, begin)

    async def __aenter__(self) -> Self:
        for vehicle in self.vehicles.values():
            vehicle.open()
        self._task = asyncio.get_running_loop().create_task(self._run())
        return self

    async def __aexit__(self, *_: object) -> None:
        await cancel_and_wait(self._task)
        await asyncio.gather(*(vehicle.close() for vehicle in self.vehicles.values()))

    async def connected(self) -> None:
        """Wait until all vehicles are connected to their brokers."""
        await asyncio.gather(*(each.connected() for each in self.vehicles.values()))

    async def ended(self) -> None:
        """Wait until the simulation fails; raises what it fails with."""
        assert self._task is not None
        await asyncio.shield(self._task)

    def _after(self, seconds: float, call: Callable[[], object]) -> None:
        self._schedule.at(self._now_s + seconds, call)

    async def _run(self) -> None:
        step_s = min(LONGEST_STEP_S, STEP_S * max(1.0, self._speed))
        began_s = time.monotonic()
        while True:
            target_s = (time.monotonic() - began_s) * self._speed
            # A process that was suspended goes on from where it was.
            if target_s - self._now_s > 5.0 * max(1.0, self._speed):
                began_s += (target_s - self._now_s) / self._speed
                target_s = self._now_s
            while self._now_s + step_s <= target_s:
                self._now_s += step_s
                self._schedule.run_until(self._now_s)
                for vehicle in self.vehicles.values():
                    vehicle.step(self._now_s, step_s)
            await asyncio.sleep(step_s / self._speed)
