"""Plans of teams that cover an area in lanes, or stand around an area or a target."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TypeAlias

from m2pem.fleet.parameters import accepted
from m2pem.geo.lawn_mower import lawn_mower, longest_edge_yaw
from m2pem.geo.polygon import middle_of
from m2pem.mission.geometry import Area, Route, VehiclePosition
from m2pem.teams.paths import SPACING_M
from m2pem.teams.plan import Leg, Plan, PlanningContext, TeamRefusedError


def split(whole: float, weights: Sequence[float], reaches: Sequence[float]) -> list[float] | None:
    """The share of each, their sum the whole; None: all of them together cannot do it.

    A share is as its weight, or its reach where that is less; what is left is for the others.
    """
    if sum(reaches) < whole:
        return None
    shares = [0.0] * len(weights)
    open_ = [index for index, weight in enumerate(weights) if weight > 0]
    left = whole
    while open_:
        each = left / sum(weights[index] for index in open_)
        full = [index for index in open_ if reaches[index] < each * weights[index]]
        for index in full or open_:
            shares[index] = reaches[index] if full else each * weights[index]
            left -= shares[index]
        open_ = [index for index in open_ if index not in full] if full else []
    return shares


def owners(lengths: Sequence[float], shares: Sequence[float]) -> list[int]:
    """Whose each of some lengths in a row is, so that together they are nearly as the shares.

    Nobody has more than a share and the longest of the lengths.
    """
    whole = sum(lengths) or 1.0
    bounds = [sum(shares[: index + 1]) / sum(shares) for index in range(len(shares))]
    last = max(index for index, share in enumerate(shares) if share > 0)
    found = []
    done = 0.0
    for length in lengths:
        middle = (done + length / 2) / whole
        at = next((i for i, b in enumerate(bounds) if middle <= b and shares[i] > 0), last)
        found.append(at)
        done += length
    return found


def reach_m(lasts_s: float | None, way_s: float, speed_m_s: float) -> float:
    """How far a vehicle can go that lasts so long, if it is so long under way there and back."""
    return math.inf if lasts_s is None else max(0.0, lasts_s - way_s) * speed_m_s


Place: TypeAlias = tuple[float, float]
"""East and north in metres."""

Pass: TypeAlias = Sequence[Place]
"""Its two ends; or the corners of a ring, the first of them again at the end."""


def lanes(passes: Sequence[Pass], shares: Sequence[float]) -> list[list[Pass]]:
    """The passes in their order, cut so that the ways over the area are as the shares."""
    lanes: list[list[Pass]] = [[] for _ in shares]
    lengths = [math.dist(*each) for each in passes]
    for each, index in zip(passes, owners(lengths, shares), strict=True):
        lanes[index].append(each)
    return lanes


def strips(
    rings: Sequence[Pass], passes: Sequence[Pass], yaw_rad: float, shares: Sequence[float]
) -> list[list[list[Place]]]:
    """The parts of an area between passes, as rings; nothing for whom there is no pass."""
    level = [[turned(corner, (0.0, 0.0), yaw_rad) for corner in ring] for ring in rings]
    low = min(y for _, y in level[0])
    high = max(y for _, y in level[0])
    lengths: dict[float, float] = {}
    for each in passes:
        y = round(turned(each[0], (0.0, 0.0), yaw_rad)[1], 6)
        lengths[y] = lengths.get(y, 0.0) + math.dist(*each)
    whose = owners(list(lengths.values()), shares)
    middles = list(lengths)
    parts: list[list[list[Place]]] = []
    for member in range(len(shares)):
        mine = [y for y, owner in zip(middles, whose, strict=True) if owner == member]
        if not mine:
            parts.append([])
            continue
        first, last = middles.index(mine[0]), middles.index(mine[-1])
        bottom = low if first == 0 else (middles[first - 1] + middles[first]) / 2
        top = high if last == len(middles) - 1 else (middles[last] + middles[last + 1]) / 2
        cut = [_between(ring, bottom, top) for ring in level]
        parts.append(
            [
                [turned(corner, (0.0, 0.0), -yaw_rad) for corner in [*ring, ring[0]]]
                for ring in cut
                if len(ring) > 2
            ]
        )
    return parts


def _between(ring: Pass, bottom: float, top: float) -> list[Place]:
    """What of a closed ring lies between two y, as corners."""
    kept = _above(list(ring[:-1]), bottom)
    over = _above([(x, -y) for x, y in kept], -top)
    return [(x, -y) for x, y in over]


def _above(corners: Sequence[Place], bottom: float) -> list[Place]:
    found: list[Place] = []
    for a, b in zip(corners, [*corners[1:], *corners[:1]], strict=True):
        if a[1] >= bottom:
            found.append(a)
        if (a[1] >= bottom) != (b[1] >= bottom):
            found.append((a[0] + (b[0] - a[0]) * (bottom - a[1]) / (b[1] - a[1]), bottom))
    return found


def turned(
    place: tuple[float, float], centre: tuple[float, float], angle_rad: float
) -> tuple[float, float]:
    """In a frame at the centre whose first axis points that way."""
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    east, north = place[0] - centre[0], place[1] - centre[1]
    return east * cos + north * sin, north * cos - east * sin


SURVEY_SPACING_M = 20.0
STANDOFF_M = 20.0
FLYING_STANDOFF_M = 30.0
"""When nobody says."""


def survey(context: PlanningContext) -> Plan:
    """The passes over the area in as many lanes as there are members, the faster the wider, and
    none longer than its member lasts.

    Where all can survey an area themselves, with cameras that their arbiters trigger perhaps, each
    is given the area of its band; else each moves along the passes.
    """
    area = context.parameters.area
    if area is None:
        raise TeamRefusedError("parameter 'area': there is none")
    rings = [[context.level(corner) for corner in ring] for ring in area.rings]
    heading = context.parameters.heading_rad
    yaw = longest_edge_yaw(rings[0]) if heading is None else math.pi / 2 - heading
    spacing = context.parameters.spacing_m or SURVEY_SPACING_M
    try:
        tracks = lawn_mower(rings, spacing, yaw, context.parameters.overshoot_m)
    except ValueError as error:
        raise TeamRefusedError(f"parameter 'spacing': {error}") from None
    wished = context.parameters.speed_m_s
    passes = [tracks[index : index + 2] for index in range(0, len(tracks), 2)]
    shares = context.split or _shares(context, rings[0], passes, wished)
    themselves = all("area_survey" in context.offered[member] for member in context.members)
    behavior = "area_survey" if themselves else "single_vehicle_routing"
    legs: list[Leg] = []
    if themselves:
        parts = strips(rings, passes, yaw, shares)
        for member, ring in zip(context.members, parts, strict=True):
            if ring:
                own = {
                    **context.parameters.only("speed", "overshoot"),
                    "area": _band_area(context, area, ring),
                    "heading": (math.pi / 2 - yaw) % math.tau,
                    "spacing": spacing,
                }
                legs.append(context.leg(member, behavior, own))
    else:
        for member, band in zip(context.members, lanes(passes, shares), strict=True):
            if band:
                places = (context.coordinate(place, None) for each in band for place in each)
                parameters = {"route": Route(tuple(places)), "speed": wished}
                legs.append(context.leg(member, behavior, parameters))
    takes = {
        member: frozenset(accepted(context.offered[member][behavior])) for member in context.members
    }
    return Plan(tuple(legs), shared=True, takes=takes, split=tuple(shares))


def _shares(
    context: PlanningContext, ring: Pass, passes: Sequence[Pass], wished_m_s: float | None
) -> list[float]:
    """How many metres of the passes each member is to do: as its speed, within its endurance.

    Raises:
        TeamRefusedError: together they do not last long enough.
    """
    lengths = [math.dist(*each) for each in passes]
    corners = ring[:-1]
    middle = tuple(sum(axis) / len(corners) for axis in zip(*corners, strict=True))
    weights, reaches = [], []
    for member in context.members:
        nominal_m_s = context.motion(member).nominal_m_s
        speed_m_s = nominal_m_s if wished_m_s is None else wished_m_s
        way_s = 2 * math.dist(context.poses[member].place, middle) / nominal_m_s
        reach = reach_m(context.lasts_s.get(member), way_s, speed_m_s)
        weights.append(speed_m_s)
        # A band ends with a pass: it may be longer than its share by the longest one.
        reaches.append(max(0.0, reach - max(lengths, default=0.0)))
    shares = split(sum(lengths), weights, reaches)
    if shares is None:
        last = ", ".join(
            f"{member} {reach:.0f} m"
            for member, reach in zip(context.members, reaches, strict=True)
        )
        raise TeamRefusedError(
            f"the area has {sum(lengths):.0f} m of passes, and its members last for less: {last}; "
            "take more of them, a wider `spacing`, or full batteries"
        )
    return shares


def _band_area(context: PlanningContext, area: Area, rings: Sequence[Pass]) -> Area:
    """A part of the area, at the height that it says."""
    up_m = area.rings[0][0][2]
    return Area(
        tuple(tuple(context.coordinate(corner, up_m) for corner in ring) for ring in rings),
        area.altitude_frame,
    )


def observe(context: PlanningContext) -> Plan:
    """Each goes to a place of its own around the area or target, looks at it, and stays."""
    area = context.parameters.area
    legs = []
    for index, member in enumerate(context.members):
        angle = math.tau * index / len(context.members)
        flies = context.domains[member] == "air"
        if area is None:
            centre = context.target_place()
            reach = FLYING_STANDOFF_M if flies else STANDOFF_M
        else:
            ring = [context.level(corner) for corner in area.rings[0]]
            centre = middle_of(ring[:-1])
            reach = _reach(ring, centre, angle)
        place = (centre[0] + reach * math.cos(angle), centre[1] + reach * math.sin(angle))
        heading = (math.pi / 2 - (angle + math.pi)) % math.tau
        legs.append(context.to_place(member, place, heading))
    return Plan(tuple(legs), stays=True, duration_s=context.parameters.duration_s)


def _reach(
    ring: Sequence[tuple[float, float]], centre: tuple[float, float], angle_rad: float
) -> float:
    """How far it is from the centre to the outermost edge in a direction."""
    found = 0.0
    for a, b in pairwise(ring):
        (ax, ay), (bx, by) = (turned(corner, centre, angle_rad) for corner in (a, b))
        if (ay <= 0) != (by <= 0):
            found = max(found, ax + (bx - ax) * ay / (ay - by))
    return found


def escort(context: PlanningContext) -> Plan:
    """Each keeps to a place of its own around the target, the first one ahead of it."""
    spacing = context.parameters.spacing_m or SPACING_M
    target = context.parameters.target
    legs = []
    for index, member in enumerate(context.members):
        angle = math.tau * index / len(context.members)
        if not isinstance(target, VehiclePosition):
            centre = context.target_place()
            place = (centre[0] + spacing * math.cos(angle), centre[1] + spacing * math.sin(angle))
            legs.append(context.to_place(member, place))
            continue
        if target.vehicle == member:
            raise TeamRefusedError(f"parameter 'target': {member} cannot escort itself")
        leg = context.leg(member, "follow", {"target": target, "offset": spacing, "bearing": angle})
        if len(context.members) > 1 and "bearing" not in leg.parameters:
            raise TeamRefusedError(f"{member} follows without a bearing: all would be in one place")
        legs.append(leg)
    return Plan(tuple(legs), stays=True)
