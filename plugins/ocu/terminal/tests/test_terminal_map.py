"""The map in characters: what is drawn, how it moves, and what a terminal without Unicode gets."""

from typing import Any

import pytest
from m2pem_plugin_terminal.ascii_only import ascii_only, in_ascii
from m2pem_plugin_terminal.map_scene import Scene
from m2pem_plugin_terminal.map_viewport import Viewport
from m2pem_plugin_terminal.raster import Raster
from rich.style import Style
from terminal_world import World, fleet, scout

from m2pem.api import GeoPosition, LinkState, VehicleState
from m2pem.api import records as r
from m2pem.mission.catalogue import ResourceId

PLAIN = Style.null()
ROAD = {"type": "LineString", "coordinates": [[-77.3192, 38.1075], [-77.3142, 38.1075]]}


def uav(latitude_deg: float, longitude_deg: float, **more: Any) -> VehicleState:
    place = GeoPosition(latitude_deg, longitude_deg, 100.0)
    return VehicleState(ResourceId("uav"), 0, place, **more)


@pytest.mark.parametrize(
    ("ascii_", "drawn"),
    [(True, "\\   \n \\  \n  \\ "), (False, "⠑⢄\n  ⠑⢄\n    ⠑⢄")],
)
def test_a_line_is_dots_or_a_character(ascii_: bool, drawn: str) -> None:
    raster = Raster(6, 3, ascii=ascii_)
    raster.polyline([(0, 0), (6, 3)] if not ascii_ else [(0, 0), (2, 2)], PLAIN, "\\")
    assert raster.text() == "\n".join(line.rstrip() for line in drawn.split("\n"))


def test_what_is_outside_of_the_picture_is_cut_off() -> None:
    raster = Raster(4, 1, ascii=True)
    raster.polyline([(-1e9, 0.5), (1e9, 0.5)], PLAIN, "-")
    raster.polyline([(-5, -5), (-5, 9)], PLAIN, "#")
    raster.polyline([(-1, 9), (9, 9)], PLAIN, "#")
    raster.put(2, 0, "uav9", PLAIN)
    raster.put(0, 5, "below", PLAIN)
    assert raster.text() == "--ua"


def test_all_points_are_in_a_fitted_picture_and_the_scale_is_round() -> None:
    points = [(0.0, 0.0), (900.0, 100.0), (300.0, -700.0)]
    view = Viewport(80, 20).fitted(points)
    assert all(view.shows(point) for point in points)
    cells, name = view.scale_bar()
    assert name == "500 m"
    assert cells == round(500 / view.metres)


def test_zooming_keeps_the_place_under_the_pointer() -> None:
    view = Viewport(80, 20).fitted([(0.0, 0.0), (500.0, 500.0)])
    at = (12.0, 3.0)
    for factor in (1.5, 1 / 1.5, 1e9, 1e-9):
        assert view.zoomed(factor, at).point(at) == pytest.approx(view.point(at))
    assert view.moved(8, 0).point((0, 0))[0] == pytest.approx(view.point((8, 0))[0])


def test_a_vehicle_without_a_fix_has_no_place_on_the_map() -> None:
    scene = Scene(fleet())
    scene.update(uav(0.0, 0.0))
    assert scene.position("uav") is None
    assert list(scene.points()) == []
    scene.update(uav(38.1, -77.3))
    assert scene.position("uav") == pytest.approx((0.0, 0.0))


