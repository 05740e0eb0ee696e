"""A ground station that speaks raw MAVLink to one autopilot and records what it answers.

It knows nothing of the arbiter, so that it can judge real and simulated autopilots alike. Times are
seconds of the autopilot's own clock (`time_boot_ms`), places metres from where it started.
"""

import math
import struct
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_recording import ARDUPILOT_MODES, OWN, Recording
from mavlink_wires import SimulatedWire, Wire
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as dialect

SECOND = 254
"""System id of the second ground station."""
GROUND_COMPONENT = dialect.MAV_COMP_ID_MISSIONPLANNER
DEGREE_M = 111_194.9
ACK_WITHIN_S = 5.0
SETTLE_S = 1.5
"""For how long a step goes on after its answer, so that what it causes is seen within it."""

STREAMS_HZ = {
    dialect.MAVLINK_MSG_ID_SYSTEM_TIME: 10,
    dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 5,
    dialect.MAVLINK_MSG_ID_MISSION_CURRENT: 5,
    dialect.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 5,
    dialect.MAVLINK_MSG_ID_SYS_STATUS: 2,
    dialect.MAVLINK_MSG_ID_EKF_STATUS_REPORT: 2,
    dialect.MAVLINK_MSG_ID_ESTIMATOR_STATUS: 2,
    dialect.MAVLINK_MSG_ID_GPS_RAW_INT: 2,
    dialect.MAVLINK_MSG_ID_FENCE_STATUS: 2,
}
GIMBAL_STREAMS_HZ = {
    dialect.MAVLINK_MSG_ID_GIMBAL_DEVICE_ATTITUDE_STATUS: 5,
    dialect.MAVLINK_MSG_ID_GIMBAL_MANAGER_STATUS: 5,
}

At = tuple[float, float, float]
"""North, east and up of where the vehicle started, m."""

HOLD = {Kind.COPTER: "BRAKE", Kind.ROVER: "HOLD", Kind.BOAT: "HOLD", Kind.PLANE: "LOITER"}
"""The mode of ArduPilot in which a vehicle stays."""


