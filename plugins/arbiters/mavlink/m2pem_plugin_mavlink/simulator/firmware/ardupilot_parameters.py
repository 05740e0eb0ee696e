"""Parameters of ArduPilot that a ground station looks for, with ArduPilot's defaults."""

import re
from collections.abc import Mapping

from m2pem_plugin_mavlink.simulator.specification import Kind

EVERY = {
    "AHRS_EKF_TYPE": 3,
    "ARMING_CHECK": 1,
    "ARMING_REQUIRE": 1,
    "BATT_ARM_VOLT": 0,
    "BATT_CAPACITY": 3300,
    "BATT_CRT_MAH": 0,
    "BATT_CRT_VOLT": 0,
    "BATT_FS_CRT_ACT": 0,
    "BATT_FS_LOW_ACT": 0,
    "BATT_LOW_MAH": 0,
    "BATT_LOW_TIMER": 10,
    "BATT_LOW_VOLT": 10.5,
    "BATT_MONITOR": 4,
    "EK3_ENABLE": 1,
    "EK3_GPS_CHECK": 31,
    "FENCE_ACTION": 1,
    "FENCE_ALT_MAX": 100,
    "FENCE_ALT_MIN": -10,
    "FENCE_ENABLE": 0,
    "FENCE_MARGIN": 2,
    "FENCE_RADIUS": 300,
    "FENCE_TOTAL": 0,
    "FENCE_TYPE": 7,
    "FRAME_CLASS": 1,
    "FS_CRASH_CHECK": 1,
    "FS_EKF_ACTION": 1,
    "FS_EKF_THRESH": 0.8,
    "FS_OPTIONS": 16,
    "GPS1_TYPE": 1,
    "LOG_BITMASK": 65535,
    "MAV_GCS_SYSID": 255,
    "MAV_SYSID": 1,
    "MIS_OPTIONS": 0,
    "MIS_RESTART": 0,
    "MIS_TOTAL": 0,
    "RALLY_TOTAL": 0,
    "SCHED_LOOP_RATE": 400,
    "SERVO1_FUNCTION": 0,
    "SERVO9_FUNCTION": 0,
    "STAT_BOOTCNT": 1,
    "SYSID_ENFORCE": 0,
}

COPTER = {
    "ANGLE_MAX": 3000,
    "DISARM_DELAY": 10,
    "FRAME_TYPE": 1,
    "FS_DR_ENABLE": 2,
    "FS_GCS_ENABLE": 0,
    "FS_GCS_TIMEOUT": 5,
    "FS_THR_ENABLE": 1,
    "FS_THR_VALUE": 975,
    "GUID_OPTIONS": 0,
    "GUID_TIMEOUT": 3,
    "LAND_ALT_LOW": 1000,
    "LAND_SPEED": 50,
    "LAND_SPEED_HIGH": 0,
    "LOIT_SPEED": 1250,
    "MNT1_PITCH_MAX": 25,
    "MNT1_PITCH_MIN": -90,
    "MNT1_TYPE": 1,
    "MNT1_YAW_MAX": 160,
    "MNT1_YAW_MIN": -160,
    "PILOT_SPEED_UP": 250,
    "RTL_ALT": 1500,
    "RTL_ALT_FINAL": 0,
    "RTL_LOIT_TIME": 5000,
    "RTL_SPEED": 0,
    "WPNAV_ACCEL": 250,
    "WPNAV_RADIUS": 200,
    "WPNAV_SPEED": 1000,
    "WPNAV_SPEED_DN": 150,
    "WPNAV_SPEED_UP": 250,
    "WP_YAW_BEHAVIOR": 2,
}

ROVER = {
    "CRUISE_SPEED": 2,
    "CRUISE_THROTTLE": 30,
    "FS_ACTION": 2,
    "FS_GCS_ENABLE": 0,
    "FS_GCS_TIMEOUT": 5,
    "FS_THR_ENABLE": 1,
    "FS_THR_VALUE": 910,
    "FS_TIMEOUT": 1.5,
    "LOIT_RADIUS": 2,
    "LOIT_TYPE": 0,
    "MIS_DONE_BEHAVE": 0,
    "RTL_SPEED": 0,
    "SCHED_LOOP_RATE": 50,
    "TURN_RADIUS": 0.9,
    "WP_RADIUS": 2,
    "WP_SPEED": 2,
}

PLANE = {
    "AIRSPEED_CRUISE": 22,
    "AIRSPEED_MAX": 30,
    "AIRSPEED_MIN": 9,
    "FS_GCS_ENABL": 0,
    "FS_LONG_ACTN": 0,
    "FS_LONG_TIMEOUT": 5,
    "FS_SHORT_ACTN": 0,
    "FS_SHORT_TIMEOUT": 1.5,
    "RTL_ALTITUDE": 100,
    "RTL_AUTOLAND": 0,
    "RTL_RADIUS": 0,
    "SCHED_LOOP_RATE": 50,
    "THR_FAILSAFE": 1,
    "TKOFF_ALT": 50,
    "WP_LOITER_RAD": 60,
    "WP_RADIUS": 90,
}

PARAMETERS: Mapping[Kind, Mapping[str, float]] = {
    Kind.COPTER: {**EVERY, **COPTER},
    Kind.ROVER: {**EVERY, **ROVER},
    Kind.BOAT: {**EVERY, **ROVER, "FRAME_CLASS": 2, "LOIT_TYPE": 1},
    Kind.PLANE: {**EVERY, **PLANE},
}

WHOLE_NUMBERS: frozenset[str] = frozenset(
    name
    for values in PARAMETERS.values()
    for name, value in values.items()
    if float(value).is_integer()
    and re.search(
        "_(ACT|ACTION|ACTN|ALT|BEHAVE|CHECK|CLASS|ENABLE?|FUNCTION|MONITOR|OPTIONS|RATE|RESTART"
        "|SYSID|TOTAL|TYPE)$",
        name,
    )
)
"""Those that ArduPilot keeps as whole numbers."""
