"""One simulated autopilot without I/O: messages and simulated time in, messages out.

Its abilities are in its components (`simulator.interfaces.Component`), the behavior of its firmware
is in `simulator.firmware`. Call `meet` with a peer, `receive` with each message and `step` as time
passes; `take_outbox` returns the messages to send. Time is simulated time: its caller decides how
fast it passes.
"""

from collections.abc import Mapping
from typing import Any, TypeVar

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.simulator.arming import Arming
from m2pem_plugin_mavlink.simulator.camera import Camera
from m2pem_plugin_mavlink.simulator.commands import CommandServer, Payload, SystemCommands
from m2pem_plugin_mavlink.simulator.dynamics import (
    BodyState,
    CircleSetpoint,
    MotionSetpoint,
    NoThrust,
    PositionSetpoint,
    dynamics_of,
)
from m2pem_plugin_mavlink.simulator.fence import Fence
from m2pem_plugin_mavlink.simulator.firmware.ardupilot import ArduPilot
from m2pem_plugin_mavlink.simulator.firmware.px4 import Px4
from m2pem_plugin_mavlink.simulator.geometry import LocalFrame, Point
from m2pem_plugin_mavlink.simulator.gimbal import Gimbal
from m2pem_plugin_mavlink.simulator.home import Home
from m2pem_plugin_mavlink.simulator.identity import Identity
from m2pem_plugin_mavlink.simulator.interfaces import (
    Component,
    EventLog,
    Firmware,
    InjectedFaults,
    MessageHandler,
    Parameters,
    Tuning,
)
from m2pem_plugin_mavlink.simulator.messages import Command, Outgoing, Peer, Result, Sender
from m2pem_plugin_mavlink.simulator.missions.plan import PlanStore
from m2pem_plugin_mavlink.simulator.missions.progress import MissionProgress
from m2pem_plugin_mavlink.simulator.missions.protocol import MissionServer
from m2pem_plugin_mavlink.simulator.modes import ModeSwitch
from m2pem_plugin_mavlink.simulator.motion_commands import MotionCommands
from m2pem_plugin_mavlink.simulator.parameters import ParameterServer
from m2pem_plugin_mavlink.simulator.reports import Reports, Texts
from m2pem_plugin_mavlink.simulator.sensors import Battery, Estimator
from m2pem_plugin_mavlink.simulator.signing import SigningState
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec
from m2pem_plugin_mavlink.simulator.streams import Streams

FIRMWARES: Mapping[str, type[Firmware]] = {"ardupilot": ArduPilot, "px4": Px4}


AUTOPILOT_COMPONENT = 1
REBOOT_S = 2.0
"""For how long a rebooting autopilot is silent."""

P = TypeVar("P", bound=Component)


