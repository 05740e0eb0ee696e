"""What an act of another ground station means for each behavior: the rules, and nothing else.

MAVLink has no arbitration between ground stations: each one may command. The table in
docs/mavlink.md is made of `RULES`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
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


@dataclass(frozen=True, slots=True)
class Rule:
    """The meaning of an act for behaviors by their names, and for all the others."""

    of: Mapping[str, Meaning]
    otherwise: Meaning


GUIDED = ("goto", "change_altitude")
MISSIONS = ("single_vehicle_routing", "area_survey", "run_onboard_mission")
UPLOADED = MISSIONS[:2]


def _rule(otherwise: Meaning, names: tuple[str, ...] = (), of: Meaning = Meaning.NOTHING) -> Rule:
    return Rule(MappingProxyType(dict.fromkeys(names, of)), otherwise)


RULES: Mapping[Act, Rule] = MappingProxyType(
    {
        Act.FALLS: _rule(Meaning.FAILED),
        Act.DISARMED: _rule(Meaning.TAKEN_OVER),
        Act.MODE: _rule(Meaning.TAKEN_OVER),
        Act.HOLD: _rule(Meaning.TAKEN_OVER, MISSIONS, Meaning.WAITS),
        Act.PAUSED: _rule(Meaning.NOTHING, MISSIONS, Meaning.WAITS),
        Act.MISSION: _rule(Meaning.NOTHING, UPLOADED, Meaning.TAKEN_OVER),
        Act.ITEM: _rule(Meaning.NOTHING, MISSIONS, Meaning.TAKEN_OVER),
        Act.TARGET: _rule(Meaning.NOTHING, GUIDED, Meaning.TAKEN_OVER),
        Act.HOME: _rule(Meaning.SAID),
        Act.PARAMETER: _rule(Meaning.SAID),
    }
)


def meaning(act: Act, behavior: str) -> Meaning:
    """Return what an act means for a behavior."""
    rule = RULES[act]
    return rule.of.get(behavior, rule.otherwise)
