"""A process of rovers with ArduPilot, as far as an executive needs them, on UDP ports.

They stand armed, in GUIDED, each in its place; they send what autopilots send, and accept whatever
they are commanded. Needs Linux: the kernel says when a command has come.
"""

import multiprocessing
import random
import selectors
import socket
import struct
import time
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from m2pem_plugin_mavlink.protocol.frames import encode
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bench.programs.mavlink_frames import RATES_HZ
from bench.programs.mavlink_gateway import FRAME, SO_TIMESTAMPNS, TICK_S

SET_MODE: int = dialect.MAV_CMD_DO_SET_MODE
REPOSITION: int = dialect.MAV_CMD_DO_REPOSITION
STEERING = (SET_MODE, REPOSITION)
"""Commands that are told of; what a rover is to send may be asked for at any time."""

HOME = (47.397742, 8.545594)
APART_DEG = 0.001
COMMANDS = {each.id: each for each in map(message_type, ("COMMAND_LONG", "COMMAND_INT"))}
LATITUDE_E7, LONGITUDE_E7 = (round(each * 1e7) for each in HOME)
FIELDS: dict[str, dict[str, int]] = {
    "SYS_STATUS": {"battery_remaining": 80},
    "BATTERY_STATUS": {"battery_remaining": 80},
    "GPS_RAW_INT": {"fix_type": dialect.GPS_FIX_TYPE_3D_FIX},
    "EXTENDED_SYS_STATE": {"landed_state": dialect.MAV_LANDED_STATE_ON_GROUND},
    "EKF_STATUS_REPORT": {"flags": dialect.EKF_POS_HORIZ_ABS},
    "HOME_POSITION": {"latitude": LATITUDE_E7, "longitude": LONGITUDE_E7},
}
"""What is not 0 in the messages that are the same for all."""


def place(rover: int) -> tuple[float, float]:
    """Where it stands: latitude and longitude in degrees."""
    return HOME[0], HOME[1] + rover * APART_DEG


PER_PORT = 200
"""Rovers that speak to one port: there are 255 system ids."""


def address(rover: int) -> Address:
    """Of its autopilot."""
    return Address(rover % PER_PORT + 1, 1)


class Rover:
    """One of them, with a socket of its own."""

    def __init__(self, number: int, port: int) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
        self.socket.setblocking(False)
        self.socket.connect(("127.0.0.1", port))
        self._number = number
        self._sent = 0
        latitude, longitude = place(number)
        position = {"lat": round(latitude * 1e7), "lon": round(longitude * 1e7)}
        fields = {**FIELDS, "GLOBAL_POSITION_INT": position}
        self._messages: dict[str, Message] = {
            name: message_type(name).make(**fields.get(name, {})) for name in RATES_HZ
        }
        self._enter(15)  # GUIDED

    def _enter(self, custom_mode: int) -> None:
        self._messages["HEARTBEAT"] = message_type("HEARTBEAT").make(
            type=dialect.MAV_TYPE_GROUND_ROVER,
            autopilot=dialect.MAV_AUTOPILOT_ARDUPILOTMEGA,
            base_mode=dialect.MAV_MODE_FLAG_SAFETY_ARMED
            | dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED,
            custom_mode=custom_mode,
        )

    def tell(self, name: str) -> None:
        """Send one of its messages."""
        self.send(self._messages[name])

    def send(self, message: Message) -> None:
        """Send a message of any content."""
        self.socket.send(encode(message, self._sent & 255, address(self._number)))
        self._sent += 1

    def hear(self, pipe: Connection) -> None:
        """Answer what has come, and tell of steering: who, the command, and when (ns since the
        epoch)."""
        while True:
            try:
                data, (stamp, *_), _, _ = self.socket.recvmsg(2048, 256)
            except BlockingIOError:
                return
            length, _, _, _, low, high = FRAME.unpack_from(data)
            type_ = COMMANDS.get(low | high << 16)
            if type_ is None:
                continue
            command: Any = type_.unpack(data[10 : 10 + length])
            if command.command == SET_MODE:
                self._enter(round(command.param2))
                self.tell("HEARTBEAT")
            self.send(message_type("COMMAND_ACK").make(command=command.command))
            if command.command in STEERING:
                seconds, nanoseconds = struct.unpack("qq", stamp[2])
                pipe.send((self._number, command.command, seconds * 10**9 + nanoseconds))


def stream(count: int, rate_hz: int, pipe: Connection) -> None:
    """The process: is told the ports to speak to, and goes on until it is told something else."""
    kinds = [name for name, rate in RATES_HZ.items() for _ in range(rate)]
    random.Random(4).shuffle(kinds)
    ports: list[int] = pipe.recv()
    rovers = [Rover(number, ports[number // PER_PORT]) for number in range(count)]
    with selectors.DefaultSelector() as selector:
        selector.register(pipe, selectors.EVENT_READ)
        for rover in rovers:
            selector.register(rover.socket, selectors.EVENT_READ, rover)
        began_s = time.monotonic()
        sent = 0
        while True:
            due = int((time.monotonic() - began_s) * rate_hz * count)
            while sent < due:
                turn, number = divmod(sent, count)
                rovers[number].tell(kinds[(turn + number) % len(kinds)])
                sent += 1
            for key, _ in selector.select(TICK_S):
                if key.data is None:
                    return
                key.data.hear(pipe)


def started(count: int, rate_hz: int) -> tuple[BaseProcess, Connection]:
    """The process, and the pipe to it. To be called before there are threads, as it forks."""
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe()
    process = context.Process(target=stream, args=(count, rate_hz, theirs), daemon=True)
    process.start()
    return process, ours
