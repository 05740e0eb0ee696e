"""What a fleet file may say about a simulated vehicle or payload, in its `connection`."""

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import chain
from typing import Any, TypeVar

from m2pem.api.arbiter import Connection
from m2pem.api.simulator_settings import Coordinates, coordinates, fraction, number
from m2pem.errors import FleetError
from m2pem.findings import Finding, Severity
from m2pem.geo.local_frame import Origin
from m2pem.geo.positions import NO_ORIGIN, out_of_reach
from m2pem.mission.catalogue import ResourceId
from m2pem.simulation.faults import Fault, read_faults
from m2pem.simulation.kinematics import DEFAULTS, Kinematics
from m2pem.units import Dimension, quantity


@dataclass(frozen=True, slots=True)
class PlannedDetection:
    """A detection `at_s` after the arbiter connected; where the vehicle is, if not said."""

    at_s: float
    type: str
    position: Coordinates | None = None


@dataclass(frozen=True, slots=True)
class Target:
    """Something that a detector finds when it comes near."""

    type: str
    position: Coordinates


@dataclass(frozen=True, slots=True)
class LinkLoss:
    """The link to a vehicle is lost `at_s` after the arbiter connected, for `for_s`."""

    at_s: float
    for_s: float = math.inf


@dataclass(frozen=True, slots=True)
class Gimbal:
    """Bounds of a payload, in rad, rad/s and s. Zoom 1 has the whole `view_rad`."""

    slew_rate_rad_s: float = math.radians(60)
    pan_limit_rad: float = math.pi
    tilt_low_rad: float = -math.pi / 2
    tilt_high_rad: float = math.pi / 2
    zoom_max: float = 30.0
    zoom_rate_s: float = 5.0
    view_rad: float = math.radians(30)
    shutter_s: float = 0.5


@dataclass(frozen=True, slots=True)
class Settings:
    """All that is said about one resource; vehicles and payloads use what concerns them."""

    kinematics: Kinematics
    gimbal: Gimbal = field(default_factory=Gimbal)
    home: Coordinates | None = None
    altitude_m: float = 0.0
    heading_rad: float = 0.0
    battery: float = 1.0
    kind: str = ""
    detection_range_m: float = 5.0
    detections: tuple[PlannedDetection, ...] = ()
    targets: tuple[Target, ...] = ()
    faults: tuple[Fault, ...] = ()
    link_lost: tuple[LinkLoss, ...] = ()
    telemetry_hz: float | None = None
    reports_left: bool = True
    footprints: bool = True
    state: str = ""


T = TypeVar("T")

KINDS = ("ptz", "camera", "gpr")
"""Kinds of payload that `kind` may say; without it a payload can do all that payloads can."""

_KINEMATICS = {
    "max_speed": ("max_speed_m_s", Dimension.SPEED),
    "cruise_speed": ("cruise_speed_m_s", Dimension.SPEED),
    "acceleration": ("acceleration_m_s2", Dimension.ACCELERATION),
    "deceleration": ("deceleration_m_s2", Dimension.ACCELERATION),
    "turn_rate": ("turn_rate_rad_s", Dimension.ANGULAR_SPEED),
    "turn_radius": ("turn_radius_m", Dimension.DISTANCE),
    "climb_rate": ("climb_rate_m_s", Dimension.SPEED),
    "endurance": ("endurance_s", Dimension.DURATION),
    "default_altitude": ("default_altitude_m", Dimension.DISTANCE),
}
_GIMBAL = {
    "slew_rate": ("slew_rate_rad_s", Dimension.ANGULAR_SPEED),
    "pan_limit": ("pan_limit_rad", Dimension.ANGLE),
    "tilt_low": ("tilt_low_rad", Dimension.ANGLE),
    "tilt_high": ("tilt_high_rad", Dimension.ANGLE),
    "zoom_max": ("zoom_max", None),
    "zoom_rate": ("zoom_rate_s", None),
    "view": ("view_rad", Dimension.ANGLE),
    "shutter": ("shutter_s", Dimension.DURATION),
}
_MAY_BE_ZERO = {"turn_radius", "climb_rate", "default_altitude", "tilt_low", "tilt_high", "shutter"}
_MAY_BE_ZERO |= {"altitude"}


