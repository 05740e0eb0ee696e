"""The commands of mission items: what becomes of each in a route, and which task does it instead.

Numbers, names and parameters: https://mavlink.io/en/messages/common.html and ardupilotmega.html.
"""

from collections.abc import Iterator, Mapping, Sequence
from enum import Enum, auto
from typing import NamedTuple


class Treatment(Enum):
    """What becomes of an item. Without what is refused, a vehicle would fly another way."""

    WAYPOINT = auto()  # of the route
    WAIT = auto()  # a waypoint; that the vehicle waits there is left out
    STAY = auto()  # a waypoint at which the vehicle stays; refused where waypoints follow
    SPEED = auto()  # from the waypoint on
    BEGIN = auto()  # left out before the first waypoint, refused behind it
    END = auto()  # left out behind the last waypoint, refused before it
    REFUSED = auto()  # anywhere
    LEFT_OUT = auto()  # anywhere: the way is the same
    FENCE = auto()  # an area, its corner, or a point: no part of the route


class Command(NamedTuple):
    """`name`: without MAV_CMD_; `remedy`: how a mission does it; `value`: a format of the seven
    parameters, with what of them a person needs for that."""

    name: str
    treatment: Treatment
    remedy: str = ""
    value: str = ""

    @property
    def title(self) -> str:
        """The name as people know it."""
        return f"MAV_CMD_{self.name}"

    def said(self, params: Sequence[float | None]) -> str:
        """Return what of its parameters a person needs; "": nothing."""
        value = self.value if params[4] or params[5] else self.value.split("at {")[0]
        return value.format(*(each or 0.0 for each in params)).rstrip()


_TABLE = """
WAYPOINT
  16 NAV_WAYPOINT
WAIT a task `hold` behind a route up to it
  19 NAV_LOITER_TIME = {0:g} s
STAY a task `hold`, or `orbit` for a plane
  17 NAV_LOITER_UNLIM; 18 NAV_LOITER_TURNS = {0:g} turns, radius {2:g} m
SPEED
  178 DO_CHANGE_SPEED
BEGIN a task `takeoff` before it
  22 NAV_TAKEOFF = to {6:g} m; 24 NAV_TAKEOFF_LOCAL; 84 NAV_VTOL_TAKEOFF = to {6:g} m
END a task `goto` to its place, then `land`
  21 NAV_LAND = at {4:.7f}, {5:.7f}; 85 NAV_VTOL_LAND = at {4:.7f}, {5:.7f}
END a task `return_to_launch`
  20 NAV_RETURN_TO_LAUNCH
END a task `change_altitude` at its place
  31 NAV_LOITER_TO_ALT = to {6:g} m at {4:.7f}, {5:.7f}
END no task does it: altitudes count from the vehicle's own home
  179 DO_SET_HOME
END a task `run_onboard_mission` (arbiter mavlink) does the file as it is
  94 NAV_PAYLOAD_PLACE = at {4:.7f}, {5:.7f}
  185 DO_FLIGHTTERMINATION; 193 DO_PAUSE_CONTINUE; 194 DO_SET_REVERSE
  210 DO_INVERTED_FLIGHT
REFUSED draw the curve as waypoints
  34 DO_ORBIT; 35 DO_FIGURE_EIGHT; 36 NAV_ARC_WAYPOINT; 82 NAV_SPLINE_WAYPOINT
REFUSED `loop` of the task that follows the route, or a loop of the mission
  177 DO_JUMP = to {0:g}, {1:g} times; 601 DO_JUMP_TAG = to tag {0:g}, {1:g} times
  224 DO_SET_MISSION_CURRENT = to {0:g}
REFUSED a task `change_altitude`, between one route up to there and one from there on
  30 NAV_CONTINUE_AND_CHANGE_ALT; 113 CONDITION_CHANGE_ALT; 186 DO_CHANGE_ALTITUDE = {0:g} m
REFUSED a task `run_onboard_mission` (arbiter mavlink) flies the file as it is
  23 NAV_LAND_LOCAL; 25 NAV_FOLLOW; 81 NAV_PATHPLANNING; 83 NAV_ALTITUDE_WAIT; 92 NAV_GUIDED_ENABLE
  176 DO_SET_MODE; 192 DO_REPOSITION; 213 NAV_SET_YAW_SPEED; 30001 PAYLOAD_PREPARE_DEPLOY
  42702 NAV_SCRIPT_TIME; 42703 NAV_ATTITUDE_TIME
LEFT_OUT a task `hold` behind a route up to there
  93 NAV_DELAY = {0:g} s
LEFT_OUT what follows it counts from the waypoint on
  112 CONDITION_DELAY = {0:g} s; 114 CONDITION_DISTANCE = {0:g} m; 4501 CONDITION_GATE
LEFT_OUT `heading` of a task `goto`
  115 CONDITION_YAW = {0:g} deg
LEFT_OUT a task `ptz_point_at` or `ptz_track` of the camera
  80 NAV_ROI; 195 DO_SET_ROI_LOCATION = at {4:.7f}, {5:.7f}; 196 DO_SET_ROI_WPNEXT_OFFSET
  197 DO_SET_ROI_NONE; 198 DO_SET_ROI_SYSID; 201 DO_SET_ROI = at {4:.7f}, {5:.7f}
  204 DO_MOUNT_CONFIGURE; 205 DO_MOUNT_CONTROL; 220 DO_MOUNT_CONTROL_QUAT
  1000 DO_GIMBAL_MANAGER_PITCHYAW = pitch {0:g}, yaw {1:g} deg; 1001 DO_GIMBAL_MANAGER_CONFIGURE
LEFT_OUT tasks `take_picture` of the camera
  202 DO_DIGICAM_CONFIGURE; 203 DO_DIGICAM_CONTROL; 206 DO_SET_CAM_TRIGG_DIST = every {0:g} m
  214 DO_SET_CAM_TRIGG_INTERVAL = every {0:g} ms; 260 OBLIQUE_SURVEY; 530 SET_CAMERA_MODE
  2000 IMAGE_START_CAPTURE; 2001 IMAGE_STOP_CAPTURE; 2003 DO_TRIGGER_CONTROL; 2800 PANORAMA_CREATE
LEFT_OUT tasks `record_video` and `zoom` of the camera
  200 DO_CONTROL_VIDEO; 531 SET_CAMERA_ZOOM; 2500 VIDEO_START_CAPTURE; 2501 VIDEO_STOP_CAPTURE
LEFT_OUT a task `deploy` (arbiter mavlink)
  181 DO_SET_RELAY; 182 DO_REPEAT_RELAY; 183 DO_SET_SERVO = {0:g} to {1:g}; 184 DO_REPEAT_SERVO
  187 DO_SET_ACTUATOR; 211 DO_GRIPPER; 30002 PAYLOAD_CONTROL_DEPLOY
LEFT_OUT a task `land` or `return_to_launch`
  188 DO_RETURN_PATH_START; 189 DO_LAND_START
LEFT_OUT the fleet's `fence`
  207 DO_FENCE_ENABLE
LEFT_OUT no task does it: set it in the autopilot
  180 DO_SET_PARAMETER; 190 DO_RALLY_LAND; 191 DO_GO_AROUND; 208 DO_PARACHUTE; 209 DO_MOTOR_TEST
  212 DO_AUTOTUNE_ENABLE; 215 DO_SET_RESUME_REPEAT_DIST; 216 DO_SPRAYER; 217 DO_SEND_SCRIPT_MESSAGE
  218 DO_AUX_FUNCTION; 221 DO_GUIDED_MASTER; 222 DO_GUIDED_LIMITS; 223 DO_ENGINE_CONTROL
  400 COMPONENT_ARM_DISARM; 405 ILLUMINATOR_ON_OFF; 532 SET_CAMERA_FOCUS; 534 SET_CAMERA_SOURCE
  600 JUMP_TAG; 3000 DO_VTOL_TRANSITION; 42600 DO_WINCH
FENCE
  5000 NAV_FENCE_RETURN_POINT; 5001 NAV_FENCE_POLYGON_VERTEX_INCLUSION
  5002 NAV_FENCE_POLYGON_VERTEX_EXCLUSION; 5003 NAV_FENCE_CIRCLE_INCLUSION
  5004 NAV_FENCE_CIRCLE_EXCLUSION; 5100 NAV_RALLY_POINT
"""
"""Treatments and remedies, and below each the commands: number, name, and what of the parameters a
person needs."""


