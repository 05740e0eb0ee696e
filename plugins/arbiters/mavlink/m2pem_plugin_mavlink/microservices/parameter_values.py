"""Values of parameters within the float that carries them (mavlink.io, "Parameter Protocol",
services/parameter.html, "Parameter Encoding").

ArduPilot converts whole numbers to floats as C does (24 bits are exact); PX4 puts their bytes into
the place of the float. AUTOPILOT_VERSION tells which.
"""

import math
import struct
from dataclasses import dataclass
from enum import Enum

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.protocol.messages import Message

NAME_BYTES = 16

_REAL32: int = dialect.MAV_PARAM_TYPE_REAL32
_WHOLE: dict[int, tuple[str, str]] = {  # how it is laid out in four bytes; its name
    dialect.MAV_PARAM_TYPE_UINT8: ("<B3x", "uint8"),
    dialect.MAV_PARAM_TYPE_INT8: ("<b3x", "int8"),
    dialect.MAV_PARAM_TYPE_UINT16: ("<H2x", "uint16"),
    dialect.MAV_PARAM_TYPE_INT16: ("<h2x", "int16"),
    dialect.MAV_PARAM_TYPE_UINT32: ("<I", "uint32"),
    dialect.MAV_PARAM_TYPE_INT32: ("<i", "int32"),
}
_FLOAT = struct.Struct("<f")


class ParameterEncoding(Enum):
    """How whole numbers are carried."""

    C_CAST = "c_cast"
    BYTEWISE = "bytewise"


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter as its vehicle has it. `type`: a MAV_PARAM_TYPE; `value` is an int where that is
    a whole number; `index` of `count`: None and 0 where it was sent without being listed."""

    name: str
    value: float
    type: int
    index: int | None = None
    count: int = 0


def encoded_name(name: str) -> bytes:
    """A name as it travels.

    Raises:
        ValueError: no parameter can have it.
    """
    encoded = name.encode("ascii", "replace")
    if not name or len(encoded) > NAME_BYTES or not name.isascii() or not name.isprintable():
        raise ValueError(f"'{name}' is no name of a parameter: 1 to {NAME_BYTES} ASCII characters")
    return encoded


def parameter_of(message: Message, encoding: ParameterEncoding) -> Parameter:
    """What a PARAM_VALUE says."""
    value: float = message.param_value
    whole = _WHOLE.get(message.param_type)
    if whole is not None and encoding is ParameterEncoding.BYTEWISE:
        value = struct.unpack(whole[0], _FLOAT.pack(value))[0]
    elif whole is not None and math.isfinite(value):
        value = round(value)
    listed = message.param_index < message.param_count
    return Parameter(
        name=message.param_id.decode("ascii", "replace"),
        value=value,
        type=message.param_type,
        index=message.param_index if listed else None,
        count=message.param_count if listed else 0,
    )


def carried(value: float, type_: int, encoding: ParameterEncoding) -> float:
    """The float that carries a value of a MAV_PARAM_TYPE in PARAM_SET.

    Raises:
        ValueError: the type has no such value, or it cannot be carried.
    """
    if not math.isfinite(value):
        raise ValueError(f"{value} is not a finite number")
    if type_ not in _WHOLE:
        try:
            return float(_FLOAT.unpack(_FLOAT.pack(value))[0])
        except OverflowError:
            raise ValueError(f"{value:g} is too large for a float") from None
    layout, name = _WHOLE[type_]
    if value != int(value):
        raise ValueError(f"{value:g} is not a whole number, and the parameter is one ({name})")
    try:
        raw = struct.pack(layout, int(value))
    except struct.error:
        raise ValueError(f"{value:g} is outside of {name}") from None
    if encoding is ParameterEncoding.C_CAST:
        result = float(_FLOAT.unpack(_FLOAT.pack(value))[0])
        if result != value:
            raise ValueError(f"{value:.0f} has more digits than this autopilot can be sent")
        return result
    result = float(_FLOAT.unpack(raw)[0])
    if _FLOAT.pack(result) != raw:  # the bytes of a NaN that Python does not keep
        raise ValueError(f"{value:.0f} cannot be sent")
    return result


def same_value(kept: Parameter, value: float) -> bool:
    """Whether a parameter has a value, but for what floats of 32 bits lose."""
    if kept.type == _REAL32 or kept.type not in _WHOLE:
        return math.isclose(kept.value, value, rel_tol=1e-6, abs_tol=1e-9)
    return kept.value == value