SETTING_KEYS = (
    *_KINEMATICS,
    *_GIMBAL,
    *("home", "altitude", "heading", "battery", "kind", "range", "detections", "targets", "faults"),
    *("link_lost", "wind", "wind_from", "telemetry_hz", "reports_left", "footprints", "state"),
)
"""Every setting of a simulated vehicle or payload."""


def read_settings(connection: Connection, origin: Origin) -> Settings:
    """Read the settings of one resource; positions must be near the fleet's `origin`.

    Raises:
        FleetError: with every value that cannot be used.
    """
    reader = _Reader(connection, origin)
    default = DEFAULTS.get(connection.domain, DEFAULTS["ground"])
    said = {"cruise_speed_m_s": connection.cruise_speed_m_s, "endurance_s": connection.endurance_s}
    moves: dict[str, Any] = {key: value for key, value in said.items() if value is not None}
    moves |= {**reader.numbers(_KINEMATICS), "wind_m_s": reader.wind(connection.domain)}
    settings = Settings(
        kinematics=dataclasses.replace(default, **moves),
        gimbal=Gimbal(**reader.numbers(_GIMBAL)),
        home=reader.position("home"),
        **reader.numbers({"altitude": ("altitude_m", Dimension.DISTANCE)}),
        heading_rad=reader.number("heading", Dimension.ANGLE, 0.0),
        battery=reader.value("battery", fraction, 1.0),
        kind=reader.choice("kind", KINDS),
        detection_range_m=reader.number("range", Dimension.DISTANCE, 5.0),
        detections=reader.items("detections", _detection),
        targets=reader.items("targets", _target),
        faults=tuple(chain(*reader.items("faults", read_faults, (str, Mapping)))),
        link_lost=reader.items("link_lost", _link_loss),
        telemetry_hz=reader.rate("telemetry_hz"),
        reports_left=reader.truth("reports_left", default=True),
        footprints=reader.truth("footprints", default=True),
        state=reader.text("state"),
    )
    reader.finish()
    return settings


def own_faults(resource: ResourceId, known: Mapping[ResourceId, Settings]) -> Sequence[Fault]:
    """A payload inherits its vehicle's settings, but not the vehicle's faults."""
    faults = known[resource].faults
    vehicle = ResourceId(resource.partition("/")[0])
    inherited = vehicle != resource and vehicle in known
    return () if inherited and faults == known[vehicle].faults else faults