def test_goals_are_drawn_while_their_behavior_goes_on() -> None:
    def requested(number: int, target: object) -> r.BehaviorRequested:
        return r.BehaviorRequested(
            token=1,
            process="P",
            element="T",
            scope=1,
            behavior=f"r1.b{number}",
            name="goto",
            type="vehicle",
            resources=("uav",),
            roles={},
            parameters={"target": target},
        )

    scene = Scene(fleet())
    scene.update(uav(38.1, -77.3))
    assert scene.position("uav") == pytest.approx((0.0, 0.0))
    scene.update(scout(0.5))
    for number, target in enumerate(("scout", [38.2, -77.3], "nowhere", ROAD)):
        scene.record("r1", requested(number, target))
    first, second = scene.goals()
    assert first.target == scene.position("scout")
    assert second.target == pytest.approx((0.0, 11_100), abs=50)
    scene.record("r1", r.GeometryReceived(name="road", geometry=ROAD))
    assert {(each.name, each.kind) for each in scene.shapes()} == {
        ("r1.b3", "route"),
        ("road", "route"),
    }
    scene.record("r1", r.RunEnded(outcome=r.RunOutcome.COMPLETED, detail=""))
    assert list(scene.goals()) == []


async def test_the_map_shows_moves_zooms_and_follows(world: World) -> None:
    await world.control.set_geometry("road", ROAD, by="bob")
    async with world.terminal() as terminal:
        await terminal.until_shown("m2pem: no mission")
        await terminal.press("g")
        await terminal.until_shown("Map of 0 vehicles", "road", "N↑")
        world.fake.say(scout(0.9))
        world.fake.say(uav(38.108, -77.316, velocity_enu_m_s=(0.0, -4.0, 0.0)))
        await terminal.until_shown("Map of 2 vehicles", "scout", "↓ uav", "↗", "100 m")
        before = terminal.app.map_pane.viewport
        await terminal.press("plus", "plus")
        assert terminal.app.map_pane.viewport.metres < before.metres / 2
        await terminal.press("right", "up")
        assert terminal.app.map_pane.viewport.east_m > before.east_m
        assert terminal.app.map_pane.viewport.north_m > before.north_m
        await terminal.press("full_stop", "full_stop")
        await terminal.until_shown("follows uav")
        world.fake.say(uav(38.118, -77.316, link=LinkState.LOST))
        await terminal.until_shown("● uav")
        await terminal.press("0")
        await terminal.until_shown("scout", "● uav")
        await terminal.press("escape")
        await terminal.until_shown("─Mission─", "─Log─")


async def test_on_a_wide_terminal_the_map_is_beside_the_mission(world: World) -> None:
    async with world.terminal(size=(160, 50)) as terminal:
        await world.start()
        world.fake.say(scout(0.9))
        await terminal.until_shown("─Mission─", "Map of one vehicle (1 without a position)")
        await terminal.until_shown("─Vehicles─", "PATROL", "DRIVE", "scout     ")


async def test_a_narrow_terminal_has_the_vehicles_below_the_mission(world: World) -> None:
    async with world.terminal(size=(48, 30)) as terminal:
        await world.start()
        await terminal.until_shown("● DRIVE", "○ scout")
        lines = terminal.screen.splitlines()
        assert [line for line in lines if "DRIVE" in line and "scout  " in line] == []


async def test_a_terminal_without_unicode_gets_ascii_only(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("M2PEM_ASCII", "1")
    async with world.terminal() as terminal:
        await world.start()
        world.fake.say(scout(0.9))
        await terminal.until_shown("* DRIVE", "-Mission-", "* scout")
        await terminal.press("g")
        await terminal.until_shown("Map of one vehicle", "N^", "/ scout")
        assert terminal.screen.isascii()


@pytest.mark.parametrize(
    ("environment", "encoding", "expected"),
    [
        ({"TERM": "xterm-256color"}, "UTF-8", False),
        ({"TERM": "xterm"}, "ANSI_X3.4-1968", True),
        ({"TERM": "linux"}, "utf-8", True),
        ({"TERM": "dumb", "M2PEM_ASCII": "0"}, "ascii", False),
        ({"TERM": "xterm", "M2PEM_ASCII": "1"}, "utf-8", True),
    ],
)
def test_which_terminals_show_ascii_only(
    environment: dict[str, str], encoding: str, expected: bool
) -> None:
    assert ascii_only(environment, encoding) is expected


def test_a_text_in_ascii_is_as_wide_as_before() -> None:
    assert in_ascii("● ü 車 ─┤ N↑") == "* ? ?? -+ N^"
