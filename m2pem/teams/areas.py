"""Plans of teams that cover an area in lanes, or stand around an area or a target."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TypeAlias

from m2pem.fleet.parameters import accepted
from m2pem.geo.fence import Fence, rings_of, valid
from m2pem.geo.lawn_mower import Ring
from m2pem.geo.lazy_imports import shapely
from m2pem.geo.polygon import middle_of, turned
from m2pem.geo.polyline import Polyline
from m2pem.geo.survey_tracks import SurveyTracks
from m2pem.geo.work_shares import owners, reach_m, split
from m2pem.mission.geometry import Area, Route, VehiclePosition
from m2pem.teams.paths import SPACING_M
from m2pem.teams.plan import Leg, Plan, PlanningContext, TeamRefusedError

Place: TypeAlias = tuple[float, float]
"""East and north in metres."""


def lanes(tracks: SurveyTracks, shares: Sequence[float]) -> list[list[Place]]:
    """Return each member's places to pass, so that the lengths of its passes are as its share."""
    first: dict[int, int] = {}
    last: dict[int, int] = {}
    at = [index for index, *_ in tracks.passes]
    lengths = [tracks.line.segments[index].length_m for index in at]
    for index, owner in zip(at, owners(lengths, shares), strict=True):
        first.setdefault(owner, index)
        last[owner] = index + 2
    points = tracks.line.points
    return [list(points[first.get(each, 0) : last.get(each, 0)]) for each in range(len(shares))]


def strips(
    rings: Sequence[Ring], tracks: SurveyTracks, shares: Sequence[float]
) -> list[list[list[Place]]]:
    """Return each member's band of an area as rings, an empty list for a member without a pass; or
    nothing where a band is in several pieces, or where tracks over one would enter a hole: one that
    other bands have a part of is no hole of it."""
    level, *_ = corners = [[turned(corner, tracks.yaw_rad) for corner in ring] for ring in rings]
    holes = Fence.around(rings[1:])
    west, east = (extreme(x for x, _ in level) for extreme in (min, max))
    low, high = (extreme(y for _, y in level) for extreme in (min, max))
    count = max(1, round((high - low) / tracks.width_m))
    lengths = [0.0] * count
    for index, *_ in tracks.passes:
        y = turned(tracks.line.points[index], tracks.yaw_rad)[1]
        strip = min(count - 1, int((y - low) / tracks.width_m))
        lengths[strip] += tracks.line.segments[index].length_m
    whose = owners(lengths, shares)
    parts: list[list[list[Place]]] = []
    for member in range(len(shares)):
        mine = [strip for strip, owner in enumerate(whose) if owner == member]
        if not mine:
            parts.append([])
            continue
        bottom, top = low + mine[0] * tracks.width_m, low + (mine[-1] + 1) * tracks.width_m
        inside = shapely.box(west - 1, bottom, east + 1, top)
        band = [
            [turned(corner, -tracks.yaw_rad) for corner in ring]
            for ring in rings_of(valid(*corners).intersection(inside))
        ]
        if not band or (rings[1:] and not _keeps_out(holes, band, tracks)):
            return []
        parts.append(band)
    return parts


def _keeps_out(holes: Fence, band: Sequence[Ring], tracks: SurveyTracks) -> bool:
    spacing_m = tracks.spacing_m(band)
    try:
        own = SurveyTracks.over(band, spacing_m, tracks.yaw_rad, tracks.overshoot_m)
    except ValueError:
        return False
    return all(holes.is_free(*leg) for leg in pairwise(own.line.points))


_CORNER_M = 0.2
"""Vehicles round corners, the less the shorter the legs are."""

STANDOFF_M = 20.0
FLYING_STANDOFF_M = 30.0
"""Defaults."""


