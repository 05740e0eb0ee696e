"""Conversations that a real and a simulated autopilot must lead alike.

Each scenario begins with an autopilot that was just started. What belongs to its beginning is not
recorded (`Station.forget`).
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_station import SECOND, Station
from pymavlink.dialects.v20 import ardupilotmega as dialect

WAYPOINT, SPEED = dialect.MAV_CMD_NAV_WAYPOINT, dialect.MAV_CMD_DO_CHANGE_SPEED
TAKEOFF, RETURN = dialect.MAV_CMD_NAV_TAKEOFF, dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH
FENCE = dialect.MAV_MISSION_TYPE_FENCE
INCLUSION = dialect.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION
CIRCLE = dialect.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION

ARDUPILOT = ("arducopter", "ardurover", "arduplane")
ALL = (*ARDUPILOT, "px4copter")
COPTERS = ("arducopter", "px4copter")
GROUNDED = ("arducopter", "ardurover", "px4copter")
"""Vehicles that stand still when they hold."""


@dataclass(frozen=True, slots=True)
class Scenario:
    """`vehicles`: those that can play it."""

    name: str
    play: Callable[[Station], None]
    vehicles: tuple[str, ...]


SCENARIOS: dict[str, Scenario] = {}


def of(*vehicles: str) -> Callable[[Callable[[Station], None]], Callable[[Station], None]]:
    """Make a function a scenario of these vehicles."""

    def keep(play: Callable[[Station], None]) -> Callable[[Station], None]:
        SCENARIOS[play.__name__] = Scenario(play.__name__, play, vehicles)
        return play

    return keep


def scenarios_of(vehicle: str) -> Iterator[Scenario]:
    """All that a vehicle can play."""
    return (scenario for scenario in SCENARIOS.values() if vehicle in scenario.vehicles)


# --- arming -------------------------------------------------------------------------------------


@of(*ALL)
def boot(s: Station) -> None:
    """When it knows where it is, and what it says until then."""
    s.known.clear()
    s.begin("boot")
    s.until("position", lambda: s.located, 120.0)
    if s.px4:
        # It knew its position before it was connected.
        s.watch(3.0)


@of(*ARDUPILOT)
def arm_before_there_is_a_position(s: Station) -> None:
    s.known.clear()
    s.begin("wait for 15 s")
    s.watch(15.0 - s.now_s)
    s.set_mode("GUIDED")
    s.arm()
    if s.kind is Kind.COPTER:
        s.set_mode("STABILIZE")
        s.arm()


@of(*ALL)
def arm_and_disarm(s: Station) -> None:
    s.ready()
    s.set_mode(s.guided)
    s.arm()
    s.arm()
    s.disarm()
    s.disarm()


@of(*COPTERS)
def disarm_by_itself(s: Station) -> None:
    """A copter that was armed and does not take off."""
    s.armed_in_guided()
    s.begin("wait")
    s.landed(60.0)


@of("arducopter", "arduplane")
def arm_where_it_may_not(s: Station) -> None:
    s.ready()
    s.set_mode("RTL")
    s.arm()


# --- up and down --------------------------------------------------------------------------------


@of(*COPTERS)
def take_off(s: Station) -> None:
    s.armed_in_guided()
    s.take_off(20.0)
    s.until("up", lambda: abs(s.height_m - 20.0) < 1.0)
    s.watch(3.0)
    if not s.px4:
        s.take_off(20.0)
    s.disarm()


@of("arduplane")
def take_off_of_a_plane(s: Station) -> None:
    s.ready()
    s.set_mode("TAKEOFF")
    s.arm()
    s.begin("climb")
    s.until("up", lambda: s.height_m > 40.0)
    s.watch(15.0)
    s.disarm()


@of(*COPTERS)
def take_off_unarmed(s: Station) -> None:
    s.ready()
    s.set_mode(s.guided)
    s.take_off(20.0)


@of(*COPTERS)
def land(s: Station) -> None:
    s.airborne(15.0)
    s.set_mode("LAND")
    s.begin("come down")
    s.landed()


@of(*GROUNDED)
def return_to_launch(s: Station) -> None:
    s.airborne(20.0)
    s.go_to("go 60 m north", (60.0, 0.0, 20.0))
    s.begin("on the way")
    s.until("there", lambda: s.distance_m(60.0) < 2.5)
    s.watch(3.0)
    s.set_mode("RTL")
    s.begin("come home")
    if s.flies:
        s.landed()
    else:
        s.until("home", lambda: s.distance_m() < 3.0)
        s.watch(5.0)
    s.note("at home", s.distance_m() < 4.0)


@of("arduplane")
def return_of_a_plane(s: Station) -> None:
    s.airborne()
    s.set_mode("RTL")
    s.begin("circle")
    s.watch(40.0)
    s.note("near", s.distance_m() < 300.0)


@of(*COPTERS)
def land_while_it_returns(s: Station) -> None:
    """Another ground station lets a vehicle land that was on its way home."""
    s.airborne(20.0)
    s.go_to("go 60 m north", (60.0, 0.0, 20.0))
    s.begin("on the way")
    s.until("there", lambda: s.distance_m(60.0) < 2.5)
    s.set_mode("RTL")
    s.set_mode("LAND", SECOND)
    s.begin("come down")
    s.landed()
    s.note("at home", s.distance_m() < 4.0)


# --- to places ----------------------------------------------------------------------------------


@of(*GROUNDED)
def go_to(s: Station) -> None:
    s.airborne()
    s.go_to("go 40 m north", (40.0, 0.0, 20.0))
    s.begin("on the way")
    s.until("there", lambda: s.distance_m(40.0) < 2.5)
    s.watch(5.0)
    s.note("stays", s.distance_m(40.0) < 3.0)
    s.go_to("go back", (0.0, 0.0, 20.0))
    s.begin("on the way back")
    s.until("there", lambda: s.distance_m() < 2.5)


@of("arduplane")
def go_to_with_a_plane(s: Station) -> None:
    s.airborne()
    s.go_to("go 300 m north", (300.0, 0.0, 80.0))
    s.begin("on the way")
    s.until("there", lambda: s.distance_m(300.0) < 120.0)
    s.until("high", lambda: abs(s.height_m - 80.0) < 5.0)


@of(*GROUNDED)
def go_to_unarmed(s: Station) -> None:
    s.ready()
    s.set_mode(s.guided)
    s.go_to("go 40 m north", (40.0, 0.0, 20.0))
    s.watch(3.0)
    s.note("stays", s.distance_m() < 3.0)


@of(*GROUNDED)
def speed_at_rest(s: Station) -> None:
    """Rovers refuse a speed while they have no target."""
    s.airborne()
    s.set_speed("speed 3 m/s", 3.0)
    s.go_to("go 60 m north, 3 m/s", (60.0, 0.0, 20.0), 3.0)


@of(*GROUNDED)
def speed_on_the_way(s: Station) -> None:
    s.airborne()
    s.go_to("go 200 m north", (200.0, 0.0, 20.0))
    s.begin("gather way")
    s.watch(6.0)
    s.set_speed("speed 2 m/s", 2.0)
    s.begin("slow down")
    s.until("slow", lambda: abs(s.speed_mps - 2.0) < 0.4, 30.0)
    s.watch(3.0)
    s.note("slow", abs(s.speed_mps - 2.0) < 0.4)


@of("arducopter", "ardurover")
def hold_and_speed(s: Station) -> None:
    """Copters in BRAKE refuse speeds."""
    s.airborne()
    s.go_to("go 100 m north", (100.0, 0.0, 20.0))
    s.begin("gather way")
    s.watch(5.0)
    s.set_mode(s.hold)
    s.begin("stop")
    s.until("at rest", lambda: s.speed_mps < 0.3, 30.0)
    s.set_speed("speed 3 m/s", 3.0)
    s.set_mode("GUIDED")
    s.watch(3.0)
    s.note("stays", s.speed_mps < 0.5)


@of(*GROUNDED)
def hold(s: Station) -> None:
    s.airborne()
    s.go_to("go 100 m north", (100.0, 0.0, 20.0))
    s.begin("gather way")
    s.watch(5.0)
    s.set_mode(s.hold)
    s.begin("stop")
    s.until("at rest", lambda: s.speed_mps < 0.3, 30.0)


def _velocity(s: Station, north_mps: float) -> None:
    s.send(
        dialect.MAVLink_set_position_target_local_ned_message(
            *(int(s.now_s * 1000), s.system, 1, dialect.MAV_FRAME_LOCAL_NED, 0b0000_1101_1100_0111),
            *(0, 0, 0, north_mps, 0, 0, 0, 0, 0, 0, 0),
        )
    )


@of("arducopter", "ardurover")
def velocity(s: Station) -> None:
    """A velocity holds for 3 s; then the vehicle stops."""
    s.airborne()
    s.begin("one velocity")
    _velocity(s, 2.0)
    s.until("moves", lambda: s.speed_mps > 1.0, 10.0)
    s.until("stands again", lambda: s.speed_mps < 0.3, 20.0)


@of("px4copter")
def velocity_of_px4(s: Station) -> None:
    """OFFBOARD wants setpoints before it, and leaves when they end."""
    s.airborne()
    s.set_mode("OFFBOARD")
    s.begin("velocities")
    for _ in range(20):
        _velocity(s, 2.0)
        s.watch(0.1)
    s.begin("mode OFFBOARD")
    s.send(
        dialect.MAVLink_command_long_message(
            s.system, 1, dialect.MAV_CMD_DO_SET_MODE, 0, 1, 6, 0, 0, 0, 0, 0
        )
    )
    for _ in range(30):
        _velocity(s, 2.0)
        s.watch(0.1)
    s.note("moves", s.speed_mps > 1.0)
    s.begin("silence")
    s.watch(12.0)


# --- missions -----------------------------------------------------------------------------------


def _leg(s: Station, north_m: float = 40.0) -> list:
    """A takeoff (of copters), a speed, and two waypoints."""
    height_m = 0.0 if s.kind is Kind.ROVER else 20.0
    items = [s.item(TAKEOFF, (0.0, 0.0, height_m))] if s.kind is Kind.COPTER else []
    return [
        *items,
        s.item(SPEED, params=(1.0, 4.0, -1.0)),
        s.item(WAYPOINT, (north_m, 0.0, height_m)),
        s.item(WAYPOINT, (north_m, 20.0, height_m)),
    ]


def _start(s: Station) -> None:
    s.set_mode(s.auto)
    s.begin("execute it")


def _flown(s: Station, limit_s: float = 150.0) -> None:
    s.until("completed", lambda: s.known.get("mission") == "COMPLETE", limit_s)
    s.watch(3.0)


@of(*GROUNDED)
def mission(s: Station) -> None:
    s.airborne()
    s.mission("upload", _leg(s))
    _start(s)
    _flown(s)


@of("arducopter")
def mission_from_the_ground(s: Station) -> None:
    """AUTO takes off when MISSION_START says so."""
    s.ready()
    s.mission("upload", _leg(s))
    s.set_mode("GUIDED")
    s.arm()
    s.set_mode("AUTO")
    s.command("start", dialect.MAV_CMD_MISSION_START)
    s.begin("execute it")
    _flown(s)


@of("px4copter")
def mission_of_px4_from_the_ground(s: Station) -> None:
    s.ready()
    s.mission("upload", _leg(s))
    s.arm()
    _start(s)
    _flown(s)


@of("arduplane")
def mission_of_a_plane(s: Station) -> None:
    s.airborne()
    s.mission(
        "upload",
        [
            s.item(SPEED, params=(0.0, 18.0, -1.0)),
            s.item(WAYPOINT, (900.0, 0.0, 60.0)),
            s.item(WAYPOINT, (900.0, 300.0, 60.0)),
        ],
    )
    _start(s)
    _flown(s)


@of("arducopter", "ardurover")
def second_mission_in_auto(s: Station) -> None:
    """AUTO while in AUTO, with a completed mission: nothing begins."""
    s.airborne()
    s.mission("upload", _leg(s))
    _start(s)
    _flown(s)
    s.mission("upload another", _leg(s, -40.0))
    s.set_mode("AUTO")
    s.command("start", dialect.MAV_CMD_MISSION_START)
    s.begin("wait")
    s.watch(10.0)
    s.note("went there", s.distance_m(-40.0) < 30.0)


@of(*GROUNDED)
def second_mission(s: Station) -> None:
    """The mode is left, and entered again."""
    s.airborne()
    s.mission("upload", _leg(s))
    _start(s)
    _flown(s)
    s.set_mode(s.guided)
    s.mission("upload another", _leg(s, 10.0))
    _start(s)
    _flown(s)


@of("px4copter")
def mission_replaced_on_the_way(s: Station) -> None:
    """By one whose first item is marked as current, then by one without such a mark."""
    s.airborne()
    s.mission("upload", _leg(s, 80.0)[1:])
    _start(s)
    s.until("at the second waypoint", lambda: s.known.get("current") == 2)
    s.watch(0.5)
    s.mission("upload another", _leg(s, 20.0)[1:])
    s.begin("fly it")
    s.until("at the second waypoint of the other", lambda: s.known.get("current") == 2)
    s.watch(0.5)
    s.mission("upload a third without a mark", _leg(s, -30.0)[1:], current=None)
    s.begin("fly it")
    _flown(s, 60.0)


@of(*GROUNDED)
def mission_paused(s: Station) -> None:
    s.airborne()
    s.mission("upload", _leg(s, 80.0))
    _start(s)
    s.until("on its way", lambda: s.distance_m() > 20.0)
    s.set_mode(s.hold)
    s.begin("stop")
    s.until("at rest", lambda: s.speed_mps < 0.3, 30.0)
    s.watch(3.0)
    _start(s)
    _flown(s)


@of(*GROUNDED)
def mission_from_an_item(s: Station) -> None:
    s.airborne()
    s.mission("upload", _leg(s))
    s.command("item 1", dialect.MAV_CMD_DO_SET_MISSION_CURRENT, 1)
    s.command("item 9", dialect.MAV_CMD_DO_SET_MISSION_CURRENT, 9)
    _start(s)
    s.until("on its way", lambda: s.distance_m() > 15.0)
    last = 3 if s.px4 or s.kind is Kind.ROVER else 4
    s.command(f"item {last}", dialect.MAV_CMD_DO_SET_MISSION_CURRENT, last)
    s.begin("go on")
    _flown(s)


@of(*COPTERS)
def mission_that_returns(s: Station) -> None:
    s.airborne()
    s.mission("upload", [*_leg(s), s.item(RETURN)])
    _start(s)
    s.landed(240.0)


@of(*GROUNDED)
def mission_cleared_on_the_way(s: Station) -> None:
    s.airborne()
    s.mission("upload", _leg(s, 80.0))
    _start(s)
    s.until("on its way", lambda: s.distance_m() > 15.0)
    s.begin("clear")
    s.send(dialect.MAVLink_mission_clear_all_message(s.system, 1, 0))
    s.watch(5.0)


@of(*GROUNDED)
def start_without_a_mission(s: Station) -> None:
    s.airborne()
    s.set_mode(s.auto)
    s.begin("wait")
    s.watch(3.0)


@of(*ALL)
def upload_that_is_given_up(s: Station) -> None:
    """The station announces items and never sends them."""
    s.ready()
    s.begin("count 3")
    s.send(dialect.MAVLink_mission_count_message(s.system, 1, 3, 0))
    s.watch(14.0)


@of(*ALL)
def upload_of_two_stations(s: Station) -> None:
    s.ready()
    s.begin("count 3")
    s.send(dialect.MAVLink_mission_count_message(s.system, 1, 3, 0))
    s.watch(0.5)
    s.begin("second station: count 2")
    s.send(dialect.MAVLink_mission_count_message(s.system, 1, 2, 0), SECOND)
    s.watch(0.5)


@of(*ALL)
def upload_of_what_is_unknown(s: Station) -> None:
    s.ready()
    s.mission("upload", [s.item(WAYPOINT, (10.0, 0.0, 20.0)), s.item(31999)])


@of(*ALL)
def download(s: Station) -> None:
    s.ready()
    s.mission("upload", [s.item(WAYPOINT, (10.0, 0.0, 20.0)), s.item(WAYPOINT, (20.0, 0.0, 20.0))])
    s.begin("download")
    s.send(dialect.MAVLink_mission_request_list_message(s.system, 1, 0))
    count = s.answer("MISSION_COUNT")
    s.note("count", None if count is None else count.count)
    for seq in range(count.count if count is not None else 0):
        s.send(dialect.MAVLink_mission_request_int_message(s.system, 1, seq, 0))
        item = s.answer("MISSION_ITEM_INT")
        s.note(f"item {seq}", None if item is None else f"{item.command} frame {item.frame}")
    s.send(dialect.MAVLink_mission_ack_message(s.system, 1, 0, 0))
    s.watch()


# --- who commands -------------------------------------------------------------------------------


@of(*GROUNDED)
def second_station_holds(s: Station) -> None:
    s.airborne()
    s.go_to("go 100 m north", (100.0, 0.0, 20.0))
    s.begin("gather way")
    s.watch(5.0)
    s.set_mode(s.hold, SECOND)
    s.begin("stop")
    s.until("at rest", lambda: s.speed_mps < 0.3, 30.0)


@of(*GROUNDED)
def second_station_takes_a_mission_over(s: Station) -> None:
    s.airborne()
    s.mission("upload", _leg(s, 80.0))
    _start(s)
    s.until("on its way", lambda: s.distance_m() > 15.0)
    s.mission("second station: upload", _leg(s, 60.0), SECOND)
    s.begin("go on")
    s.watch(5.0)


# --- failsafes ----------------------------------------------------------------------------------


@of(*GROUNDED)
def ground_station_lost(s: Station) -> None:
    """With the failsafe that its users set: return (a rover: hold)."""
    if s.px4:
        s.ready()
        s.parameter("NAV_DLL_ACT", 2)
        s.parameter("COM_DL_LOSS_T", 5)
    else:
        s.ready()
        s.parameter("FS_GCS_ENABLE" if s.flies else "FS_ACTION", 1 if s.flies else 2)
        if not s.flies:
            s.parameter("FS_GCS_ENABLE", 1)
    s.airborne()
    s.go_to("go 60 m north", (60.0, 0.0, 20.0))
    s.begin("on the way")
    s.until("there", lambda: s.distance_m(60.0) < 2.5)
    s.silence()
    s.watch(25.0)
    s.begin("the ground station is back")
    s.beats = True
    s.watch(5.0)


@of(*GROUNDED)
def ground_station_lost_without_a_failsafe(s: Station) -> None:
    s.airborne()
    s.go_to("go 30 m north", (30.0, 0.0, 20.0))
    s.silence()
    s.watch(20.0)
    s.note("there", s.distance_m(30.0) < 3.0)


@of(*COPTERS)
def battery_low(s: Station) -> None:
    """Without an action: a text alone."""
    s.airborne()
    s.battery(0.14, 10.4)
    s.begin("wait")
    s.watch(25.0)


@of("arducopter")
def battery_low_returns(s: Station) -> None:
    s.ready()
    s.parameter("BATT_FS_LOW_ACT", 2)
    s.airborne()
    s.battery(0.1, 10.4)
    s.begin("wait")
    s.watch(25.0)


@of("arducopter")
def battery_critical_lands(s: Station) -> None:
    s.ready()
    s.parameter("BATT_CRT_VOLT", 10.45)
    s.parameter("BATT_FS_CRT_ACT", 1)
    s.airborne()
    s.battery(0.0, 10.3)
    s.begin("wait")
    s.watch(25.0)


@of("px4copter")
def battery_critical_of_px4_returns(s: Station) -> None:
    s.ready()
    s.parameter("COM_LOW_BAT_ACT", 3)
    s.airborne()
    s.battery(0.066, 10.3)
    s.begin("wait")
    s.watch(25.0)


@of("px4copter")
def fence_of_px4_breached(s: Station) -> None:
    """A circle of 50 m around home; the action is to return."""
    s.ready()
    s.parameter("GF_MAX_HOR_DIST", 50)
    s.parameter("GF_ACTION", 3)
    s.airborne()
    s.go_to("go 40 m north", (40.0, 0.0, 20.0))
    s.begin("on the way")
    s.until("there", lambda: s.distance_m(40.0) < 2.5)
    s.go_to("go 90 m north", (90.0, 0.0, 20.0))
    s.watch(10.0)
    s.note("stays", s.distance_m(40.0) < 3.0)


@of(*GROUNDED)
def satellites_lost(s: Station) -> None:
    s.airborne()
    s.satellites(False)
    s.watch(20.0)
    s.begin("try to be guided")
    s.set_mode(s.guided)
    s.satellites(True)
    s.watch(30.0)


@of("px4copter")
def satellites_lost_on_the_ground(s: Station) -> None:
    """It says why it cannot be armed when it is asked."""
    s.ready()
    s.satellites(False)
    s.watch(5.0)
    s.command("check", dialect.MAV_CMD_RUN_PREARM_CHECKS)
    s.arm()


@of("arducopter")
def fence_breached(s: Station) -> None:
    """A circle of 50 m; the action is to return or land."""
    s.ready()
    s.parameter("FENCE_ACTION", 1)
    s.parameter("FENCE_TYPE", 2)
    s.parameter("FENCE_RADIUS", 50)
    s.parameter("FENCE_ENABLE", 1)
    s.airborne()
    s.go_to("go 40 m north", (40.0, 0.0, 20.0))
    s.begin("on the way")
    s.until("there", lambda: s.distance_m(40.0) < 2.5)
    s.go_to("go 90 m north", (90.0, 0.0, 20.0))
    s.begin("wait")
    s.watch(20.0)


@of(*ALL)
def fence_uploaded(s: Station) -> None:
    s.ready()
    corners = [(-100.0, -100.0), (100.0, -100.0), (100.0, 100.0), (-100.0, 100.0)]
    s.upload(
        "upload a fence",
        [s.item(INCLUSION, (n, e, 0.0), (4.0,), FENCE) for n, e in corners],
        plan=FENCE,
    )
    s.upload(
        "upload half a polygon",
        [s.item(INCLUSION, (n, e, 0.0), (4.0,), FENCE) for n, e in corners[:2]],
        plan=FENCE,
    )


@of("arducopter", "ardurover")
def reboot_on_the_ground(s: Station) -> None:
    s.ready()
    before_s = s.now_s
    reboot = dialect.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN
    s.send(dialect.MAVLink_command_long_message(s.system, 1, reboot, 0, 1, 0, 0, 0, 0, 0, 0))
    acknowledged = s.answer("COMMAND_ACK") is not None
    s.start_anew()
    s.forget()
    s.begin("reboot")
    s.note("acknowledged", acknowledged)
    s.note("its clock begins anew", s.now_s < before_s)


@of("arducopter", "px4copter")
def reboot_in_flight(s: Station) -> None:
    """A reboot that is asked for is refused."""
    s.airborne()
    s.command("reboot", dialect.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1)


# --- the rest -----------------------------------------------------------------------------------


@of(*ALL)
def what_is_unknown(s: Station) -> None:
    s.ready()
    s.set_mode("THERE IS NO SUCH MODE")
    s.command("an unknown command", 31999)
    s.command("an unknown message", dialect.MAV_CMD_SET_MESSAGE_INTERVAL, 54321, 1e6)
    s.command("ask for a camera", dialect.MAV_CMD_REQUEST_MESSAGE, 259)
    s.command("ask for home", dialect.MAV_CMD_REQUEST_MESSAGE, 242)
    s.note("home", "HOME_POSITION" in s.latest)


@of(*ALL)
def parameters(s: Station) -> None:
    s.ready()
    names = {Kind.COPTER: "DISARM_DELAY", Kind.PLANE: "TKOFF_ALT", Kind.ROVER: "WP_RADIUS"}
    parameter = "MPC_XY_CRUISE" if s.px4 else names[s.kind]
    s.read(parameter)
    s.parameter(parameter, 7)
    s.read("NO_SUCH_THING")


@of("arducopter")
def yaw(s: Station) -> None:
    s.airborne()
    s.command("turn to the east", dialect.MAV_CMD_CONDITION_YAW, 90, 0, 1, 0)
    s.begin("turn")
    s.until("east", lambda: abs(s.latest["GLOBAL_POSITION_INT"].hdg / 100 - 90) < 5, 30.0)


@of(*COPTERS)
def circle(s: Station) -> None:
    """DO_ORBIT around a place 20 m away."""
    s.airborne()
    params = (10.0, 3.0, 0.0, 0.0) if s.px4 else (10.0, math.nan, 0.0, 0.0)
    s.command_int("circle", dialect.MAV_CMD_DO_ORBIT, params, (20.0, 0.0, 20.0))
    s.watch(10.0)


@of("arduplane")
def hold_of_a_plane(s: Station) -> None:
    s.airborne()
    s.set_mode("LOITER")
    s.begin("circle")
    s.watch(30.0)
    s.note("near", s.distance_m() < 1000.0)
    s.set_mode("GUIDED")


# --- gimbal -------------------------------------------------------------------------------------

MOUNTED = ("arducopter-gimbal",)
"""A copter whose mount is turned by servos; its manager is the autopilot."""
PITCH_YAW = dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW
CONFIGURE = dialect.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE
LEVEL = dialect.GIMBAL_MANAGER_FLAGS_ROLL_LOCK | dialect.GIMBAL_MANAGER_FLAGS_PITCH_LOCK
FROM_NORTH = LEVEL | dialect.GIMBAL_MANAGER_FLAGS_YAW_LOCK
UNCHANGED = -1.0
OURS, LET_GO = -2.0, -3.0
"""Instead of a system id in DO_GIMBAL_MANAGER_CONFIGURE."""


@of(*MOUNTED)
def gimbal_points(s: Station) -> None:
    """At angles from the nose and from north, then without aim, then beyond its limits."""
    s.ready()
    s.gimbal()
    s.command("point ahead and down", PITCH_YAW, -30, 40, math.nan, math.nan, LEVEL)
    s.note_gimbal()
    s.command("point east", PITCH_YAW, -10, 90, math.nan, math.nan, FROM_NORTH)
    s.note_gimbal()
    neutral = dialect.GIMBAL_MANAGER_FLAGS_NEUTRAL
    s.command("neutral", PITCH_YAW, 0, 0, math.nan, math.nan, neutral)
    s.note_gimbal()
    s.command("point up", PITCH_YAW, 80, 0, math.nan, math.nan, LEVEL)
    s.note_gimbal()
    nothing = (math.nan,) * 4
    s.command("point nowhere", PITCH_YAW, *nothing, LEVEL)
    s.command("another device", PITCH_YAW, 0, 0, math.nan, math.nan, LEVEL, 0, 5)


@of(*MOUNTED)
def gimbal_turns(s: Station) -> None:
    """At a rate, until it is stopped."""
    s.ready()
    s.gimbal()
    s.command("level", PITCH_YAW, 0, 0, math.nan, math.nan, LEVEL)
    s.note_gimbal()
    s.command("turn", PITCH_YAW, math.nan, math.nan, 0, 10, LEVEL, settle_s=3.0)
    s.command("stop", PITCH_YAW, math.nan, math.nan, 0, 0, LEVEL)
    first = s.latest["GIMBAL_DEVICE_ATTITUDE_STATUS"].q
    s.watch(3.0)
    last = s.latest["GIMBAL_DEVICE_ATTITUDE_STATUS"].q
    s.note("stands", all(abs(a - b) < 0.02 for a, b in zip(first, last, strict=True)))
    s.note("has turned", abs(2 * math.atan2(last[3], last[0])) > math.radians(15))


@of(*MOUNTED)
def gimbal_looks_at_a_place(s: Station) -> None:
    s.airborne(20.0)
    s.gimbal()
    roi = dialect.MAV_CMD_DO_SET_ROI_LOCATION
    s.command_int("look at a place", roi, (0, 0, 0, 0), (0.0, 40.0, 0.0))
    s.note_gimbal()
    s.command("look at none", dialect.MAV_CMD_DO_SET_ROI_NONE)
    s.note_gimbal()


@of(*MOUNTED)
def gimbal_in_other_hands(s: Station) -> None:
    """Another ground station takes control, points it, and lets it go."""
    s.ready()
    s.gimbal()
    rest = (UNCHANGED, UNCHANGED, 0, 0, 0)
    s.command("take control", CONFIGURE, OURS, OURS, *rest)
    s.note_gimbal(2.0)
    s.command("the second station takes control", CONFIGURE, OURS, OURS, *rest, system=SECOND)
    s.note_gimbal(2.0)
    s.command("point", PITCH_YAW, -30, 40, math.nan, math.nan, LEVEL)
    s.note_gimbal()
    s.command(
        "the second station points", PITCH_YAW, -60, 0, math.nan, math.nan, LEVEL, system=SECOND
    )
    s.note_gimbal()
    s.command("let go", CONFIGURE, LET_GO, LET_GO, *rest)
    s.note_gimbal(2.0)
    s.command("the second station lets go", CONFIGURE, LET_GO, LET_GO, *rest, system=SECOND)
    s.note_gimbal(2.0)