class Autopilot:
    """One vehicle: its state of motion, its firmware and its components.

    Raises:
        ValueError: there is no such firmware, or not for that kind of vehicle.
    """

    def __init__(self, spec: VehicleSpec, now_s: float = 0.0, *, step_s: float = 0.02) -> None:
        self.spec = spec
        if spec.firmware not in FIRMWARES:
            known = ", ".join(FIRMWARES)
            raise ValueError(f"there is no firmware {spec.firmware!r}; there are: {known}")
        self.firmware = FIRMWARES[spec.firmware](spec)
        self.now_s = now_s
        self.step_s = step_s
        self.frame = LocalFrame(spec.home)
        self.body = BodyState(yaw_rad=spec.heading_rad)
        self.dynamics = dynamics_of(spec.kind)
        self.parameters = Parameters({**self.firmware.parameters(), **spec.parameters})
        self.plans = PlanStore()
        self.signing = SigningState(spec.signing_key)
        self.log = EventLog()
        self.injected_faults = InjectedFaults()
        self.outbox: list[Outgoing] = []
        self.peers: list[Peer] = []
        self.setpoint: MotionSetpoint = NoThrust()
        self._silent_until_s = now_s
        self._boot()

    def _boot(self) -> None:
        """Create all components anew; permanent memory (parameters, plans, key) stays."""
        spec = self.spec
        self.booted_s = self._silent_until_s
        self.components: list[Component] = []
        self.texts = self._add(Texts)
        self.estimator = self._add(Estimator)
        self.battery = self._add(Battery)
        self.home = self._add(Home)
        self.modes = self._add(ModeSwitch)
        self.arming = self._add(Arming)
        self.guided = self._add(MotionCommands)
        self.mission = self._add(MissionProgress)
        self.missions = self._add(MissionServer)
        self.payload = self._add(Payload)
        for kind in (ParameterServer, Identity, SystemCommands, Reports, Fence):
            self._add(kind)
        if spec.kind is Kind.COPTER if spec.gimbal is None else spec.gimbal:
            self._add(Gimbal)
        if spec.camera:
            self._add(Camera)
        for own in self.firmware.components():
            self._add(own)
        self._commands = self._add(CommandServer)
        self.streams = self._add(Streams)
        self._handlers: dict[tuple[int, str], list[MessageHandler]] = {}
        for component in self.components:
            self._commands.handlers.update(component.commands())
            for id_, maker in component.reports().items():
                if id_ not in self.firmware.unknown_reports:
                    self.streams.makers[id_] = maker
            for name, handler in component.messages().items():
                self._handlers.setdefault((component.component_id, name), []).append(handler)
        for peer in self.peers:
            self.streams.meet(peer)
        self.modes.start()

    def _add(self, kind: type[P]) -> P:
        component = kind(self)
        self.components.append(component)
        return component

    @property
    def since_boot_s(self) -> float:
        """Simulated time since the start."""
        return self.now_s - self.booted_s

    @property
    def boot_ms(self) -> int:
        """Milliseconds since the start, as messages have them."""
        return int(self.since_boot_s * 1000) & 0xFFFFFFFF

    @property
    def silent(self) -> bool:
        """Whether it is starting, and neither receives nor sends."""
        return self.now_s < self._silent_until_s

    @property
    def tuning(self) -> Tuning:
        """How the vehicle behaves, by the present parameters."""
        return self.parameters.derived(self.firmware.tuning)

    @property
    def target_point(self) -> Point | None:
        """The target of the present motion."""
        match self.setpoint:
            case PositionSetpoint(point=point) | CircleSetpoint(center=point):
                return point
        return None

    def log_event(self, kind: str, detail: str = "") -> None:
        """Add an event to the log."""
        self.log.log_event(self.now_s, kind, detail)

    @property
    def position(self) -> Point:
        """The position, from the origin of its frame."""
        return self.body.point

    def obey(self, command: Command) -> Result:
        """Execute a command, of any sender."""
        return self._commands.perform(command)

    def meet(self, peer: Peer) -> None:
        """Add a peer, if it is new."""
        if peer not in self.peers:
            self.peers.append(peer)
            self.streams.meet(peer)

    def component(self, kind: type[P]) -> P:
        """Return the component of a type.

        Raises:
            LookupError: there is none.
        """
        for component in self.components:
            if isinstance(component, kind):
                return component
        raise LookupError(kind.__name__)

    def send(self, message: Any, to: Peer | None = None, component: int = 1) -> None:
        """Put a message into the outbox, for one peer or (None) for all."""
        self.outbox.append(Outgoing(message, to, component))

    def say(self, text: str, severity: int = dialect.MAV_SEVERITY_INFO) -> None:
        """Send a STATUSTEXT to all."""
        self.texts.say(text, severity)

    def warn(self, text: str) -> None:
        """Send a STATUSTEXT with the reason of a refusal or fault."""
        self.texts.say(text, dialect.MAV_SEVERITY_CRITICAL)

    def take_outbox(self) -> list[Outgoing]:
        """Return the messages to send, and empty the outbox."""
        taken, self.outbox = self.outbox, []
        return taken

    def receive(self, message: Any, sender: Peer, now_s: float) -> None:
        """Receive a message of a peer."""
        self.meet(sender)
        if now_s > self.now_s:
            self.step(now_s)
        if self.silent or getattr(message, "target_system", 0) not in (0, self.spec.system):
            return
        component = getattr(message, "target_component", 0) or AUTOPILOT_COMPONENT
        origin = Sender(sender, message.get_srcSystem(), message.get_srcComponent())
        for handler in self._handlers.get((component, message.get_type()), ()):
            handler(message, origin)

    def step(self, now_s: float) -> None:
        """Advance simulated time to `now_s`, in small steps."""
        while self.now_s < now_s - 1e-9:
            dt_s = min(self.step_s, now_s - self.now_s)
            self.now_s += dt_s
            if self.silent:
                continue
            for component in self.components:
                component.step(dt_s)
            self.dynamics.step(self.body, self.setpoint, dt_s)

    def reboot(self) -> None:
        """Restart; the vehicle stays where it is."""
        self.log_event("reboot")
        self._silent_until_s = self.now_s + REBOOT_S
        self.signing.boot()
        self.setpoint = NoThrust()
        self._boot()