class Station(Recording):
    """One conversation."""

    def __init__(self, wire: Wire, system: int = 1) -> None:
        super().__init__(wire.kind.value, wire.firmware)
        self.system = system
        self.wire = wire
        self.kind = wire.kind
        self.px4 = wire.firmware == "px4"
        self.now_s = 0.0
        self.home: tuple[float, float, float] | None = None
        self.beats = True
        self.sticks = False
        """The second station sends those of a pilot, centred, ten times a second."""
        self._heard: list[Any] = []
        self._beaten_s = -math.inf
        self._held_s = -math.inf
        self._senders = {
            system: dialect.MAVLink(None, system, GROUND_COMPONENT) for system in (OWN, SECOND)
        }

    # --- observation ------------------------------------------------------------------------------

    @property
    def flies(self) -> bool:
        """It is an aircraft."""
        return self.kind in (Kind.COPTER, Kind.PLANE)

    @property
    def hold(self) -> str:
        """The mode in which it stays where it is."""
        return "LOITER" if self.px4 else HOLD[self.kind]

    @property
    def guided(self) -> str:
        """The mode in which it goes where it is commanded."""
        return "LOITER" if self.px4 else "GUIDED"

    @property
    def auto(self) -> str:
        """The mode in which it executes its mission."""
        return "MISSION" if self.px4 else "AUTO"

    @property
    def mode(self) -> str:
        """The name of the vehicle's mode."""
        return str(self.known.get("mode", ""))

    @property
    def armed(self) -> bool:
        """As the last heartbeat says."""
        return bool(self.known.get("armed"))

    @property
    def height_m(self) -> float:
        """Above home."""
        message = self.latest.get("GLOBAL_POSITION_INT")
        return math.nan if message is None else message.relative_alt / 1e3

    @property
    def speed_mps(self) -> float:
        """Over ground."""
        message = self.latest.get("GLOBAL_POSITION_INT")
        return math.nan if message is None else math.hypot(message.vx, message.vy) / 100

    def distance_m(self, north_m: float = 0.0, east_m: float = 0.0) -> float:
        """From a place, horizontally."""
        message = self.latest.get("GLOBAL_POSITION_INT")
        if message is None or self.home is None:
            return math.nan
        latitude, longitude = self.place(north_m, east_m)
        return math.hypot(
            (message.lat / 1e7 - latitude) * DEGREE_M,
            (message.lon / 1e7 - longitude) * DEGREE_M * self._shrink,
        )

    @property
    def _shrink(self) -> float:
        assert self.home is not None
        return math.cos(math.radians(self.home[0]))

    def place(self, north_m: float, east_m: float) -> tuple[float, float]:
        """Latitude and longitude of a place."""
        assert self.home is not None, "the vehicle has not said where it is"
        return (
            self.home[0] + north_m / DEGREE_M,
            self.home[1] + east_m / DEGREE_M / self._shrink,
        )

    # --- what goes on -----------------------------------------------------------------------------

    def pump(self) -> None:
        """Let a little time pass and take in what came."""
        if self.beats and self.now_s - self._beaten_s >= 1.0:
            self._beaten_s = self.now_s
            self.send(
                dialect.MAVLink_heartbeat_message(
                    dialect.MAV_TYPE_GCS, dialect.MAV_AUTOPILOT_INVALID, 0, 0, 0, 3
                )
            )
        if self.sticks and self.now_s - self._held_s >= 0.1:
            self._held_s = self.now_s
            self.send(dialect.MAVLink_manual_control_message(self.system, 0, 0, 500, 0, 0), SECOND)
        for message in self.wire.receive():
            if message.get_type() == "BAD_DATA" or message.get_srcSystem() != self.system:
                continue
            if message.get_srcComponent() == 1:
                self._heard.append(message)
                self.take(message)
                if message.get_type() == "SYSTEM_TIME":
                    self.now_s = message.time_boot_ms / 1e3
        if isinstance(self.wire, SimulatedWire):
            self.now_s = self.wire.autopilot.since_boot_s

    def watch(self, seconds: float = SETTLE_S) -> None:
        """Let time pass."""
        until_s = self.now_s + seconds
        while self.now_s < until_s:
            self.pump()

    def until(self, what: str, condition: Callable[[], bool], limit_s: float = 90.0) -> bool:
        """Wait until something is so; the trace says after how long, or that it never was."""
        start_s = self.now_s
        while not condition():
            if self.now_s - start_s > limit_s:
                self.once("never", what)
                return False
            self.pump()
        self.took(what, self.now_s - start_s)
        return True

    # --- what is said -----------------------------------------------------------------------------

    def send(self, message: Any, system: int = OWN) -> None:
        """Send a message as one of the two stations."""
        sender = self._senders[system]
        frame = message.pack(sender)
        sender.seq = (sender.seq + 1) % 256
        self.wire.send(frame)

    def answer(self, *kinds: str, within_s: float = ACK_WITHIN_S) -> Any:
        """Wait for a message of one of these types; None: none came."""
        until_s = self.now_s + within_s
        while True:
            for number, message in enumerate(self._heard):
                if message.get_type() in kinds:
                    del self._heard[: number + 1]
                    return message
            self._heard.clear()
            if self.now_s >= until_s:
                return None
            self.pump()

    def _acked(self, command: int) -> int | None:
        until_s = self.now_s + ACK_WITHIN_S
        while self.now_s < until_s:
            ack = self.answer("COMMAND_ACK", within_s=until_s - self.now_s)
            if ack is not None and ack.command == command:
                return int(ack.result)
        self.once("ack", "none")
        return None

    def command(
        self, what: str, command: int, *params: float, system: int = OWN, settle_s: float = SETTLE_S
    ) -> int | None:
        """A step: COMMAND_LONG; the result that acknowledges it."""
        self.begin(what)
        self._heard.clear()
        padded = [*params, *[0.0] * (7 - len(params))]
        self.send(dialect.MAVLink_command_long_message(self.system, 1, command, 0, *padded), system)
        result = self._acked(command)
        self.watch(settle_s)
        return result

    def command_int(self, what: str, command: int, params: Sequence[float], at: At) -> int | None:
        """A step: COMMAND_INT with a place; PX4 takes heights above the sea alone."""
        assert self.home is not None
        self.begin(what)
        self._heard.clear()
        latitude, longitude = self.place(at[0], at[1])
        frame, up_m = dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT, at[2]
        if self.px4:
            frame, up_m = dialect.MAV_FRAME_GLOBAL, at[2] + self.home[2]
        self.send(
            dialect.MAVLink_command_int_message(
                *(self.system, 1, frame, command, 0, 0, *params),
                *(round(latitude * 1e7), round(longitude * 1e7), up_m),
            )
        )
        result = self._acked(command)
        self.watch()
        return result

    def set_mode(self, mode: str, system: int = OWN, settle_s: float = SETTLE_S) -> int | None:
        """A step: DO_SET_MODE."""
        who = "second station: " if system != OWN else ""
        if self.px4:
            _, main, sub = mavutil.px4_map.get(mode, (0, 99, 0))
        else:
            numbers = {name: n for n, name in ARDUPILOT_MODES[self.kind.value].items()}
            main, sub = numbers.get(mode, 99), 0
        set_mode = dialect.MAV_CMD_DO_SET_MODE
        return self.command(
            f"{who}mode {mode}", set_mode, 1, main, sub, system=system, settle_s=settle_s
        )

    def arm(self) -> int | None:
        """A step."""
        return self.command("arm", dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1)

    def disarm(self) -> int | None:
        """A step."""
        return self.command("disarm", dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0)

    def take_off(self, height_m: float = 20.0) -> int | None:
        """A step: MAV_CMD_NAV_TAKEOFF; PX4 takes heights above the sea alone."""
        assert self.home is not None
        nan = math.nan
        params: tuple[float, ...] = (0, 0, 0, 0, 0, 0, height_m)
        if self.px4:
            params = (nan, nan, nan, nan, nan, nan, height_m + self.home[2])
        return self.command("take off", dialect.MAV_CMD_NAV_TAKEOFF, *params)

    def go_to(self, what: str, at: At, speed_mps: float = -1.0) -> int | None:
        """A step: DO_REPOSITION, which also changes the mode."""
        heading = math.nan if self.px4 else 0.0
        return self.command_int(what, dialect.MAV_CMD_DO_REPOSITION, (speed_mps, 1, 0, heading), at)

    def set_speed(self, what: str, speed_mps: float) -> int | None:
        """A step: DO_CHANGE_SPEED, over ground (airspeed of planes)."""
        kind = 0 if self.kind is Kind.PLANE else 1
        return self.command(what, dialect.MAV_CMD_DO_CHANGE_SPEED, kind, speed_mps, -1)

    # --- parameters -------------------------------------------------------------------------------

    def parameter(self, parameter: str, value: float) -> None:
        """A step: PARAM_SET and what comes back."""
        self.begin(f"set {parameter} = {value:g}")
        self._note_value(parameter, self._set(parameter, value))

    def read(self, parameter: str) -> None:
        """A step: PARAM_REQUEST_READ and what comes back."""
        self.begin(f"read {parameter}")
        self._note_value(parameter, self._read(parameter))

    def _note_value(self, parameter: str, answer: Any) -> None:
        if answer is None:
            self.note(parameter, None)
        elif answer.get_type() == "PARAM_ERROR":
            self.note(parameter, name_of_error(answer.error))
        else:
            self.note(parameter, round(self._value(answer), 3))

    def _set(self, parameter: str, value: float) -> Any:
        kind = dialect.MAV_PARAM_TYPE_REAL32
        if self.px4:
            known = self._read(parameter)
            kind = kind if known is None else known.param_type
            if kind == dialect.MAV_PARAM_TYPE_INT32:
                (value,) = struct.unpack("<f", struct.pack("<i", int(value)))
        self._heard.clear()
        self.send(
            dialect.MAVLink_param_set_message(self.system, 1, parameter.encode(), value, kind)
        )
        return self._answered(parameter)

    def _read(self, parameter: str) -> Any:
        self._heard.clear()
        self.send(
            dialect.MAVLink_param_request_read_message(self.system, 1, parameter.encode(), -1)
        )
        return self._answered(parameter)

    def _answered(self, parameter: str) -> Any:
        until_s = self.now_s + ACK_WITHIN_S
        while self.now_s < until_s:
            answer = self.answer("PARAM_VALUE", "PARAM_ERROR", within_s=until_s - self.now_s)
            if answer is not None and answer.param_id == parameter:
                return answer
        return None

    def _value(self, answer: Any) -> float:
        if self.px4 and answer.param_type == dialect.MAV_PARAM_TYPE_INT32:
            (value,) = struct.unpack("<i", struct.pack("<f", answer.param_value))
            return float(value)
        return float(answer.param_value)

    # --- what happens to the vehicle --------------------------------------------------------------

    def battery(self, left: float, volts: float) -> None:
        """A step: the battery has that part of its charge, and that voltage."""
        self.begin(f"battery at {100 * left:.0f} %")
        self.wire.battery(left, volts, self._set)

    def satellites(self, there: bool) -> None:
        """A step: satellites go or come back."""
        self.begin("satellites are back" if there else "no satellites")
        self.wire.satellites(there, self._set)

    def silence(self) -> None:
        """A step: the ground station says nothing any more."""
        self.begin("the ground station falls silent")
        self.beats = False

    # --- plans ------------------------------------------------------------------------------------

    def set_quietly(self, parameter: str, value: float) -> None:
        """No step: PARAM_SET of the second station, without waiting."""
        kind = dialect.MAV_PARAM_TYPE_REAL32
        name = parameter.encode()
        self.send(dialect.MAVLink_param_set_message(self.system, 1, name, value, kind), SECOND)

    def command_quietly(self, command: int, *params: float) -> None:
        """No step: COMMAND_LONG of the second station, without waiting."""
        padded = [*params, *[0.0] * (7 - len(params))]
        self.send(dialect.MAVLink_command_long_message(self.system, 1, command, 0, *padded), SECOND)

    def item(
        self, command: int, at: At | None = None, params: Sequence[float] = (), plan: int = 0
    ) -> Any:
        """An item of a plan, whose number `upload` sets; without a place: a command."""
        latitude, longitude = (0.0, 0.0) if at is None else self.place(at[0], at[1])
        padded = [*params, *[0.0] * (4 - len(params))]
        frame = dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT
        if at is None:
            frame = dialect.MAV_FRAME_MISSION
        return dialect.MAVLink_mission_item_int_message(
            *(self.system, 1, 0, frame, command, 0, 1, *padded),
            *(round(latitude * 1e7), round(longitude * 1e7), 0.0 if at is None else at[2], plan),
        )

    def mission(
        self, what: str, items: Sequence[Any], system: int = OWN, current: int | None = 0
    ) -> None:
        """A step: upload a mission; ArduPilot's has home as its first item."""
        if not self.px4:
            items = [self.item(dialect.MAV_CMD_NAV_WAYPOINT, (0.0, 0.0, 0.0)), *items]
        self.upload(what, items, system, current=current)

    def upload(
        self,
        what: str,
        items: Sequence[Any],
        system: int = OWN,
        plan: int = 0,
        current: int | None = 0,
    ) -> None:
        """A step: upload a plan as a well-behaved station does; `current`: the item that it marks
        as the current one."""
        self.begin(what)
        self._heard.clear()
        for seq, item in enumerate(items):
            item.seq, item.current = seq, int(seq == current)
        self.send(dialect.MAVLink_mission_count_message(self.system, 1, len(items), plan), system)
        while True:
            message = self.answer("MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK")
            if message is None or message.get_type() == "MISSION_ACK":
                break
            self.send(items[message.seq], system)
        self.watch()

    @property
    def version(self) -> str:
        """Of the firmware: its number and the beginning of its hash."""
        message = self.latest.get("AUTOPILOT_VERSION")
        if message is None:
            return ""
        number = message.flight_sw_version
        digits = ".".join(str(number >> shift & 0xFF) for shift in (24, 16, 8))
        custom = bytes(message.flight_custom_version)
        # ArduPilot gives the characters, PX4 the number, its last byte first.
        return f"{digits} {custom[::-1].hex()[:8] if self.px4 else custom.decode('ascii')}"

    # --- common beginnings ------------------------------------------------------------------------

    def connect(self) -> None:
        """Hear the autopilot and ask it for the streams that the trace is made of."""
        while "HEARTBEAT" not in self.latest:
            self.pump()
        self._stream(STREAMS_HZ)
        while "SYSTEM_TIME" not in self.latest:
            self.pump()
        version = dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION
        ask = dialect.MAV_CMD_REQUEST_MESSAGE
        self.send(
            dialect.MAVLink_command_long_message(self.system, 1, ask, 0, version, 0, 0, 0, 0, 0, 0)
        )
        self._acked(ask)
        self.answer("AUTOPILOT_VERSION", within_s=1.0)

    def _stream(self, rates_hz: Mapping[int, int]) -> None:
        interval = dialect.MAV_CMD_SET_MESSAGE_INTERVAL
        for id_, hz in rates_hz.items():
            params = (id_, 1e6 / hz, 0, 0, 0, 0, 0)
            message = dialect.MAVLink_command_long_message(self.system, 1, interval, 0, *params)
            self.send(message)
            self._acked(interval)

    def gimbal(self) -> None:
        """Ask for what the gimbal and its manager say; nothing of that is in the trace."""
        self._stream(GIMBAL_STREAMS_HZ)
        while not {"GIMBAL_DEVICE_ATTITUDE_STATUS", "GIMBAL_MANAGER_STATUS"} <= set(self.latest):
            self.pump()
        self.forget()

    def note_gimbal(self, settle_s: float = 8.0) -> None:
        """Part of a step: wait, then write down where the gimbal points and who controls it.

        Angles in degrees, to the nearest 5; the yaw as the message has it, from the nose or from
        north."""
        self.watch(settle_s)
        attitude = self.latest["GIMBAL_DEVICE_ATTITUDE_STATUS"]
        north = bool(attitude.flags & dialect.GIMBAL_DEVICE_FLAGS_YAW_LOCK)
        w, x, y, z = attitude.q
        pitch_deg = math.degrees(math.asin(max(-1.0, min(1.0, 2 * (w * y - x * z)))))
        yaw_deg = math.degrees(math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
        self.note("pitch", 5 * round(pitch_deg / 5))
        self.note("yaw", 5 * round(yaw_deg / 5))
        self.note("yaw from", "north" if north else "the nose")
        status = self.latest["GIMBAL_MANAGER_STATUS"]
        self.note("controlled by", status.primary_control_sysid)

    def start_anew(self) -> None:
        """The autopilot restarts: hear it again, and ask it again for its streams."""
        for _ in range(5):
            self.latest.pop("HEARTBEAT", None)
            while "HEARTBEAT" not in self.latest:
                self.pump()
        self._beaten_s = -math.inf
        self.latest.pop("SYSTEM_TIME", None)
        self.now_s = 0.0
        self.connect()

    @property
    def located(self) -> bool:
        """The estimator knows where the vehicle is, and it may be armed as far as that goes."""
        position = str(self.known.get("position", ""))
        if not position.startswith("there") or "GLOBAL_POSITION_INT" not in self.latest:
            return False
        if not self.px4:
            return position == "there"
        status = self.latest.get("SYS_STATUS")
        ready = dialect.MAV_SYS_STATUS_PREARM_CHECK
        return status is not None and bool(status.onboard_control_sensors_health & ready)

    def ready(self) -> None:
        """The vehicle knows where it is; nothing of that is in the trace."""
        self.until("position", lambda: self.located, 120.0)
        self.watch(3.0)
        here = self.latest["GLOBAL_POSITION_INT"]
        self.home = (here.lat / 1e7, here.lon / 1e7, here.alt / 1e3)
        self.forget()

    def armed_in_guided(self) -> None:
        """Armed, in the mode in which it can be commanded; nothing of that is in the trace.

        Raises:
            RuntimeError: the vehicle cannot be armed.
        """
        self.ready()
        for _ in range(30):
            self.set_mode(self.guided)
            if self.arm() == 0 and self.armed:
                self.forget()
                return
        raise RuntimeError(f"it cannot be armed: {self.trace[-2:]}")

    def airborne(self, height_m: float = 20.0) -> None:
        """An aircraft at a height, or a rover armed and ready; nothing of that is in the trace.

        Raises:
            RuntimeError: the vehicle does not climb.
        """
        if self.kind is Kind.PLANE and not self.px4:
            self._plane_up()
            return
        self.armed_in_guided()
        if self.flies:
            self.take_off(height_m)
            if not self.until("up", lambda: abs(self.height_m - height_m) < 1.0):
                raise RuntimeError(f"it does not climb: {self.trace}")
            if self.px4:
                self.until("loiter", lambda: self.mode == "LOITER")
            self.watch(3.0)
        self.forget()

    def _plane_up(self) -> None:
        """ArduPlane takes off in a mode of its own, circles there, and is then guided."""
        self.ready()
        for _ in range(30):
            self.set_mode("TAKEOFF")
            if self.arm() == 0 and self.armed:
                break
        if not self.until("up", lambda: self.height_m > 40.0):
            raise RuntimeError(f"it does not climb: {self.trace}")
        self.watch(15.0)
        self.set_mode("GUIDED")
        self.watch(5.0)
        self.forget()

    def landed(self, limit_s: float = 180.0) -> None:
        """Part of a step: wait until the motors stop."""
        self.until("disarmed", lambda: not self.armed, limit_s)
        self.watch(2.0)


def name_of_error(error: int) -> str:
    """What PARAM_ERROR says."""
    entry = dialect.enums.get("MAV_PARAM_ERROR", {}).get(error)
    return str(error) if entry is None else str(entry.name).removeprefix("MAV_PARAM_ERROR_")
