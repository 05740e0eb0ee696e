"""What the components of a simulated autopilot see of it, and of each other."""

from abc import ABC, abstractmethod
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple, Protocol, TypeVar, cast

from m2pem_plugin_mavlink.simulator.dynamics import (
    BodyState,
    CircleSetpoint,
    MotionSetpoint,
    NoThrust,
    PositionSetpoint,
)
from m2pem_plugin_mavlink.simulator.geometry import LocalFrame, Point
from m2pem_plugin_mavlink.simulator.messages import Command, Peer, Result, Sender
from m2pem_plugin_mavlink.simulator.missions.plan import Item, PlanStore
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec

T = TypeVar("T")


class Event(NamedTuple):
    """`kind`: armed, disarmed, mode, takeoff, motion, mission, land, payload, reboot ..."""

    at_s: float
    kind: str
    detail: str


@dataclass(slots=True)
class EventLog:
    """The last 1,000 events, and the number of each kind."""

    events: deque[Event] = field(default_factory=lambda: deque(maxlen=1000))
    counts: Counter[str] = field(default_factory=Counter)

    def log_event(self, at_s: float, kind: str, detail: str = "") -> None:
        """Add an event."""
        self.events.append(Event(at_s, kind, detail))
        self.counts[kind] += 1


@dataclass(slots=True)
class CommandRefusal:
    """A fault: a command that is refused. `result` None: not even answered; `times` None:
    always."""

    result: Result | None = Result.FAILED
    text: str = ""
    times: int | None = None


@dataclass(slots=True)
class InjectedFaults:
    """Faults that were injected into a vehicle; a reboot does not repair them.

    `gps_lost`: no satellites; `arming`: why it does not arm; `commands`: by MAV_CMD; `camera_full`:
    there is no room for another picture.
    """

    gps_lost: bool = False
    camera_full: bool = False
    arming: str | None = None
    commands: dict[int, CommandRefusal] = field(default_factory=dict)

    def refusal_of(self, command: int) -> CommandRefusal | None:
        """Return the refusal of a command this time; None if it is not refused."""
        refusal = self.commands.get(command)
        if refusal is None or refusal.times is None:
            return refusal
        refusal.times -= 1
        if refusal.times <= 0:
            del self.commands[command]
        return refusal


class Parameters:
    """The values by name, in the order of the list."""

    def __init__(self, values: Mapping[str, float]) -> None:
        self._values = {name: float(values[name]) for name in sorted(values)}
        self._names = list(self._values)
        self._index = {name: index for index, name in enumerate(self._names)}
        self._derived: dict[Callable[[Parameters], object], object] = {}

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def __setitem__(self, name: str, value: float) -> None:
        if name not in self._values:
            raise KeyError(name)
        self._values[name] = float(value)
        self._derived.clear()

    def derived(self, derive: Callable[["Parameters"], T]) -> T:
        """What a function derives from the values; again only after one has changed."""
        if derive not in self._derived:
            self._derived[derive] = derive(self)
        return cast("T", self._derived[derive])

    def __contains__(self, name: object) -> bool:
        return name in self._values

    def __len__(self) -> int:
        return len(self._values)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def get(self, name: str) -> float | None:
        """The value; None: this firmware has no such parameter."""
        return self._values.get(name)

    def index(self, name: str) -> int:
        """Its number in the list."""
        return self._index[name]

    def name(self, index: int) -> str | None:
        """The name at a number of the list."""
        return self._names[index] if 0 <= index < len(self._names) else None


@dataclass(frozen=True, slots=True)
class FenceRules:
    """`zones`: the uploaded shapes hold; heights and radius are from home, None: no limit; `mode`:
    which is entered at a breach, None: none; `text`: said then, with the name of what was breached.
    """

    enabled: bool
    zones: bool = True
    highest_m: float | None = None
    lowest_m: float | None = None
    radius_m: float | None = None
    mode: int | None = None
    text: str = "{} fence breached"


CommandHandler = Callable[[Command], Result]
"""Does it; the result is sent as the acknowledgement."""
MessageHandler = Callable[[Any, Sender], None]
ReportMaker = Callable[[], Any]
"""Makes the message as of now; None: there is nothing to tell."""

M = TypeVar("M", bound=Callable[..., Any])


def _marking(table: str) -> Callable[..., Callable[[M], M]]:
    """Return a decorator that notes the keys of a method of a component."""

    def with_keys(*keys: int | str) -> Callable[[M], M]:
        def mark(method: M) -> M:
            setattr(method, table, keys)
            return method

        return mark

    return with_keys


on_command = _marking("commands")
"""Of a `CommandHandler`: the MAV_CMD that it carries out."""
on_message = _marking("messages")
"""Of a `MessageHandler`: the names of the messages that it takes."""
makes = _marking("reports")
"""Of a `ReportMaker`: the id of its message."""


