"""What the face knows of one vehicle: its latest telemetry, behavior, home and payloads."""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

from m2pem.api import (
    Fence,
    GeoPosition,
    LinkState,
    PayloadState,
    ResourceId,
    RunId,
    RunStatus,
    VehicleState,
)
from m2pem_plugin_mavlink.face.modes import (
    GUIDED,
    HOLD,
    LAND,
    MISSION,
    RETURN,
    TAKEOFF,
    Mode,
    mode_of,
)
from m2pem_plugin_mavlink.face.plan import Plan, PlanRun, UploadedPlan
from m2pem_plugin_mavlink.protocol.messages import Address

AUTOPILOT = 1
CAMERA = 100
"""MAV_COMP_ID_CAMERA; five more follow it."""

MOST_CAMERAS = 6
AIRBORNE_M = 1.0
NO_ADDRESS = Address(0, 0)


@dataclass(slots=True)
class Camera:
    """A payload as a camera component; `gimbal_device`: its number among the gimbals, 0: none;
    `controller`: the ground station that last took the gimbal."""

    resource: ResourceId
    component: int
    gimbal_device: int
    takes_pictures: bool
    state: PayloadState | None = None
    pictures: int = 0
    controller: Address = NO_ADDRESS


@dataclass(slots=True)
class ShownVehicle:
    """`behaviors`: the names of those that it has. `received_s`: the time of the last telemetry, by
    the clock of the event loop. `behavior`: the name of what it carries out, and `behavior_id`.
    `operator`: who has taken it. `home`: where it was first seen on the ground. `type`: MAV_TYPE.
    `fence`: the fleet's. `arms_itself`: it has motors that it arms, and says whether it did.
    `arm_requested`: a station has armed it, and what it is to do has not come yet. `task`: the run
    and the element of its behavior. `uploaded`: the plan of a station, and `plan_run` its latest
    run. `own_fences`: those that stations have uploaded, and `uploaded_fence` their items.
    `guided`: a station has set ArduPilot's mode GUIDED."""

    resource: ResourceId
    domain: str
    system: int
    behaviors: Collection[str]
    cameras: Sequence[Camera] = ()
    state: VehicleState | None = None
    received_s: float = -math.inf
    behavior: str = ""
    behavior_id: str = ""
    operator: str = ""
    home: GeoPosition | None = None
    plan: Plan = field(default_factory=Plan)
    type: int = 0
    fence: Fence | None = None
    arms_itself: bool = False
    arm_requested: bool = False
    task: tuple[RunId, str] = ("", "")
    uploaded: UploadedPlan = field(default_factory=UploadedPlan)
    plan_run: PlanRun | None = None
    own_fences: Sequence[Fence] = ()
    guided: bool = False
    uploaded_fence: UploadedPlan = field(default_factory=UploadedPlan)
    rally_points: UploadedPlan = field(default_factory=UploadedPlan)

    @property
    def fences(self) -> list[Fence]:
        """All that bound where it may be."""
        return [*([self.fence] if self.fence is not None else ()), *self.own_fences]

    @property
    def runs_plan(self) -> bool:
        """Whether a run of an uploaded plan goes on."""
        return self.plan_run is not None and not self.plan_run.status.ended

    @property
    def shows_upload(self) -> bool:
        """Whether its plan is the uploaded one, and not what a mission of m2pem has it do."""
        return bool(self.uploaded.items) and (self.runs_plan or not self.plan.items)

    @property
    def autopilot(self) -> Address:
        """The address of the autopilot."""
        return Address(self.system, AUTOPILOT)

    @property
    def mode(self) -> Mode:
        """The mode that it is shown in."""
        if self.runs_plan and self.plan_run is not None:
            return HOLD if self.plan_run.status is RunStatus.PAUSED else self._plan_mode
        if self.guided and not self.behavior and not self.operator:
            return GUIDED
        return mode_of(self.behavior, self.operator)

    @property
    def _plan_mode(self) -> Mode:
        """As autopilots show it: Mission but for the take-off, the return and the landing."""
        mode = mode_of(self.behavior, "")
        return mode if mode in (TAKEOFF, LAND, RETURN) else MISSION

    @property
    def armed(self) -> bool:
        """Whether it is armed; of vehicles that do not say, or have nothing to arm: whether it
        carries something out, or a station has armed it."""
        if self.arm_requested and not self.arms_itself:
            return True
        if self.state is None or self.state.armed is None:
            return bool(self.behavior)
        return self.state.armed

    @property
    def airborne(self) -> bool:
        """Whether it is an aircraft in the air."""
        height_m = self.state.altitude_above_home_m if self.state is not None else None
        return self.domain == "air" and height_m is not None and height_m > AIRBORNE_M

    @property
    def present(self) -> bool:
        """Whether its link is not lost: of one that is, nothing is sent, as it would send nothing
        itself."""
        return self.state is not None and self.state.link is not LinkState.LOST

    def update(self, state: VehicleState, now_s: float) -> None:
        """New telemetry."""
        self.state = state
        if state.link is not LinkState.LOST:
            self.received_s = now_s
        position, height_m = state.position, state.altitude_above_home_m
        if position is not None:
            if self.home is None and not self.airborne:
                home_m = position.altitude_m - (height_m or 0.0)
                self.home = GeoPosition(position.latitude_deg, position.longitude_deg, home_m)
            self.plan.advance(position.latlon)
