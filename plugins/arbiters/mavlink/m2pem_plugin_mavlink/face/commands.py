"""Commands of ground stations as behaviors of m2pem."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import ResourceId, Value
from m2pem_plugin_mavlink.face import modes
from m2pem_plugin_mavlink.face.vehicle import Camera, ShownVehicle
from m2pem_plugin_mavlink.protocol.messages import Message
from m2pem_plugin_mavlink.protocol.raw_frames import RawFrame
from m2pem_plugin_mavlink.vehicle.modes import PX4_AUTO, PX4_OFFBOARD, px4_mode

REQUEST_OPERATOR_CONTROL = 32100
"""MAV_CMD_REQUEST_OPERATOR_CONTROL, which pymavlink 2.4.50 does not have. Parameter 1: 1 asks for
control, 0 gives it back."""

POSITION_TARGET: int = dialect.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT

_FRAMES: Mapping[int, str] = {
    0: "amsl",
    5: "amsl",
    3: "relative",
    6: "relative",
    10: "terrain",
    11: "terrain",
}
"""The frame of altitudes of each MAV_FRAME that is global."""

POSITION_IGNORED = 1 | 2 | 4
"""POSITION_TARGET_TYPEMASK of the three coordinates."""

OFFBOARD: int = modes.GUIDED.number
FOLLOW_ME = px4_mode(PX4_AUTO, 8)
_REFUSED_MODES: Mapping[int, str] = {
    OFFBOARD: "Offboard needs a target that is carried out, a SET_POSITION_TARGET_GLOBAL_INT, "
    "before it; velocities, attitudes and local positions are not",
    FOLLOW_ME: "Follow Me is not carried out: the way of its target cannot be checked before. Send "
    "DO_REPOSITION, or follow a vehicle of the fleet by a mission",
}
"""Why modes of PX4 that programs ask for are refused."""

ENDLESS_TURNS = 1_000.0
"""Of DO_ORBIT without a number of turns, which autopilots circle until another command."""

YAW_LOCK = 16
"""GIMBAL_MANAGER_FLAGS: the yaw is from north."""

YAW_IN_EARTH_FRAME = 64

_OF_BOTH = dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | dialect.MAV_MODE_FLAG_SAFETY_ARMED
"""Flags of a base mode that stations of ArduPilot and PX4 send."""


class RefusedCommandError(Exception):
    """A command that is not carried out. `result`: its MAV_RESULT."""

    def __init__(self, reason: str, result: int = dialect.MAV_RESULT_DENIED) -> None:
        super().__init__(reason)
        self.reason = reason
        self.result = result


@dataclass(frozen=True, slots=True)
class Order:
    """One behavior on a vehicle or payload."""

    resource: ResourceId
    behavior: str
    parameters: Mapping[str, Value] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Command:
    """COMMAND_LONG or COMMAND_INT. `place`: latitude and longitude in degrees, if both are given;
    `z`: parameter 7, an altitude in the frame `altitude_frame`; `flags`: parameter 5 as it is.
    `may_be_px4s`: its station does what PX4's Offboard mode needs, and nothing of ArduPilot."""

    id: int
    params: tuple[float, float, float, float]
    place: tuple[float, float] | None
    z: float
    altitude_frame: str
    confirmation: int
    flags: int = 0
    may_be_px4s: bool = False

    @property
    def name(self) -> str:
        """Its name without MAV_CMD_."""
        if self.id == REQUEST_OPERATOR_CONTROL:
            return "REQUEST_OPERATOR_CONTROL"
        entry = dialect.enums["MAV_CMD"].get(self.id)
        return str(entry.name).removeprefix("MAV_CMD_") if entry is not None else f"{self.id}"


def command_of(message: Message, frame: RawFrame, *, may_be_px4s: bool = False) -> Command:
    """Read a command."""
    params = (message.param1, message.param2, message.param3, message.param4)
    if frame.id == dialect.MAVLINK_MSG_ID_COMMAND_LONG:
        x, y, z, altitude_frame = message.param5, message.param6, message.param7, "amsl"
        confirmation = message.confirmation
        flags = int(x) if math.isfinite(x) else 0
    else:
        x, y, z, confirmation = message.x * 1e-7, message.y * 1e-7, message.z, 0
        altitude_frame, flags = _FRAMES.get(message.frame, ""), message.x
    place, id_ = _place(x, y), message.command
    return Command(id_, params, place, z, altitude_frame, confirmation, flags, may_be_px4s)


def _place(latitude: float, longitude: float) -> tuple[float, float] | None:
    if not (math.isfinite(latitude) and math.isfinite(longitude)):
        return None
    if (latitude, longitude) == (0.0, 0.0) or abs(latitude) > 90 or abs(longitude) > 180:
        return None
    return latitude, longitude


