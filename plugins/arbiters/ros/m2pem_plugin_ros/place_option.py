"""A place on Earth, as options of commands say it."""

import math

import click

from m2pem.api import GeoPosition


class Place(click.ParamType):  # type: ignore[type-arg]  # older clicks have it bare
    """LAT,LON or LAT,LON,ALT."""

    name = "lat,lon,alt"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> GeoPosition:
        """WGS-84 in degrees; metres above mean sea level."""
        if isinstance(value, GeoPosition):
            return value
        try:
            latitude, longitude, altitude = (*map(float, str(value).split(",")), 0.0)[:3]
        except ValueError:
            self.fail(f"{value!r} is not LAT,LON,ALT, such as 38.1,-77.3,60", param, ctx)
        if not (abs(latitude) <= 90 and abs(longitude) <= 180 and math.isfinite(altitude)):
            self.fail(f"{value!r} is not on Earth", param, ctx)
        return GeoPosition(latitude, longitude, altitude)
