"""Two runs that wait for each other for ever: each holds, until it goes on, what the other needs.

`holding_and_waiting("ugv1", "ugv2")` runs first, then `holding_and_waiting("ugv2", "ugv1")`. The
circle closes when both have got signal `GO`.
"""

import json
from pathlib import Path

from tests.executive.conftest import flow, mission, task

GO = "Go"
NONE_GOES_ON = "none of them can go on by itself"
"""What the alert says of the circle."""

ROVERS = """\
version: 1
origin: {lat: 38.0, lon: -77.0, alt: 60}
vehicles:
  ugv1: {domain: ground, arbiter: sim, connection: {home: [38.0, -77.0]}}
  ugv2: {domain: ground, arbiter: sim, connection: {home: [38.0, -76.999]}}
routes: {north: north.geojson}
"""


def holding_and_waiting(
    holds: str, needs: str, behavior: str = "teleop", parameters: str = ""
) -> bytes:
    """A run that drives one vehicle by hand, or does another behavior with it that does not end,
    until, after signal `GO`, it has got another one.

    Its elements: Hold, Wait, Need. When Need is done, the run ends at T.
    """
    catch = (
        '<intermediateCatchEvent id="Wait"><signalEventDefinition signalRef="Go"/>'
        "</intermediateCatchEvent>"
    )
    return mission(
        f'<signal id="{GO}"/><process id="P" isExecutable="true"><startEvent id="S"/>'
        f"<parallelGateway id='F'/>{catch}"
        + task("Hold", f"vehicle='{holds}'", behavior, parameters)
        + task("Need", f"vehicle='{needs}' wait='unlimited'")
        + '<endEvent id="T"><terminateEventDefinition/></endEvent>'
        f"{flow('S', 'F')}{flow('F', 'Hold')}{flow('F', 'Wait')}{flow('Wait', 'Need')}"
        f"{flow('Need', 'T')}</process>"
    )


def write_fleet(folder: Path, more: str = "") -> Path:
    """A fleet file with two simulated rovers, and a route; `more`: text at its end."""
    route = [[-77.0, 38.0 + step / 1000] for step in range(1, 11)]
    line = {"type": "LineString", "coordinates": route}
    (folder / "north.geojson").write_text(json.dumps(line), encoding="utf-8")
    file = folder / "fleet.yaml"
    file.write_text(f"{ROVERS}{more}", encoding="utf-8")
    return file
