"""Which failsafes of real autopilots are played, in which phases of a mission.

Parameters are those of ArduPilot 4.7 and of PX4 main of August 2026.
"""

from collections.abc import Callable, Mapping

from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_failsafes import FAR_NORTH, NORTH, Failsafe, Phase, Play, Vehicle
from mavlink_station import SECOND, Station
from pymavlink.dialects.v20 import ardupilotmega as dialect

HIGH_M = 12.0
FAR_M = 35.0
"""Beyond the fence of a rover."""
MODE = dialect.MAV_CMD_DO_SET_MODE
OFF = dialect.FAILURE_TYPE_OFF
VOLTS = "SIM_BATT_VOLTAGE"
UP: tuple[str, Mapping[str, object]] = ("takeoff", {"altitude": "30 m"})
GO: tuple[str, Mapping[str, object]] = ("goto", {"target": NORTH})
DRIVE: tuple[str, Mapping[str, object]] = ("goto", {"target": FAR_NORTH})
RETURN: tuple[str, Mapping[str, object]] = ("return_to_launch", {})

Act = Callable[[Play], None]


# --- causes ---------------------------------------------------------------------------------------


def _set(parameter: str, value: float) -> Act:
    return lambda play: play.station.set_quietly(parameter, value)


def _cut(play: Play) -> None:
    play.relay.cut = True


def _mend(play: Play) -> None:
    play.relay.cut = False


def _second(command: int, *params: float) -> Act:
    return lambda play: play.station.command_quietly(command, *params)


def _clear(play: Play) -> None:
    station = play.station
    station.send(dialect.MAVLink_mission_clear_all_message(station.system, 1, 0), SECOND)


def _restart(play: Play) -> None:
    """Forced, as it is in flight."""
    reboot = dialect.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN
    play.station.command_quietly(reboot, 1, 0, 0, 0, 0, 20190226)
    play.station.start_anew()


def _nothing(_: Play) -> None:
    """The vehicle flies into it."""


def _charge(left: float) -> Act:
    return lambda play: play.station.battery(left, 10.3)


def _no_satellites(play: Play) -> None:
    play.station.satellites(False)


def _pilot(play: Play) -> None:
    """Seen by the autopilot before the failsafe, also if that comes before the mission."""
    play.station.sticks = True
    play.station.watch(5.0)


def _no_pilot(play: Play) -> None:
    play.station.sticks = False


def _slowly(parameter: str, value: float) -> Act:
    """With an answer: PX4 must say first of what type it is."""
    return lambda play: play.station.parameter(parameter, value)


# --- phases ---------------------------------------------------------------------------------------


def _phases(*phases: Phase) -> dict[str, Phase]:
    return {each.name: each for each in phases}


def _failsafes(*failsafes: Failsafe) -> dict[str, Failsafe]:
    return {each.name: each for each in failsafes}


def _in_auto(s: Station) -> bool:
    return s.mode == s.auto


def _in_its_mission(s: Station) -> bool:
    return s.mode == s.auto and int(s.known.get("current", 0)) > 1


ON_THE_FIELD = {"area": "field", "spacing": "20 m"}
SURVEY: tuple[str, Mapping[str, object]] = ("area_survey", {**ON_THE_FIELD, "altitude": "30 m"})
ABOVE_TERRAIN: tuple[str, Mapping[str, object]] = (
    "area_survey",
    {**ON_THE_FIELD, "altitude": "30 m", "altitude_frame": "terrain"},
)
FLYING = _phases(
    Phase("on the ground", (UP,), lambda s: s.located, before=True),
    Phase("taking off", (("takeoff", {"altitude": "90 m"}),), lambda s: s.height_m > HIGH_M),
    Phase("in a survey", (UP, SURVEY), _in_its_mission),
    Phase("in RTL", (UP, GO, RETURN), lambda s: s.mode == "RTL"),
    Phase("landing", (UP, GO, ("land", {})), lambda s: s.mode == "LAND"),
)
DRIVING = _phases(
    Phase("at rest", (DRIVE,), lambda s: s.located, before=True),
    Phase("in a goto", (DRIVE,), lambda s: s.mode == "GUIDED" and s.distance_m() > FAR_M),
    Phase(
        "in a survey",
        (("area_survey", ON_THE_FIELD),),
        lambda s: _in_its_mission(s) and s.distance_m() > FAR_M,
    ),
    Phase("in RTL", (DRIVE, RETURN), lambda s: s.mode == "RTL"),
)


def _store_a_landing(s: Station) -> None:
    """The landing of a plane, which m2pem keeps behind its own missions (docs/mavlink.md)."""
    land, start = dialect.MAV_CMD_NAV_LAND, dialect.MAV_CMD_DO_LAND_START
    approach = [
        s.item(dialect.MAV_CMD_NAV_WAYPOINT, at) for at in ((500.0, 0, 50.0), (250.0, 0, 25.0))
    ]
    s.mission("a landing", [s.item(start), *approach, s.item(land, (0.0, 0.0, 0.0))])
    s.forget()


