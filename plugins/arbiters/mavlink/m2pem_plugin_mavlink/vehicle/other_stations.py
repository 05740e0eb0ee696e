"""What an act of another ground station means for each behavior: the rules, and nothing else.

MAVLink has no arbitration between ground stations: each one may command. The table in
docs/mavlink.md is made of `RULES`.
"""

from collections.abc import Mapping
from enum import StrEnum
from types import MappingProxyType


class Act(StrEnum):
    """What another station does. The value says how the vehicle shows it."""

    FALLS = "disarmed in the air: HEARTBEAT, and how GLOBAL_POSITION_INT goes on"
    DISARMED = "disarmed: HEARTBEAT"
    MODE = "another mode: HEARTBEAT"
    HOLD = "Hold of PX4: HEARTBEAT"
    PAUSED = "the mission is paused (ArduCopter): MISSION_CURRENT.mission_state"
    MISSION = "another mission: MISSION_CURRENT.total, the current item, what is sent to others"
    ITEM = "another current item: MISSION_CURRENT.seq, and where the vehicle was"
    TARGET = "another target: POSITION_TARGET_GLOBAL_INT"
    HOME = "another home: HOME_POSITION"
    PARAMETER = "another value of a parameter of speed, return, fence or failsafes: PARAM_VALUE"


class Meaning(StrEnum):
    """What m2pem makes of it."""

    TAKEN_OVER = "`TAKEN_OVER`"
    FAILED = "`FAILED`"
    WAITS = "waits"
    SAID = "operators read it"
    NOTHING = "-"


GUIDED = ("goto", "change_altitude")
MISSIONS = ("single_vehicle_routing", "area_survey", "run_onboard_mission")
UPLOADED = MISSIONS[:2]

RULES: Mapping[Act, tuple[Meaning, tuple[str, ...], Meaning]] = MappingProxyType(
    {
        Act.FALLS: (Meaning.FAILED, (), Meaning.FAILED),
        Act.DISARMED: (Meaning.TAKEN_OVER, (), Meaning.TAKEN_OVER),
        Act.MODE: (Meaning.TAKEN_OVER, (), Meaning.TAKEN_OVER),
        Act.HOLD: (Meaning.WAITS, MISSIONS, Meaning.TAKEN_OVER),
        Act.PAUSED: (Meaning.WAITS, MISSIONS, Meaning.NOTHING),
        Act.MISSION: (Meaning.TAKEN_OVER, UPLOADED, Meaning.NOTHING),
        Act.ITEM: (Meaning.TAKEN_OVER, MISSIONS, Meaning.NOTHING),
        Act.TARGET: (Meaning.TAKEN_OVER, GUIDED, Meaning.NOTHING),
        Act.HOME: (Meaning.SAID, (), Meaning.SAID),
        Act.PARAMETER: (Meaning.SAID, (), Meaning.SAID),
    }
)
"""What an act means for these behaviors, and what for all others."""


def meaning(act: Act, behavior: str) -> Meaning:
    """Return what an act means for a behavior."""
    here, behaviors, otherwise = RULES[act]
    return here if behavior in behaviors else otherwise
