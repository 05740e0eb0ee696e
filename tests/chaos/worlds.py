"""Vehicles on which rounds run missions.

The vehicles outlive every executive, and note themselves what they begin: the judge compares that
with the journal.
"""

import json
import os
import signal
import socket
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from m2pem_plugin_ros import loopback
from m2pem_plugin_ros.testing import reserved_domain

from m2pem.simulation.executions import EffectKind
from m2pem.simulation.state_file import recorded_effects
from tests.chaos.missions import HOME, ChaosMission, element_at, in_turn, place, two_ways
from tests.command_line import CommandLine, Program, install_plugin
from tests.faults.tcp_proxy import TcpProxy
from tests.preloaded import preloaded


@dataclass(frozen=True, slots=True)
class Begun:
    """A vehicle began a behavior. `behavior`: its id, such as r1.b2; "": the vehicle does not know,
    and `element` is what it was. `overlaps`: the behavior that it was still doing, "" if none."""

    vehicle: str
    behavior: str
    overlaps: str = ""
    element: str = ""


@dataclass(frozen=True, slots=True)
class Sign:
    """What a vehicle was commanded, as it noted it. `begun`: to move, and for which behavior, as in
    `Begun`; None: to stop, or it `arrived`. `at_s`: of `time.monotonic`; the state file of
    simulated vehicles has no time of the wall clock: 0."""

    vehicle: str
    begun: Begun | None
    at_s: float = 0.0
    arrived: bool = False


class World(Protocol):
    """The vehicles of one round, in a folder of its own."""

    name: str
    arbiter: str
    """`module:name` of the class of their arbiter."""
    speed: float
    pauses: bool
    """Whether they begin nothing again when a pause ends."""
    missions: tuple[ChaosMission, ...]
    fleet: Path
    environment: Mapping[str, str]
    """Variables that executives need to reach them."""

    def begun(self) -> Sequence[Begun]:
        """Return what the vehicles have begun, in order, by what they noted themselves."""
        ...

    def signs(self) -> Sequence[Sign]:
        """Return what the vehicles were commanded, in order."""
        ...

    def send_signal(self, number: int) -> None:
        """Send a signal to the process of the vehicles, where they have one of their own."""
        ...

    def close(self) -> None:
        """End the vehicles."""
        ...


_SIMULATED = """version: 1
name: chaos
origin: {{lat: 38.1075, lon: -77.3192, alt: 60.0}}
vehicles:
  ugv1: {{domain: ground, arbiter: sim, connection: {{state: {state}, telemetry_hz: 0.2}}}}
  ugv2: {{domain: ground, arbiter: sim, connection: {{state: {state}, telemetry_hz: 0.2}}}}
  uav1: {{domain: air, arbiter: sim, connection: {{state: {state}, telemetry_hz: 0.2}}}}
"""


class SimulatedVehicles:
    """Simulated vehicles whose state file outlives the executive, and has all that they began."""

    name = "simulated"
    arbiter = "m2pem.simulation.arbiters:SimArbiter"
    speed = 60.0
    pauses = True
    missions = (two_ways("ugv1", "uav1"), in_turn("ugv2", "ugv1"))
    environment: Mapping[str, str] = {}

    def __init__(self, folder: Path, speed: float = speed) -> None:
        self.speed = speed
        self.fleet = folder / "fleet.yaml"
        self._state = folder / "vehicles.state"
        self.fleet.write_text(_SIMULATED.format(state=self._state), encoding="utf-8")

    def begun(self) -> list[Begun]:
        """See `World.begun`."""
        doing: dict[str, str] = {}
        found: list[Begun] = []
        for effect in recorded_effects(self._state) if self._state.exists() else ():
            if effect.kind is EffectKind.START:
                found.append(
                    Begun(effect.resource, effect.behavior, doing.get(effect.resource, ""))
                )
                doing[effect.resource] = effect.behavior
            elif effect.kind is EffectKind.END and doing.get(effect.resource) == effect.behavior:
                del doing[effect.resource]
        return found

    def signs(self) -> list[Sign]:
        """See `World.signs`. A vehicle that goes on after a hold is commanded to move again."""
        found: list[Sign] = []
        doing: dict[str, Begun] = {}
        for effect in recorded_effects(self._state) if self._state.exists() else ():
            vehicle, kind = effect.resource, effect.kind
            if kind is EffectKind.START:
                doing[vehicle] = Begun(vehicle, effect.behavior)
            moves = kind in (EffectKind.START, EffectKind.RESUME)
            begun = doing.get(vehicle) if moves else None
            found.append(Sign(vehicle, begun, arrived=kind is EffectKind.END))
        return found

    def send_signal(self, number: int) -> None:
        """See `World.send_signal`: they have none."""
        raise NotImplementedError

    def close(self) -> None:
        """They end with the executive."""


