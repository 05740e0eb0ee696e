"""One simulated autopilot without I/O: messages and simulated time in, messages out.

    autopilot = Autopilot(VehicleSpec(), now_s=0.0)
    autopilot.meet("gcs")
    autopilot.receive(message, "gcs", now_s=0.4)
    autopilot.step(now_s=0.5)
    for message, to, component in autopilot.take_outbox(): ...

What it can do is in its parts (`sim.part`), how its firmware behaves in `sim.firmware`. Time is
that of the simulation: whoever runs it decides how fast that passes.
"""

import logging
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.sim.arming import Arming
from m2pem_plugin_mavlink.sim.battery import Battery
from m2pem_plugin_mavlink.sim.body import Body
from m2pem_plugin_mavlink.sim.chronicle import Chronicle
from m2pem_plugin_mavlink.sim.command import Command, Result
from m2pem_plugin_mavlink.sim.commands.dispatch import CommandServer
from m2pem_plugin_mavlink.sim.commands.motion import MotionCommands
from m2pem_plugin_mavlink.sim.commands.payload import Payload
from m2pem_plugin_mavlink.sim.commands.system import SystemCommands
from m2pem_plugin_mavlink.sim.demands import Circle, Demand, Reach, Rest
from m2pem_plugin_mavlink.sim.estimator import Estimator
from m2pem_plugin_mavlink.sim.firmware import Tuning, firmware_of
from m2pem_plugin_mavlink.sim.geometry import LocalFrame, Point
from m2pem_plugin_mavlink.sim.guided import GuidedSetpoints
from m2pem_plugin_mavlink.sim.home import Home
from m2pem_plugin_mavlink.sim.identity import Identity
from m2pem_plugin_mavlink.sim.kinematics import kinematics_of
from m2pem_plugin_mavlink.sim.missions.plan import PlanStore
from m2pem_plugin_mavlink.sim.missions.progress import MissionProgress
from m2pem_plugin_mavlink.sim.missions.protocol import MissionServer
from m2pem_plugin_mavlink.sim.modes import ModeSwitch
from m2pem_plugin_mavlink.sim.parameters import Parameters, ParameterServer
from m2pem_plugin_mavlink.sim.part import MessageHandler, Part
from m2pem_plugin_mavlink.sim.peers import Heard, Outgoing, Peer
from m2pem_plugin_mavlink.sim.reports import Reports
from m2pem_plugin_mavlink.sim.specification import VehicleSpec
from m2pem_plugin_mavlink.sim.streams import Streams
from m2pem_plugin_mavlink.sim.texts import Texts

AUTOPILOT_COMPONENT = 1
REBOOT_S = 2.0
"""For how long a rebooting autopilot is silent."""

logger = logging.getLogger(__name__)


