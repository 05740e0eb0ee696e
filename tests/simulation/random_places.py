"""Random fences, areas, routes and homes, as drawing programs write them, and what becomes of them.

Places are metres east and north of an origin, by pyproj. What may be entered, and what was, is
judged by shapely alone.
"""

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from random import Random
from typing import Any, TypeAlias

import numpy as np
import pyproj
import shapely

from m2pem.testing.contracts.arbiter_harness import ORIGIN

At: TypeAlias = tuple[float, float]
Geojson: TypeAlias = dict[str, Any]
Ring: TypeAlias = list[At]

_PLANE = pyproj.Proj(proj="aeqd", lat_0=ORIGIN[0], lon_0=ORIGIN[1], ellps="WGS84")


def longitude_latitude(at: At) -> At:
    return _PLANE(*at, inverse=True)


def metres(latitude: float, longitude: float) -> At:
    return _PLANE(longitude, latitude)


@dataclass(frozen=True)
class Task:
    """A behavior of a vehicle or a team; geometries are GeoJSON."""

    actor: str
    behavior: str
    given: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Trial:
    """`fence`: as it was drawn; `free`: what is inside of it. `unclear`: polygons that bound no
    area. `leader`: the vehicle that another one follows, by the last task, until it has done the
    one before."""

    domain: str
    fence: Geojson
    free: shapely.Polygon
    unclear: Sequence[Geojson]
    homes: Mapping[str, At]
    tasks: Sequence[Task]
    leader: str = ""


@dataclass(frozen=True)
class Done:
    """What became of a task, from when until when, in s."""

    task: Task
    vehicles: Sequence[str]
    state: str
    reason: str
    begin_s: float
    end_s: float


# --- drawing ------------------------------------------------------------------------------------


def star(random: Random, at: At, least: float, most: float) -> shapely.Polygon:
    count = random.randint(4, 9)
    turn = random.random()
    return shapely.Polygon(
        [
            (
                at[0] + r * math.cos(math.tau * (i + turn) / count),
                at[1] + r * math.sin(math.tau * (i + turn) / count),
            )
            for i, r in enumerate(random.uniform(least, most) for _ in range(count))
        ]
    )


def _spike(random: Random, corners: Ring) -> Ring:
    at = random.randrange(len(corners) - 1)
    corner, length = corners[at], random.choice((0.05, 1.0, 60.0))
    turn = random.uniform(0, math.tau)
    out = (corner[0] + length * math.cos(turn), corner[1] + length * math.sin(turn))
    more = random.choice(([out, corner], [corner], [out, out, corner], [out, corner, out, corner]))
    return [*corners[: at + 1], *more, *corners[at + 1 :]]


def _bow_tie(random: Random, corners: Ring) -> Ring:
    at = random.randrange(1, len(corners) - 2)
    return [*corners[:at], corners[at + 1], corners[at], *corners[at + 2 :]]


def _sliver(random: Random, corners: Ring) -> Ring:
    at = random.randrange(1, len(corners) - 1)
    (x, y), wide = corners[at], random.choice((1e-6, 0.02, 0.5))
    return [*corners[: at + 1], (x * 1.3, y * 1.3), (x + wide, y), *corners[at + 1 :]]


def _beyond(random: Random, corners: Ring) -> Ring:
    return [(x + 40.0, y) for x, y in corners]


DAMAGES: Sequence[Callable[[Random, Ring], Ring]] = (_spike, _spike, _bow_tie, _sliver, _beyond)
"""What drawing programs do."""


def _drawn(random: Random, shape: shapely.Polygon) -> Geojson:
    """Return a polygon as it was drawn: with a third of them something is wrong."""
    rings = [[(x, y) for x, y, *_ in ring.coords] for ring in (shape.exterior, *shape.interiors)]
    if random.random() < 1 / 3:
        for _ in range(random.randint(1, 2)):
            at = random.randrange(len(rings))
            rings[at] = random.choice(DAMAGES)(random, rings[at])
    return {
        "type": "Polygon",
        "coordinates": [[list(longitude_latitude(at)) for at in ring] for ring in rings],
    }


