"""Survey patterns: routes that cover an area with parallel passes and keep out of other areas.

The passes are those of `m2pem.geo.lawn_mower`, which teams and arbiters use. Those side by side
make a cell, each cell is covered as a whole, and the way between two passes leads around what is
kept out. Several vehicles get passes in a row, by their speeds.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from typing import TypeAlias

from shapely.geometry.base import BaseGeometry

from m2pem.geo.fence import Fence, area_in, polygons
from m2pem.geo.geojson import GeometryError
from m2pem.geo.lawn_mower import Row, Span, rows
from m2pem.geo.local_frame import EastNorth, LocalFrame
from m2pem.geo.polygon import convex_hull, turned
from m2pem.geo.work_shares import owners, reach_m, split
from m2pem.mission.geometry import Area, Route

MAX_PASSES = 2_000
MAX_CORNERS = 500
"""Of the area and of all that is kept out together: the way around them is searched."""

_TRIED_HEADINGS = 3
_SAME_HEADING_RAD = 1e-6

Pass: TypeAlias = tuple[EastNorth, EastNorth]
"""From its beginning to its end, in metres."""


@dataclass(frozen=True, slots=True)
class SurveyPattern:
    """What is surveyed, and how.

    `heading_rad`: of the passes, from true north, clockwise; None: that with the fewest turns.
    `margin_m`: how far beyond the area's edge is surveyed; below 0, within it. `turn_around_m`: how
    far each pass goes on. `corner`: where it begins: 0 to 3, counter-clockwise from the right of
    the passes' beginning. `cross_hatch`: a second time, across. `keep_out`: areas that no way
    enters, nor comes nearer to than `clearance_m`.
    """

    area: Area
    spacing_m: float
    heading_rad: float | None = None
    margin_m: float = 0.0
    turn_around_m: float = 0.0
    corner: int = 0
    cross_hatch: bool = False
    keep_out: Sequence[Area] = ()
    clearance_m: float = 0.0
    altitude_m: float | None = None
    altitude_frame: str = "relative"


@dataclass(frozen=True, slots=True)
class Surveyor:
    """A vehicle that surveys. `lasts_s`: how long it can, None: not known."""

    name: str
    speed_m_s: float
    lasts_s: float | None = None


@dataclass(frozen=True, slots=True)
class SurveyRoute:
    """The route of one vehicle. `length_m`: of all of it; `surveyed_m`: of its passes alone."""

    surveyor: Surveyor
    route: Route
    passes: int
    length_m: float
    surveyed_m: float

    @property
    def time_s(self) -> float:
        """How long the route takes at the vehicle's speed, without turns."""
        return self.length_m / self.surveyor.speed_m_s


def survey_routes(pattern: SurveyPattern, surveyors: Sequence[Surveyor]) -> list[SurveyRoute]:
    """Return a route for each vehicle; one that gets no pass has none.

    Raises:
        GeometryError: nothing of the area is left, it needs too many passes, the vehicles do not
            last long enough, or a part cannot be reached.
    """
    if not surveyors:
        raise GeometryError("a survey needs a vehicle")
    for each in surveyors:
        if not 0 < each.speed_m_s < math.inf:
            raise GeometryError(f"{each.name or 'speed'}: {each.speed_m_s:g} m/s is not above 0")
    ground = _Ground.of(pattern)
    heading = pattern.heading_rad
    yaw = _yaw(pattern, ground) if heading is None else math.pi / 2 - heading
    passes = _passes(pattern, ground, yaw)
    if pattern.cross_hatch:
        passes += _passes(pattern, ground, yaw + math.pi / 2)
    if not passes:
        raise GeometryError(
            "nothing of the area is left to survey: check margin and keep-out areas"
        )
    shares = zip(surveyors, _shared(passes, surveyors), strict=True)
    return [_route(pattern, ground, surveyor, own) for surveyor, own in shares if own]


