"""Shared space: areas and corridors in which few vehicles may be at a time.

It is what Open-RMF calls a mutex group, with a capacity. A behavior whose volume enters one needs a
place in it for each of its vehicles, from its start until the vehicle has left it and the rest of
its way does not enter it again. A vehicle at rest in it has a place.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from m2pem.deconfliction.conflicts import Occupant, Refusal, does_what, way_out
from m2pem.deconfliction.operational_volume import Volume
from m2pem.fleet.fleet import Fleet, SharedSpace
from m2pem.geo.local_frame import EastNorth, LocalFrame
from m2pem.geo.polygon import Hull, Region, region_of
from m2pem.mission.catalogue import ResourceId


@dataclass(frozen=True, slots=True)
class SharedRegion:
    """A shared space in the local frame."""

    space: SharedSpace
    region: Region

    def entered_by(self, volume: Volume) -> bool:
        """Whether a volume has a part in it, at whatever height."""
        return any(self.region.meets(piece.area) for piece in volume.pieces)

    def entrance(self, volume: Volume) -> EastNorth | None:
        """Return a place of it that a volume covers; None: the volume is everywhere."""
        areas = (piece.area for piece in volume.pieces)
        return self.region.common_place(next(each for each in areas if self.region.meets(each)))

    def conflict(
        self,
        own: Mapping[ResourceId, tuple[Hull, Volume]],
        others: tuple[Occupant, ...],
        *,
        one_by_one: bool,
    ) -> "SpaceConflict | None":
        """Return why there is no place for all vehicles of a behavior; None: there is.

        `own`: where each of them is, and its volume; one that is in the space has a place already.
        `others`: who else has one. `one_by_one`: one of the vehicles moves at a time.
        """
        inside = [each for each, (stop, _) in own.items() if self.region.meets(stop)]
        entering = {
            each: volume
            for each, (_, volume) in own.items()
            if each not in inside and self.entered_by(volume)
        }
        if not entering:
            return None
        needed = len(entering)
        if one_by_one:
            ends = [volume.route[-1:] for volume in entering.values()]
            staying = sum(not end or self.region.meets(end) for end in ends)
            needed = min(needed, staying + 1)
        needed += len(inside)
        if needed + len(others) <= self.space.capacity:
            return None
        vehicle, volume = next(iter(entering.items()))
        return SpaceConflict(self.space, vehicle, self.entrance(volume), needed, others)


@dataclass(frozen=True, slots=True)
class SpaceConflict:
    """A shared space has no place for the vehicles of a behavior.

    `vehicle`: the first of them that enters it, at `place`. `needed`: how many places they need,
    those that they have already included. `others`: who else has a place.
    """

    space: SharedSpace
    vehicle: ResourceId
    place: EastNorth | None
    needed: int
    others: tuple[Occupant, ...]

    @property
    def lacking(self) -> int:
        """How many of the others must leave it first."""
        return self.needed + len(self.others) - self.space.capacity

    @property
    def never_fits(self) -> bool:
        """Whether there is no place though all others leave it."""
        return self.needed > self.space.capacity

    def refusal(self, where: str) -> Refusal:
        """Say it. `where`: the vehicle would enter the space; "": anywhere."""
        space = self.space
        into = f"{space.name} (capacity {space.capacity})" + (f" {where}" if where else "")
        if self.never_fits:
            reason = (
                f"its vehicles would need {self.needed} places at a time in {into}, "
                f"which {self.vehicle} would enter"
            )
            return Refusal(reason, self.vehicle, self.others, space=space.name)
        who = " and ".join(f"{each.vehicle}, which {does_what(each)}" for each in self.others)
        first = self.others[0]
        after = way_out(first) if first.lost else f"after {first.vehicle} has left it"
        reason = f"{self.vehicle} would enter {into}, which is taken by {who}: start it {after}"
        wait_s = space.wait_s if space.waits else None
        return Refusal(reason, self.vehicle, self.others, self.lacking, space.name, wait_s)


def regions_of(fleet: Fleet, frame: LocalFrame) -> tuple[SharedRegion, ...]:
    return tuple(
        SharedRegion(space, region_of(fleet.geometries[space.name], space.width_m, frame))
        for space in fleet.shared_space.values()
    )


def occupants_of(
    shared: SharedRegion, occupants: Iterable[Occupant], apart_from: Collection[ResourceId]
) -> tuple[Occupant, ...]:
    """Return who has a place in a shared space, each vehicle once."""
    found: dict[ResourceId, Occupant] = {}
    for each in occupants:
        if each.vehicle in apart_from or each.vehicle in found:
            continue
        if shared.entered_by(each.volume):
            found[each.vehicle] = each
    return tuple(found.values())
