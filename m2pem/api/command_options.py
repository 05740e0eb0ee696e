"""Types of options that the commands of simulators share, and some of these options."""

import math
from collections.abc import Callable
from typing import Any

import click

from m2pem.api.faults import FaultGrammar
from m2pem.api.telemetry import GeoPosition
from m2pem.units import Dimension, quantity


class TextOption(click.ParamType):  # type: ignore[type-arg]  # older clicks have it bare
    """What `read` makes of a text. Its ValueError says what is wrong with the text."""

    def __init__(self, name: str, read: Callable[[str], Any]) -> None:
        self.name = name
        self._read = read

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> Any:
        if not isinstance(value, str):
            return value
        try:
            return self._read(value)
        except ValueError as error:
            self.fail(str(error), param, ctx)


class FaultOption(TextOption):
    """A fault of a simulator, by its grammar."""

    def __init__(self, grammar: FaultGrammar[Any]) -> None:
        super().__init__("fault", grammar.parse)


class PositionOption(TextOption):
    """A position on Earth, as `read_position` reads it."""

    def __init__(self) -> None:
        super().__init__("lat,lon,alt", read_position)


class DurationOption(TextOption):
    """Seconds, or with a unit: 6s, 500ms, 1min. `negative`: a duration below 0 is one, too."""

    def __init__(self, *, negative: bool = False) -> None:
        super().__init__("duration", self._seconds)
        self._negative = negative

    def _seconds(self, text: str) -> float:
        seconds = quantity(text, Dimension.DURATION)
        if math.isnan(seconds) or (seconds < 0 and not self._negative):
            raise ValueError(f"{text!r} is not a duration such as 50ms or 6s")
        return seconds


def read_position(text: str) -> GeoPosition:
    """Read LAT,LON or LAT,LON,ALT: WGS-84 in degrees, metres above sea level.

    Raises:
        ValueError: it is something else, or not on Earth.
    """
    try:
        latitude, longitude, altitude = (*map(float, text.split(",")), 0.0)[:3]
    except ValueError:
        raise ValueError(f"{text!r} is not LAT,LON,ALT, such as 38.1,-77.3,60") from None
    if not (abs(latitude) <= 90 and abs(longitude) <= 180 and math.isfinite(altitude)):
        raise ValueError(f"{text!r} is not on Earth")
    return GeoPosition(latitude, longitude, altitude)


def read_setting(text: str, example: str) -> tuple[str, str]:
    """Read KEY=VALUE.

    Raises:
        ValueError: it is something else.
    """
    key, equals, value = (part.strip() for part in text.partition("="))
    if not (key and equals and value):
        raise ValueError(f"{text!r} is not KEY=VALUE, such as {example}")
    return key, value


def speed_option(most: float) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return the option `--speed` of a simulator that can be so many times as fast."""
    return click.option(
        "--speed",
        type=click.FloatRange(0.1, most),
        default=1.0,
        show_default=True,
        help="Simulated seconds per second.",
    )
