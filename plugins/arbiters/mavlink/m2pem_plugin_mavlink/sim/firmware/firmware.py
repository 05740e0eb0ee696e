"""What a firmware decides: numbers, names, modes, defaults, wording."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar, NamedTuple

from m2pem_plugin_mavlink.sim.fence.rules import FenceRules
from m2pem_plugin_mavlink.sim.modes import Mode
from m2pem_plugin_mavlink.sim.parameters import Parameters
from m2pem_plugin_mavlink.sim.part import Part
from m2pem_plugin_mavlink.sim.specification import VehicleSpec

if TYPE_CHECKING:
    from m2pem_plugin_mavlink.sim.autopilot import Autopilot


class Tuning(NamedTuple):
    """How the vehicle behaves, read from its parameters, whatever the firmware calls them."""

    cruise_mps: float
    climb_mps: float
    descent_mps: float
    land_mps: float
    return_up_m: float
    loiter_radius_m: float
    acceptance_m: float
    setpoint_timeout_s: float
    disarm_delay_s: float


class Roles(NamedTuple):
    """Which mode (custom_mode) does what; None: this kind of vehicle has none."""

    hold: int
    guided: int
    mission: int
    back: int
    land: int | None


class Firmware(ABC):
    """ArduPilot or PX4, on one kind of vehicle."""

    autopilot_id: ClassVar[int]
    """MAV_AUTOPILOT."""
    version: ClassVar[int]
    """As in AUTOPILOT_VERSION.flight_sw_version."""
    capabilities: ClassVar[int]
    """MAV_PROTOCOL_CAPABILITY."""
    is_ardupilot: ClassVar[bool]
    """Its missions have the home position as item 0, and go on as ArduPilot's do."""
    asks_for_items_as_int: ClassVar[bool]
    """It asks with MISSION_REQUEST_INT rather than with MISSION_REQUEST."""
    unknown_reports: ClassVar[frozenset[int]] = frozenset()
    """Ids of messages that other firmwares make and this one does not."""
    capacity: ClassVar[str]
    """The parameter that has the battery's capacity in mAh."""
    texts_need_heartbeats: ClassVar[bool] = False
    """Only links on which a ground station sent a heartbeat a moment ago get texts."""
    gimbal_needs_control: ClassVar[bool] = False
    """Only a ground station that has taken control of the gimbal may move it."""
    reason_home: str
    reason_position: str
    reason_sensors: str
    reason_satellites: str = ""
    """Without satellites, on the ground; "": as for any other lack of a position."""
    arming_denied: str = ""
    """What it says before the reasons why it does not arm."""
    loop_hz: float
    first_mode: int
    vtol_state: int
    """MAV_VTOL_STATE."""
    tells_landed: bool
    """EXTENDED_SYS_STATE says whether it is in the air."""
    armed_text, disarmed_text = "Arming motors", "Disarming motors"
    """What it says then; "{}" is the reason."""
    silent_reports: ClassVar[frozenset[int]] = frozenset()
    """Ids of messages that it acknowledges to be asked for, and never sends."""
    roles: Roles

    def __init__(self, spec: VehicleSpec) -> None:
        self.spec = spec

    @property
    @abstractmethod
    def vehicle_type(self) -> int:
        """MAV_TYPE."""

    @abstractmethod
    def modes(self) -> Sequence[Mode]:
        """All its modes."""

    @abstractmethod
    def parameters(self) -> Mapping[str, float]:
        """All its parameters, with their defaults."""

    @abstractmethod
    def parameter_type(self, name: str) -> int:
        """MAV_PARAM_TYPE."""

    @abstractmethod
    def tuning(self, parameters: Parameters) -> Tuning:
        """What the parameters say."""

    @abstractmethod
    def default_streams(self) -> Mapping[int, float]:
        """What is sent unasked: message id to interval in seconds."""

    @abstractmethod
    def base_mode(self, autopilot: "Autopilot") -> int:
        """MAV_MODE_FLAG, as HEARTBEAT has it."""

    @abstractmethod
    def active(self, autopilot: "Autopilot") -> bool:
        """HEARTBEAT says ACTIVE rather than STANDBY."""

    @abstractmethod
    def mode_number(self, base_mode: int, main: int, sub: int) -> int | None:
        """The custom_mode that the parameters of DO_SET_MODE mean; None: no custom mode."""

    @abstractmethod
    def fence_rules(self, parameters: Parameters) -> FenceRules:
        """How the parameters set the fence up."""

    def parts(self) -> Sequence[type[Part]]:
        """What only this firmware has; their commands replace those of other parts."""
        return ()

    def checks_sensors(self, autopilot: "Autopilot") -> bool:
        """Arming waits until sensors are well, whatever the mode."""
        return True

    def check_text(self, reason: str) -> str:
        """How it says what is against arming it, when it is asked."""
        return f"PreArm: {reason}"

    def arming_text(self, reason: str) -> str:
        """How it says that it does not arm."""
        return f"Arm: {reason}"

    def mode_text(self, mode: Mode, reason: str) -> str:
        """How it says that it does not enter a mode."""
        return f"Mode change to {mode.name} failed: {reason}"

    def reached_text(self, autopilot: "Autopilot", index: int) -> str:
        """What it says when an item of a mission is done; "": nothing."""
        return ""

    def parameter_to_wire(self, name: str, value: float) -> float:
        """A parameter's value as the float in PARAM_VALUE."""
        return value

    def parameter_from_wire(self, name: str, value: float) -> float:
        """The value that the float in PARAM_SET means."""
        return value

    def mode_entered(self, autopilot: "Autopilot") -> None:  # noqa: B027  # most say nothing
        """A mode has been entered: what it says or sends then."""
