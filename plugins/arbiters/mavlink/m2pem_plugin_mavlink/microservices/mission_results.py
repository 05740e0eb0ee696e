"""The words for why a mission was refused (MAV_MISSION_RESULT; mavlink.io, messages/common.html),
and what to do about it."""

from pymavlink.dialects.v20 import ardupilotmega as dialect

ACCEPTED: int = dialect.MAV_MISSION_ACCEPTED
CANCELLED: int = dialect.MAV_MISSION_OPERATION_CANCELLED
OUT_OF_SEQUENCE: int = dialect.MAV_MISSION_INVALID_SEQUENCE

_WORDS: dict[int, str] = {
    dialect.MAV_MISSION_ERROR: "not accepted, or not now",
    dialect.MAV_MISSION_UNSUPPORTED_FRAME: "its frame is not supported",
    dialect.MAV_MISSION_UNSUPPORTED: "not supported",
    dialect.MAV_MISSION_NO_SPACE: "there is no space for so many items",
    dialect.MAV_MISSION_INVALID: "a parameter has a value that is not valid",
    dialect.MAV_MISSION_INVALID_PARAM1: "param1 is not valid",
    dialect.MAV_MISSION_INVALID_PARAM2: "param2 is not valid",
    dialect.MAV_MISSION_INVALID_PARAM3: "param3 is not valid",
    dialect.MAV_MISSION_INVALID_PARAM4: "param4 is not valid",
    dialect.MAV_MISSION_INVALID_PARAM5_X: "param5 or latitude is not valid",
    dialect.MAV_MISSION_INVALID_PARAM6_Y: "param6 or longitude is not valid",
    dialect.MAV_MISSION_INVALID_PARAM7: "param7 or altitude is not valid",
    dialect.MAV_MISSION_INVALID_SEQUENCE: "out of sequence",
    dialect.MAV_MISSION_DENIED: "denied to us: perhaps another ground station is uploading",
    dialect.MAV_MISSION_OPERATION_CANCELLED: "cancelled by the vehicle",
}
_OF_ONE_ITEM = frozenset(
    {
        dialect.MAV_MISSION_UNSUPPORTED_FRAME,
        dialect.MAV_MISSION_UNSUPPORTED,
        *range(dialect.MAV_MISSION_INVALID, dialect.MAV_MISSION_INVALID_PARAM7 + 1),
    }
)
_TEMPORARY = frozenset({dialect.MAV_MISSION_ERROR, dialect.MAV_MISSION_DENIED, CANCELLED})


def mission_result_words(result: int) -> str:
    """What a MAV_MISSION_RESULT other than "accepted" means."""
    return _WORDS.get(result, f"refused with result {result}")


def is_of_one_item(result: int) -> bool:
    """Whether the item that was sent last is to blame."""
    return result in _OF_ONE_ITEM


def is_temporary(result: int) -> bool:
    """Whether asking again later may help."""
    return result in _TEMPORARY