Read = Callable[[Command, ShownVehicle], Order | None]
"""Returns what to do; None: it is so already.

Raises:
    RefusedCommandError: it cannot be done.
"""


def order_of(command: Command, vehicle: ShownVehicle, camera: Camera | None) -> Order | None:
    """Return what a command means; None: there is nothing to do. `camera`: the component that it is
    addressed to, if it is one.

    Raises:
        RefusedCommandError: m2pem does not do this.
    """
    if camera is not None:
        return _camera_order(command, camera)
    read = _READ.get(command.id)
    if read is None:
        raise RefusedCommandError(
            f"{command.name} is not carried out", dialect.MAV_RESULT_UNSUPPORTED
        )
    order = read(command, vehicle)
    is_own = order is not None and order.resource == vehicle.resource
    is_own = is_own and order is not None and order.behavior not in (modes.RUN_PLAN, modes.GUIDE)
    if order is not None and is_own and order.behavior not in vehicle.behaviors:
        raise RefusedCommandError(
            f"{vehicle.resource} has no behavior {order.behavior}",
            dialect.MAV_RESULT_UNSUPPORTED,
        )
    return order


def _target(
    vehicle: ShownVehicle, place: tuple[float, float], z: float, frame: str
) -> dict[str, Value]:
    parameters: dict[str, Value] = {"target": list(place)}
    if vehicle.domain in ("air", "subsurface") and math.isfinite(z):
        parameters["target"] = [*place, z]
        parameters["altitude_frame"] = frame
    return parameters


def _reposition(command: Command, vehicle: ShownVehicle) -> Order:
    if command.place is None:
        raise RefusedCommandError("DO_REPOSITION needs a latitude and a longitude")
    if not command.altitude_frame:
        raise RefusedCommandError("DO_REPOSITION needs a global frame")
    parameters = _target(vehicle, command.place, command.z, command.altitude_frame)
    speed = command.params[0]
    if math.isfinite(speed) and speed > 0:
        parameters["speed"] = f"{speed} m/s"
    return Order(vehicle.resource, "goto", parameters)


def _takeoff(command: Command, vehicle: ShownVehicle) -> Order:
    if not math.isfinite(command.z):
        raise RefusedCommandError("NAV_TAKEOFF needs an altitude")
    altitude_m = command.z
    # COMMAND_LONG has no frame: ArduPilot takes the altitude above home, PX4 above sea level.
    home = vehicle.home
    if command.altitude_frame == "amsl" and home is not None and altitude_m > home.altitude_m + 1:
        altitude_m -= home.altitude_m
    if altitude_m <= 0:
        raise RefusedCommandError("NAV_TAKEOFF needs an altitude above the ground")
    return Order(vehicle.resource, "takeoff", {"altitude": f"{altitude_m} m"})


def _speed(command: Command, vehicle: ShownVehicle) -> Order:
    speed = command.params[1]
    if not math.isfinite(speed) or speed <= 0:
        raise RefusedCommandError("DO_CHANGE_SPEED needs a speed in parameter 2")
    return Order(vehicle.resource, "set_speed", {"speed": f"{speed} m/s"})


def _pause(command: Command, vehicle: ShownVehicle) -> Order:
    if command.params[0] == 0:
        return Order(vehicle.resource, "hold")
    if not vehicle.runs_plan:
        raise RefusedCommandError("no run of an uploaded plan is paused")
    return Order(vehicle.resource, modes.RUN_PLAN)


def _start_plan(command: Command, vehicle: ShownVehicle) -> Order:
    first, last = command.params[:2]
    end = len(vehicle.uploaded.items) - 1
    if (math.isfinite(first) and first > 0) or (math.isfinite(last) and 0 < last < end):
        raise RefusedCommandError("a plan is carried out as a whole")
    return Order(vehicle.resource, modes.RUN_PLAN)


def _orbit(command: Command, vehicle: ShownVehicle) -> Order:
    radius_m, speed, _, turned_rad = command.params
    place = command.place
    if place is None and vehicle.state is not None and vehicle.state.position is not None:
        place = vehicle.state.position.latlon
    if place is None or not command.altitude_frame:
        raise RefusedCommandError("DO_ORBIT needs a place in a global frame")
    if radius_m < 0:
        raise RefusedCommandError("it circles clockwise only: the radius is above 0")
    frame = "amsl" if _is_amsl(command, vehicle) else command.altitude_frame
    parameters = _target(vehicle, place, command.z, frame)
    if math.isfinite(radius_m) and radius_m > 0:
        parameters["radius"] = f"{radius_m} m"
    if math.isfinite(speed) and speed > 0:
        parameters["speed"] = f"{speed} m/s"
    endless = not math.isfinite(turned_rad) or turned_rad == 0
    turns = ENDLESS_TURNS if endless else turned_rad / math.tau
    if turns < 0:
        raise RefusedCommandError("DO_ORBIT needs a number of turns above 0")
    parameters["turns"] = turns
    return Order(vehicle.resource, "orbit", parameters)


