"""What a behavior is called and which parameters it takes: the words of an arbiter's catalogue."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import NewType

from m2pem.mission.behavior import BehaviorType

ResourceId = NewType("ResourceId", str)
"""A vehicle ("evsg1") or a payload ("evsg2/ptz"). Teams are spelled out as their members."""


class ParameterKind(StrEnum):
    """The type of a parameter's value, which determines its units. Inside, all is SI."""

    DURATION = "duration"  # s
    DISTANCE = "distance"  # m
    ALTITUDE = "altitude"  # m, in the frame that `altitude_frame` says
    SPEED = "speed"  # m/s
    ANGLE = "angle"  # rad; people write deg or rad
    ANGULAR_SPEED = "angular_speed"  # rad/s; people write deg/s or rad/s
    NUMBER = "number"
    COUNT = "count"  # a whole number, 0 or more
    BOOLEAN = "boolean"
    TEXT = "text"
    OFFSETS = "offsets"  # [[metres behind, metres left], ...] of members after a team's lead
    ROUTE = "route"  # name of a LineString or MultiPoint
    AREA = "area"  # name of a Polygon
    POSITION = "position"  # name of a point or of a vehicle, or [lat, lon, altitude]
    VEHICLE = "vehicle"  # name of a vehicle


class ResumePolicy(StrEnum):
    """The reaction, after a restart, to a behavior that its arbiter no longer knows."""

    RESTART = "restart"  # start it again: a scan, a picture
    FAIL = "fail"  # it ends with error LOST, for a boundary event to catch
    HOLD = "hold"  # hold the vehicle and ask the operator: resume, skip or abort


class BehaviorState(StrEnum):
    """The state of a behavior (docs/architecture.md, "Plugins"); the last six are terminal."""

    ACCEPTED = "ACCEPTED"
    RUNNING = "RUNNING"
    SUCCEEDED = "SUCCEEDED"
    FAILED = "FAILED"
    CANCELLED = "CANCELLED"
    REJECTED = "REJECTED"
    LOST = "LOST"
    UNKNOWN = "UNKNOWN"

    @property
    def terminal(self) -> bool:
        """Whether nothing can follow it."""
        return self not in (BehaviorState.ACCEPTED, BehaviorState.RUNNING)


@dataclass(frozen=True, slots=True)
class ParameterSpec:
    """One parameter. `minimum` and `maximum` are in SI and inclusive; `choices` are texts."""

    name: str
    kind: ParameterKind
    required: bool = False
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()
    default: float | str | bool | None = None
    doc: str = ""


@dataclass(frozen=True, slots=True)
class BehaviorSpec:
    """One behavior that an arbiter offers on a resource.

    `required_one_of`: groups of parameter names of which at least one group must be given whole
    (`ptz_point_at`: target, or bearing and elevation). `ends`: whether it ends by itself when
    no parameter says so. `writes`: dotted names of the data store that it writes when it ends.
    `keeps_speeds`: whether it keeps the speeds of a route's waypoints (`Route.speeds_m_s`).
    """

    name: str
    type: BehaviorType
    parameters: tuple[ParameterSpec, ...] = ()
    required_one_of: tuple[tuple[str, ...], ...] = ()
    resume: ResumePolicy = ResumePolicy.HOLD
    ends: bool = True
    doc: str = ""
    writes: tuple[str, ...] = ()
    keeps_speeds: bool = False
    by_name: Mapping[str, ParameterSpec] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "by_name", {p.name: p for p in self.parameters})