def _read(table: str) -> Iterator[tuple[int, Command]]:
    treatment, remedy = Treatment.WAYPOINT, ""
    for line in table.strip().splitlines():
        if not line.startswith(" "):
            name, _, remedy = line.partition(" ")
            treatment = Treatment[name]
            continue
        for entry in line.split("; "):
            command, _, value = entry.strip().partition(" = ")
            number, name = command.split()
            yield int(number), Command(name, treatment, remedy, value)


COMMANDS: Mapping[int, Command] = dict(_read(_TABLE))

_NAVIGATION = (range(16, 96), range(31000, 31005))
"""Commands that move a vehicle, known or not: MAV_CMD_NAV_LAST is 95; those of users."""

ENDINGS = frozenset({17, 20, 21, 85})
"""Behind these the mission is over."""

POLYGONS = frozenset({5001, 5002})
KEEP_OUT = "keep_out"
FENCES = {5001: "fence", 5002: KEEP_OUT, 5003: "fence", 5004: KEEP_OUT}
"""The names of areas: those to stay in, and those to stay out of."""
RALLY_POINT = 5100

_JUMPS = frozenset({177, 601})
"""With a parameter 2 of 0 they are never made."""

LANDING_SECTION = frozenset({188, 189})
"""What follows one of these behind the end of a mission is flown only where a landing is asked
for."""


def command_of(number: int, params: Sequence[float | None]) -> Command:
    """Return what becomes of an item with this command and these seven parameters."""
    command = COMMANDS.get(number)
    if command is None:
        moves = any(number in each for each in _NAVIGATION)
        treatment = Treatment.REFUSED if moves else Treatment.LEFT_OUT
        return Command(f"{number}, which is not known,", treatment, "draw what it does as tasks")
    if number in _JUMPS and params[1] == 0:
        return command._replace(treatment=Treatment.LEFT_OUT, remedy="it is never made")
    return command