FINAL = 6
"""The item of the stored landing that lands, behind home and the two of the takeoff."""
GLIDING = _phases(
    Phase("on the ground", (UP,), lambda s: s.located, before=True),
    Phase("taking off", (("takeoff", {"altitude": "150 m"}),), lambda s: s.height_m > HIGH_M),
    Phase(
        "in a survey",
        (UP, SURVEY),
        lambda s: s.mode == "AUTO" and s.height_m > 25.0 and int(s.known.get("current", 0)) > 2,
    ),
    Phase("in RTL", (UP, DRIVE, RETURN), lambda s: s.mode == "RTL" and s.height_m > HIGH_M),
    Phase(
        "landing",
        (UP, DRIVE, ("land", {})),
        lambda s: s.mode == "AUTO" and s.height_m < 24.0 and int(s.known["current"]) >= FINAL,
    ),
)

# --- vehicles -------------------------------------------------------------------------------------

COPTER = Vehicle(
    name="arducopter",
    title="ArduCopter 4.7",
    variable="M2PEM_ARDUCOPTER",
    kind=Kind.COPTER,
    firmware="ardupilot",
    model="quad",
    domain="air",
    resource="uav1",
    failsafe="return_to_launch",
    speed=10,
    parameters={"FS_GCS_ENABLE": 1},
    phases=FLYING,
    failsafes=_failsafes(
        Failsafe("ground station lost for 20 s, RTL", {}, _cut, _mend),
        Failsafe("battery low, no action", {"BATT_FS_LOW_ACT": 0}, _set(VOLTS, 10.4)),
        Failsafe("battery low, RTL", {"BATT_FS_LOW_ACT": 2}, _set(VOLTS, 10.4)),
        Failsafe(
            "battery critical, LAND",
            {"BATT_CRT_VOLT": 10.45, "BATT_FS_CRT_ACT": 1},
            _set(VOLTS, 10.3),
        ),
        Failsafe("radio of the pilot lost, RTL", {"FS_THR_ENABLE": 1}, _set("SIM_RC_FAIL", 1)),
        Failsafe("no GPS (EKF failsafe)", {}, _set("SIM_GPS1_ENABLE", 0)),
        Failsafe(
            "fence breached, RTL",
            {"FENCE_ENABLE": 1, "FENCE_TYPE": 1, "FENCE_ALT_MAX": 100, "FENCE_ACTION": 1},
            _set("FENCE_ALT_MAX", 10),
        ),
        Failsafe("motors fail, crash check", {"SIM_ENGINE_MUL": 0.0}, _set("SIM_ENGINE_FAIL", 15)),
        Failsafe("the autopilot restarts", {}, _restart),
        Failsafe(
            "no data about the terrain",
            {"TERRAIN_ENABLE": 1},
            _nothing,
            phases=(Phase("in a survey above terrain", (UP, ABOVE_TERRAIN), _in_auto),),
        ),
        Failsafe("a second ground station: mode LOITER", {}, _second(MODE, 1, 5)),
        Failsafe("a second ground station: mode RTL", {}, _second(MODE, 1, 6)),
        Failsafe("a second ground station: clears the mission", {}, _clear),
    ),
)

ROVER = Vehicle(
    name="ardurover",
    title="ArduRover 4.7",
    variable="M2PEM_ARDUROVER",
    kind=Kind.ROVER,
    firmware="ardupilot",
    model="rover",
    domain="ground",
    resource="rover1",
    failsafe="hold",
    speed=10,
    parameters={"FS_GCS_ENABLE": 1, "FS_ACTION": 2, "BATT_LOW_VOLT": 10.5},
    phases=DRIVING,
    failsafes=_failsafes(
        Failsafe("ground station lost for 20 s, HOLD", {}, _cut, _mend),
        Failsafe("ground station lost for 20 s, RTL", {"FS_ACTION": 1}, _cut, _mend),
        Failsafe("battery low, no action", {"BATT_FS_LOW_ACT": 0}, _set(VOLTS, 10.4)),
        Failsafe("battery low, RTL", {"BATT_FS_LOW_ACT": 1}, _set(VOLTS, 10.4)),
        Failsafe(
            "battery critical, HOLD",
            {"BATT_CRT_VOLT": 10.45, "BATT_FS_CRT_ACT": 2},
            _set(VOLTS, 10.3),
        ),
        Failsafe("radio of the pilot lost, HOLD", {"FS_THR_ENABLE": 1}, _set("SIM_RC_FAIL", 1)),
        Failsafe("no GPS (EKF failsafe)", {}, _set("SIM_GPS1_ENABLE", 0)),
        Failsafe(
            "fence breached, RTL",
            {"FENCE_ENABLE": 1, "FENCE_TYPE": 2, "FENCE_RADIUS": 500, "FENCE_ACTION": 1},
            _set("FENCE_RADIUS", 30),
        ),
        Failsafe("the autopilot restarts", {}, _restart),
        Failsafe("a second ground station: mode HOLD", {}, _second(MODE, 1, 4)),
        Failsafe("a second ground station: mode RTL", {}, _second(MODE, 1, 11)),
        Failsafe("a second ground station: clears the mission", {}, _clear),
    ),
)