def survey(context: PlanningContext) -> Plan:
    """Divide the passes over the area into one band for each member, by speed and endurance.

    If all members offer `area_survey`, each surveys the area of its band, so that its arbiter can
    trigger a camera. Else each moves along its passes, as it does where the area has holes, if all
    can: who surveys a band does not know those beside it.
    """
    area = context.parameters.area
    if area is None:
        raise TeamRefusedError("parameter 'area': there is none")
    rings = [[context.level(corner) for corner in ring] for ring in area.rings]
    given = context.parameters
    try:
        tracks = SurveyTracks.over(rings, given.spacing_m, given.yaw_rad, given.overshoot_m)
    except ValueError as error:
        raise TeamRefusedError(f"parameter {error}") from None
    speed_m_s = given.speed_m_s
    lengths = [tracks.line.segments[index].length_m for index, *_ in tracks.passes]
    shares = context.split or _shares(context, rings[0], lengths, speed_m_s)
    holes, lacks_survey, lacks_route = (
        Fence.around(rings[1:]),
        *(
            ", ".join(member for member in context.members if name not in context.offered[member])
            for name in ("area_survey", "single_vehicle_routing")
        ),
    )
    themselves = not lacks_survey and (lacks_route or not rings[1:])
    bands = strips(rings, tracks, shares) if themselves else []
    if lacks_route and not bands:
        pieces = "a band would be in pieces, or a hole lies across two"
        lacks_survey = f"{lacks_survey} does not offer area_survey" if lacks_survey else pieces
        raise TeamRefusedError(f"{lacks_route} needs single_vehicle_routing: {lacks_survey}")
    legs: list[Leg] = []
    for index, (member, ends) in enumerate(
        zip(context.members, lanes(tracks, shares), strict=True)
    ):
        if bands and bands[index]:
            own = {
                **given.only("speed", "overshoot"),
                "area": _band_area(context, area, bands[index]),
                "heading": (math.pi / 2 - tracks.yaw_rad) % math.tau,
                # With the spacing itself, rounding may give a band one pass more than it has here.
                "spacing": tracks.spacing_m(bands[index]),
            }
            legs.append(context.leg(member, "area_survey", own))
        elif ends and not bands:
            here = context.poses[member].place
            if math.dist(here, ends[-1]) < math.dist(here, ends[0]):
                ends.reverse()
            way = _cornered([*(holes.way(here, ends[0]) or ()), *ends])
            places = tuple(context.coordinate(place, None) for place in way)
            parameters = {"route": Route(places), "speed": speed_m_s}
            legs.append(context.leg(member, "single_vehicle_routing", parameters))
    behavior = "area_survey" if bands else "single_vehicle_routing"
    takes = {
        member: frozenset(accepted(context.offered[member][behavior])) for member in context.members
    }
    speeds = {member: speed_m_s or context.motion(member).nominal_m_s for member in context.members}
    return Plan(tuple(legs), shared=True, takes=takes, speeds_m_s=speeds, split=tuple(shares))


def _cornered(places: Sequence[Place]) -> list[Place]:
    """Return a way with further places beside its corners, at which vehicles then hardly cut it."""
    line = Polyline(places)
    marks = {mark_m + aside_m for mark_m in line.marks_m for aside_m in (-_CORNER_M, 0, _CORNER_M)}
    return [line.at(mark_m) for mark_m in sorted(marks) if 0.0 <= mark_m <= line.length_m]


def _shares(
    context: PlanningContext, ring: Ring, lengths: Sequence[float], requested_m_s: float | None
) -> list[float]:
    """Return each member's share of the passes in metres: by its speed, within its endurance.

    Raises:
        TeamRefusedError: the endurance of all members together is too short.
    """
    corners = ring[:-1]
    middle = tuple(sum(axis) / len(corners) for axis in zip(*corners, strict=True))
    weights, reaches = [], []
    for member in context.members:
        nominal_m_s = context.motion(member).nominal_m_s
        speed_m_s = nominal_m_s if requested_m_s is None else requested_m_s
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


def _band_area(context: PlanningContext, area: Area, rings: Sequence[Ring]) -> Area:
    """Return a part of the area, at the area's altitude."""
    up_m = area.rings[0][0][2]
    return Area(
        tuple(tuple(context.coordinate(corner, up_m) for corner in ring) for ring in rings),
        area.altitude_frame,
    )


def observe(context: PlanningContext) -> Plan:
    """Send each member to a place around the area or target, from which it looks at it."""
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


def _reach(ring: Sequence[Place], centre: Place, angle_rad: float) -> float:
    """Return the distance from the centre to the outermost edge in a direction, in metres."""
    far_m = 2 * max(math.dist(centre, corner) for corner in ring)
    there = (centre[0] + far_m * math.cos(angle_rad), centre[1] + far_m * math.sin(angle_rad))
    edge = shapely.LineString([centre, there]).intersection(shapely.LineString(ring))
    return max((math.dist(centre, each) for each in shapely.get_coordinates(edge)), default=0.0)


def escort(context: PlanningContext) -> Plan:
    """Let each member keep its place around the target, the first one ahead of it."""
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
