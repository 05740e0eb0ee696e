"""Which messages go to whom how often. ArduPilot sends little until it is asked.

Each peer has its own rates, set by SET_MESSAGE_INTERVAL, in simulated time.
"""

from collections.abc import Mapping
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.protocol.station_requests import requested_intervals
from m2pem_plugin_mavlink.simulator.interfaces import (
    AutopilotInterface,
    Component,
    MessageHandler,
    ReportMaker,
    on_command,
)
from m2pem_plugin_mavlink.simulator.messages import Command, Peer, Result, Sender


class Streams(Component):
    """Sends reports when they are due. `makers`: the makers of messages, by message id."""

    def __init__(self, autopilot: AutopilotInterface) -> None:
        super().__init__(autopilot)
        self.makers: dict[int, ReportMaker] = {}
        self._due: dict[Peer, dict[int, list[float]]] = {}
        self._next_s = 0.0

    def meet(self, peer: Peer) -> None:
        """Give a new peer the default streams of the firmware."""
        self._due[peer] = {}
        for id_, interval_s in self.autopilot.firmware.default_streams().items():
            if id_ in self.makers:
                self._set(peer, id_, interval_s)

    def _set(self, peer: Peer, id_: int, interval_s: float) -> None:
        self._due[peer][id_] = [interval_s, self.autopilot.now_s]
        self._next_s = self.autopilot.now_s

    def step(self, dt_s: float) -> None:
        """Send what is due."""
        now_s = self.autopilot.now_s
        if now_s < self._next_s - 1e-9:
            return
        next_s = now_s + 1.0
        made: dict[int, Any] = {}
        for peer, streams in self._due.items():
            for id_, entry in streams.items():
                if entry[1] <= now_s + 1e-9:
                    if id_ not in made:
                        made[id_] = self.makers[id_]()
                    if made[id_] is not None:
                        self.autopilot.send(made[id_], peer)
                    entry[1] = max(entry[1] + entry[0], now_s)
                next_s = min(next_s, entry[1])
        self._next_s = next_s

    def messages(self) -> Mapping[str, MessageHandler]:
        """ArduPilot also has the older way to set streams."""
        is_ardupilot = self.autopilot.firmware.is_ardupilot
        return {"REQUEST_DATA_STREAM": self._set_streams} if is_ardupilot else {}

    def _set_streams(self, message: Any, sender: Sender) -> None:
        for id_, interval_s in requested_intervals(message).items():
            self._due[sender.peer].pop(id_, None)
            if interval_s > 0 and id_ in self.makers:
                self._set(sender.peer, id_, max(interval_s, 1 / self.autopilot.firmware.loop_hz))

    @on_command(dialect.MAV_CMD_SET_MESSAGE_INTERVAL)
    def _set_interval(self, command: Command) -> Result:
        id_, interval_us = int(command.param1), command.param2
        peer = command.sender.peer
        if id_ in self.autopilot.firmware.silent_reports - self.makers.keys():
            return Result.ACCEPTED
        if id_ not in self.makers:
            return Result.DENIED if self.autopilot.firmware.is_ardupilot else Result.FAILED
        if interval_us < 0:
            self._due[peer].pop(id_, None)
        elif interval_us == 0:
            self._due[peer].pop(id_, None)
            default_s = self.autopilot.firmware.default_streams().get(id_)
            if default_s is not None:
                self._set(peer, id_, default_s)
        elif interval_us <= 1e6 / self.autopilot.firmware.loop_hz:
            self.autopilot.warn("Message interval too short")
            return Result.DENIED
        else:
            self._set(peer, id_, interval_us * 1e-6)
        return Result.ACCEPTED

    @on_command(dialect.MAV_CMD_REQUEST_MESSAGE)
    def _request(self, command: Command) -> Result:
        """ArduPilot acknowledges it even if there is nothing to send; PX4 denies it."""
        id_, firmware = int(command.param1), self.autopilot.firmware
        maker = self.makers.get(id_)
        message = maker() if maker else None
        if message is not None:
            self.autopilot.send(message, command.sender.peer)
        known = maker is not None or id_ in firmware.silent_reports
        if not firmware.is_ardupilot:
            return Result.DENIED if message is None else Result.ACCEPTED
        return Result.ACCEPTED if known else Result.FAILED
