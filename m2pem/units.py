"""Quantities as people write them ("30 s", "5 km/h", "45 deg"), read into SI numbers.

A bare number is SI already, except for an angle: radians and degrees look alike, so an angle
always says which it is. The table is our own: the `pint` package reads far more than fleets and
missions need, and importing it took 0.2 to 0.4 s of CPU where we measured it; every start of
`m2pem check` would pay for that.
"""

import math
import re
from collections.abc import Mapping
from enum import StrEnum

from m2pem.errors import M2pemError
from m2pem.suggestions import did_you_mean

US_PER_S = 1_000_000
"""Microseconds in a second: times of clocks and records are microseconds."""


class Dimension(StrEnum):
    """What a quantity measures; its SI unit is the first one in `UNITS`."""

    DURATION = "duration"
    DISTANCE = "distance"
    SPEED = "speed"
    ACCELERATION = "acceleration"
    ANGLE = "angle"
    ANGULAR_SPEED = "angular speed"
    FREQUENCY = "frequency"


UNITS: Mapping[Dimension, Mapping[str, float]] = {
    Dimension.DURATION: {"s": 1.0, "ms": 0.001, "min": 60.0, "h": 3600.0},
    Dimension.DISTANCE: {
        "m": 1.0,
        "cm": 0.01,
        "km": 1000.0,
        "ft": 0.3048,
        "mi": 1609.344,
        "nmi": 1852.0,
    },
    Dimension.SPEED: {
        "m/s": 1.0,
        "km/h": 1000.0 / 3600.0,
        "kn": 1852.0 / 3600.0,
        "mph": 1609.344 / 3600.0,
        "ft/s": 0.3048,
    },
    Dimension.ACCELERATION: {"m/s2": 1.0, "m/s²": 1.0, "m/s^2": 1.0},
    Dimension.ANGLE: {"rad": 1.0, "deg": math.pi / 180.0},
    Dimension.ANGULAR_SPEED: {"rad/s": 1.0, "deg/s": math.pi / 180.0},
    Dimension.FREQUENCY: {"Hz": 1.0},
}
"""Factor to SI of every unit that is understood."""

_LENGTHS = UNITS[Dimension.DISTANCE]
LENGTHS_IN_FILES: Mapping[str, float] = {
    **_LENGTHS,
    **dict.fromkeys(("metre", "metres", "meter", "meters"), 1.0),
    **dict.fromkeys(("centimetre", "centimeter"), 0.01),
    **dict.fromkeys(("foot", "feet"), _LENGTHS["ft"]),
    **dict.fromkeys(("ft_us", "us_ft", "ftus", "foot_us"), 1200 / 3937),
    **dict.fromkeys(("us_survey_foot", "us_survey_feet"), 1200 / 3937),
}
"""Units of length by their names in tables and elevation files: in lower case, with _ for spaces
and hyphens."""

_UNIT_REQUIRED = frozenset({Dimension.ANGLE, Dimension.ANGULAR_SPEED})
_DIMENSION_OF = {unit: dimension for dimension, units in UNITS.items() for unit in units}
_QUANTITY = re.compile(r"\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)\s*(\S*)\s*")


class UnitError(M2pemError, ValueError):
    """A quantity cannot be read; the message says why and what would be right."""

    exit_status = 2


def article(noun: str) -> str:
    """The noun with "a" or "an" before it."""
    return f"an {noun}" if noun[0] in "aeiou" else f"a {noun}"


def _expected(dimension: Dimension) -> str:
    return f"{article(dimension.value)} is written with {', '.join(UNITS[dimension])}"


def quantity(value: object, dimension: Dimension) -> float:
    """Read a quantity of `dimension`, in SI: seconds, metres, m/s, m/s², radians, rad/s, Hz.

    `value` is a text ("5 km/h", also "5km/h"; units are case-sensitive) or a number. A number
    without a unit is SI; an angle needs one.

    Raises:
        UnitError: no number, an unknown unit, a unit of something else, not finite.
    """
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise UnitError(f"{value!r} is not {article(dimension.value)}; {_expected(dimension)}")
    match = _QUANTITY.fullmatch(value if isinstance(value, str) else repr(value))
    if match is None:
        raise UnitError(
            f"{value!r} is not a number with a unit; {_expected(dimension)}, "
            f"for example '5 {next(iter(UNITS[dimension]))}'"
        )
    number, unit = match.groups()
    if not unit:
        if dimension in _UNIT_REQUIRED:
            degrees, radians = ("deg/s", "rad/s") if "speed" in dimension else ("deg", "rad")
            raise UnitError(
                f"{value!r} has no unit; {article(dimension.value)} needs one: "
                f"'{number} {degrees}' or '{number} {radians}'"
            )
        factor = 1.0
    elif unit not in _DIMENSION_OF:
        hint = did_you_mean(unit, UNITS[dimension])
        raise UnitError(f"{value!r}: unknown unit '{unit}'; {hint or _expected(dimension)}")
    elif unit not in UNITS[dimension]:
        raise UnitError(
            f"{value!r} is {article(_DIMENSION_OF[unit].value)}, "
            f"not {article(dimension.value)}; {_expected(dimension)}"
        )
    else:
        factor = UNITS[dimension][unit]
    result = float(number) * factor
    if not math.isfinite(result):
        raise UnitError(f"{value!r} is too large")
    return result


def plain_number(value: object) -> float:
    """Read a number that has no unit, from a text or a number.

    Raises:
        UnitError: no number, a unit behind it, not finite.
    """
    if isinstance(value, str | int | float) and not isinstance(value, bool):
        match = _QUANTITY.fullmatch(value if isinstance(value, str) else repr(value))
        if match and match[2]:
            raise UnitError(f"{value!r} has the unit '{match[2]}'; a plain number is expected")
        if match and math.isfinite(float(match[1])):
            return float(match[1])
    raise UnitError(f"{value!r} is not a number")