def _is_amsl(command: Command, vehicle: ShownVehicle) -> bool:
    """Return whether the altitude of DO_ORBIT is above sea level, whatever its frame says.

    PX4 takes it so in all frames, and MAVSDK (`do_orbit` of 3.15 and 4.1) sends one above sea level
    with the relative frame. Of both heights, the one nearer to the vehicle's is meant."""
    home, state = vehicle.home, vehicle.state
    if command.altitude_frame != "relative" or home is None or state is None:
        return False
    now_m, above_home_m = state.altitude_above_home_m or 0.0, command.z - home.altitude_m
    return above_home_m > 0 and abs(above_home_m - now_m) < abs(command.z - now_m)


def _loiter(command: Command, vehicle: ShownVehicle) -> Order:
    if command.place is None:
        return Order(vehicle.resource, "hold")
    return Order(
        vehicle.resource,
        "goto",
        _target(vehicle, command.place, command.z, command.altitude_frame or "relative"),
    )


def _set_mode(command: Command, vehicle: ShownVehicle) -> Order:
    base, main, sub = (int(each) if math.isfinite(each) else 0 for each in command.params[:3])
    if not base & dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
        raise RefusedCommandError("modes are set by their numbers, with base mode 1")
    # ArduPilot's numbers and PX4's main modes without a sub mode are alike: 6 is RTL of a copter,
    # and Offboard. pymavlink sends ArduPilot's with base mode 1 and zeros, PX4's with more flags;
    # MAVSDK sends PX4's with NaN.
    is_of_px4 = any(math.isnan(each) for each in (*command.params[2:], command.z))
    if is_of_px4 or main >= 256 or sub or base & ~_OF_BOTH:
        number = main if main >= 256 else px4_mode(main, sub)
        if number in _REFUSED_MODES:
            raise RefusedCommandError(_REFUSED_MODES[number])
        name, mode = modes.px4_name(number) or f"mode {number:#x}", modes.BY_NUMBER.get(number)
    else:
        name, mode = modes.by_ardupilot_number(main, vehicle.type)
        px4s = modes.px4_name(px4_mode(main)) if command.may_be_px4s else ""
        if mode is not None and px4s:
            raise RefusedCommandError(
                f"mode {main} is {px4s} of PX4 and {name} of ArduPilot, which SET_MODE sets"
            )
    if mode is None:
        raise RefusedCommandError(f"{name} cannot be commanded")
    if mode is modes.GUIDED:
        return Order(vehicle.resource, modes.GUIDE)
    return _of_mode(mode, vehicle)


def asks_for_offboard(command: Command) -> bool:
    """Return whether a command sets PX4's mode Offboard."""
    base, main, sub = command.params[:3]
    # Such as MAVSDK sends it. Without the NaN, the number may be that of a mode of ArduPilot.
    is_of_px4 = math.isnan(command.z) or command.may_be_px4s
    return (
        command.id == dialect.MAV_CMD_DO_SET_MODE
        and is_of_px4
        and (int(base) & 1, main, sub) == (1, PX4_OFFBOARD, 0)
    )


def _set_standard_mode(command: Command, vehicle: ShownVehicle) -> Order:
    standard = command.params[0]
    mode = next((each for each in modes.MODES if each.standard == standard != 0), None)
    if mode is None:
        raise RefusedCommandError(f"there is no standard mode {standard:g}")
    return _of_mode(mode, vehicle)


def _of_mode(mode: modes.Mode, vehicle: ShownVehicle) -> Order:
    if not mode.behavior:
        raise RefusedCommandError(f"the mode {mode.name} cannot be commanded")
    return Order(vehicle.resource, mode.behavior)


def _gimbal_of(vehicle: ShownVehicle, device: float) -> Camera:
    gimbals = [each for each in vehicle.cameras if each.gimbal_device]
    wanted = int(device) if math.isfinite(device) else 0
    found = next((each for each in gimbals if wanted in (0, each.gimbal_device)), None)
    if found is None:
        raise RefusedCommandError("it has no such gimbal", dialect.MAV_RESULT_UNSUPPORTED)
    return found


