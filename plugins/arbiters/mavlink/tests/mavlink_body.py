"""A vehicle that moves as it is told, a step at a time."""

import math
from dataclasses import dataclass, field

from m2pem_plugin_mavlink.behaviors.mission import is_navigation
from m2pem_plugin_mavlink.vehicle.driver import FlightMode
from m2pem_plugin_mavlink.vehicle.identity import Firmware

from m2pem.api import LocalFrame

HOME = (47.397742, 8.545594)
SPEED_M_S = 5.0


@dataclass
class Body:
    """A vehicle: where it is and what it was told, east and north of home, up from its ground."""

    domain: str = "air"
    east: float = 0.0
    north: float = 0.0
    up: float = 0.0
    yaw: float = 0.0
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    mode: FlightMode = FlightMode.HOLD
    armed: bool = False
    target: tuple[float, float, float] | None = None
    center: tuple[float, float, float, float] | None = None
    speed: float = SPEED_M_S
    mission: tuple = ()
    current: int | None = None
    reached: int | None = None
    heard_by_us: bool = True
    begun: int = 0
    calls: list = field(default_factory=list)
    texts: list = field(default_factory=list)
    stuck: set = field(default_factory=set)
    refuses: dict = field(default_factory=dict)
    circles: bool = False
    findings: list = field(default_factory=list)
    rally: list = field(default_factory=list)
    boots: int = 1
    firmware: Firmware = Firmware.ARDUPILOT

    @property
    def landed(self) -> bool:
        return self.domain != "air" or self.up < 0.1

    def fly(self, up: float = 20.0) -> "Body":
        """Have it hover already."""
        self.up, self.armed, self.mode = up, True, FlightMode.GUIDED
        return self

    def drive(self) -> "Body":
        self.armed, self.mode = True, FlightMode.GUIDED
        return self

    # --- motion ---------------------------------------------------------------------------------

    def step(self, dt: float) -> None:
        before = (self.east, self.north, self.up)
        if self.armed:
            self._move(dt)
        now = (self.east, self.north, self.up)
        self.velocity = tuple((b - a) / dt for a, b in zip(before, now, strict=True))

    def _move(self, dt: float) -> None:
        match self.mode:
            case FlightMode.GUIDED if self.target:
                self._towards(self.target, dt)
            case FlightMode.MISSION:
                self._follow_mission(dt)
            case FlightMode.ORBIT if self.center:
                self._circle(dt)
            case FlightMode.RETURN:
                if self._towards((0.0, 0.0, self.up), dt) and self.domain == "air":
                    self._sink(dt)
            case FlightMode.LAND:
                self._sink(dt)

    def _sink(self, dt: float) -> None:
        self.up = max(0.0, self.up - min(2.0, self.speed) * dt)
        if self.up == 0.0:
            self.armed = False

    def _towards(self, place: tuple[float, float, float], dt: float) -> bool:
        place = place if self.domain == "air" else (place[0], place[1], 0.0)
        here = (self.east, self.north, self.up)
        away = math.dist(here, place)
        if math.dist(here[:2], place[:2]) > 0.01 and self.domain != "air":
            self.yaw = math.atan2(place[1] - here[1], place[0] - here[0])
        part = min(1.0, self.speed * dt / away) if away else 1.0
        self.east, self.north, self.up = (
            a + (b - a) * part for a, b in zip(here, place, strict=True)
        )
        return part == 1.0

    def _circle(self, dt: float) -> None:
        east, north, up, radius = self.center
        angle = math.atan2(self.north - north, self.east - east)
        if abs(math.dist((self.east, self.north), (east, north)) - radius) > 0.5:
            self._towards(
                (east + radius * math.cos(angle), north + radius * math.sin(angle), up), dt
            )
            return
        angle -= self.speed * dt / radius
        self.east, self.north = east + radius * math.cos(angle), north + radius * math.sin(angle)

    def _follow_mission(self, dt: float) -> None:
        while self.current is not None and self.current < len(self.mission):
            item = self.mission[self.current]
            if is_navigation(item):
                level = LocalFrame(HOME).to_local((item.latitude_deg, item.longitude_deg))
                if self._towards((*level, item.altitude_m), dt):
                    self.reached = self.current
                    self._next()
                return
            if item.command == 178:
                self.speed = item.params[1]
            self._next()

    def _next(self) -> None:
        if self.current + 1 < len(self.mission):
            self.current += 1
        elif self.firmware is Firmware.PX4:
            self.mode = FlightMode.HOLD
