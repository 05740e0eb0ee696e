"""Fleets for tests: written to a folder and loaded, so that lines are those of a real file."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.fleet_file import load_fleet
from m2pem.mission.catalogue import BehaviorSpec, ResourceId

PATROL = """\
version: 1
vehicles:
  evsg1:
    domain: ground
    arbiter: ros
    payloads:
      gpr: {detector: true}
  evsg2: {domain: ground, arbiter: ros, behaviors: [drive_stop]}
  evsg3:
    domain: ground
    arbiter: ros
    payloads:
      ptz: {arbiter: ptz}
  lead: {domain: ground, arbiter: ros, manned: true}
teams:
  section: {members: [evsg3, evsg1], lead: evsg1}
  convoy: {members: [evsg1, lead]}
routes: {alpha: alpha.geojson}
areas: {field: field.geojson}
points: {gate: gate.geojson}
"""

LINE = {"type": "LineString", "coordinates": [[-77.0, 38.0], [-77.1, 38.1, 5]]}
SQUARE = {"type": "Polygon", "coordinates": [[[-77, 38], [-76, 38], [-76, 39], [-77, 38]]]}
POINT = {"type": "Point", "coordinates": [-77.0, 38.0]}


def write_fleet(folder: Path, text: str = PATROL) -> Path:
    """`fleet.yaml` with geometry files alpha, field and gate beside it."""
    for name, geometry in (("alpha", LINE), ("field", SQUARE), ("gate", POINT)):
        write_json(folder / f"{name}.geojson", geometry)
    path = folder / "fleet.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def write_json(path: Path, value: Any) -> Path:
    path.write_text(json.dumps(value), encoding="utf-8")
    return path


def patrol(folder: Path, text: str = PATROL) -> Fleet:
    return load_fleet(write_fleet(folder, text))


def everything(resource: ResourceId) -> Sequence[BehaviorSpec]:
    """The catalogue of an arbiter that can do all that is shared."""
    wanted = {"payload"} if "/" in resource else {"vehicle", "team"}
    return [spec for spec in SHARED.values() if spec.type.value in wanted]