def _point(
    camera: Camera, vehicle: ShownVehicle, pitch_rad: float, yaw_rad: float, flags: int
) -> Order:
    """Point a gimbal; the yaw is from the vehicle's heading, or with a flag from north.

    Raises:
        RefusedCommandError: an angle is missing, or the vehicle's heading is not known.
    """
    if not (math.isfinite(pitch_rad) and math.isfinite(yaw_rad)):
        raise RefusedCommandError("a gimbal is pointed by a pitch and a yaw angle")
    if flags & (YAW_LOCK | YAW_IN_EARTH_FRAME):
        heading = vehicle.state.yaw_rad if vehicle.state is not None else None
        if heading is None:
            raise RefusedCommandError("its heading is not known")
        yaw_rad = math.remainder(yaw_rad - (math.pi / 2 - heading), 2 * math.pi)
    parameters: dict[str, Value] = {
        "bearing": f"{math.degrees(yaw_rad):.4f} deg",
        "elevation": f"{math.degrees(pitch_rad):.4f} deg",
    }
    return Order(camera.resource, "ptz_point_at", parameters)


def _pitch_yaw(command: Command, vehicle: ShownVehicle) -> Order:
    pitch, yaw = command.params[:2]
    camera = _gimbal_of(vehicle, command.z)
    return _point(camera, vehicle, math.radians(pitch), math.radians(yaw), command.flags)


def _roi(command: Command, vehicle: ShownVehicle) -> Order:
    if command.place is None:
        raise RefusedCommandError("DO_SET_ROI_LOCATION needs a latitude and a longitude")
    camera = _gimbal_of(vehicle, 0)
    parameters: dict[str, Value] = {"target": list(command.place)}
    if math.isfinite(command.z) and command.altitude_frame:
        parameters["target"] = [*command.place, command.z]
        parameters["altitude_frame"] = command.altitude_frame
    return Order(camera.resource, "ptz_point_at", parameters)


def _camera_order(command: Command, camera: Camera) -> Order | None:
    if command.id == dialect.MAV_CMD_SET_CAMERA_MODE and camera.takes_pictures:
        if command.params[1] != dialect.CAMERA_MODE_IMAGE:
            raise RefusedCommandError("it takes pictures alone: CAMERA_MODE_IMAGE")
        return None
    if command.id == dialect.MAV_CMD_IMAGE_START_CAPTURE and camera.takes_pictures:
        interval, count = command.params[1:3]
        if not math.isfinite(count) or not 1 <= count <= 10_000:
            raise RefusedCommandError("IMAGE_START_CAPTURE needs the number of pictures")
        parameters: dict[str, Value] = {"count": int(count)}
        if math.isfinite(interval) and interval > 0:
            parameters["interval"] = f"{interval} s"
        return Order(camera.resource, "take_picture", parameters)
    raise RefusedCommandError(f"{command.name} is not carried out", dialect.MAV_RESULT_UNSUPPORTED)


_READ: Mapping[int, Read] = {
    dialect.MAV_CMD_DO_REPOSITION: _reposition,
    dialect.MAV_CMD_NAV_TAKEOFF: _takeoff,
    dialect.MAV_CMD_NAV_LAND: lambda _, vehicle: Order(vehicle.resource, "land"),
    dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH: lambda _, vehicle: Order(
        vehicle.resource, "return_to_launch"
    ),
    dialect.MAV_CMD_DO_CHANGE_SPEED: _speed,
    dialect.MAV_CMD_DO_PAUSE_CONTINUE: _pause,
    dialect.MAV_CMD_MISSION_START: _start_plan,
    dialect.MAV_CMD_DO_ORBIT: _orbit,
    dialect.MAV_CMD_NAV_LOITER_UNLIM: _loiter,
    dialect.MAV_CMD_DO_SET_MODE: _set_mode,
    262: _set_standard_mode,  # MAV_CMD_DO_SET_STANDARD_MODE
    dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW: _pitch_yaw,
    dialect.MAV_CMD_DO_SET_ROI_LOCATION: _roi,
}


def position_order(message: Message, vehicle: ShownVehicle) -> Order | None:
    """Return the goto that SET_POSITION_TARGET_GLOBAL_INT means; None: it has no position.

    Raises:
        RefusedCommandError: its frame is not global.
    """
    if message.type_mask & POSITION_IGNORED:
        return None
    frame = _FRAMES.get(message.coordinate_frame)
    if frame is None:
        raise RefusedCommandError("a position target needs a global frame")
    place = _place(message.lat_int * 1e-7, message.lon_int * 1e-7)
    if place is None:
        return None
    return Order(vehicle.resource, "goto", _target(vehicle, place, message.alt, frame))
