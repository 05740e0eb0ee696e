"""What a mission takes as it is drawn: distance, time and battery of each vehicle."""

from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class TaskEstimate:
    """One task of one vehicle or payload, of which `vehicle` is the id. `begins_s`: after the
    mission's start. `battery_left`: of the vehicle after the task, from 0 to 1; below 0 if the
    battery does not last."""

    element: str
    label: str
    vehicle: str
    begins_s: float
    distance_m: float
    time_s: float
    battery_left: float


@dataclass(frozen=True, slots=True)
class VehicleEstimate:
    """One vehicle. `distance_m` in space, and `time_s`, of its tasks; where the mission branches,
    of those that take the most. `battery_left`: at the mission's end. `endurance_s`: with a full
    battery; `stated`: whether the fleet says so, or the simulation assumes it."""

    vehicle: str
    distance_m: float
    time_s: float
    battery_left: float
    endurance_s: float
    stated: bool


@dataclass(frozen=True, slots=True)
class NotEstimated:
    """An element that is left out of an estimate, in whole or in part, and why."""

    element: str
    label: str
    reason: str


@dataclass(frozen=True, slots=True)
class MissionEstimate:
    """A whole mission. `time_s`: until its end, without what is `left_out`. `reserve`: the part of
    a full battery that plans leave unused."""

    time_s: float
    reserve: float
    vehicles: tuple[VehicleEstimate, ...] = ()
    tasks: tuple[TaskEstimate, ...] = ()
    left_out: tuple[NotEstimated, ...] = field(default=())
