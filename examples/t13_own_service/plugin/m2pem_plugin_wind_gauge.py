"""The service `WindGauge`: listens to the wind for a minute and tells its strongest gust.

This one has no gauge: it is given its readings. A real one would read them from a device in `run`.
"""

from collections.abc import Callable, Mapping, Sequence

from m2pem import hookimpl
from m2pem.api.service import Service, ServiceContext, ServiceError
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.values import Value


class WindGauge:
    """Property `gusts`: a list of speeds in m/s. Writes `wind.gust`, m/s."""

    writes: Sequence[str] = ("wind.gust",)

    async def run(
        self,
        context: ServiceContext,
        roles: Mapping[str, ResourceId],
        properties: Mapping[str, Value],
    ) -> Mapping[str, Value]:
        """Listen for a minute.

        Raises:
            ServiceError: NO_WIND_DATA, when there is no reading.
        """
        await context.clock.sleep(60)
        gusts = properties.get("gusts")
        readings = (
            [g for g in gusts if isinstance(g, int | float)] if isinstance(gusts, list) else []
        )
        if not readings:
            raise ServiceError("NO_WIND_DATA", f"gusts is no list of speeds: {gusts!r}")
        return {"wind.gust": max(readings)}


@hookimpl
def m2pem_register_services(register: Callable[[str, Callable[[], Service]], None]) -> None:
    """Tell m2pem what the class of a service task may be."""
    register("WindGauge", WindGauge)
