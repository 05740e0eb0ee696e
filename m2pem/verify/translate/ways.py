"""Where the vehicles of tasks go, as far as that is known before a mission starts.

The translation asks a `KnownWays` (`m2pem.deconfliction.known_ways`): verification knows no
geometry.
"""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeAlias

from m2pem.mission.behavior import Behavior
from m2pem.mission.catalogue import ResourceId

Station: TypeAlias = Hashable
"""Where a vehicle may stand."""


@dataclass(frozen=True, slots=True)
class Way:
    """The way of a vehicle in a behavior that begins at some station.

    `enters`: by shared space that counts the vehicle, whether its volume enters it; None: unknown.
    `after`: where it stands when the behavior has succeeded. `leaves`: shared spaces in which it
    gives its place back as soon as it has left them, and not only at the behavior's end. `stays`:
    those in which its way ends, or may end.
    """

    enters: Mapping[str, bool | None]
    after: Station
    leaves: frozenset[str] = frozenset()
    stays: frozenset[str] = frozenset()


class KnownWays(Protocol):
    """What the fleet file and the parameters of tasks say about ways."""

    @property
    def anywhere(self) -> Station:
        """The station of a vehicle of which it is not known where it stands."""

    def home(self, vehicle: ResourceId) -> Station:
        """Return where a vehicle stands at first."""

    def inside(self, station: Station, vehicle: ResourceId) -> Mapping[str, bool | None]:
        """Return, by shared space that counts the vehicle, whether it stands in it; None: not
        known."""

    def moves(self, behavior: Behavior) -> bool:
        """Whether a behavior moves its vehicles."""

    def way(
        self,
        behavior: Behavior,
        vehicles: Sequence[ResourceId],
        indexes: Sequence[int],
        station: Station,
    ) -> Way:
        """Return the way of any of some vehicles of one domain, which is one of the members
        `indexes` of the behavior's team (0 leads), or (0,)."""