def best_heading_rad(pattern: SurveyPattern) -> float:
    """Return the heading of the passes with the fewest turns: from true north, clockwise, from 0 to
    below pi, as a pass is flown both ways.

    Raises:
        GeometryError: as `survey_routes`.
    """
    heading = (math.pi / 2 - _yaw(pattern, _Ground.of(pattern))) % math.pi
    return 0.0 if math.pi - heading < _SAME_HEADING_RAD else heading


@dataclass
class _Ground:
    """What is surveyed, in metres, and what is kept out."""

    region: BaseGeometry
    fence: Fence

    @classmethod
    def of(cls, pattern: SurveyPattern) -> "_Ground":
        """Return it in a frame at the area's first corner.

        Raises:
            GeometryError: the spacing is not above 0, or there are too many corners.
        """
        if not 0 < pattern.spacing_m < math.inf:
            raise GeometryError(f"spacing: {pattern.spacing_m:g} m is not above 0")
        areas = (pattern.area, *pattern.keep_out)
        if sum(len(ring) for each in areas for ring in each.rings) > MAX_CORNERS:
            raise GeometryError(
                f"the area and what is kept out have more than {MAX_CORNERS} corners: simplify them"
            )
        outer, *holes = (Area((ring,)) for ring in pattern.area.rings)
        frame = LocalFrame(outer.rings[0][0][:2])
        fence = Fence(None, [*holes, *pattern.keep_out], pattern.clearance_m, frame)
        region = area_in(outer.rings, frame)
        if pattern.margin_m:
            region = region.buffer(pattern.margin_m, join_style="mitre")
        return cls(region.difference(fence.closed), fence)


def _yaw(pattern: SurveyPattern, ground: _Ground) -> float:
    """Return the direction of the fewest passes, from east, counter-clockwise, in rad."""
    corners = [place for part in polygons(ground.region) for place in part.exterior.coords]
    hull = convex_hull((x, y) for x, y, *_ in corners)
    if len(hull) < 3:
        return 0.0
    headings = {
        math.atan2(b[1] - a[1], b[0] - a[0]) % math.pi for a, b in pairwise((*hull, hull[0]))
    }
    # The fewest passes are along a side of the hull across which it is narrowest.
    narrow = sorted(headings, key=lambda yaw: (round(_width_m(hull, yaw), 3), yaw))
    tried = [(_passes(pattern, ground, yaw), yaw) for yaw in narrow[:_TRIED_HEADINGS]]
    return min(tried, key=lambda found: (len(found[0]), _length_m(found[0])))[1]


def _width_m(hull: Sequence[EastNorth], yaw: float) -> float:
    norths = [turned(corner, yaw)[1] for corner in hull]
    return max(norths) - min(norths)


def _passes(pattern: SurveyPattern, ground: _Ground, yaw: float) -> list[Pass]:
    """Return the passes in the order in which they are flown or driven."""
    cells: list[Row] = []
    for part in polygons(ground.region):
        ring = [(x, y) for x, y, *_ in part.exterior.coords]
        if _width_m(ring, yaw) > MAX_PASSES * pattern.spacing_m:
            raise GeometryError(
                f"spacing: {pattern.spacing_m:g} m needs more than {MAX_PASSES} passes: "
                "survey with a wider spacing, or a smaller area"
            )
        closed = None if ground.fence.closed.is_empty else ground.fence.closed
        cells += _cells(rows(ring, pattern.spacing_m, yaw, closed))
    ordered = _ordered(cells, pattern.corner)
    return [(turned(a, -yaw), turned(b, -yaw)) for a, b in ordered]


def _cells(strips: Sequence[Row]) -> list[Row]:
    """Group passes: a cell ends where a pass has two neighbours, or none, in the next strip."""
    cells: list[Row] = []
    before: list[tuple[Row, Span]] = []
    for row in strips:
        now: list[tuple[Row, Span]] = []
        for y, span in row:
            near = [(cell, other) for cell, other in before if _overlap(other, span)]
            alone = len(near) == 1 and sum(_overlap(near[0][1], each) for _, each in row) == 1
            cell = near[0][0] if alone else []
            if not alone:
                cells.append(cell)
            cell.append((y, span))
            now.append((cell, span))
        before = now
    return cells


