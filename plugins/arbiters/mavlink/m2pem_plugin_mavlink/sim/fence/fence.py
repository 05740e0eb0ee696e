"""The fence: a breach is told (FENCE_STATUS, a text), and ends in another mode."""

from collections.abc import Iterator, Mapping
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.sim.command import Command, Result
from m2pem_plugin_mavlink.sim.fence.rules import FenceRules
from m2pem_plugin_mavlink.sim.fence.zones import Zone, zones_of
from m2pem_plugin_mavlink.sim.geometry import Point
from m2pem_plugin_mavlink.sim.missions.plan import FENCE
from m2pem_plugin_mavlink.sim.part import CommandHandler, Part, ReportMaker
from m2pem_plugin_mavlink.sim.specification import Kind

if TYPE_CHECKING:
    from m2pem_plugin_mavlink.sim.autopilot import Autopilot


class Breach(StrEnum):
    """What was breached, as ArduPilot names it."""

    LOWEST = "Min Alt"
    HIGHEST = "Max Alt"
    CIRCLE = "Circle"
    ZONES = "Polygon"


TYPES = {
    Breach.LOWEST: dialect.FENCE_BREACH_MINALT,
    Breach.HIGHEST: dialect.FENCE_BREACH_MAXALT,
    Breach.CIRCLE: dialect.FENCE_BREACH_BOUNDARY,
    Breach.ZONES: dialect.FENCE_BREACH_BOUNDARY,
}


class Fence(Part):
    """Watches where the vehicle is. `breach`: what is breached now; `count`: how often."""

    def __init__(self, autopilot: "Autopilot") -> None:
        super().__init__(autopilot)
        self.breach: Breach | None = None
        self.count = 0
        self._breach_ms = 0
        self._changes = -1
        self._zones: tuple[Zone, ...] = ()

    @property
    def rules(self) -> FenceRules:
        """As the parameters say now."""
        return self.autopilot.firmware.fence_rules(self.autopilot.parameters)

    @property
    def zones(self) -> tuple[Zone, ...]:
        """The uploaded shapes."""
        plans = self.autopilot.plans
        if self._changes != plans.changes:
            self._changes = plans.changes
            self._zones = zones_of(plans[FENCE], self.autopilot.frame)
        return self._zones

    def at(self, point: Point, rules: FenceRules) -> Breach | None:
        """What is breached at a point."""
        home = self.autopilot.home.point
        flies = self.autopilot.spec.kind in (Kind.COPTER, Kind.PLANE)
        up_m = point.up_m - home.up_m
        if flies and rules.highest_m is not None and up_m > rules.highest_m:
            return Breach.HIGHEST
        if rules.radius_m is not None and point.distance_m(home) > rules.radius_m:
            return Breach.CIRCLE
        if rules.zones and any(zone.breached(point) for zone in self.zones):
            return Breach.ZONES
        in_air = flies and not self.autopilot.body.on_ground
        if in_air and rules.lowest_m is not None and up_m < rules.lowest_m:
            return Breach.LOWEST
        return None

    def step(self, dt_s: float) -> None:
        """Look where it is; the first moment of a breach counts."""
        pilot, rules = self.autopilot, self.rules
        now = None
        if rules.enabled and pilot.arming.armed and pilot.estimator.ready:
            now = self.at(pilot.position, rules)
        before, self.breach = self.breach, now
        if now is before:
            return
        if now is None:
            self._send_status()
            return
        self.count += 1
        self._breach_ms = pilot.boot_ms
        pilot.warn(rules.text.format(now))
        pilot.note("fence", now)
        self._send_status()
        if rules.mode is not None:
            pilot.modes.switch(rules.mode)

    def forbids(self, point: Point) -> bool:
        """It does not go beyond the fence."""
        rules = self.rules
        return rules.enabled and self.at(point, rules) not in (None, Breach.LOWEST)

    def refusals(self) -> Iterator[str]:
        """It is not armed beyond the fence."""
        rules = self.rules
        if rules.enabled and self.autopilot.estimator.ready:
            breach = self.at(self.autopilot.position, rules)
            if breach is not None:
                yield f"Vehicle breaching {breach} fence"

    def commands(self) -> Mapping[int, CommandHandler]:
        """DO_FENCE_ENABLE, where a parameter enables the fence."""
        if "FENCE_ENABLE" not in self.autopilot.parameters:
            return {}
        return {dialect.MAV_CMD_DO_FENCE_ENABLE: self._enable}

    def _enable(self, command: Command) -> Result:
        if command.param1 not in (0, 1):
            return Result.FAILED
        self.autopilot.parameters["FENCE_ENABLE"] = command.param1
        return Result.ACCEPTED

    def reports(self) -> Mapping[int, ReportMaker]:
        """FENCE_STATUS, while there is a fence."""
        status = dialect.MAVLINK_MSG_ID_FENCE_STATUS
        return {status: lambda: self._status() if self.rules.enabled else None}

    def _send_status(self) -> None:
        if dialect.MAVLINK_MSG_ID_FENCE_STATUS not in self.autopilot.firmware.unknown_reports:
            self.autopilot.send(self._status())

    def _status(self) -> Any:
        kind = dialect.FENCE_BREACH_NONE if self.breach is None else TYPES[self.breach]
        return dialect.MAVLink_fence_status_message(
            int(self.breach is not None), min(self.count, 0xFFFF), kind, self._breach_ms
        )
