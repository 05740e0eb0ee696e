"""Plans of teams that cover an area, or stand around an area or a target."""

import math
from collections.abc import Sequence
from itertools import pairwise

from m2pem.model.geometry import Route, VehiclePosition
from m2pem.resources.lawn_mower import lawn_mower, longest_edge_yaw
from m2pem.teams.plan import Leg, Plan, Setting, TeamRefusedError
from m2pem.teams.shapes import SPACING_M

SURVEY_SPACING_M = 20.0
STANDOFF_M = 20.0
FLYING_STANDOFF_M = 30.0
"""When nobody says."""


def survey(setting: Setting) -> Plan:
    """The passes over the area in as many bands as there are members, the faster the wider."""
    area = setting.area()
    if area is None:
        raise TeamRefusedError("parameter 'area': there is none")
    rings = [[setting.level(corner) for corner in ring] for ring in area.rings]
    heading = setting.number("heading")
    yaw = longest_edge_yaw(rings[0]) if heading is None else math.pi / 2 - heading
    spacing = setting.number("spacing") or SURVEY_SPACING_M
    try:
        tracks = lawn_mower(rings, spacing, yaw, setting.number("overshoot") or 0.0)
    except ValueError as error:
        raise TeamRefusedError(f"parameter 'spacing': {error}") from None
    wished = setting.number("speed")
    weights = [
        setting.motion(member).nominal_m_s if wished is None else 1.0 for member in setting.members
    ]
    passes = [tracks[index : index + 2] for index in range(0, len(tracks), 2)]
    legs: list[Leg] = []
    for member, band in zip(setting.members, _bands(passes, weights), strict=True):
        if band:
            route = Route(tuple(setting.coordinate(place, None) for each in band for place in each))
            parameters = {"route": route, "speed": wished}
            legs.append(setting.leg(member, "single_vehicle_routing", parameters))
    takes = {
        member: frozenset(setting.offered[member]["single_vehicle_routing"].by_name)
        for member in setting.members
    }
    return Plan(tuple(legs), shared=True, takes=takes)


def _bands(
    passes: Sequence[Sequence[tuple[float, float]]], weights: Sequence[float]
) -> list[list[Sequence[tuple[float, float]]]]:
    """The passes in their order, cut so that the ways over the area are as the weights."""
    lengths = [math.dist(*each) for each in passes]
    whole = sum(lengths) or 1.0
    bands: list[list[Sequence[tuple[float, float]]]] = [[] for _ in weights]
    done = 0.0
    bounds = [sum(weights[: index + 1]) / sum(weights) for index in range(len(weights))]
    for each, length in zip(passes, lengths, strict=True):
        middle = (done + length / 2) / whole
        index = next((i for i, bound in enumerate(bounds) if middle <= bound), len(bounds) - 1)
        bands[index].append(each)
        done += length
    return bands


def observe(setting: Setting) -> Plan:
    """Each goes to a place of its own around the area or target, looks at it, and stays."""
    area = setting.area()
    legs = []
    for index, member in enumerate(setting.members):
        angle = math.tau * index / len(setting.members)
        flies = setting.domains[member] == "air"
        if area is None:
            centre = setting.target_place()
            reach = FLYING_STANDOFF_M if flies else STANDOFF_M
        else:
            ring = [setting.level(corner) for corner in area.rings[0]]
            corners = ring[:-1]
            centre = (
                sum(east for east, _ in corners) / len(corners),
                sum(north for _, north in corners) / len(corners),
            )
            reach = _reach(ring, centre, angle)
        place = (centre[0] + reach * math.cos(angle), centre[1] + reach * math.sin(angle))
        heading = (math.pi / 2 - (angle + math.pi)) % math.tau
        legs.append(setting.to_place(member, place, heading))
    return Plan(tuple(legs), stays=True, duration_s=setting.number("duration"))


def _reach(
    ring: Sequence[tuple[float, float]], centre: tuple[float, float], angle_rad: float
) -> float:
    """How far it is from the centre to the outermost edge in a direction."""
    found = 0.0
    for a, b in pairwise(ring):
        (ax, ay), (bx, by) = (_turned(corner, centre, angle_rad) for corner in (a, b))
        if (ay <= 0) != (by <= 0):
            found = max(found, ax + (bx - ax) * ay / (ay - by))
    return found


def _turned(
    place: tuple[float, float], centre: tuple[float, float], angle_rad: float
) -> tuple[float, float]:
    """In a frame at the centre whose first axis points that way."""
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    east, north = place[0] - centre[0], place[1] - centre[1]
    return east * cos + north * sin, north * cos - east * sin


def escort(setting: Setting) -> Plan:
    """Each keeps to a place of its own around the target, the first one ahead of it."""
    spacing = setting.number("spacing") or SPACING_M
    target = setting.parameters.get("target")
    legs = []
    for index, member in enumerate(setting.members):
        angle = math.tau * index / len(setting.members)
        if not isinstance(target, VehiclePosition):
            centre = setting.target_place()
            place = (centre[0] + spacing * math.cos(angle), centre[1] + spacing * math.sin(angle))
            legs.append(setting.to_place(member, place))
            continue
        if target.vehicle == member:
            raise TeamRefusedError(f"parameter 'target': {member} cannot escort itself")
        leg = setting.leg(member, "follow", {"target": target, "offset": spacing, "bearing": angle})
        if len(setting.members) > 1 and "bearing" not in leg.parameters:
            raise TeamRefusedError(f"{member} follows without a bearing: all would be in one place")
        legs.append(leg)
    return Plan(tuple(legs), stays=True)