_MAVLINK = """version: 1
name: chaos
origin: {lat: 38.1075, lon: -77.3192, alt: 60.0}
vehicles:
"""
_MAVLINK_VEHICLE = """  {name}:
    domain: {domain}
    arbiter: mavlink
    sitl: true
    lost_after: 120 s
    connection: {{url: "udpout://127.0.0.1:{port}", system_id: {system}}}
"""
_BY_SYSTEM = {1: "uav1", 2: "ugv1", 3: "ugv2"}

_AUTOPILOTS = """
import json, math, runpy, sys, time
from m2pem_plugin_mavlink.simulator.autopilot import Autopilot

notes = open({notes!r}, "a", buffering=1)
log_event = Autopilot.log_event

def stays(self, detail):
    place = self.frame.to_location(self.position)
    north, east = (float(each) for each in detail.split(","))
    return math.hypot(north - place.latitude_deg, east - place.longitude_deg) * 111_000 < 2.5

def noted(self, kind, detail=""):
    # To be sent to the place where it is begins nothing: it does not move.
    if kind == "motion" and "," in detail and stays(self, detail):
        kind = "stays"
    notes.write(json.dumps([self.spec.system, kind, detail, time.monotonic()]) + "\\n")
    log_event(self, kind, detail)

Autopilot.log_event = noted
sys.argv = ["m2pem", *{words!r}]
runpy.run_module("m2pem", run_name="__main__", alter_sys=True)
"""


def _free_ports(count: int) -> int:
    """Return the first of some UDP ports, one after the other, that nothing listens at."""
    while True:
        with ExitStack() as stack:
            some = [
                stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
                for _ in range(count)
            ]
            some[0].bind(("127.0.0.1", 0))
            first: int = some[0].getsockname()[1]
            with suppress(OSError):
                for place, each in enumerate(some[1:], 1):
                    each.bind(("127.0.0.1", first + place))
                return first


class MavlinkVehicles:
    """Simulated autopilots in a process of their own, over UDP, which note what they begin: a
    takeoff, a landing, a motion to another place."""

    name = "mavlink"
    arbiter = "m2pem_plugin_mavlink.arbiter:MavlinkArbiter"
    speed = 20.0
    pauses = False
    missions = SimulatedVehicles.missions
    environment: Mapping[str, str] = {}

    def __init__(self, folder: Path, speed: float = speed) -> None:
        self.speed = speed
        # Each autopilot listens, so that it receives from two executives at a time.
        first = _free_ports(len(_BY_SYSTEM))
        self.fleet = folder / "fleet.yaml"
        vehicles = (
            _MAVLINK_VEHICLE.format(
                name=name,
                domain="air" if name.startswith("uav") else "ground",
                port=first + system - 1,
                system=system,
            )
            for system, name in _BY_SYSTEM.items()
        )
        self.fleet.write_text(_MAVLINK + "".join(vehicles), encoding="utf-8")
        self._notes = folder / "vehicles.jsonl"
        words = [
            *("sim", "mavlink", "--copters", "1", "--rovers", "2", "--speed", f"{self.speed:g}"),
            *(
                "--listen",
                f"udp://127.0.0.1:{first}",
                "--ekf",
                "1s",
                "--home",
                ",".join(map(str, (*HOME, 60))),
            ),
            *("--set", "FS_GCS_ENABLE=0"),
        ]
        code = _AUTOPILOTS.format(notes=str(self._notes), words=words)
        with Path(os.devnull).open("r+b") as nothing, (folder / "vehicles.txt").open("wb") as said:
            streams = (nothing.fileno(), nothing.fileno(), said.fileno())
            environment = CommandLine(folder).environment
            self._process = preloaded().start(["-c", code], folder, environment, streams)

    def begun(self) -> list[Begun]:
        """See `World.begun`. Each place to which missions send a vehicle is another one."""
        return [sign.begun for sign in self.signs() if sign.begun is not None]

    def signs(self) -> list[Sign]:
        """See `World.signs`. No autopilot notes that it has arrived."""
        lines = self._notes.read_text(encoding="utf-8").splitlines(keepends=True)
        found = (_sign(*json.loads(line)) for line in lines if line.endswith("\n"))
        return [each for each in found if each is not None]

    def send_signal(self, number: int) -> None:
        """See `World.send_signal`."""
        self._process.send_signal(number)

    def close(self) -> None:
        """See `World.close`."""
        self._process.kill()
        self._process.wait()


