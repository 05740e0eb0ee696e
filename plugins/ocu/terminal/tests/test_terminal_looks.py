"""What the screen looks like, colours and all: the pictures of docs/operating.md.

A change that is meant is drawn anew with M2PEM_DRAW=1, and looked at.
"""

import os
import re
from contextlib import suppress
from pathlib import Path

import pytest
from terminal_world import Terminal, World, characters, scout

from m2pem.api.telemetry import GeoPosition, VehicleState
from m2pem.mission.catalogue import BehaviorState, ResourceId

PICTURES = Path(__file__).parents[4] / "docs" / "images"


def normalised(svg: str) -> str:
    """Without what changes by itself, and without fonts from elsewhere."""
    svg = re.sub(r"@font-face \{.*?\}\s*", "", svg, flags=re.DOTALL)
    svg = re.sub(r"terminal-\d+", "terminal", svg)
    return svg.replace("Fira Code, monospace", "monospace").rstrip() + "\n"


def drawn(terminal: Terminal) -> str:
    return normalised(terminal.app.export_screenshot(title="m2pem"))


async def compare(terminal: Terminal, name: str) -> None:
    picture = PICTURES / f"terminal_{name}.svg"
    if os.environ.get("M2PEM_DRAW"):
        for _ in range(50):  # until the log has scrolled to its end
            await terminal.pilot.pause(0.01)
        picture.write_text(drawn(terminal), encoding="utf-8")
    expected = picture.read_text(encoding="utf-8")
    with suppress(TimeoutError):
        await terminal.until(lambda: drawn(terminal) == expected)
    assert characters(drawn(terminal), 80, 24) == characters(expected, 80, 24)
    assert drawn(terminal) == expected


@pytest.fixture
async def terminal(world: World, monkeypatch: pytest.MonkeyPatch):
    """A mission under way: something is done, something asked, something waited for."""
    monkeypatch.delenv("NO_COLOR", raising=False)
    async with world.terminal() as terminal:
        await world.start()
        await world.clock.advance(125)
        place = GeoPosition(38.10818, -77.31666, 100.0)
        world.fake.say(scout(0.87, behavior="r1.b1"))
        uav, velocity = ResourceId("uav"), (8.0, 0.0, 0.0)
        world.fake.say(
            VehicleState(uav, 0, place, 40.0, velocity, battery_fraction=0.15, mode="auto")
        )
        await terminal.until_shown("15%", "87%", "2:05", "in 2:55", "BRIDGE asks")
        yield terminal


async def test_a_mission_that_asks(world: World, terminal: Terminal) -> None:
    await terminal.until_shown("Question 1 of 2")
    await compare(terminal, "question")


async def test_stop_over_a_dialog(world: World, terminal: Terminal) -> None:
    await terminal.press("s")
    await terminal.until_shown("Send a signal")
    await terminal.press("ctrl+x")
    await terminal.until_shown("STOP r1?")
    await compare(terminal, "stop")


async def test_somebody_else_answered_and_things_are_done(world: World, terminal: Terminal) -> None:
    for state in (BehaviorState.ACCEPTED, BehaviorState.RUNNING, BehaviorState.FAILED):
        world.fake.report("r1.b1", state, "ROUTE_BLOCKED" if state == "FAILED" else "")
    await terminal.until_shown("FAILED", "r1 failed", "drive_stop ended FAILED")
    await compare(terminal, "failed")


AREA = [[-77.3180, 38.1078], [-77.3158, 38.1078], [-77.3158, 38.1090], [-77.3180, 38.1090]]
ROAD = [[-77.3192, 38.1075], [-77.3170, 38.1082], [-77.3150, 38.1080], [-77.3138, 38.1092]]


async def test_the_map(world: World, terminal: Terminal) -> None:
    area = {"type": "Polygon", "coordinates": [[*AREA, AREA[0]]]}
    await world.control.set_geometry("field", area, by="bob")
    await world.control.set_geometry("road", {"type": "LineString", "coordinates": ROAD}, by="bob")
    await world.control.execute_behavior("uav", "goto", {"target": [38.1091, -77.3145]}, by="bob")
    await terminal.press("g")
    await terminal.until_shown("Map of 2 vehicles", "field", "✕", "Question")
    await compare(terminal, "map")