def _overlap(a: Span, b: Span) -> bool:
    return a[0] < b[1] and b[0] < a[1]


def _ordered(cells: Sequence[Row], corner: int) -> list[Pass]:
    """Return the passes of all cells, from the corner on: next is the cell that begins nearest."""
    ends = [(x, y) for cell in cells for y, span in cell for x in span]
    if not ends:
        return []
    xs, ys = zip(*ends, strict=True)
    right, top = corner in (1, 2), corner in (2, 3)
    at = (max(xs) if right else min(xs), max(ys) if top else min(ys))
    left = [_serpentines(cell) for cell in cells]
    ordered: list[Pass] = []
    while left:
        options = [(way, ways) for ways in left for way in ways]
        way, chosen = min(options, key=lambda option: math.dist(at, option[0][0][0]))
        left = [ways for ways in left if ways is not chosen]
        ordered += way
        at = way[-1][1]
    return ordered


def _serpentines(cell: Row) -> list[list[Pass]]:
    """Return the four ways to cover a cell: from each of its corners."""
    ways = []
    for passes, first in product((cell, cell[::-1]), (0, 1)):
        ends = [((span[0], y), (span[1], y)) for y, span in passes]
        ways.append([(a, b) if row % 2 == first else (b, a) for row, (a, b) in enumerate(ends)])
    return ways


def _shared(passes: Sequence[Pass], surveyors: Sequence[Surveyor]) -> list[list[Pass]]:
    """Return each vehicle's passes in a row: by their speeds, within their endurance."""
    lengths = [math.dist(*each) for each in passes]
    reaches = [reach_m(each.lasts_s, 0.0, each.speed_m_s) for each in surveyors]
    shares = split(sum(lengths), [each.speed_m_s for each in surveyors], reaches)
    if shares is None:
        last = ", ".join(
            f"{each.name} {reach:.0f} m" for each, reach in zip(surveyors, reaches, strict=True)
        )
        raise GeometryError(
            f"the area has {sum(lengths):.0f} m of passes, and the vehicles last for less: {last}; "
            "take more of them, or a wider spacing"
        )
    own: list[list[Pass]] = [[] for _ in surveyors]
    for each, owner in zip(passes, owners(lengths, shares), strict=True):
        own[owner].append(each)
    return own


def _route(
    pattern: SurveyPattern, ground: _Ground, surveyor: Surveyor, passes: Sequence[Pass]
) -> SurveyRoute:
    places: list[EastNorth] = []
    for start, end in passes:
        begin = _beyond(end, start, pattern.turn_around_m, ground)
        around = ground.fence.way(places[-1], begin) if places else []
        if around is None:
            raise GeometryError(
                "a part of the area cannot be reached without entering what is kept out: "
                "survey the parts on their own"
            )
        places += around
        places += [begin, _beyond(start, end, pattern.turn_around_m, ground)]
    waypoints = [(*ground.fence.frame.to_latlon(place), pattern.altitude_m) for place in places]
    return SurveyRoute(
        surveyor,
        Route(tuple(waypoints), pattern.altitude_frame),
        passes=len(passes),
        length_m=_length_m(list(pairwise(places))),
        surveyed_m=_length_m(passes),
    )


def _beyond(a: EastNorth, b: EastNorth, by_m: float, ground: _Ground) -> EastNorth:
    """Return the place so far beyond the end of a pass; at the end if that is kept out."""
    length = math.dist(a, b)
    if by_m <= 0 or length <= 0:
        return b
    place = (b[0] + (b[0] - a[0]) * by_m / length, b[1] + (b[1] - a[1]) * by_m / length)
    return place if ground.fence.is_free(b, place) else b


def _length_m(lines: Sequence[Pass]) -> float:
    return sum(math.dist(a, b) for a, b in lines)