class HostedVehicles(SimulatedVehicles):
    """Simulated vehicles of an arbiter host, a process of its own that has no other speed than 1.
    Between it and executives there is a `proxy`."""

    name = "zenoh"
    arbiter = "m2pem_plugin_zenoh.remote_arbiter:RemoteArbiter"
    speed = 1.0
    pauses = False
    hosted = -1
    """How many of them are of the host, the others of the executive's own process; -1: all."""

    def __init__(self, folder: Path, speed: float = speed) -> None:
        super().__init__(folder, speed)
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port: int = probe.getsockname()[1]
        self.proxy = TcpProxy(port)
        host = f'hosts: {{pi: {{connect: ["tcp/127.0.0.1:{self.proxy.port}"]}}}}\nvehicles:'
        text = self.fleet.read_text(encoding="utf-8").replace("vehicles:", host)
        text = text.replace("arbiter: sim,", "arbiter: sim, lost_after: 10 s,")
        text = text.replace("arbiter: sim,", "arbiter: sim, host: pi,", self.hosted)
        self.fleet.write_text(text, encoding="utf-8")
        self._m2pem = CommandLine(folder, self._environment(folder))
        self._words = (
            *("arbiter-host", "--fleet", self.fleet, "--state", folder / "host"),
            *("--listen", f"tcp/127.0.0.1:{port}"),
        )
        self._host = self._start()

    def _environment(self, folder: Path) -> dict[str, str]:
        return {}

    def _start(self) -> Program:
        host = self._m2pem.start(*self._words)
        for line in host.stderr:
            if "listens" in line:
                return host
        raise AssertionError(f"the host has ended: {host.rest()}")

    def send_signal(self, number: int) -> None:
        """See `World.send_signal`. A host that was killed is started again, as systemd would."""
        self._host.send(signal.Signals(number))
        if number == signal.SIGKILL:
            self._host.rest()
            self._host = self._start()

    def close(self) -> None:
        """See `World.close`."""
        self._m2pem.end()
        self.proxy.close()


BLOCK = signal.SIGUSR1
TROUBLE = "trouble"
"""The file in the folder of a round that is there for as long as something is wrong."""

_BLOCKING = f"""
import asyncio, signal, time
from pathlib import Path

def block():
    while Path({TROUBLE!r}).exists():
        time.sleep(0.01)

def soon(*_):
    asyncio.get_running_loop().call_soon_threadsafe(block)

signal.signal({BLOCK:d}, soon)
"""


class BlockingHost(HostedVehicles):
    """One vehicle of an arbiter host, where a plugin blocks all after the signal `BLOCK`, as long
    as there is the file `TROUBLE`."""

    name = "one on a host"
    arbiter = SimulatedVehicles.arbiter
    hosted = 1

    def _environment(self, folder: Path) -> dict[str, str]:
        return install_plugin(folder, "blocking", _BLOCKING)


STOPPED = ("BRAKE", "HOLD", "LOITER")
"""Modes in which an autopilot stays where it is."""


def _sign(system: int, kind: str, detail: str, at_s: float) -> Sign | None:
    begun = _begun(_BY_SYSTEM[system], kind, detail)
    if begun is None and (kind, detail in STOPPED) != ("mode", True):
        return None
    return Sign(_BY_SYSTEM[system], begun, at_s)


def _begun(vehicle: str, kind: str, detail: str) -> Begun | None:
    if kind == "takeoff":
        return Begun(vehicle, "", element="Up")
    if (kind, detail) == ("mode", "LAND"):
        return Begun(vehicle, "", element="Home")
    if kind != "motion":
        return None
    # A takeoff that begins again in the air climbs where it is.
    other = "Up" if vehicle.startswith("uav") else "Reverse"
    return Begun(vehicle, "", element=element_at(detail) or other)


@dataclass(frozen=True, slots=True)
class _Rover:
    """`connection`: how it is reached. `home`: where it is at first, metres east and north."""

    connection: Mapping[str, str]
    home: tuple[float, float]

    def line(self, name: str) -> str:
        """Its line of a fleet."""
        home = json.loads(place(*self.home))
        sim = {"home": home, "max_speed": "2 m/s", "acceleration": "2 m/s2"}
        settings = {
            "domain": "ground",
            "arbiter": "ros",
            "sitl": True,
            "lost_after": "120 s",
            "connection": {"namespace": f"/{name}", "sim": sim, **self.connection},
        }
        return f"  {name}: {json.dumps(settings)}\n"