class _Reader:
    """Reads values and gathers what is wrong with them."""

    def __init__(self, connection: Connection, origin: Origin) -> None:
        self._connection = connection
        self._origin = origin
        own = connection.settings.get("sim")
        self._settings = own if isinstance(own, Mapping) else connection.settings
        self._findings: list[Finding] = []

    def finish(self) -> None:
        if self._findings:
            what = f"{self._connection.resource} cannot be simulated"
            raise FleetError(what, self._findings)

    def wrong(self, key: str, problem: object, remedy: str = "") -> None:
        element = f"{self._connection.resource}.connection.{key}"
        rule = "bad-simulation-setting"
        self._findings.append(
            Finding(Severity.ERROR, "fleet", 0, element, rule, str(problem), remedy)
        )

    def near(self, key: str, place: Coordinates | None) -> None:
        """Note a position that is too far from the fleet's origin."""
        if place is not None and (wrong := out_of_reach(place, self._origin)):
            if self._origin == NO_ORIGIN:
                wrong = ("the fleet has no origin", "set the fleet's `origin` near its vehicles")
            self.wrong(key, *wrong)

    def numbers(self, keys: Mapping[str, tuple[str, Dimension | None]]) -> dict[str, float]:
        found = {}
        for key in self._settings:
            if key in keys:
                name, dimension = keys[key]
                value = self.number(key, dimension, 1.0)
                if value <= 0 and not (key in _MAY_BE_ZERO and (value == 0 or "tilt" in key)):
                    self.wrong(key, f"{self._settings[key]!r} is not above 0")
                found[name] = value
        return found

    def number(self, key: str, dimension: Dimension | None, default: float) -> float:
        if key == "endurance" and self._settings.get(key) == math.inf:
            return math.inf
        read = number if dimension is None else partial(quantity, dimension=dimension)
        return self.value(key, read, default)

    def value(self, key: str, read: Callable[[Any], T], default: T) -> T:
        """What `read` makes of a value; it may raise ValueError."""
        value = self._settings.get(key)
        if value is None:
            return default
        try:
            return read(value)
        except ValueError as error:
            self.wrong(key, error)
            return default

    def wind(self, domain: str) -> tuple[float, float]:
        """How the air moves, east and north; only what flies is in it."""
        speed_m_s = self.number("wind", Dimension.SPEED, 0.0)
        if speed_m_s < 0:
            self.wrong("wind", f"{speed_m_s:g} m/s is below 0")
        from_rad = self.number("wind_from", Dimension.ANGLE, 0.0)
        if domain != "air":
            return (0.0, 0.0)
        return (-speed_m_s * math.sin(from_rad), -speed_m_s * math.cos(from_rad))

    def rate(self, key: str) -> float | None:
        if self._settings.get(key) is None:
            return None
        rate = self.number(key, None, 0.0)
        if rate < 0:
            self.wrong(key, f"{rate:g} is below 0")
        return rate

    def text(self, key: str) -> str:
        value = self._settings.get(key, "")
        if not isinstance(value, str):
            self.wrong(key, f"{value!r} is not a text")
            return ""
        return value

    def truth(self, key: str, *, default: bool) -> bool:
        value = self._settings.get(key, default)
        if not isinstance(value, bool):
            self.wrong(key, f"{value!r} is neither true nor false")
            return default
        return value

    def choice(self, key: str, choices: Sequence[str]) -> str:
        value = self.text(key)
        if value and value not in choices:
            self.wrong(key, f"{value!r} is not one of {', '.join(choices)}")
        return value

    def position(self, key: str) -> Coordinates | None:
        place: Coordinates | None = self.value(key, coordinates, None)
        self.near(key, place)
        return place

    def items(
        self, key: str, read: Any, types: type | tuple[type, ...] = Mapping
    ) -> tuple[Any, ...]:
        value = self._settings.get(key)
        if value is None:
            return ()
        if not isinstance(value, list | tuple):
            self.wrong(key, "is not a list")
            return ()
        found = []
        for index, item in enumerate(value):
            if not isinstance(item, types):
                self.wrong(f"{key}[{index}]", f"{item!r} is not a map")
                continue
            try:
                found.append(read(item))
                self.near(f"{key}[{index}].position", getattr(found[-1], "position", None))
            except KeyError as error:
                self.wrong(f"{key}[{index}]", f"{error} is missing")
            except ValueError as error:
                self.wrong(f"{key}[{index}]", error)
        return tuple(found)


def _detection(item: Mapping[str, Any]) -> PlannedDetection:
    position = item.get("position")
    return PlannedDetection(
        quantity(item["at"], Dimension.DURATION),
        str(item["type"]),
        None if position is None else coordinates(position),
    )


def _link_loss(item: Mapping[str, Any]) -> LinkLoss:
    loss = LinkLoss(
        quantity(item["at"], Dimension.DURATION),
        quantity(item["for"], Dimension.DURATION) if "for" in item else math.inf,
    )
    if loss.at_s < 0 or loss.for_s <= 0:
        raise ValueError("`at` is not below 0, and `for` above it")
    return loss


def _target(item: Mapping[str, Any]) -> Target:
    return Target(str(item["type"]), coordinates(item["position"]))
