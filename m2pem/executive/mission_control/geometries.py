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
        given = bounded(geometry)
        if run is None:
            self._supervisor.set_geometry(name, given, None, by)
            await self._supervisor.drawings.write(f"{name} is handed over")
            return
        async with self._explain_end("set_geometry", run):
            refuse_ended(self._supervisor.runner(run))
            self._supervisor.set_geometry(name, given, run, by)

    async def delete_geometry(self, name: str, *, by: str = "") -> None:
        self._supervisor.delete_geometry(name, by)
        await self._supervisor.drawings.write(f"{name} is deleted")

    async def geometry_versions(self, name: str) -> Sequence[GeometryVersion]:
        return self._supervisor.drawings.versions(name)

    async def geometry_users(self, name: str) -> Sequence[RunId]:
        return self._supervisor.geometry_users(name)

    def geometries(self) -> Mapping[str, HandedOver]:
        return self._supervisor.drawings.handed_over

    def run_geometries(self) -> Mapping[RunId, Mapping[str, Route | Area | Point]]:
        return self._supervisor.run_geometries()