def bounded(polygon: Geojson) -> shapely.Polygon | None:
    """Return what a polygon bounds, in metres; None: it is not clear."""
    outer, *holes = polygon["coordinates"]
    shape = shapely.Polygon(outer, holes)
    if not shape.is_valid:
        valid = shapely.make_valid(shape, method="structure", keep_collapsed=False)
        if valid.geom_type != "Polygon" or abs(valid.area - shape.area) > 1e-9 * shape.area:
            return None
        shape = valid
    return shapely.transform(shape, lambda places: np.column_stack(_PLANE(*places.T)))


def drawn(
    random: Random, shape: shapely.Polygon, unclear: list[Geojson]
) -> tuple[Geojson, shapely.Polygon]:
    """Return a polygon as it was drawn in the end, and what it bounds; before, `unclear` ones."""
    while True:
        polygon = _drawn(random, shape)
        if (free := bounded(polygon)) is not None:
            return polygon, free
        unclear.append(polygon)


def with_holes(random: Random, rim: shapely.Polygon, count: int, most: float) -> shapely.Polygon:
    """Return the largest part of a polygon without some holes."""
    west, south, east, north = rim.bounds
    holes = [
        star(random, (random.uniform(west, east), random.uniform(south, north)), most / 7, most)
        for _ in range(count)
    ]
    shape = rim.difference(shapely.union_all(holes))
    return max(getattr(shape, "geoms", [shape]), key=lambda each: each.area)


@dataclass(frozen=True)
class Ground:
    """Draws within what is free; polygons that bound no area go to `unclear`."""

    random: Random
    free: shapely.Polygon
    unclear: list[Geojson]

    def somewhere(self) -> At:
        return self.random.uniform(-150, 150), self.random.uniform(-150, 150)

    def inside(self) -> At:
        while not self.free.covers(shapely.Point(at := self.somewhere())):
            pass
        return at

    def home(self) -> At:
        """Return a place inside, in a third of the cases anywhere or just beside the rim."""
        rim = self.free.exterior.interpolate(self.random.random(), normalized=True)
        near = (rim.x + self.random.uniform(-1, 1), rim.y + self.random.uniform(-1, 1))
        kind = self.random.randrange(6)
        return near if kind == 0 else self.somewhere() if kind == 1 else self.inside()

    def fitting(self, draw: Callable[[], Any], shape: Callable[[Any], Any]) -> Any:
        """Return something drawn; two thirds of what does not fit inside is drawn again."""
        while True:
            one = draw()
            if self.random.random() < 1 / 3 or self.free.covers(shape(one)):
                return one

    def route(self) -> Geojson:
        def draw() -> list[At]:
            return [self.inside() for _ in range(self.random.randint(2, 4))]

        places = self.fitting(draw, shapely.LineString)
        return {"type": "LineString", "coordinates": [*map(list, map(longitude_latitude, places))]}

    def area(self) -> Geojson:
        def draw() -> shapely.Polygon:
            rim = star(self.random, self.inside(), 8, self.random.uniform(12, 60))
            return with_holes(self.random, rim, self.random.randint(0, 2), 12)

        return drawn(self.random, self.fitting(draw, lambda area: area), self.unclear)[0]

    def target(self) -> str:
        longitude, latitude = longitude_latitude(self.inside())
        return f"[{latitude:.9f}, {longitude:.9f}]"

    def task(self, actor: str) -> Task:
        kind = self.random.randrange(7)
        if kind <= 1:
            return Task(actor, "goto", {"target": self.target()})
        if kind <= 3:
            return Task(actor, "single_vehicle_routing", {"route": self.route()})
        if kind == 4:
            radius = f"{self.random.uniform(3, 30):.2f} m"
            return Task(actor, "orbit", {"target": self.target(), "radius": radius})
        return Task(actor, "area_survey", self.survey())

    def survey(self) -> dict[str, Any]:
        given = {"area": self.area(), "spacing": f"{self.random.choice((4, 7, 11))} m"}
        if self.random.random() < 1 / 3:
            given["heading"] = f"{self.random.randint(0, 179)} deg"
        if self.random.random() < 1 / 4:
            given["overshoot"] = "3 m"
        return given


