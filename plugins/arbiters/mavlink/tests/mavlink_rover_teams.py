"""Three rovers that drive as a team over MAVLink, and how near they come to each other.

Places are metres east and north of where the first one starts; they start side by side, towards the
east. Tracks are what each rover says of itself: times in s, the same for all, and places.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
from mavlink_simulated import HOME, HOME_ALTITUDE_M, at

from m2pem import load_fleet
from m2pem.fleet.fleet import Fleet
from tests.executive.conftest import mission, sequence
from tests.teams.conftest import team_task

Place = tuple[float, float]
Said = tuple[float, float, float]
Track = Sequence[Said]

NAMES = ("rover1", "rover2", "rover3")
STARTS: Mapping[str, Place] = dict(zip(NAMES, ((0.0, 0.0), (22.0, 0.0), (44.0, 0.0)), strict=True))
CORNER: Sequence[Place] = ((-25.0, 0.0), (-110.0, 0.0), (-110.0, 75.0))
STRAIGHT: Sequence[Place] = CORNER[:2]
NEAREST = 0.8
"""Of the spacing, docs/teams.md."""

CORNER_M = 2.5
"""A rover cuts corners by so much, as it is steered back to its path."""

REACHED_M = 4.0

TEAMS = {
    "column": ("road_following_formation", 20.0, CORNER),
    "wedge": ("formation", 18.0, CORNER),
    "bridge": ("bridge_crossing", 20.0, STRAIGHT),
}
"""By the name of its route in the fleet: what a team does, its spacing, and the route."""

SPEED = "2 m/s"
HOLDS = {
    "ardupilot": {"FS_GCS_ENABLE": 1, "FS_ACTION": 2, "FS_GCS_TIMEOUT": 5},
    "px4": {"NAV_DLL_ACT": 1, "COM_DL_LOSS_T": 5},
}
"""By firmware: parameters with which a rover stops when it loses the link to its ground station."""


def write_fleet(
    folder: Path,
    urls: Mapping[str, str],
    fence: Sequence[Sequence[Place]] = (),
    connection: str = "",
) -> Fleet:
    """Write the fleet's file, and read it: the rovers as team `crew`, which goes on without a lost
    member. `fence`: its rings."""
    vehicles = "".join(
        f"  {name}:\n    domain: ground\n    arbiter: mavlink\n    lost_after: 8 s\n"
        f"    failsafe: hold\n    sitl: true\n"
        f"    connection: {{url: '{url}', system_id: {number}}}\n"
        for number, (name, url) in enumerate(urls.items(), 1)
    )
    text = (
        f"version: 1\norigin: {{lat: {HOME[0]}, lon: {HOME[1]}, alt: {HOME_ALTITUDE_M}}}\n"
        f"vehicles:\n{vehicles}routes: {{{', '.join(f'{name}: {name}.json' for name in TEAMS)}}}\n"
        f"teams: {{crew: {{members: [{', '.join(urls)}], on_lost_member: continue}}}}\n"
    )
    for name, (*_, places) in TEAMS.items():
        _write(folder / f"{name}.json", "LineString", _degrees(places))
    if fence:
        _write(folder / "yard.json", "Polygon", [_degrees((*ring, ring[0])) for ring in fence])
        text += "areas: {yard: yard.json}\nfence: yard\n"
    file = folder / "fleet.yaml"
    file.write_text(text, encoding="utf-8")
    return load_fleet(file)


def _degrees(places: Sequence[Place]) -> list[list[float]]:
    return [[*at(*place)[::-1]] for place in places]


def _write(file: Path, kind: str, coordinates: object) -> None:
    file.write_text(json.dumps({"type": kind, "coordinates": coordinates}), encoding="utf-8")


def drives(team: str, speed: str = SPEED) -> bytes:
    """Return a mission of one task: the team drives along its route."""
    behavior, spacing_m, _ = TEAMS[team]
    given = {"route": team, "spacing": f"{spacing_m} m", "speed": speed}
    return mission(sequence(team_task("Task", behavior, **given)))


@dataclass(frozen=True)
class Nearest:
    """The two rovers that came nearest to each other, when, and where they were."""

    m: float
    names: tuple[str, str]
    at_s: float
    places: tuple[Place, Place]


def nearest(tracks: Mapping[str, Track]) -> Nearest:
    """Return which two came nearest to each other. Between two places that it has said, a rover was
    on the straight line; one that says nothing more is where it was last."""
    rows = {name: np.array(track) for name, track in tracks.items()}
    begin_s = max(each[0, 0] for each in rows.values())
    times = np.unique(np.concatenate([each[:, 0] for each in rows.values()]))
    times = times[times >= begin_s]
    found = []
    for names in combinations(rows, 2):
        places = [
            np.stack([np.interp(times, rows[name][:, 0], rows[name][:, axis]) for axis in (1, 2)])
            for name in names
        ]
        apart_m = np.hypot(*(places[0] - places[1]))
        at = int(apart_m.argmin())
        there = tuple((float(each[0, at]), float(each[1, at])) for each in places)
        found.append(Nearest(float(apart_m[at]), names, float(times[at] - begin_s), there))
    return min(found, key=lambda each: each.m)


def check(team: str, tracks: Mapping[str, Track]) -> None:
    """Check that no two rovers came nearer than 0.8 of the spacing, and that the team is at the end
    of its route."""
    keep_apart(team, tracks)
    _, spacing_m, places = TEAMS[team]
    ends = [track[-1][1:] for track in tracks.values()]
    assert math.dist(ends[0], places[-1]) < REACHED_M, ends
    assert all(math.dist(a, b) < 2 * spacing_m + REACHED_M for a, b in pairwise(ends)), ends


def check_lost(team: str, tracks: Mapping[str, Track], nearer_m: float = 0.0) -> None:
    """Check that the first rover is at the end of the route, that the third has passed the second,
    and that no two came nearer than 0.8 of the spacing, or by `nearer_m`."""
    keep_apart(team, tracks, nearer_m)
    _, spacing_m, places = TEAMS[team]
    lead, lost, other = (track[-1][1:] for track in tracks.values())
    assert math.dist(lead, places[-1]) < REACHED_M
    assert math.dist(lead, other) < 2 * spacing_m + REACHED_M < math.dist(lead, lost)


def keep_apart(team: str, tracks: Mapping[str, Track], nearer_m: float = 0.0) -> None:
    found, spacing_m = nearest(tracks), TEAMS[team][1]
    assert found.m >= NEAREST * spacing_m - nearer_m, found
    print(f"{team}: {found.m:.1f} m at the nearest, spacing {spacing_m:g} m")  # for people
