"""The words for why something was refused (MAV_RESULT; mavlink.io, messages/common.html)."""

from collections.abc import Sequence

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.microservices.texts import Text

_WORDS: dict[int, str] = {
    dialect.MAV_RESULT_TEMPORARILY_REJECTED: "not possible now",
    dialect.MAV_RESULT_DENIED: "denied, as it stands or with these values",
    dialect.MAV_RESULT_UNSUPPORTED: "not supported",
    dialect.MAV_RESULT_FAILED: "failed",
    6: "cancelled",  # MAV_RESULT_CANCELLED, which the dialect does not have
    dialect.MAV_RESULT_COMMAND_LONG_ONLY: "taken as COMMAND_LONG only",
    dialect.MAV_RESULT_COMMAND_INT_ONLY: "taken as COMMAND_INT only",
}
MOST_TEXTS = 3


def result_words(result: int) -> str:
    """What a MAV_RESULT other than "accepted" means."""
    return _WORDS.get(result, f"refused with result {result}")


def command_name(command: int) -> str:
    """A MAV_CMD as people call it: "COMPONENT_ARM_DISARM"."""
    known = dialect.enums["MAV_CMD"].get(command)
    return str(known.name).removeprefix("MAV_CMD_") if known else f"command {command}"


def message_name(id_: int) -> str:
    """A message as people call it: "GLOBAL_POSITION_INT"."""
    known = dialect.mavlink_map.get(id_)
    return str(known.msgname) if known else f"message {id_}"


def with_reason(what: str, texts: Sequence[Text]) -> str:
    """What was refused, and what the vehicle said of it: "ARM: failed (PreArm: no position)"."""
    said = dict.fromkeys(each.text for each in texts if each.text)
    reasons = "; ".join(list(said)[-MOST_TEXTS:])
    return f"{what} ({reasons})" if reasons else what