class Autopilot:
    """One vehicle: its body, its firmware and its parts."""

    def __init__(self, spec: VehicleSpec, now_s: float = 0.0, *, step_s: float = 0.02) -> None:
        self.spec = spec
        self.firmware = firmware_of(spec)
        self.now_s = now_s
        self.step_s = step_s
        self.frame = LocalFrame(spec.home)
        self.body = Body(yaw_rad=spec.heading_rad)
        self.kinematics = kinematics_of(spec.kind)
        self.parameters = Parameters({**self.firmware.parameters(), **spec.parameters})
        self.plans = PlanStore()
        self.chronicle = Chronicle()
        self.components = {0, AUTOPILOT_COMPONENT}
        self.outbox: list[Outgoing] = []
        self.peers: list[Peer] = []
        self.demand: Demand = Rest()
        self._silent_until_s = now_s
        self._boot()

    def _boot(self) -> None:
        """Make all parts anew; what is in permanent memory (parameters, plans) stays."""
        self.booted_s = self._silent_until_s
        self.texts = Texts(self)
        self.estimator = Estimator(self)
        self.battery = Battery(self)
        self.home = Home(self)
        self.modes = ModeSwitch(self)
        self.arming = Arming(self)
        self.guided = GuidedSetpoints(self)
        self.mission = MissionProgress(self)
        self.missions = MissionServer(self)
        self.payload = Payload(self)
        self.streams = Streams(self)
        self.parts: list[Part] = [
            self.texts,
            self.estimator,
            self.battery,
            self.home,
            self.modes,
            self.arming,
            self.guided,
            self.mission,
            self.missions,
            self.payload,
            ParameterServer(self),
            Identity(self),
            SystemCommands(self),
            MotionCommands(self),
            Reports(self),
        ]
        self.parts.extend(part(self) for part in self.firmware.parts())
        self._commands = CommandServer(self)
        self.parts += [self._commands, self.streams]
        self._handlers: dict[str, list[MessageHandler]] = {}
        for part in self.parts:
            self._commands.handlers.update(part.commands())
            self.streams.makers.update(part.reports())
            for name, handler in part.messages().items():
                self._handlers.setdefault(name, []).append(handler)
        for peer in self.peers:
            self.streams.meet(peer)
        self.modes.start()

    @property
    def since_boot_s(self) -> float:
        """Simulated time since it was started."""
        return self.now_s - self.booted_s

    @property
    def boot_ms(self) -> int:
        """The same, as messages have it."""
        return int(self.since_boot_s * 1000) & 0xFFFFFFFF

    @property
    def silent(self) -> bool:
        """It is starting, and neither hears nor speaks."""
        return self.now_s < self._silent_until_s

    @property
    def tuning(self) -> Tuning:
        """How it behaves, as its parameters say now."""
        return self.firmware.tuning(self.parameters)

    @property
    def target_point(self) -> Point | None:
        """Where it is on the way to."""
        match self.demand:
            case Reach(point=point) | Circle(center=point):
                return point
        return None

    def note(self, kind: str, detail: str = "") -> None:
        """Write into the chronicle."""
        self.chronicle.note(self.now_s, kind, detail)

    @property
    def position(self) -> Point:
        """Where it is, from the origin of its frame."""
        return self.body.point

    def obey(self, command: Command) -> Result:
        """Do what a command says, whoever sends it."""
        return self._commands.perform(command)

    def meet(self, peer: Peer) -> None:
        """There is somebody to talk to. Knowing him already is well."""
        if peer not in self.peers:
            self.peers.append(peer)
            self.streams.meet(peer)

    def part(self, kind: type[Part]) -> Part:
        """The part of that type.

        Raises:
            LookupError: there is none.
        """
        for part in self.parts:
            if isinstance(part, kind):
                return part
        raise LookupError(kind.__name__)

    def send(self, message: Any, to: Peer | None = None, component: int = 1) -> None:
        """Put a message into the outbox, for one peer or (None) for all."""
        self.outbox.append(Outgoing(message, to, component))

    def say(self, text: str, severity: int = dialect.MAV_SEVERITY_INFO) -> None:
        """Send a STATUSTEXT to all."""
        self.texts.say(text, severity)

    def warn(self, text: str) -> None:
        """Say why something is refused or wrong."""
        self.texts.say(text, dialect.MAV_SEVERITY_CRITICAL)

    def take_outbox(self) -> list[Outgoing]:
        """What is to be sent; it is yours, and the outbox is empty."""
        taken, self.outbox = self.outbox, []
        return taken

    def receive(self, message: Any, sender: Peer, now_s: float) -> None:
        """A message has come from a peer."""
        self.meet(sender)
        if now_s > self.now_s:
            self.step(now_s)
        if self.silent or not self._is_for_us(message):
            return
        heard = Heard(sender, message.get_srcSystem(), message.get_srcComponent())
        for handler in self._handlers.get(message.get_type(), ()):
            handler(message, heard)

    def _is_for_us(self, message: Any) -> bool:
        system = getattr(message, "target_system", 0)
        component = getattr(message, "target_component", 0)
        return system in (0, self.spec.system) and component in self.components

    def step(self, now_s: float) -> None:
        """Let simulated time pass up to then, in steps that are small enough."""
        while self.now_s < now_s - 1e-9:
            dt_s = min(self.step_s, now_s - self.now_s)
            self.now_s += dt_s
            if self.silent:
                continue
            for part in self.parts:
                part.step(dt_s)
            self.kinematics.step(self.body, self.demand, dt_s)

    def reboot(self) -> None:
        """Start anew; the vehicle stays where it is."""
        self._silent_until_s = self.now_s + REBOOT_S
        self.demand = Rest()
        self._boot()
