"""The state of a vehicle: what it reports, and what this arbiter has commanded."""

from dataclasses import dataclass, field

from m2pem.api import GeoPosition, LinkState
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem
from m2pem_plugin_mavlink.vehicle.driver import FlightMode


@dataclass(slots=True)
class AutopilotState:
    """The last values that a vehicle has reported; None: not yet. Frames and units as in
    VehicleState.

    `changes` counts the messages that were taken in. By the link's clock: `at_s` and `heartbeat_s`
    are when the last message and the last heartbeat came, `boot_s` when the first message since the
    last boot came; `boots` counts the boots. `landed`: it is on the ground
    (EXTENDED_SYS_STATE, or where that is not sent, what the heights and speeds say), and has come
    to rest there since it was disarmed. `fell_from_m`: see `Touchdown`.
    """

    # The vehicle
    position: GeoPosition | None = None
    altitude_above_home_m: float | None = None
    altitude_above_terrain_m: float | None = None
    velocity_enu_m_s: tuple[float, float, float] | None = None
    roll_rad: float | None = None
    pitch_rad: float | None = None
    yaw_rad: float | None = None
    home: GeoPosition | None = None
    target: GeoPosition | None = None
    """Of POSITION_TARGET_GLOBAL_INT; None: its target is no position."""
    landed: bool | None = None
    fell_from_m: float | None = None
    battery_fraction: float | None = None
    # Its activity
    custom_mode: int | None = None
    mode: FlightMode = FlightMode.OTHER
    armed: bool | None = None
    mission_sequence: int | None = None
    mission_total: int | None = None
    mission_state: int | None = None
    """MISSION_STATE of MISSION_CURRENT; None also for an autopilot that does not report it."""
    reached_sequence: int | None = None
    # The radii of its circles around a place and around home; None: it can stop
    loiter_radius_m: float | None = None
    home_loiter_radius_m: float | None = None
    # Whether it is ready: GPS_FIX_TYPE, EKF_STATUS_FLAGS (the same as ESTIMATOR_STATUS_FLAGS as far
    # as positions go), and the bit MAV_SYS_STATUS_PREARM_CHECK, None where it is not in use
    gps_fix: int | None = None
    estimator_flags: int | None = None
    prearm_passed: bool | None = None
    # Its fence: what was breached ("boundary"), "" while it is inside, and since when
    fence_breach: str = ""
    fence_breached_s: float | None = None
    # The reception
    changes: int = 0
    at_s: float | None = None
    heartbeat_s: float | None = None
    boot_s: float | None = None
    boots: int = 0
    clock_s: float | None = None
    """When a message with its own clock (`time_boot_ms`) came last."""
    messages_s: dict[int, float] = field(default_factory=dict)
    """When each kind of message came last, by its id."""

    @property
    def speed_m_s(self) -> float:
        """The speed over ground and in height; infinite while it is unknown."""
        if self.velocity_enu_m_s is None:
            return float("inf")
        east, north, up = self.velocity_enu_m_s
        return float((east * east + north * north + up * up) ** 0.5)

    def forget_the_last_boot(self) -> None:
        """Clear the values that a restart of the autopilot changes."""
        self.gps_fix = self.estimator_flags = self.prearm_passed = None
        self.position = self.home = self.target = self.velocity_enu_m_s = self.yaw_rad = None
        self.altitude_above_home_m = self.altitude_above_terrain_m = None
        self.landed = self.fell_from_m = self.reached_sequence = None
        self.fence_breach, self.fence_breached_s = "", None
        self.messages_s.clear()


@dataclass(slots=True)
class CommandedState:
    """Kept by the driver. None, and False: not since this arbiter was started.

    `custom_mode`: the mode commanded last; `entered`: the vehicle has shown it since the present
    behavior began; `changing`: how many commands that change it are on their way. `mission`: what
    was uploaded last, as the driver's `upload` takes it; `exchanging`: how many exchanges of
    missions go on; `first_item`: with which item a mission was started last. `disarming`: a disarm
    command was sent.
    """

    custom_mode: int | None = None
    entered: bool = False
    changing: int = 0
    mission: tuple[MissionItem, ...] | None = None
    exchanging: int = 0
    first_item: int = 0
    disarming: bool = False


DEGRADED_SHARE = 0.5
"""Of `lost_after_s`: a vehicle that is silent for longer has a bad link."""

DEGRADED_LOSS = 0.25
"""Of its frames: a link that loses more is a bad one."""


def link_state(silent_s: float | None, lost_after_s: float, loss: float = 0.0) -> LinkState:
    """Return the state of the link to a vehicle that was silent for `silent_s` (None: always) and
    loses the share `loss` of its frames."""
    if silent_s is None or silent_s >= lost_after_s:
        return LinkState.LOST
    if silent_s >= DEGRADED_SHARE * lost_after_s or loss > DEGRADED_LOSS:
        return LinkState.DEGRADED
    return LinkState.CONNECTED