class Component:
    """What an autopilot answers, reports and does as time passes; by itself it does nothing.

    Its methods are marked with the commands and messages that they take, and with the messages that
    may be streamed or requested (`on_command`, `on_message`, `makes`). `component_id`: the MAVLink
    component that its messages and commands are sent to.
    """

    component_id = 1

    def __init__(self, autopilot: "AutopilotInterface") -> None:
        self.autopilot = autopilot

    def commands(self) -> Mapping[int, CommandHandler]:
        """Return the handlers of commands, by MAV_CMD."""
        return self._marked("commands")

    def messages(self) -> Mapping[str, MessageHandler]:
        """Return the handlers of other messages, by name."""
        return self._marked("messages")

    def reports(self) -> Mapping[int, ReportMaker]:
        """Return the makers of messages that can be streamed or requested, by id."""
        return self._marked("reports")

    def _marked(self, table: str) -> dict[Any, Any]:
        methods = {name: getattr(type(self), name) for name in dir(type(self))}
        return {
            key: getattr(self, name)
            for name, method in methods.items()
            for key in getattr(method, table, ())
        }

    def step(self, dt_s: float) -> None:
        """Advance by `dt_s` of simulated time."""

    @property
    def failsafe(self) -> bool:
        """Whether a failsafe is active (MAV_STATE_CRITICAL)."""
        return False

    def refusals(self) -> Iterable[str]:
        """Yield the reasons against arming, in the words of ArduPilot."""
        return ()

    def forbids(self, point: Point) -> bool:
        """Return whether the vehicle must not go to a point (a fence)."""
        return False


class Maneuver:
    """What a vehicle does in a mode. Created when its mode is entered. `taking_off`, `landing`: the
    vehicle leaves or approaches the ground."""

    taking_off = False
    landing = False

    def __init__(self, autopilot: "AutopilotInterface") -> None:
        self.autopilot = autopilot

    @property
    def takes_speed(self) -> bool:
        """Whether ArduPilot obeys DO_CHANGE_SPEED in it now (set_desired_speed of Rover's modes,
        set_speed_xy_cms of Copter's)."""
        return False

    def refusal(self) -> str | None:
        """Return why the mode cannot be entered now, in the words of ArduPilot; None if it can."""
        return None

    def begin(self) -> None:
        """The mode was entered; the vehicle may be armed or not."""

    def end(self) -> None:
        """The mode was left."""

    def step(self, dt_s: float) -> MotionSetpoint:
        """Return the motion setpoint; called only while armed."""
        raise NotImplementedError

    def hand_over(self, mode: int, dt_s: float) -> MotionSetpoint:
        """Enter another mode and return its setpoint; stay if it cannot be entered."""
        autopilot = self.autopilot
        autopilot.modes.switch(mode)
        successor = autopilot.modes.maneuver
        return self.stay(autopilot.position) if successor is self else successor.step(dt_s)

    def stay(self, point: Point) -> MotionSetpoint:
        """Return the setpoint to stay at a point: a copter hovers, a rover stops, a boat keeps its
        position, a plane circles."""
        tuning = self.autopilot.tuning
        match self.autopilot.spec.kind:
            case Kind.ROVER:
                return NoThrust()
            case Kind.PLANE:
                return CircleSetpoint(point, tuning.loiter_radius_m, tuning.cruise_mps)
            case Kind.BOAT:
                if self.autopilot.position.distance_m(point) <= tuning.loiter_radius_m:
                    return NoThrust()
        return self.reach(point, yaw_rad=self.autopilot.body.yaw_rad)

    def reach(self, point: Point, *, yaw_rad: float | None = None) -> PositionSetpoint:
        """Return the setpoint to go to a point at the present speed."""
        tuning = self.autopilot.tuning
        return PositionSetpoint(
            point,
            self.autopilot.modes.speed_mps,
            tuning.climb_mps,
            tuning.descent_mps,
            yaw_rad,
            self.autopilot.modes.reverse,
        )


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
    """The mode (custom_mode) for each role; None: this kind of vehicle has none."""

    hold: int
    guided: int
    mission: int
    rtl: int
    land: int | None


@dataclass(frozen=True, slots=True)
class Mode:
    """A mode of a firmware. `number`: custom_mode; `armable`: it may be armed in it."""

    number: int
    name: str
    maneuver: type[Maneuver]
    needs_position: bool = True
    armable: bool = False
    automatic: bool = True


