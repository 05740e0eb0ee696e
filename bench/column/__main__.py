"""python -m bench.column --fleet FLEET --camera evsg2/ptz --speed 2 --reached EndBypassed

Listens to a team that marches in a column and to a camera over ROS on one of its vehicles, from
"watching" until the run ends, and prints how well both did. Ends with 1 if the run did not come to
the end event `--reached`, or somebody did worse than is promised.
"""

import argparse
import math
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pymap3d
import rclpy
from rclpy.executors import ExternalShutdownException

from bench.column.listening import Commanded, Listener, Told
from bench.column.pointing import Looked, Mount, along_sector, at_target
from bench.column.series import Array, Errors, Series, errors
from bench.column.spacing import gaps_m
from m2pem import load_fleet
from m2pem.api import Fleet, Point, ResourceId

MARCHES = ("road_following_formation", "road_sweep", "formation")
SPACING_SHARE = 0.5
"""Of the spacing: no two come nearer to each other than that (docs/teams.md)."""

USUAL_SPACING_M = 15.0
USUAL_UP_M = 2.0


class Watch:
    """Measures what was heard of a team's vehicles, and of a camera on one of them."""

    def __init__(self, fleet: Fleet, camera: ResourceId, told: Told) -> None:
        self._fleet = fleet
        self._camera = camera
        self._told = told
        self._vehicles = {name: _unwrapped(heard.series()) for name, heard in told.vehicles.items()}
        self._head = told.head.series()

    def marches(self) -> Iterator[tuple[Commanded, float, Errors, float]]:
        """Each march in a column: its spacing, its errors and the smallest gap, in metres."""
        for each in self._ended():
            if each.name in MARCHES and len(each.resources) > 1 and "route" in each.parameters:
                wished_m = _number(each.parameters.get("spacing", USUAL_SPACING_M))
                column = [self._vehicles[name] for name in each.resources]
                gaps = gaps_m(column, each.begin_s, each.end_s)
                yield each, wished_m, errors((gaps - wished_m).ravel()), float(np.min(gaps))

    def looks(self) -> Iterator[tuple[Commanded, Looked]]:
        """What the camera was to look at."""
        for each in self._ended():
            if self._camera in each.resources and each.name.startswith("ptz_"):
                yield each, self._look(each)

    def _ended(self) -> list[Commanded]:
        return [each for each in self._told.commanded.values() if math.isfinite(each.end_s)]

    def _look(self, each: Commanded) -> Looked:
        vehicle = self._vehicles[self._fleet.payloads[self._camera].vehicle]
        window_s, wished = (each.begin_s, each.end_s), each.parameters
        if each.name == "ptz_scan_sector":
            middle, half = _number(wished["heading"]), _number(wished["sector"]) / 2
            sector = middle - half, middle + half, _number(wished["elevation"])
            return along_sector(vehicle, self._head, sector, _number(wished["speed"]), window_s)
        target = self._place(wished["target"], wished.get("altitude_frame"))
        return at_target(vehicle, self._head, self._mount(), target, window_s)

    def _place(self, target: Any, frame: str | None) -> Array:
        """East, north and up of the fleet's origin, on whose height the vehicles stand."""
        origin = self._fleet.origin
        if isinstance(target, str):
            point = self._fleet.geometries[target]
            assert isinstance(point, Point), f"{target} is no point"
            latitude, longitude, up = point.position
            above_m = origin[2] + (up or 0.0)
        else:
            latitude, longitude, above_m = target
            above_m += 0.0 if frame == "amsl" else origin[2]
        return np.array(pymap3d.geodetic2enu(latitude, longitude, above_m, *origin), dtype=float)

    def _mount(self) -> Mount:
        wished = self._fleet.payloads[self._camera].settings.get("mounting", {})
        forward, left = (_number(wished.get(key, 0.0)) for key in ("forward", "left"))
        return Mount(forward, left, _number(wished.get("up", USUAL_UP_M)))


