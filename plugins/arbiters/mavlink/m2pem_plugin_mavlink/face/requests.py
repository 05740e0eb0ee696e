"""What ground stations ask vehicles for: messages, intervals, parameters, plans. Nothing here
changes what a vehicle does; what would is refused."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import Area, Fleet
from m2pem_plugin_mavlink.face import modes
from m2pem_plugin_mavlink.face.commands import Command
from m2pem_plugin_mavlink.face.components import CAMERA_MAKERS
from m2pem_plugin_mavlink.face.plan import Item
from m2pem_plugin_mavlink.face.plan_messages import plan_id, plan_message
from m2pem_plugin_mavlink.face.stations import HEARTBEAT, Station
from m2pem_plugin_mavlink.face.streams import Streams, is_known, messages_of
from m2pem_plugin_mavlink.face.telemetry import heartbeat
from m2pem_plugin_mavlink.face.vehicle import AUTOPILOT, Camera, ShownVehicle
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.station_requests import refusal_of_ftp, requested_intervals

ACCEPTED: int = dialect.MAV_RESULT_ACCEPTED
DENIED: int = dialect.MAV_RESULT_DENIED
UNSUPPORTED: int = dialect.MAV_RESULT_UNSUPPORTED
REJECTED: int = dialect.MAV_RESULT_TEMPORARILY_REJECTED

MISSION, FENCE = 0, 1
"""MAV_MISSION_TYPE."""

GLOBAL_INT: int = dialect.MAV_FRAME_GLOBAL_INT
KEEP_IN: int = dialect.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION
KEEP_OUT: int = dialect.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION

MOST_DOWNLOADS = 64
UNKNOWN_PROGRESS = 255

Say = Callable[[Station, ShownVehicle, str], None]
"""Tells a station why something is refused."""


@dataclass(frozen=True, slots=True)
class Request:
    """A message of a ground station to a vehicle. `source`: the address of its sender; `camera`:
    the component that it is addressed to, None: the autopilot."""

    message: Message
    source: Address
    station: Station
    vehicle: ShownVehicle
    camera: Camera | None

    @property
    def component(self) -> Address:
        """The address of the component."""
        own = self.camera.component if self.camera is not None else AUTOPILOT
        return Address(self.vehicle.system, own)

    @property
    def by(self) -> str:
        """Who asks, for the journal."""
        return name_of(self.source, self.station)

    def answer(self, message: Message) -> None:
        """Send a message of the component to the sender."""
        self.station.send(message, self.component)


def name_of(source: Address, station: Station) -> str:
    """Return who asks, for the journal."""
    return f"mavlink {source.system}/{source.component} at {station.name}"


_ONE_MESSAGE: Mapping[int, int] = {
    dialect.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION,
    dialect.MAV_CMD_GET_HOME_POSITION: dialect.MAVLINK_MSG_ID_HOME_POSITION,
    dialect.MAV_CMD_REQUEST_CAMERA_INFORMATION: dialect.MAVLINK_MSG_ID_CAMERA_INFORMATION,
    dialect.MAV_CMD_REQUEST_CAMERA_SETTINGS: dialect.MAVLINK_MSG_ID_CAMERA_SETTINGS,
    dialect.MAV_CMD_REQUEST_STORAGE_INFORMATION: dialect.MAVLINK_MSG_ID_STORAGE_INFORMATION,
    dialect.MAV_CMD_REQUEST_CAMERA_CAPTURE_STATUS: dialect.MAVLINK_MSG_ID_CAMERA_CAPTURE_STATUS,
    dialect.MAV_CMD_REQUEST_PROTOCOL_VERSION: 300,  # PROTOCOL_VERSION
    dialect.MAV_CMD_REQUEST_FLIGHT_INFORMATION: dialect.MAVLINK_MSG_ID_FLIGHT_INFORMATION,
    dialect.MAV_CMD_REQUEST_VIDEO_STREAM_INFORMATION: 269,  # VIDEO_STREAM_INFORMATION
    dialect.MAV_CMD_REQUEST_VIDEO_STREAM_STATUS: dialect.MAVLINK_MSG_ID_VIDEO_STREAM_STATUS,
}
"""Commands that ask for one message; the last four are UNSUPPORTED."""


class Requests:
    """Answers requests of stations."""

    def __init__(self, streams: Streams, fleet: Fleet, say: Say) -> None:
        self._streams = streams
        self._say = say
        area = fleet.geometries.get(fleet.fence)
        self._fence = [
            (Item(*corner[:2], 0.0, GLOBAL_INT), len(ring) - 1, KEEP_OUT if hole else KEEP_IN)
            for hole, ring in enumerate(area.rings if isinstance(area, Area) else ())
            for corner in ring[:-1]
        ]
        self._downloads: dict[tuple[str, Address, int, int], Sequence[Message]] = {}
        self._commands: Mapping[int, Callable[[Command, Request], int]] = {
            **dict.fromkeys((dialect.MAV_CMD_REQUEST_MESSAGE, *_ONE_MESSAGE), self._send),
            dialect.MAV_CMD_SET_MESSAGE_INTERVAL: self._set_interval,
            dialect.MAV_CMD_GET_MESSAGE_INTERVAL: self._get_interval,
        }
        self._messages: Mapping[str, Callable[[Request], None]] = {
            "PARAM_REQUEST_LIST": self._list_parameters,
            "PARAM_REQUEST_READ": self._read_parameter,
            "PARAM_SET": self._set_parameter,
            "REQUEST_DATA_STREAM": self._set_streams,
            "FILE_TRANSFER_PROTOCOL": self._refuse_file,
            "LOG_REQUEST_LIST": self._list_logs,
            "MISSION_REQUEST_LIST": self._list_items,
            "MISSION_REQUEST": self._send_item,
            "MISSION_REQUEST_INT": self._send_item,
        }

    def command(self, command: Command, request: Request) -> int | None:
        """Carry out a command that only asks; return its MAV_RESULT; None: it is another one."""
        answer = self._commands.get(command.id)
        return None if answer is None else answer(command, request)

    def message(self, request: Request) -> bool:
        """Answer a message; return False if it is of another kind."""
        answer = self._messages.get(request.message.TYPE.name)
        if answer is not None:
            answer(request)
        return answer is not None

    # --- messages and intervals -------------------------------------------------------------------

    def _send(self, command: Command, request: Request) -> int:
        id_, station = _ONE_MESSAGE.get(command.id, _whole(command.params[0])), request.station
        if request.camera is not None:
            make = CAMERA_MAKERS.get(id_)
            if make is None:
                return UNSUPPORTED
            request.answer(make(request.camera))
            return ACCEPTED
        if station.ardupilot_modes and id_ in (modes.AVAILABLE_MODES, modes.CURRENT_MODE):
            return UNSUPPORTED  # they have PX4's numbers
        if id_ == modes.AVAILABLE_MODES:
            return self._send_modes(_whole(command.params[1]), request)
        if not is_known(id_):
            return UNSUPPORTED
        found = messages_of(request.vehicle, id_)
        for message, source in found:
            station.send(message, source)
        return ACCEPTED if found else DENIED

    @staticmethod
    def _send_modes(index: int, request: Request) -> int:
        if not 0 <= index <= len(modes.MODES):
            return DENIED
        for each in [index] if index else range(1, len(modes.MODES) + 1):
            request.answer(modes.available_mode(each))
        return ACCEPTED

    def _set_interval(self, command: Command, request: Request) -> int:
        id_, interval_us = _whole(command.params[0]), command.params[1]
        if request.camera is not None or not is_known(id_):
            return UNSUPPORTED
        if not math.isfinite(interval_us) or (id_ == HEARTBEAT and interval_us < 0):
            return DENIED
        interval_s = interval_us / 1e6
        set_ = self._streams.set_interval(request.station, request.vehicle, id_, interval_s)
        return ACCEPTED if set_ else REJECTED

    def _get_interval(self, command: Command, request: Request) -> int:
        id_ = _whole(command.params[0])
        if request.camera is not None:
            return UNSUPPORTED
        interval_us = 0
        if is_known(id_):
            interval_s = self._streams.interval_s(request.station, request.vehicle, id_)
            interval_us = round(interval_s * 1e6) or -1
        number = max(0, min(id_, 0xFFFF))
        make = message_type("MESSAGE_INTERVAL").make
        request.answer(make(message_id=number, interval_us=interval_us))
        return ACCEPTED

    def _set_streams(self, request: Request) -> None:
        request.station.ardupilot_modes = True
        for id_, interval_s in requested_intervals(request.message).items():
            if is_known(id_):
                self._streams.set_interval(request.station, request.vehicle, id_, interval_s)

    def clock(
        self, message: Message, source: Address, station: Station, vehicles: Iterable[ShownVehicle]
    ) -> None:
        """Answer PING and TIMESYNC for all vehicles that are present; each answer counts as a frame
        of the station."""
        is_ping = message.TYPE.name == "PING"
        if message.target_system if is_ping else message.tc1:
            return  # it is an answer itself
        now_s = self._streams.now_s()
        for vehicle in vehicles:
            if vehicle.state is None or not vehicle.present or not station.may_send(now_s):
                continue
            own_ns = vehicle.state.time_us * 1000 + round((now_s - vehicle.received_s) * 1e9)
            changed = source.as_target if is_ping else {"tc1": own_ns}
            station.send(message._replace(**changed), vehicle.autopilot)

    @staticmethod
    def _refuse_file(request: Request) -> None:
        # MAVProxy asks for ArduPilot's parameters 1 s after it meets a vehicle, for streams 15 s.
        request.station.ardupilot_modes |= b"@PARAM" in bytes(request.message.payload)
        if (answer := refusal_of_files(request.message, request.source)) is not None:
            request.answer(answer)

    @staticmethod
    def _list_logs(request: Request) -> None:
        request.answer(message_type("LOG_ENTRY").make(num_logs=0))

    # --- parameters -------------------------------------------------------------------------------

    def _list_parameters(self, request: Request) -> None:
        for index in range(len(_PARAMETERS)):
            request.answer(_parameter(index, request.vehicle))

    def _read_parameter(self, request: Request) -> None:
        name, index = request.message.param_id, request.message.param_index
        known = index if index >= 0 else _index_of(name)
        if 0 <= known < len(_PARAMETERS):
            request.answer(_parameter(known, request.vehicle))
        else:
            unknown = dialect.MAV_PARAM_ERROR_DOES_NOT_EXIST
            request.answer(_parameter_error(name, index, request.source, unknown))

    def _set_parameter(self, request: Request) -> None:
        name = request.message.param_id
        index, error = _index_of(name), dialect.MAV_PARAM_ERROR_READ_ONLY
        if index >= 0:
            request.answer(_parameter(index, request.vehicle))
        else:
            error = dialect.MAV_PARAM_ERROR_DOES_NOT_EXIST
        request.answer(_parameter_error(name, -1, request.source, error))
        text = f"{name.decode('ascii', 'replace')}: parameters are read-only here"
        self._say(request.station, request.vehicle, text)

    # --- the plan ---------------------------------------------------------------------------------

    def _list_items(self, request: Request) -> None:
        type_ = request.message.mission_type
        items = self._items(type_, request.source.as_target, request.vehicle)
        key = _download(request)
        self._downloads.pop(key, None)
        if len(self._downloads) >= MOST_DOWNLOADS:
            del self._downloads[next(iter(self._downloads))]
        self._downloads[key] = items
        make = plan_message("MISSION_COUNT").make
        own = {"count": len(items), "mission_type": type_, "opaque_id": plan_id(items)}
        request.answer(make(**request.source.as_target, **own))

    def _send_item(self, request: Request) -> None:
        items = self._downloads.get(_download(request))
        if items is None:
            items = self._items(
                request.message.mission_type, request.source.as_target, request.vehicle
            )
        if request.message.seq < len(items):
            request.answer(items[request.message.seq])
        else:
            acknowledge_plan(request, dialect.MAV_MISSION_INVALID_SEQUENCE)

    def _items(self, type_: int, to: dict[str, int], vehicle: ShownVehicle) -> list[Message]:
        uploads = vehicle.uploaded, vehicle.uploaded_fence, vehicle.rally_points
        uploaded = uploads[type_].items if 0 <= type_ < len(uploads) else ()
        if uploaded and (type_ != MISSION or vehicle.shows_upload):
            run = vehicle.plan_run
            current = run.current if vehicle.runs_plan and run is not None else 0
            return [
                as_item(each, to, current=type_ == MISSION and number == current)
                for number, each in enumerate(uploaded)
            ]
        if type_ == MISSION:
            plan, command = vehicle.plan, dialect.MAV_CMD_NAV_WAYPOINT
            return [
                _item(number, command, item, **to, param4=math.nan, current=number == plan.current)
                for number, item in enumerate(plan.items)
            ]
        if type_ == FENCE:
            return [
                _item(number, command, item, **to, param1=corners, mission_type=FENCE)
                for number, (item, corners, command) in enumerate(self._fence)
            ]
        return []


def refusal_of_files(message: Message, to: Address) -> Message | None:
    """Return the answer to FILE_TRANSFER_PROTOCOL: there are no files; None: it asks nothing."""
    payload = refusal_of_ftp(bytes(message.payload))
    if payload is None:
        return None
    return message._replace(payload=tuple(payload), **to.as_target)


def refusals_of(message: Message, to: Address) -> list[Message]:
    """Return how the protocol of a message says that it is refused; none: it cannot."""
    name = message.TYPE.name
    if name in ("COMMAND_LONG", "COMMAND_INT", "SET_MODE"):
        command = dialect.MAV_CMD_DO_SET_MODE if name == "SET_MODE" else message.command
        return [acknowledgement(command, DENIED, to)]
    if name in ("MISSION_COUNT", "MISSION_CLEAR_ALL", "MISSION_WRITE_PARTIAL_LIST"):
        denied = {"type": dialect.MAV_MISSION_DENIED, "mission_type": message.mission_type}
        return [plan_message("MISSION_ACK").make(**to.as_target, **denied)]
    if name == "PARAM_SET":
        return [_parameter_error(message.param_id, -1, to, dialect.MAV_PARAM_ERROR_READ_ONLY)]
    if name == "FILE_TRANSFER_PROTOCOL":
        refusal = refusal_of_files(message, to)
        return [] if refusal is None else [refusal]
    return []


def acknowledgement(command: int, result: int, to: Address) -> Message:
    """Return COMMAND_ACK."""
    progress = UNKNOWN_PROGRESS if result == dialect.MAV_RESULT_IN_PROGRESS else 0
    make = message_type("COMMAND_ACK").make
    return make(command=command, result=result, progress=progress, **to.as_target)


def _parameter_error(name: bytes, index: int, to: Address, error: int) -> Message:
    make = message_type("PARAM_ERROR").make
    return make(**to.as_target, param_id=name, param_index=index, error=error)


def _download(request: Request) -> tuple[str, Address, int, int]:
    vehicle, type_ = request.vehicle, request.message.mission_type
    return request.station.name, request.source, vehicle.system, type_


def acknowledge_plan(
    request: Request, result: int, type_: int | None = None, plan: int = 0
) -> None:
    """Answer a message of the mission protocol by MISSION_ACK. `plan`: its id, if it is new."""
    if type_ is None:
        type_ = getattr(request.message, "mission_type", MISSION)
    make = plan_message("MISSION_ACK").make
    to = request.source.as_target
    request.answer(make(**to, type=result, mission_type=type_, opaque_id=plan))


def as_item(message: Message, to: dict[str, int], *, current: bool) -> Message:
    """Return an uploaded item as it is downloaded."""
    if message.TYPE.name == "MISSION_ITEM_INT":
        return message._replace(**to, current=current)
    fields = dict(zip(message.TYPE.make._fields, message, strict=True))
    scale = 1.0 if message.frame == dialect.MAV_FRAME_MISSION else 1e7
    fields |= {"x": round(message.x * scale), "y": round(message.y * scale), "current": current}
    return message_type("MISSION_ITEM_INT").make(**{**fields, **to})


def _whole(value: float) -> int:
    return int(value) if math.isfinite(value) else -1


def _item(number: int, command: int, item: Item, **fields: float) -> Message:
    return message_type("MISSION_ITEM_INT").make(
        seq=number,
        command=command,
        frame=item.frame,
        autocontinue=1,
        x=round(item.latitude_deg * 1e7),
        y=round(item.longitude_deg * 1e7),
        z=item.altitude_m,
        **fields,
    )


_PARAMETERS: Sequence[tuple[bytes, Callable[[ShownVehicle], float]]] = (
    (b"MAV_SYS_ID", lambda vehicle: float(vehicle.system)),
    (b"MAV_COMP_ID", lambda vehicle: float(vehicle.autopilot.component)),
    (b"MAV_TYPE", lambda vehicle: float(heartbeat(vehicle).type)),
)
"""Ground stations wait for a list of parameters; this is the shortest that is true."""


def _index_of(name: bytes) -> int:
    found = (index for index, (each, _) in enumerate(_PARAMETERS) if each == name)
    return next(found, -1)


def _parameter(index: int, vehicle: ShownVehicle) -> Message:
    name, read = _PARAMETERS[index]
    return message_type("PARAM_VALUE").make(
        param_id=name,
        param_value=read(vehicle),
        param_type=dialect.MAV_PARAM_TYPE_REAL32,
        param_count=len(_PARAMETERS),
        param_index=index,
    )