TEAM_BEHAVIORS = ("formation", "road_following_formation", "road_sweep", "bridge_crossing")
SHAPES = ("column", "line", "wedge", "vee", "diamond", "echelon_left")


def trial(seed: int, *, teams: bool = True) -> Trial:
    """Return the trial of a seed: of a vehicle alone, of two that follow each other, or of a team
    of two to five."""
    random = Random(seed)
    rim = star(random, (0, 0), 60, 200)
    shape = with_holes(random, rim, random.randint(1, 5), 35)
    unclear: list[Geojson] = []
    fence, free = drawn(random, shape, unclear)
    ground = Ground(random, free, unclear)
    domain = random.choice(("air", "ground"))
    kind = random.randrange(6)
    home = ground.home()
    if kind == 0 and teams:
        count = random.randint(2, 5)
        beside = [
            (home[0] + 12 * random.uniform(-2, 2), home[1] - 12 * each) for each in range(count)
        ]
        homes = {f"v{each}": at for each, at in enumerate(beside)}
        behavior = random.choice((*TEAM_BEHAVIORS, "area_survey"))
        given = ground.survey()
        if behavior != "area_survey":
            given = {"route": ground.route(), "spacing": f"{random.randint(6, 20)} m"}
        if behavior == "formation":
            given["shape"] = random.choice(SHAPES)
        main = [Task("crew", behavior, given)]
    elif kind == 1:
        homes = {"v0": home, "v1": ground.inside()}
        main = [Task("v1", "single_vehicle_routing", {"route": ground.route()})]
        main.append(Task("v0", "follow", {"target": "v1"}))
    else:
        homes = {"v0": home}
        main = [ground.task("v0") for _ in range(random.randint(1, 3))]
    up = [Task(each, "takeoff", {"altitude": "20 m"}) for each in homes if domain == "air"]
    if main[-1].behavior == "follow":
        return Trial(domain, fence, free, unclear, homes, [*up, *main], "v1")
    back = [Task(each, "return_to_launch") for each in homes]
    return Trial(domain, fence, free, unclear, homes, [*up, *main, *back])


# --- judging ------------------------------------------------------------------------------------

STEP_M = 0.1
INSIDE_M = 0.2
"""As deep in what is kept out counts."""

THIN_M = 0.1
"""What is left out and nowhere as far from its edge does not count."""

_SAID = re.compile(r"(?:by|is) (\d+(?:\.\d)?) m ")

Track: TypeAlias = Sequence[tuple[float, float, float]]
"""At s, east and north in m."""


def each_step(track: Track) -> Any:
    """Return a track with a place each 0.1 m: rows of s, m and m."""
    rows = np.array(track)
    gaps = np.maximum(1, np.ceil(np.hypot(*np.diff(rows[:, 1:], axis=0).T) / STEP_M)).astype(int)
    marks = np.concatenate([[0], np.cumsum(gaps)])
    steps = np.arange(marks[-1] + 1)
    return np.column_stack([np.interp(steps, marks, column) for column in rows.T])


def mistakes(
    trial: Trial,
    done: Sequence[Done],
    tracks: Mapping[str, Track],
    said: Sequence[str],
    inside_m: float = INSIDE_M,
    thin_m: float = THIN_M,
) -> Iterator[str]:
    """Yield what was entered and was not said, what was refused in vain, and what was left out."""
    dense = {vehicle: each_step(track) for vehicle, track in tracks.items()}
    for vehicle, rows in dense.items():
        yield from _entered(trial, vehicle, rows, done, said, inside_m)
    for each in done:
        if each.task.behavior == "area_survey" and each.state == "SUCCEEDED":
            yield from _left_out(each, dense, inside_m, thin_m)
        if each.state == "REJECTED" and "fence" in each.reason:
            yield from _in_vain(trial, each, dense)