PLANE = Vehicle(
    name="arduplane",
    title="ArduPlane 4.7",
    variable="M2PEM_ARDUPLANE",
    kind=Kind.PLANE,
    firmware="ardupilot",
    model="plane",
    domain="air",
    resource="uav1",
    failsafe="return_to_launch",
    speed=4,
    parameters={
        "FS_GCS_ENABL": 1,
        "FS_LONG_ACTN": 1,
        "FS_LONG_TIMEOUT": 8,
        "RTL_AUTOLAND": 3,
        "BATT_LOW_VOLT": 10.5,
    },
    phases=GLIDING,
    prepare=_store_a_landing,
    circles=True,
    failsafes=_failsafes(
        Failsafe("ground station lost for 20 s, RTL", {}, _cut, _mend),
        Failsafe("battery low, no action", {"BATT_FS_LOW_ACT": 0}, _set(VOLTS, 10.4)),
        Failsafe("battery low, RTL", {"BATT_FS_LOW_ACT": 1}, _set(VOLTS, 10.4)),
        Failsafe(
            "battery critical, land",
            {"BATT_CRT_VOLT": 10.45, "BATT_FS_CRT_ACT": 2},
            _set(VOLTS, 10.3),
        ),
        Failsafe("radio of the pilot lost, RTL", {"THR_FAILSAFE": 1}, _set("SIM_RC_FAIL", 1)),
        Failsafe("no GPS", {}, _set("SIM_GPS1_ENABLE", 0)),
        Failsafe(
            "fence breached, RTL",
            {"FENCE_TYPE": 1, "FENCE_ALT_MAX": 100, "FENCE_ACTION": 1, "FENCE_ENABLE": 1},
            _set("FENCE_ALT_MAX", 10),
        ),
        Failsafe("the motor fails", {"SIM_ENGINE_MUL": 0.0}, _set("SIM_ENGINE_FAIL", 15)),
        Failsafe("the autopilot restarts", {}, _restart),
        Failsafe("a second ground station: mode LOITER", {}, _second(MODE, 1, 12)),
        Failsafe("a second ground station: mode RTL", {}, _second(MODE, 1, 11)),
        Failsafe("a second ground station: clears the mission", {}, _clear),
    ),
)

PX4 = Vehicle(
    name="px4copter",
    title="PX4 main, a copter",
    variable="M2PEM_PX4",
    kind=Kind.COPTER,
    firmware="px4",
    model="sihsim_quadx",
    domain="air",
    resource="uav1",
    failsafe="return_to_launch",
    speed=4,
    parameters={"NAV_DLL_ACT": 2, "COM_DL_LOSS_T": 10, "SIM_BAT_MIN_PCT": 50},
    phases=FLYING,
    failsafes=_failsafes(
        Failsafe("ground station lost for 20 s, RTL", {}, _cut, _mend),
        Failsafe("battery critical, no action", {"COM_LOW_BAT_ACT": 0}, _charge(0.06)),
        Failsafe("battery critical, RTL", {"COM_LOW_BAT_ACT": 3}, _charge(0.06)),
        Failsafe("battery emergency, LAND", {"COM_LOW_BAT_ACT": 3}, _charge(0.03)),
        Failsafe("no GPS", {}, _no_satellites),
        Failsafe(
            "manual control of the pilot lost, RTL",
            {"COM_RC_IN_MODE": 1, "NAV_RCL_ACT": 2, "COM_RCL_EXCEPT": 0, "COM_RC_LOSS_T": 4},
            _no_pilot,
            prepare=_pilot,
        ),
        Failsafe("fence breached, RTL", {"GF_ACTION": 3}, _slowly("GF_MAX_VER_DIST", 10)),
        Failsafe(
            "a motor fails",
            {"SYS_FAILURE_EN": 1, "CA_FAILURE_MODE": 1},
            _second(dialect.MAV_CMD_INJECT_FAILURE, dialect.FAILURE_UNIT_SYSTEM_MOTOR, OFF, 1),
        ),
        Failsafe("a second ground station: mode LOITER", {}, _second(MODE, 1, 4, 3)),
        Failsafe("a second ground station: mode RTL", {}, _second(MODE, 1, 4, 5)),
        Failsafe("a second ground station: clears the mission", {}, _clear),
    ),
)

VEHICLES = {each.name: each for each in (COPTER, ROVER, PLANE, PX4)}
