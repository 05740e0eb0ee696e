"""Parameters: named numbers that set the vehicle up, and their protocol (mavlink.io, "Parameter
Protocol"). An unknown name gets no answer from ArduPilot, and PARAM_ERROR from PX4. MAVLink FTP, by
which ground stations ask for the list first, is refused."""

import math
from collections.abc import Iterator
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.protocol.station_requests import refusal_of_ftp
from m2pem_plugin_mavlink.simulator.interfaces import AutopilotInterface, Component, on_message
from m2pem_plugin_mavlink.simulator.messages import Peer, Sender

LIST_BURST = 25
"""How many of a list are sent in one step, that sockets' buffers do not overflow."""


class ParameterServer(Component):
    """Answers PARAM_REQUEST_LIST, PARAM_REQUEST_READ and PARAM_SET."""

    def __init__(self, autopilot: AutopilotInterface) -> None:
        super().__init__(autopilot)
        self._listing: dict[Peer, Iterator[str]] = {}

    @on_message("FILE_TRANSFER_PROTOCOL")
    def _refuse_file(self, message: Any, sender: Sender) -> None:
        if (payload := refusal_of_ftp(bytes(message.payload))) is not None:
            make = dialect.MAVLink_file_transfer_protocol_message
            answer = make(0, sender.system, sender.component, list(payload))
            self.autopilot.send(answer, sender.peer)

    def step(self, dt_s: float) -> None:
        """Send more of the lists that were asked for."""
        for peer, names in list(self._listing.items()):
            for _ in range(LIST_BURST):
                name = next(names, None)
                if name is None:
                    del self._listing[peer]
                    break
                self._send(name, peer, self.autopilot.parameters.index(name))

    @on_message("PARAM_REQUEST_LIST")
    def _list(self, message: Any, sender: Sender) -> None:
        self._listing[sender.peer] = iter(self.autopilot.parameters)

    @on_message("PARAM_REQUEST_READ")
    def _read(self, message: Any, sender: Sender) -> None:
        parameters = self.autopilot.parameters
        name: str | None = message.param_id
        if message.param_index != -1:
            name = parameters.name(message.param_index)
        if name is not None and name in parameters:
            self._send(name, sender.peer, parameters.index(name))
        else:
            self._unknown(message.param_id, message.param_index, sender)

    @on_message("PARAM_SET")
    def _set(self, message: Any, sender: Sender) -> None:
        """Set a parameter, and report its value to all peers."""
        name, parameters = message.param_id, self.autopilot.parameters
        if name not in parameters:
            self._unknown(name, -1, sender)
            return
        value = self.autopilot.firmware.parameter_from_wire(name, message.param_value)
        if math.isfinite(value):
            parameters[name] = value
        self._send(name, None, 0xFFFF)

    def _unknown(self, name: str, index: int, sender: Sender) -> None:
        if self.autopilot.firmware.is_ardupilot:
            return
        self.autopilot.send(
            dialect.MAVLink_param_error_message(
                *(sender.system, sender.component, name.encode(), index),
                dialect.MAV_PARAM_ERROR_DOES_NOT_EXIST,
            ),
            sender.peer,
        )

    def _send(self, name: str, to: Peer | None, index: int) -> None:
        parameters = self.autopilot.parameters
        self.autopilot.send(
            dialect.MAVLink_param_value_message(
                name.encode(),
                self.autopilot.firmware.parameter_to_wire(name, parameters[name]),
                self.autopilot.firmware.parameter_type(name),
                len(parameters),
                index,
            ),
            to,
        )
