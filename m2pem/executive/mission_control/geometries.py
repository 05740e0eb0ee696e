"""Operations on the routes, areas and points that operators hand over."""

from collections.abc import Mapping, Sequence

from m2pem.api.runs import GeometryVersion, HandedOver, RunId
from m2pem.executive.ended_runs import refuse_ended
from m2pem.executive.mission_control.parts import ControlParts, bounded
from m2pem.mission.geometry import Area, Point, Route
from m2pem.mission.values import Value


class GeometryOperations(ControlParts):
    """See `m2pem.api.mission_control.geometries.GeometryControl`."""

    async def set_geometry(
        self, name: str, geometry: Mapping[str, Value], *, run: RunId | None = None, by: str = ""
    ) -> None:
        """Hand over a route, area or point (GeoJSON)."""
        given = bounded(geometry)
        if run is None:
            self._supervisor.set_geometry(name, given, None, by)
            await self._supervisor.drawings.write(f"{name} is handed over")
            return
        async with self._explain_end("set_geometry", run):
            refuse_ended(self._supervisor.runner(run))
            self._supervisor.set_geometry(name, given, run, by)

    async def delete_geometry(self, name: str, *, by: str = "") -> None:
        """Delete a geometry that was handed over for all runs."""
        self._supervisor.delete_geometry(name, by)
        await self._supervisor.drawings.write(f"{name} is deleted")

    async def geometry_versions(self, name: str) -> Sequence[GeometryVersion]:
        """The versions of a geometry that were handed over for all runs."""
        return self._supervisor.drawings.versions(name)

    async def geometry_users(self, name: str) -> Sequence[RunId]:
        """The runs under way whose missions name a geometry that is not their own."""
        return self._supervisor.geometry_users(name)

    def geometries(self) -> Mapping[str, HandedOver]:
        """What operators have handed over for all runs."""
        return self._supervisor.drawings.handed_over

    def run_geometries(self) -> Mapping[RunId, Mapping[str, Route | Area | Point]]:
        """The routes, areas and points that runs under way have alone."""
        return self._supervisor.run_geometries()
