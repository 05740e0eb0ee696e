"""Copters that simulate themselves in a process of their own: their fleet, route and missions."""

import json
from pathlib import Path

from tests.executive import conftest

HOME = (38.1075, -77.3192, 60.0)
ROUND = [[-77.3192, 38.1080], [-77.3182, 38.1080], [-77.3182, 38.1090], [-77.3192, 38.1090]]


def simulated(port: int, speed: str, *faults: str, copters: int = 1) -> tuple[str, ...]:
    """The words of a command that simulates copters, which send to a port and have no failsafe for
    the loss of their ground station."""
    return (
        *("sim", "mavlink", "--copters", str(copters), "--speed", speed, "--ekf", "6s"),
        *("--home", ",".join(map(str, HOME)), "--to", f"udp://127.0.0.1:{port}"),
        *("--set", "FS_GCS_ENABLE=0", *(word for fault in faults for word in ("--fault", fault))),
    )


def write(
    folder: Path,
    port: int,
    mission: bytes,
    *others: str,
    lost_after: str,
    rounds: int,
    copters: int = 1,
) -> tuple[Path, Path]:
    """Write a mission, and the fleet of uav1, uav2, ..., with the route `around`; returns both.

    `others`: lines of vehicles that are not copters.
    """
    vehicles = [
        f"uav{number}: {{domain: air, arbiter: mavlink, lost_after: {lost_after}, sitl: true,"
        f" connection: {{url: 'udpin://127.0.0.1:{port}', system_id: {number}}}}}"
        for number in range(1, copters + 1)
    ]
    lat, lon, alt = HOME
    (folder / "fleet.yaml").write_text(
        f"version: 1\norigin: {{lat: {lat}, lon: {lon}, alt: {alt}}}\nvehicles:\n"
        + "".join(f"  {line}\n" for line in (*vehicles, *others))
        + "routes: {around: around.geojson}\n",
        encoding="utf-8",
    )
    around = {"type": "LineString", "coordinates": ROUND * rounds}
    (folder / "around.geojson").write_text(json.dumps(around), encoding="utf-8")
    (folder / "m.bpmn").write_bytes(mission)
    return folder / "m.bpmn", folder / "fleet.yaml"


def task(element: str, behavior: str, role: str, **parameters: str) -> tuple[str, str]:
    """A task of one vehicle, as `sequence` takes it; `role`: the attributes of its role."""
    inside = "".join(
        f'<m2pem:property name="{key}" value="{value}"/>' for key, value in parameters.items()
    )
    return element, conftest.task(element, role, behavior, inside)
