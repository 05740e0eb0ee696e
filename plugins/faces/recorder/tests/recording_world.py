"""A simulated fleet with geometries, missions, and a recorder beside them."""

import asyncio
import os
import subprocess
import sys
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from dataclasses import replace
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

import msgspec
from m2pem_plugin_recorder.faces import RecorderFace

from m2pem.api import Area, FaceSettings, Fleet, MissionControl, Point, Route, as_geojson
from m2pem.testing.scenarios import fleet, one_after_another

GATE = (38.1080, -77.3190, None)
MAST = Point((38.1075, -77.3192, 60.0), "ellipsoid")
"""Above mean sea level it is 33.97 m higher: the undulation by PROJ 9.5.1 with egm96_15.gtx."""

HOME = (38.1075, -77.3192, None)
ROAD = Route((HOME, GATE))
_CORNERS = ((38.105, -77.322), (38.110, -77.322), (38.110, -77.316), (38.105, -77.316))
FIELD = Area((tuple((*corner, None) for corner in (*_CORNERS, _CORNERS[0])),))

DRIVE = one_after_another("ugv1", ("goto", {"target": "gate"}), ("goto", {"target": "home"}))
"""Start, Task1, Task2, End."""


def simulated_fleet() -> Fleet:
    """Two ground vehicles, one of them with a camera, a route and a fence."""
    made = fleet(
        "sim",
        {"ugv1": {}, "ugv1/camera": {"type": "ptz"}, "ugv2": {}},
        geometries={"road": ROAD, "field": FIELD, "gate": Point(GATE), "home": Point(HOME)},
    )
    return replace(made, fence="field")


@asynccontextmanager
async def recorded(
    control: MissionControl, folder: Path, **settings: Any
) -> AsyncIterator[asyncio.Task[None]]:
    """Record within the block; yields the task of the face."""
    face = RecorderFace(
        control, FaceSettings("recorder", {"folder": str(folder), "min_free_mb": 0, **settings})
    )
    task = asyncio.create_task(face.serve())
    try:
        yield task
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


FLEET = """\
version: 1
name: pair
origin: {lat: 38.1075, lon: -77.3192, alt: 60.0}
faces:
  recorder: {min_free_mb: 0}
vehicles:
  ugv1: {domain: ground, arbiter: sim, connection: {home: [38.1075, -77.3192]}}
  ugv2: {domain: ground, arbiter: sim, connection: {home: [38.1076, -77.3192]}}
points:
  gate: gate.geojson
  home: home.geojson
  mast: mast.geojson
"""


def write_fleet(folder: Path) -> None:
    """Write the fleet file and the mission into a folder."""
    (folder / "fleet.yaml").write_text(FLEET)
    (folder / "drive.bpmn").write_bytes(DRIVE)
    for name, point in (("gate", Point(GATE)), ("home", Point(HOME)), ("mast", MAST)):
        (folder / f"{name}.geojson").write_bytes(msgspec.json.encode(as_geojson(point)))


@contextmanager
def m2pem(folder: Path, *arguments: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run the command line in a folder within the block, with this plugin, installed or not."""
    paths = [str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")]
    if not any(each.name == "m2pem-plugin-recorder" for each in distributions()):
        info = folder / "installed" / "m2pem_plugin_recorder-0.2.0.dist-info"
        info.mkdir(parents=True, exist_ok=True)
        (info / "METADATA").write_text(
            "Metadata-Version: 2.1\nName: m2pem-plugin-recorder\nVersion: 0.2.0\n"
        )
        (info / "entry_points.txt").write_text("[m2pem]\nrecorder = m2pem_plugin_recorder\n")
        paths.append(str(info.parent))
    process = subprocess.Popen(
        [sys.executable, "-m", "m2pem", *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    with process:
        try:
            yield process
        except BaseException:
            process.kill()
            raise


def finished(folder: Path, *arguments: str, status: int = 0) -> str:
    """Run the command line to its end; returns what it prints."""
    with m2pem(folder, *arguments) as process:
        printed, _ = process.communicate(timeout=120)
    assert process.returncode == status, printed.decode()
    return printed.decode()