class RosVehicles(SimulatedVehicles):
    """Simulated ROS 2 rovers in a process of their own, over DDS: one is reached by the topics of
    an m2pem node, one by Nav2. The aircraft is a simulated vehicle."""

    name = "ros"
    arbiter = "m2pem_plugin_ros.arbiter:RosArbiter"
    speed = 3.0  # what is on board steers each 0.05 s, or less often on a busy computer
    pauses = False
    rovers: Mapping[str, _Rover] = {
        "ugv1": _Rover({}, (0.0, -5.0)),
        "ugv2": _Rover({"driver": "nav2"}, (0.0, -15.0)),
    }

    def __init__(self, folder: Path, speed: float = speed) -> None:
        super().__init__(folder, speed)
        simulated = self.fleet.read_text(encoding="utf-8").splitlines(keepends=True)
        lines = [line for line in simulated if line.partition(":")[0].strip() not in self.rovers]
        lines += [rover.line(name) for name, rover in self.rovers.items()]
        self.fleet.write_text("".join(lines), encoding="utf-8")
        self._notes = folder / "vehicles.jsonl"
        self._signs: list[Sign] = []
        self._read = [0, 0]
        self._domain = ExitStack()
        self.environment = loopback.environment(self._domain.enter_context(reserved_domain()))
        words = ("sim", "ros", "--fleet", str(self.fleet), "--speed", f"{self.speed:g}")
        self._m2pem = CommandLine(folder, dict(self.environment))
        code = _ROVERS_CODE.format(notes=str(self._notes), words=words)
        self._process = self._m2pem.start("-c", code)
        self._process.until_text("ready")

    def begun(self) -> list[Begun]:
        """See `World.begun`."""
        return [*super().begun(), *(begun for begun, _ in self._rover_signs() if begun is not None)]

    def signs(self) -> list[Sign]:
        """See `World.signs`."""
        for file, found in enumerate((super().signs(), [sign for _, sign in self._rover_signs()])):
            self._signs += found[self._read[file] :]
            self._read[file] = len(found)
        return self._signs

    def _rover_signs(self) -> Iterator[tuple[Begun | None, Sign]]:
        """What rovers noted: what was begun by it, and the sign. A base that starts to move with no
        order has begun what no journal requested."""
        doing: dict[str, Begun] = {}
        for line in self._notes.read_text(encoding="utf-8").splitlines(keepends=True):
            if not line.endswith("\n"):
                return
            vehicle, kind, detail, at_s = json.loads(line)
            begun: Begun | None = None
            if kind == "begin":
                element = element_at(detail) if detail else "Reverse"
                before = doing.get(vehicle)
                begun = Begun(vehicle, "", before.element if before else "", element)
                doing[vehicle] = begun
            elif kind == "motion" and vehicle not in doing:
                begun = Begun(vehicle, "", element="a motion without an order")
            elif kind == "ended":
                doing.pop(vehicle, None)
            if kind != "motion" or begun is not None:
                moves = kind in ("begin", "resume", "motion")
                now = doing.get(vehicle, begun) if moves else None
                yield begun, Sign(vehicle, now, at_s, arrived=kind == "ended")

    def send_signal(self, number: int) -> None:
        """See `World.send_signal`."""
        self._process.send(signal.Signals(number))

    def close(self) -> None:
        """See `World.close`."""
        self._m2pem.end()
        self._domain.close()


class RosActionVehicles(RosVehicles):
    """The same, reached by Nav2 and by the action of an m2pem node."""

    name = "ros-action"
    rovers: Mapping[str, _Rover] = {
        "ugv1": _Rover({"driver": "nav2"}, (0.0, -5.0)),
        "ugv2": _Rover({"via": "action"}, (0.0, -15.0)),
    }


_ROVERS_CODE = """
from pathlib import Path
from tests.chaos.ros_rovers import main

main(Path({notes!r}), {words!r})
"""

WORLDS: Mapping[str, type[SimulatedVehicles] | type[MavlinkVehicles]] = {
    each.name: each
    for each in (
        SimulatedVehicles,
        MavlinkVehicles,
        HostedVehicles,
        BlockingHost,
        RosVehicles,
        RosActionVehicles,
    )
}
OF_ROS = tuple(name for name, world in WORLDS.items() if issubclass(world, RosVehicles))
"""Those that need ROS 2, which is in an environment of its own."""
