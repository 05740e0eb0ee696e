"""Conflicts between operational volumes: why a behavior is refused, and what would be right."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from m2pem.deconfliction.operational_volume import NOTHING_M, Piece, Separation, Volume
from m2pem.geo.local_frame import EastNorth
from m2pem.geo.polygon import meeting_place
from m2pem.mission.catalogue import ResourceId

LOWEST_M = 2.0
HIGHEST_M = 10_000.0
"""Above home: nothing lower or higher is proposed."""

_TRIES = 8


@dataclass(frozen=True, slots=True)
class Occupant:
    """A vehicle that occupies a volume.

    `behavior`, `name`: the id and the name of its behavior; "" when it has none. `lost`: the
    behavior has ended, and nothing was received from the vehicle since.
    """

    vehicle: ResourceId
    volume: Volume
    behavior: str = ""
    name: str = ""
    lost: bool = False


@dataclass(frozen=True, slots=True)
class Conflict:
    """A vehicle would come too near to another one.

    `own`, `piece`: the parts of both volumes that come too near. `home_m`: the height of the home
    of `vehicle`; None: not known. `policy`: what both must keep.
    """

    vehicle: ResourceId
    volume: Volume
    home_m: float | None
    other: Occupant
    own: Piece
    piece: Piece
    policy: Separation

    @property
    def place(self) -> EastNorth | None:
        """Where they would meet; None: anywhere."""
        return meeting_place(self.own.area, self.piece.area)


@dataclass(frozen=True, slots=True)
class Refusal:
    """Why a behavior may not start now.

    `vehicle`: its vehicle that another one is in the way of. `blockers`: who is in the way;
    `lacking` of them must go. `space`: the name of the shared space that is full; "": none is.
    `wait_s`: how long its task may wait for that; None: the behavior is refused at once.
    """

    reason: str
    vehicle: ResourceId
    blockers: tuple[Occupant, ...] = ()
    lacking: int = 1
    space: str = ""
    wait_s: float | None = None


Again: TypeAlias = Callable[[float, bool], Conflict | None]
"""Return the conflict at another altitude above home in metres; True: it goes there first."""


def conflict_text(conflict: Conflict, where: str, again: Again | None) -> str:
    """Return why the behavior is refused. `where`: they would meet; "": anywhere. `again` None: it
    takes no altitude."""
    other, policy = conflict.other, conflict.policy
    airborne = math.isfinite(policy.vertical_m)
    does = does_what(other, _heights(conflict.piece, conflict.home_m) if airborne else None)
    why = "".join(f"; {who}: {what}" for who, what in _unknown(conflict))
    near = f"nearer than {policy.horizontal_m:g} m"
    if airborne:
        near += f" and {policy.vertical_m:g} m in height"
    altitudes = [] if again is None else _altitudes(conflict, again)
    advice = ", or ".join([*altitudes, way_out(other, "landed" if airborne else "")])
    if not altitudes:
        advice = f"start it {advice}"
    at = f", {where}" if where else ""
    return (
        f"{conflict.vehicle} would come {near} to {other.vehicle}, which {does}{at}{why}: {advice}"
    )


def does_what(other: Occupant, heights: str | None = None) -> str:
    """Say what a vehicle does that is in the way. `heights`: None: they do not matter."""
    at = heights or ""
    if other.lost:
        did = f", and did {other.behavior} ({other.name}){at}" if other.behavior else ""
        return f"is lost{did}"
    if other.behavior:
        return f"does {other.behavior} ({other.name}){at}"
    return "is at rest there" if heights is None else f"flies{at}"


def _unknown(conflict: Conflict) -> list[tuple[str, str]]:
    found = [(conflict.vehicle, conflict.volume.unknown)]
    found.append((conflict.other.vehicle, conflict.other.volume.unknown))
    return [(who, what) for who, what in found if what]


def way_out(other: Occupant, or_has: str = "") -> str:
    """Say when a vehicle is not in the way any more. `or_has`: what else it can do for that."""
    if other.lost:
        return f"when the link to {other.vehicle} is restored"
    if other.behavior:
        return f"after {other.behavior} has ended"
    done = f"{or_has} or gone" if or_has else "gone"
    return f"after {other.vehicle} has {done} elsewhere"


def _heights(piece: Piece, home_m: float | None) -> str:
    base_m, frame = (0.0, " above mean sea level") if home_m is None else (home_m, "")
    low, high = (f"{each - base_m:.0f}" for each in (piece.low_m, piece.high_m))
    if math.isinf(piece.low_m) and math.isinf(piece.high_m):
        return " at any height"
    if math.isinf(piece.high_m):
        return f" at {low} m{frame} or more"
    if math.isinf(piece.low_m):
        return f" at {high} m{frame} or less"
    return f" at {high} m{frame}" if low == high else f" at {low} to {high} m{frame}"


def _altitudes(conflict: Conflict, again: Again) -> list[str]:
    """Altitudes that were found to be free, the higher ones first."""
    found = []
    for up, change, beyond in ((True, "climb", "more"), (False, "descend", "less")):
        altitude_m = _free_altitude_m(conflict, up, again)
        if altitude_m is not None:
            farthest_free = again(HIGHEST_M if up else LOWEST_M, True) is None
            at = f"{altitude_m:.0f} m" + (f" or {beyond}" if farthest_free else "")
            at_once = again(altitude_m, False) is None
            found.append(f"fly at {at}" if at_once else f"{change} to {at} first")
    return found


def _free_altitude_m(conflict: Conflict, up: bool, again: Again) -> float | None:
    """Return the nearest altitude above home without any conflict; None: there is none."""
    met: Conflict | None = conflict
    apart_m = conflict.policy.vertical_m - NOTHING_M
    altitude_m, tried = 0.0, set[float]()
    while met is not None:
        edge_m = met.piece.high_m + apart_m if up else met.piece.low_m - apart_m
        if met.home_m is None or not LOWEST_M <= edge_m - met.home_m <= HIGHEST_M:
            return None
        altitude_m = float((math.ceil if up else math.floor)(edge_m - met.home_m))
        if altitude_m in tried or len(tried) == _TRIES:
            return None
        tried.add(altitude_m)
        met = again(altitude_m, True)
    return altitude_m
