"""Parameters of PX4 that a ground station looks for, with defaults of PX4's simulated vehicles."""

from collections.abc import Mapping

from m2pem_plugin_mavlink.simulator.specification import Kind

INTEGERS: Mapping[str, int] = {
    "BAT1_N_CELLS": 3,
    "BAT1_SOURCE": 0,
    "CAL_ACC0_ID": 1310988,
    "CAL_BARO0_ID": 6620172,
    "CAL_GYRO0_ID": 1310988,
    "CAL_MAG0_ID": 197388,
    "CBRK_SUPPLY_CHK": 0,
    "COM_ARM_WO_GPS": 1,
    "COM_DLL_EXCEPT": 0,
    "COM_DL_LOSS_T": 10,
    "COM_LOW_BAT_ACT": 0,
    "COM_OBL_RC_ACT": 0,
    "COM_POSCTL_NAVL": 0,
    "COM_RC_IN_MODE": 1,
    "COM_TAKEOFF_ACT": 0,
    "GF_ACTION": 2,
    "MAV_COMP_ID": 1,
    "MAV_TYPE": 2,
    "MIS_TKO_LAND_REQ": 0,
    "MNT_MODE_IN": 4,
    "NAV_DLL_ACT": 0,
    "NAV_RCL_ACT": 2,
    "RTL_CONE_ANG": 45,
    "RTL_TYPE": 0,
    "SYS_AUTOSTART": 10040,
    "SYS_HITL": 0,
}
"""Those that PX4 keeps as whole numbers; they travel as the bytes of an int32."""

FLOATS: Mapping[str, float] = {
    "BAT1_CAPACITY": 3300.0,
    "BAT_CRIT_THR": 0.07,
    "BAT_EMERGEN_THR": 0.05,
    "BAT_LOW_THR": 0.15,
    "COM_DISARM_LAND": 2.0,
    "COM_DISARM_PRFLT": 10.0,
    "COM_FAIL_ACT_T": 5.0,
    "COM_OF_LOSS_T": 1.0,
    "COM_SPOOLUP_TIME": 1.0,
    "GF_MAX_HOR_DIST": 0.0,
    "GF_MAX_VER_DIST": 0.0,
    "MIS_DIST_1WP": 10000.0,
    "NAV_ACC_RAD": 2.0,
    "NAV_LOITER_RAD": 80.0,
    "RTL_DESCEND_ALT": 30.0,
    "RTL_LAND_DELAY": 0.0,
    "RTL_MIN_DIST": 10.0,
    "RTL_RETURN_ALT": 60.0,
}

COPTER: Mapping[str, float] = {
    "MIS_TAKEOFF_ALT": 2.5,
    "MPC_LAND_SPEED": 0.7,
    "MPC_TKO_SPEED": 1.5,
    "MPC_XY_CRUISE": 5.0,
    "MPC_XY_VEL_MAX": 12.0,
    "MPC_Z_V_AUTO_DN": 1.5,
    "MPC_Z_V_AUTO_UP": 3.0,
}

ROVER: Mapping[str, float] = {"RO_SPEED_LIM": 3.0, "RD_TRANS_DRV_TRN": 0.17}


def parameters_of(kind: Kind) -> Mapping[str, float]:
    """All of a kind of vehicle."""
    return {**INTEGERS, **FLOATS, **(COPTER if kind is Kind.COPTER else ROVER)}


def whole(name: str) -> bool:
    """It is kept as a whole number."""
    return name in INTEGERS or name == "MAV_SYS_ID"
