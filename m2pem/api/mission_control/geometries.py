"""Operations on the routes, areas and points that operators hand over."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

from m2pem.api.runs import GeometryVersion, HandedOver, RunId
from m2pem.mission.values import Value

if TYPE_CHECKING:
    from m2pem.mission.geometry import Area, Point, Route


class GeometryControl(Protocol):
    """The operations of `MissionControl` on geometries."""

    async def set_geometry(
        self, name: str, geometry: Mapping[str, Value], *, run: RunId | None = None, by: str = ""
    ) -> None:
        """Hand over a route, area or point (GeoJSON), to one run or to all, now and later.

        What is for all runs is kept in the journal, with its former versions.

        Raises:
            OperatorError: it is no geometry; or it is handed over, and the journal has not written
                it within 1.5 s.
        """

    async def delete_geometry(self, name: str, *, by: str = "") -> None:
        """Delete a geometry that was handed over for all runs: later runs get that of the fleet
        file, if it has one. Runs under way keep it. Its versions are kept.

        Raises:
            OperatorError: no operator has handed it over; or as for `set_geometry`.
        """

    async def geometry_versions(self, name: str) -> Sequence[GeometryVersion]:
        """The versions of a geometry that were handed over for all runs, the newest last."""

    async def geometry_users(self, name: str) -> Sequence[RunId]:
        """The runs under way whose missions name a geometry that is not their own.

        Operators see them before they hand over another one of that name.
        """

    def geometries(self) -> Mapping[str, HandedOver]:
        """The routes, areas and points that operators have handed over for all runs."""

    def run_geometries(self) -> "Mapping[RunId, Mapping[str, Route | Area | Point]]":
        """The routes, areas and points that runs under way have alone, by run and name.

        They are those of its mission's files, those that were handed over to this run, and those
        of all runs that have changed since and that it keeps.
        """