def _entered(
    trial: Trial,
    vehicle: str,
    rows: Any,
    done: Sequence[Done],
    said: Sequence[str],
    inside_m: float,
) -> Iterator[str]:
    depths = shapely.distance(trial.free, shapely.points(rows[:, 1:]))
    kept_out = shapely.union_all([shapely.Polygon(ring) for ring in trial.free.interiors])
    indices = [*range(len(rows))]
    for is_out, group in groupby(indices, lambda at: depths[at] > inside_m):
        part = [*group]
        if not is_out:
            continue
        deepest = max(part, key=lambda at: depths[at])
        at_s = rows[deepest][0]
        begun = [each for each in done if vehicle in each.vehicles and each.begin_s <= at_s]
        name = f"{begun[-1].task.behavior} of {vehicle}" if begun else vehicle
        depth_m = float(depths[deepest])
        where = f"{name}: {depth_m:.2f} m inside at {rows[deepest][1:].round(1)}, {at_s:.1f} s"
        if part[0] == 0:  # it begins there
            first_m = float(depths[0])
            if depth_m > first_m + inside_m:
                yield f"{where}: farther out than at first, {first_m:.2f} m"
            elif kept_out.distance(shapely.Point(rows[0][1:])) == 0.0 and not _stays(rows, part):
                way_m = STEP_M * len({tuple(rows[at][1:].round(3)) for at in part})
                if way_m > 3 * first_m + 1.5:
                    yield f"{where}: a way of {way_m:.1f} m out, {first_m:.2f} m deep at first"
            continue
        words = [each for each in said if each.startswith(f"{vehicle} returns")]
        most_m = max((float(m) for each in words for m in _SAID.findall(each)), default=0.0)
        stays = name.startswith("return") and part[-1] == indices[-1]  # its home is outside
        if not (stays and depth_m <= 1.05 * most_m + inside_m):
            yield f"{where}; said: {words}"


def _stays(rows: Any, part: Sequence[int]) -> bool:
    """Whether it never leaves where it begins."""
    return len(part) == len(rows)


def _left_out(
    done: Done, dense: Mapping[str, Any], inside_m: float, thin_m: float
) -> Iterator[str]:
    shape = bounded(done.task.given["area"])
    half_m = float(done.task.given["spacing"].split()[0]) / 2
    swaths = []
    for vehicle in done.vehicles:
        rows = dense[vehicle]
        own = rows[(rows[:, 0] >= done.begin_s) & (rows[:, 0] <= done.end_s)][:, 1:]
        swaths.append(shapely.LineString(own).simplify(0.01).buffer(half_m + 0.05, quad_segs=32))
        for hole in shape.interiors:
            depths = -shapely.distance(hole, shapely.points(own))
            inside = shapely.contains(shapely.Polygon(hole), shapely.points(own))
            if inside[0]:
                continue  # it begins there
            if inside.any() and (deep := float(-depths[inside].min())) > inside_m:
                yield f"area_survey of {vehicle}: {deep:.2f} m inside a hole of its area"
    left = shape.difference(shapely.union_all(swaths)).buffer(-thin_m)
    if left.area > 0:
        place = left.representative_point()
        yield f"area_survey of {done.vehicles}: {left.area:.2f} m2 left out at {place}"


def _in_vain(trial: Trial, done: Done, dense: Mapping[str, Any]) -> Iterator[str]:
    given = done.task.given
    if done.task.behavior == "goto":
        latitude, longitude = map(float, given["target"].strip("[]").split(","))
        places = [metres(latitude, longitude)]
    elif done.task.behavior == "single_vehicle_routing":
        places = [_PLANE(*each[:2]) for each in given["route"]["coordinates"]]
    else:
        return
    rows = dense[done.vehicles[0]]
    before = rows[rows[:, 0] <= done.begin_s]
    line = shapely.LineString([tuple((before if len(before) else rows)[-1, 1:]), *places])
    if line.difference(trial.free).length < 0.05:
        yield f"{done.task.behavior} of {done.vehicles[0]} is refused in vain: {done.reason}"
