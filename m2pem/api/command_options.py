"""Types of options that the commands of simulators share."""

import math
from typing import Any

import click

from m2pem.api.faults import FaultError, FaultGrammar, PlannedFault
from m2pem.api.telemetry import GeoPosition
from m2pem.units import Dimension, quantity


class FaultOption(click.ParamType):  # type: ignore[type-arg]  # older clicks have it bare
    """A fault of a simulator, by its grammar."""

    name = "fault"

    def __init__(self, grammar: FaultGrammar[Any]) -> None:
        self._grammar = grammar

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> PlannedFault[Any]:
        if isinstance(value, PlannedFault):
            return value
        try:
            return self._grammar.parse(str(value))
        except FaultError as error:
            self.fail(str(error), param, ctx)


class PositionOption(click.ParamType):  # type: ignore[type-arg]  # older clicks have it bare
    """A position on Earth, LAT,LON or LAT,LON,ALT: WGS-84 in degrees, metres above sea level."""

    name = "lat,lon,alt"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> GeoPosition:
        if isinstance(value, GeoPosition):
            return value
        try:
            latitude, longitude, altitude = (*map(float, str(value).split(",")), 0.0)[:3]
        except ValueError:
            self.fail(f"{value!r} is not LAT,LON,ALT, such as 38.1,-77.3,60", param, ctx)
        if not (abs(latitude) <= 90 and abs(longitude) <= 180 and math.isfinite(altitude)):
            self.fail(f"{value!r} is not on Earth", param, ctx)
        return GeoPosition(latitude, longitude, altitude)


class DurationOption(click.ParamType):  # type: ignore[type-arg]  # older clicks have it bare
    """Seconds, or with a unit: 6s, 500ms, 1min. `negative`: a duration below 0 is one, too."""

    name = "duration"

    def __init__(self, *, negative: bool = False) -> None:
        self._negative = negative

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        try:
            seconds = quantity(str(value), Dimension.DURATION)
        except ValueError as error:
            self.fail(str(error), param, ctx)
        if math.isnan(seconds) or (seconds < 0 and not self._negative):
            self.fail(f"{value!r} is not a duration such as 50ms or 6s", param, ctx)
        return seconds
