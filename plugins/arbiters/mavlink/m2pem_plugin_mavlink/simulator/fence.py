"""The fence: its zones, made from the items of the plan (MAV_CMD 5001 to 5004), and what happens at
a breach."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import edges_enclose
from m2pem_plugin_mavlink.simulator.geometry import LocalFrame, Location, Point
from m2pem_plugin_mavlink.simulator.interfaces import (
    AutopilotInterface,
    CommandHandler,
    Component,
    FenceRules,
    ReportMaker,
)
from m2pem_plugin_mavlink.simulator.messages import Command, Result
from m2pem_plugin_mavlink.simulator.missions.plan import FENCE, Item
from m2pem_plugin_mavlink.simulator.specification import Kind

POLYGON_IN, POLYGON_OUT, CIRCLE_IN, CIRCLE_OUT = 5001, 5002, 5003, 5004


@dataclass(frozen=True, slots=True)
class PolygonZone:
    """A polygon. `keep_in`: it must not be left; else it must not be entered."""

    corners: tuple[Point, ...]
    keep_in: bool

    def breached(self, point: Point) -> bool:
        """Whether a point is on the wrong side."""
        ring = [(corner.east_m, corner.north_m) for corner in self.corners]
        inside = edges_enclose(pairwise([*ring, ring[0]]), (point.east_m, point.north_m))
        return inside != self.keep_in


@dataclass(frozen=True, slots=True)
class CircleZone:
    """A circle. `keep_in`: it must not be left; else it must not be entered."""

    center: Point
    radius_m: float
    keep_in: bool

    def breached(self, point: Point) -> bool:
        """Whether a point is on the wrong side."""
        return (self.center.distance_m(point) <= self.radius_m) != self.keep_in


Zone = PolygonZone | CircleZone


def is_whole(items: Sequence[Item]) -> bool:
    """Return whether every polygon has as many corners as its items say, and at least three."""
    return all(
        len(each) == count >= 3 and len({(item.command, item.param1) for item in each}) == 1
        for each, count in _shapes(items)
        if each[0].command in (POLYGON_IN, POLYGON_OUT)
    )


def zones_of(items: Sequence[Item], frame: LocalFrame) -> Iterator[Zone]:
    """Yield the zones. A polygon with missing corners (its upload was abandoned) is left out."""
    for shape, count in _shapes(items):
        item, points = shape[0], tuple(_point(each, frame) for each in shape)
        if item.command in (CIRCLE_IN, CIRCLE_OUT):
            yield CircleZone(points[0], item.param1, item.command == CIRCLE_IN)
        elif len(shape) == count >= 3 and len({each.command for each in shape}) == 1:
            yield PolygonZone(points, item.command == POLYGON_IN)


def _shapes(items: Sequence[Item]) -> Iterator[tuple[Sequence[Item], int]]:
    """Yield the items of each shape, and how many there should be."""
    index = 0
    while index < len(items):
        first, count = items[index], 1
        if first.command in (POLYGON_IN, POLYGON_OUT) and math.isfinite(first.param1):
            count = max(1, int(first.param1))
        yield items[index : index + count], count
        index += count


def _point(item: Item, frame: LocalFrame) -> Point:
    return frame.to_point(
        Location(item.latitude_deg, item.longitude_deg, frame.origin.altitude_amsl_m)
    )


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


class Fence(Component):
    """Monitors the position. `breach`: the present one; `count`: how many there were."""

    def __init__(self, autopilot: AutopilotInterface) -> None:
        super().__init__(autopilot)
        self.breach: Breach | None = None
        self.count = 0
        self._breach_ms = 0
        self._changes = -1
        self._zones: tuple[Zone, ...] = ()

    @property
    def rules(self) -> FenceRules:
        """The rules, by the present parameters."""
        return self.autopilot.parameters.derived(self.autopilot.firmware.fence_rules)

    @property
    def zones(self) -> tuple[Zone, ...]:
        """The uploaded zones."""
        plans = self.autopilot.plans
        if self._changes != plans.changes:
            self._changes = plans.changes
            self._zones = tuple(zones_of(plans[FENCE], self.autopilot.frame))
        return self._zones

    def at(self, point: Point, rules: FenceRules) -> Breach | None:
        """Return what a point breaches."""
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
        """Check the position; the first moment of a breach counts."""
        autopilot, rules = self.autopilot, self.rules
        now = None
        if rules.enabled and autopilot.arming.armed and autopilot.estimator.ready:
            now = self.at(autopilot.position, rules)
        before, self.breach = self.breach, now
        if now is before:
            return
        if now is None:
            self._send_status()
            return
        self.count += 1
        self._breach_ms = autopilot.boot_ms
        autopilot.warn(rules.text.format(now))
        autopilot.log_event("fence", now)
        self._send_status()
        if rules.mode is not None:
            autopilot.modes.switch(rules.mode)

    def forbids(self, point: Point) -> bool:
        """Return whether a point is beyond the fence."""
        rules = self.rules
        return rules.enabled and self.at(point, rules) not in (None, Breach.LOWEST)

    def refusals(self) -> Iterator[str]:
        """Refuse arming beyond the fence."""
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