def _unwrapped(poses: Series) -> Series:
    values = poses.values.copy()
    values[:, 3] = np.unwrap(values[:, 3])
    return Series(poses.times_s, values)


def _number(value: Any) -> float:
    """SI, of what missions and fleets say: metres and seconds, or degrees."""
    if not isinstance(value, str):
        return float(value)
    number, _, unit = value.partition(" ")
    return math.radians(float(number)) if unit.startswith("deg") else float(number)


def report(watch: Watch, bound_deg: float) -> bool:
    """Print what was measured; whether all kept to what is promised: of the camera, to look no
    farther than `bound_deg` beside its target once it is there."""
    kept = True
    for each, wished_m, off, nearest_m in watch.marches():
        print(
            f"spacing   {each.element}: {' '.join(each.resources)}, {wished_m:g} m wished: "
            f"error RMS {off.rms:.2f} m, at most {off.most:.2f} m; never nearer than "
            f"{nearest_m:.1f} m"
        )
        kept &= nearest_m >= SPACING_SHARE * wished_m
    moving: list[Array] = []
    for each, looked in watch.looks():
        all_off, off = (
            errors(np.degrees(part)) for part in (looked.off_rad, looked.off_rad[looked.moving])
        )
        print(
            f"pointing  {each.element} ({each.name}): on target after {looked.acquired_s:.1f} s, "
            f"then error RMS {all_off.rms:.2f} deg, at most {all_off.most:.2f} deg; vehicle "
            f"moving {off.count} of {all_off.count} times"
        )
        kept &= all_off.count > 0 and all_off.most < bound_deg
        moving.append(looked.off_rad[looked.moving])
    total = errors(np.degrees(np.concatenate(moving)) if moving else np.array([]))
    print(
        f"pointing from the moving vehicle: error RMS {total.rms:.2f} deg, at most "
        f"{total.most:.2f} deg ({total.count} times); promised: below {bound_deg:g} deg"
    )
    return kept and total.count > 0


def read_options() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(prog="python -m bench.column", description=__doc__)
    parser.add_argument("--fleet", type=Path, required=True)
    parser.add_argument("--team", required=True, help="whose members to watch")
    parser.add_argument("--camera", type=ResourceId, required=True, help="VEHICLE/PAYLOAD")
    parser.add_argument("--speed", type=float, default=1.0, help="simulated seconds per second")
    parser.add_argument("--bound", type=float, default=1.0, metavar="DEG", help="of pointing")
    parser.add_argument("--reached", required=True, help="the end event that must be reached")
    parser.add_argument("--within", type=float, default=300.0, metavar="SECONDS")
    return parser.parse_args()


def main() -> int:
    """Watch."""
    options = read_options()
    fleet = load_fleet(options.fleet)
    team = fleet.teams[options.team]
    settings = fleet.payloads[options.camera].settings
    rclpy.init()
    vehicles: dict[str, str] = {
        name: fleet.vehicles[name].settings["namespace"] for name in team.members
    }
    joints = settings["joints"]["pan"], settings["joints"]["tilt"]
    listener = Listener(vehicles, f"{settings['namespace']}/joint_states", joints, options.speed)
    deadline_s = time.monotonic() + options.within
    try:
        listener.wait_until_heard(deadline_s)
        print("watching", flush=True)
        listener.listen(deadline_s)
    except TimeoutError as error:
        print(f"it took too long: {error}", file=sys.stderr)
        return 1
    except (KeyboardInterrupt, ExternalShutdownException):
        return 130
    kept = report(Watch(fleet, options.camera, listener.told), options.bound)
    reached = options.reached in listener.told.elements
    print(f"the run {listener.told.ended}; {options.reached}{'' if reached else ' not'} reached")
    return 0 if kept and reached and listener.told.ended in ("completed", "terminated") else 1


if __name__ == "__main__":
    sys.exit(main())