class Firmware(ABC):
    """ArduPilot or PX4, on one kind of vehicle."""

    autopilot_id: ClassVar[int]
    """MAV_AUTOPILOT."""
    types: ClassVar[Mapping[Kind, int]]
    """MAV_TYPE of each kind of vehicle."""
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
    def vehicle_type(self) -> int:
        """MAV_TYPE."""
        return self.types[self.spec.kind]

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
    def base_mode(self, autopilot: "AutopilotInterface") -> int:
        """MAV_MODE_FLAG, as HEARTBEAT has it."""

    @abstractmethod
    def active(self, autopilot: "AutopilotInterface") -> bool:
        """HEARTBEAT says ACTIVE rather than STANDBY."""

    @abstractmethod
    def mode_number(self, base_mode: int, main: int, sub: int) -> int | None:
        """The custom_mode that the parameters of DO_SET_MODE mean; None: no custom mode."""

    @abstractmethod
    def fence_rules(self, parameters: Parameters) -> FenceRules:
        """How the parameters set the fence up."""

    def components(self) -> Sequence[type[Component]]:
        """What only this firmware has; their commands replace those of other parts."""
        return ()

    def checks_sensors(self, autopilot: "AutopilotInterface") -> bool:
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

    def reached_text(self, autopilot: "AutopilotInterface", index: int) -> str:
        """What it says when an item of a mission is done; "": nothing."""
        return ""

    def parameter_to_wire(self, name: str, value: float) -> float:
        """A parameter's value as the float in PARAM_VALUE."""
        return value

    def parameter_from_wire(self, name: str, value: float) -> float:
        """The value that the float in PARAM_SET means."""
        return value

    def mode_entered(self, autopilot: "AutopilotInterface") -> None:  # noqa: B027  # most say nothing
        """A mode has been entered: what it says or sends then."""


class EstimatorInterface(Protocol):
    @property
    def found(self) -> bool: ...
    @property
    def gps_lost(self) -> bool: ...
    @property
    def ready(self) -> bool: ...
    @property
    def levelled(self) -> bool: ...
    @property
    def sensors_well(self) -> bool: ...
    @property
    def flags(self) -> int: ...


class BatteryInterface(Protocol):
    left: float

    @property
    def voltage_v(self) -> float: ...
    @property
    def current_a(self) -> float: ...
    @property
    def percent(self) -> int: ...


class HomeInterface(Protocol):
    @property
    def point(self) -> Point: ...
    def set_at_arming(self) -> None: ...


class ModesInterface(Protocol):
    mode: Mode
    maneuver: Maneuver
    reverse: bool
    by_number: dict[int, Mode]

    @property
    def speed_mps(self) -> float: ...
    def set_speed(self, speed_mps: float | None) -> None: ...
    def switch(self, number: int) -> bool: ...


class ArmingInterface(Protocol):
    armed: bool

    @property
    def healthy(self) -> bool: ...
    def reasons(self) -> Iterator[str]: ...
    def arm(self, *, force: bool = False, by: str = ...) -> bool: ...
    def disarm(self, *, force: bool = False, by: str = ...) -> bool: ...
    def disarm_after_landing(self) -> None: ...


class SetpointsInterface(Protocol):
    def forbidden(self, point: Point) -> bool: ...
    def up_m(self, z: float, frame: int) -> float: ...
    def point_of(self, command: Command) -> Point: ...


class MissionInterface(Protocol):
    current: int
    resume_at: int
    paused: bool
    running: bool
    complete: bool
    begun: bool
    released: bool

    @property
    def items(self) -> tuple[Item, ...]: ...
    @property
    def first(self) -> int: ...
    @property
    def empty(self) -> bool: ...
    def restart(self) -> None: ...
    def replaced(self, marked: int | None) -> None: ...
    def clear(self) -> None: ...
    def disarmed(self) -> None: ...
    def advance(self, index: int) -> tuple[list[int], int | None]: ...
    def set_current(self, index: int) -> bool: ...
    def reached(self, index: int) -> None: ...


P = TypeVar("P", bound=Component)


class SigningMemory(Protocol):
    """The key with which frames are signed."""

    def set_up(self, key: bytes, timestamp: int) -> None: ...


class AutopilotInterface(Protocol):
    """A simulated autopilot as its components see it."""

    spec: VehicleSpec
    firmware: Firmware
    now_s: float
    frame: LocalFrame
    body: BodyState
    parameters: Parameters
    plans: PlanStore
    injected_faults: InjectedFaults
    peers: list[Peer]
    components: list[Component]
    setpoint: MotionSetpoint

    @property
    def signing(self) -> SigningMemory: ...
    @property
    def estimator(self) -> EstimatorInterface: ...
    @property
    def battery(self) -> BatteryInterface: ...
    @property
    def home(self) -> HomeInterface: ...
    @property
    def modes(self) -> ModesInterface: ...
    @property
    def arming(self) -> ArmingInterface: ...
    @property
    def guided(self) -> SetpointsInterface: ...
    @property
    def mission(self) -> MissionInterface: ...
    @property
    def since_boot_s(self) -> float: ...
    @property
    def boot_ms(self) -> int: ...
    @property
    def tuning(self) -> Tuning: ...
    @property
    def position(self) -> Point: ...
    @property
    def target_point(self) -> Point | None: ...
    def log_event(self, kind: str, detail: str = "") -> None: ...
    def obey(self, command: Command) -> Result: ...
    def component(self, kind: type[P]) -> P: ...
    def send(self, message: Any, to: Peer | None = None, component: int = 1) -> None: ...
    def say(self, text: str, severity: int = ...) -> None: ...
    def warn(self, text: str) -> None: ...
    def reboot(self) -> None: ...
