"""The ways of a `Station` to an autopilot: a simulated one without I/O, a real one over UDP."""

import select
import socket
import time
from collections.abc import Callable
from typing import Any, Protocol

from m2pem_plugin_mavlink.simulator.autopilot import Autopilot
from m2pem_plugin_mavlink.simulator.sensors import EMPTY_V, FULL_V
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec
from pymavlink.dialects.v20 import ardupilotmega as dialect

SetParameter = Callable[[str, float], None]


class Wire(Protocol):
    """The way to an autopilot. `firmware`: "ardupilot" or "px4"."""

    kind: Kind
    firmware: str

    def send(self, frame: bytes) -> None:
        """Send a frame."""

    def receive(self) -> list[Any]:
        """Let a little time pass; the messages that came."""

    def battery(self, left: float, volts: float, set_parameter: SetParameter) -> None:
        """Let the battery have that part of its charge (0 to 1), and that voltage."""

    def satellites(self, there: bool, set_parameter: SetParameter) -> None:
        """Take the satellites away or give them back."""


class SimulatedWire:
    """To a simulated autopilot on simulated time, without I/O."""

    STEP_S = 0.1

    def __init__(self, spec: VehicleSpec) -> None:
        self.kind = spec.kind
        self.firmware = spec.firmware
        self.autopilot = Autopilot(spec, step_s=0.05)
        self.autopilot.meet("ground")
        self._parser = dialect.MAVLink(None)
        self._said = dialect.MAVLink(None)
        self._senders: dict[int, dialect.MAVLink] = {}

    def send(self, frame: bytes) -> None:
        """Hand it over."""
        for message in self._parser.parse_buffer(frame) or ():
            self.autopilot.receive(message, "ground", self.autopilot.now_s)

    def receive(self) -> list[Any]:
        """Step on; what it said, through real frames."""
        said: list[Any] = []
        self.autopilot.step(self.autopilot.now_s + self.STEP_S)
        for message, _, component in self.autopilot.take_outbox():
            if message is not None:
                frame = message.pack(self._sender(component))
                said += self._said.parse_buffer(frame) or ()
        return said

    def _sender(self, component: int) -> dialect.MAVLink:
        if component not in self._senders:
            made = dialect.MAVLink(None, self.autopilot.spec.system, component)
            self._senders[component] = made
        return self._senders[component]

    def battery(self, left: float, volts: float, set_parameter: SetParameter) -> None:
        """The simulated battery's voltage falls with its charge."""
        self.autopilot.battery.left = (
            left if self.firmware == "px4" else (volts - EMPTY_V) / (FULL_V - EMPTY_V)
        )

    def satellites(self, there: bool, set_parameter: SetParameter) -> None:
        """As `sim.faults` does it."""
        self.autopilot.injected_faults.gps_lost = not there


class UdpWire:
    """To an autopilot that sends to a UDP port of this machine, and simulates itself."""

    PATIENCE_S = 60.0

    def __init__(self, kind: Kind, firmware: str, port: int = 0) -> None:
        self.kind = kind
        self.firmware = firmware
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
        self._socket.bind(("127.0.0.1", port))
        self._socket.setblocking(False)
        self.port: int = self._socket.getsockname()[1]
        self._peer: Any = None
        self._parser = dialect.MAVLink(None)
        self._parser.robust_parsing = True
        self._received_s = time.monotonic()

    def send(self, frame: bytes) -> None:
        """Send it to whence the last datagram came."""
        if self._peer is not None:
            self._socket.sendto(frame, self._peer)

    def receive(self) -> list[Any]:
        """Wait for a datagram, at most 10 ms, and read all that are there.

        Raises:
            TimeoutError: the autopilot has been silent for a minute of the wall clock.
        """
        messages: list[Any] = []
        select.select([self._socket], [], [], 0.01)
        while True:
            try:
                data, self._peer = self._socket.recvfrom(65536)
            except BlockingIOError:
                break
            self._received_s = time.monotonic()
            messages += self._parser.parse_buffer(data) or ()
        if time.monotonic() - self._received_s > self.PATIENCE_S:
            raise TimeoutError("the autopilot is silent")
        return messages

    def battery(self, left: float, volts: float, set_parameter: SetParameter) -> None:
        """By a parameter: PX4's simulation knows the lowest charge, ArduPilot's the voltage."""
        if self.firmware == "px4":
            set_parameter("SIM_BAT_MIN_PCT", 100.0 * left)
            set_parameter("SIM_BAT_DRAIN", 1.0)
        else:
            set_parameter("SIM_BATT_VOLTAGE", volts)

    def satellites(self, there: bool, set_parameter: SetParameter) -> None:
        """By a parameter of the autopilot's own simulation."""
        if self.firmware == "px4":
            set_parameter("SIM_GPS_USED", 10.0 if there else 0.0)
        else:
            set_parameter("SIM_GPS1_ENABLE", float(there))

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
