"""The map pane: vehicles, routes, areas, the fence and targets, in characters.

The shapes are drawn once for each part of the world that is shown; vehicles are drawn on a copy of
that, a few times in a second.
"""

import math
from typing import TYPE_CHECKING

from rich.cells import cell_len
from rich.segment import Segment
from rich.style import Style
from textual import events
from textual.strip import Strip
from textual.widget import Widget

from m2pem.api import EastNorth, LinkState, ResourceId, Telemetry, VehicleState
from m2pem_plugin_terminal.map_scene import Scene
from m2pem_plugin_terminal.map_viewport import Viewport
from m2pem_plugin_terminal.raster import Raster

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from m2pem.api import Fleet

NOTHING = "No vehicle has sent a position yet"
PAN = 0.2
"""Part of the picture by which an arrow key moves it."""
ZOOM = 1.5
MOVES_M_S = 0.3
"""A slower vehicle has no direction but its heading."""

ARROWS = "→↗↑↖←↙↓↘"
ASCII_ARROWS = ">/^\\</v\\"
"""Directions from east, counter-clockwise, by 45 degrees."""

KINDS = {
    "fence": (Style.parse("#e07a6a"), "#"),
    "space": (Style.parse("#b48ad8"), "="),
    "area": (Style.parse("#6f8fb0"), ":"),
    "route": (Style.parse("#747c86"), "."),
    "point": (Style.parse("#9aa4af"), "+"),
}
ACTIVE = Style.parse("#7fc8a9")
GOAL = Style.parse("#4f8f78")
TARGET = Style.parse("bold #7fc8a9")
FOOTPRINT = Style.parse("#8a7a4a")
NAME = Style.parse("#c8d0d9")
SHAPE_NAME = Style.parse("#747c86")
LEGEND = Style.parse("#9aa4af")
LINKS = {
    LinkState.CONNECTED: Style.parse("bold #7fc8a9"),
    LinkState.DEGRADED: Style.parse("bold #e8c468"),
    LinkState.LOST: Style.parse("bold #e07a6a"),
}
SILENT = Style.parse("#5f6771")
FOLLOWED = Style.parse("bold reverse")


class MapPane(Widget):
    """`ascii`: for terminals without Unicode. Keys are those of the app; a mouse moves it, too."""

    def __init__(self, fleet: "Fleet", *, ascii: bool = False) -> None:  # noqa: A002
        super().__init__(id="map")
        self._fleet = fleet
        self._ascii = ascii
        self.scene = Scene(fleet)
        self.viewport = Viewport(0, 0)
        self.followed = ""
        self._fits = True
        self._still: Raster | None = None
        self._still_of: tuple[Viewport, int] | None = None
        self._drawn = Raster(0, 0, ascii=ascii)
        self._active = False

    # --- what operators do ----------------------------------------------------------------------

    def set_active(self, active: bool) -> None:
        """Say whether the arrow keys move the map."""
        self._active = active
        self._title()

    def pan(self, right: int, down: int) -> None:
        """Move by a part of the picture."""
        self._fits, self.followed = False, ""
        view = self.viewport
        self.viewport = view.moved(right * view.columns * PAN, down * view.rows * PAN)
        self.draw()

    def zoom(self, closer: bool) -> None:
        """Show less of the world in more detail, or more of it."""
        self._fits = False
        self.viewport = self.viewport.zoomed(ZOOM if closer else 1 / ZOOM)
        self.draw()

    def fit(self) -> None:
        """Show everything, also what comes later."""
        self._fits, self.followed = True, ""
        self.viewport = self.viewport.fitted(self.scene.points())
        self.draw()

    def follow(self, resource: str) -> None:
        """Keep a vehicle in the centre; "": none."""
        self._fits, self.followed = False, resource
        self.draw()

    def follow_next(self, step: int) -> None:
        """Follow the next vehicle of the fleet that has a position, or the one before."""
        names = [each for each in self._fleet.vehicles if self.scene.position(each) is not None]
        if not names:
            return
        place = names.index(ResourceId(self.followed)) if self.followed in names else -1
        if place < 0 and step < 0:
            place = 0
        self.follow(names[(place + step) % len(names)])

    # --- what is shown --------------------------------------------------------------------------

    def update_state(self, state: Telemetry) -> None:
        """Keep a state; the next `draw` shows it."""
        self.scene.update(state)

    def draw(self, silent: "Collection[str]" = ()) -> None:
        """Show where everything is now. `silent`: the vehicles that send nothing any more."""
        columns, rows = self.size
        if not columns or not rows:
            return
        view = self.viewport.sized(columns, rows)
        resized = view != self.viewport
        place = self.scene.position(self.followed)
        if place is not None:
            view = view.centred(place)
        elif self._fits and (resized or not all(map(view.shows, self.scene.points()))):
            view = view.fitted(self.scene.points())
        self.viewport = view
        raster = self._shapes(view).copy()
        for goal in self.scene.goals():
            line = [view.place(goal.vehicle), view.place(goal.target)]
            raster.polyline(line, GOAL, "-")
            column, row = map(math.floor, line[1])
            raster.put(column, row, "x" if self._ascii else "✕", TARGET)
        for corners in self.scene.footprints():
            raster.polyline(map(view.place, corners), FOOTPRINT, "'")
        self._vehicles(raster, view, silent)
        self._legend(raster, view)
        self._drawn = raster
        self._title()
        self.refresh()

    def _shapes(self, view: Viewport) -> Raster:
        key = (view, self.scene.version)
        if self._still is None or self._still_of != key:
            raster = Raster(view.columns, view.rows, ascii=self._ascii)
            active = self.scene.active_names()
            shapes = self.scene.shapes()
            for shape in shapes:
                style, mark = KINDS[shape.kind]
                style = ACTIVE if shape.name in active else style
                for line in shape.lines:
                    raster.polyline(map(view.place, line), style, mark)
                if shape.kind == "point":
                    column, row = map(math.floor, view.place(shape.anchor))
                    raster.put(column, row, "+", style)
            used: set[tuple[int, int]] = set()
            for shape in shapes:
                column, row = map(math.floor, view.place(shape.anchor))
                _label(raster, used, column, row, shape.name, SHAPE_NAME)
            self._still, self._still_of = raster, key
        return self._still

    def _vehicles(self, raster: Raster, view: Viewport, silent: "Collection[str]") -> None:
        at: dict[tuple[int, int], list[VehicleState]] = {}
        for resource, state in self.scene.vehicles.items():
            place = self.scene.position(resource)
            if place is not None and view.shows(place):
                column, row = map(math.floor, view.place(place))
                at.setdefault((column, row), []).append(state)
        used = set(at)
        for (column, row), states in at.items():
            first = next((each for each in states if each.resource == self.followed), states[0])
            style = SILENT if first.resource in silent else LINKS[first.link]
            if first.resource == self.followed:
                style += FOLLOWED
            many = str(min(9, len(states)))
            raster.put(column, row, self._mark(first) if len(states) == 1 else many, style)
        for (column, row), states in at.items():
            name = states[0].resource if len(states) == 1 else ""
            if name:
                _label(raster, used, column, row, name, NAME)

    def _mark(self, state: VehicleState) -> str:
        arrows = ASCII_ARROWS if self._ascii else ARROWS
        east, north, _ = state.velocity_enu_m_s or (0.0, 0.0, 0.0)
        if math.hypot(east, north) >= MOVES_M_S:
            direction_rad = math.atan2(north, east)
        elif state.yaw_rad is not None and math.isfinite(state.yaw_rad):
            direction_rad = state.yaw_rad
        else:
            return "o" if self._ascii else "●"
        return arrows[round(direction_rad / (math.pi / 4)) % len(arrows)]

    def _legend(self, raster: Raster, view: Viewport) -> None:
        shown = any(True for _ in self.scene.points())
        if not shown:
            column = max(0, (view.columns - len(NOTHING)) // 2)
            raster.put(column, view.rows // 2, NOTHING, LEGEND)
            return
        cells, name = view.scale_bar()
        bar = f"|{'-' * (cells - 2)}|" if self._ascii else f"├{'─' * (cells - 2)}┤"
        raster.put(1, view.rows - 1, f"{bar} {name} ", LEGEND)
        raster.put(view.columns - 4, 0, " N^ " if self._ascii else " N↑ ", LEGEND)

    def _title(self) -> None:
        seen = [each for each in self._fleet.vehicles if self.scene.position(each) is not None]
        what = f"Map of {len(seen)} vehicles" if len(seen) != 1 else "Map of one vehicle"
        unplaced = len(self._fleet.vehicles) - len(seen)
        what += f" ({unplaced} without a position)" if seen and unplaced else ""
        if self.followed:
            what += f", follows {self.followed}"
        keys = "   arrows +/- 0: all  . follow  g" if self._active else "   (g)"
        self.border_title = f"{what}{keys}"

    def render_line(self, y: int) -> Strip:
        """Return a row for the terminal."""
        if y >= self._drawn.rows or self._drawn.columns != self.size.width:
            return Strip.blank(self.size.width, self.rich_style)
        segments: Sequence[Segment] = self._drawn.row(y)
        return Strip(segments, self._drawn.columns).apply_style(self.rich_style)

    def on_resize(self) -> None:
        """Draw for the new size."""
        self.draw()

    # --- the mouse ------------------------------------------------------------------------------

    def on_mouse_scroll_up(self, event: events.MouseScrollUp) -> None:
        """Zoom in, around the pointer."""
        self._wheel(event, ZOOM)

    def on_mouse_scroll_down(self, event: events.MouseScrollDown) -> None:
        """Zoom out, around the pointer."""
        self._wheel(event, 1 / ZOOM)

    def _wheel(self, event: events.MouseEvent, factor: float) -> None:
        event.stop()
        self._fits = False
        offset = event.get_content_offset(self)
        at = (float(offset.x), float(offset.y)) if offset is not None else None
        self.viewport = self.viewport.zoomed(factor, at)
        self.draw()

    def on_click(self, event: events.Click) -> None:
        """Follow the vehicle that is clicked, or centre the place."""
        offset = event.get_content_offset(self)
        if offset is None:
            return
        near = self._nearest((offset.x + 0.5, offset.y + 0.5))
        if near:
            self.follow(near)
        else:
            self._fits, self.followed = False, ""
            self.viewport = self.viewport.centred(self.viewport.point((offset.x, offset.y)))
            self.draw()

    def _nearest(self, place: tuple[float, float]) -> str:
        def cells(point: EastNorth) -> float:
            column, row = self.viewport.place(point)
            return max(abs(column - place[0]), abs(row - place[1]))

        found: Mapping[str, float] = {
            resource: cells(point)
            for resource in self.scene.vehicles
            if (point := self.scene.position(resource)) is not None
        }
        best = min(found, key=lambda each: found[each], default="")
        return best if best and found[best] <= 1.5 else ""


def _label(
    raster: Raster, used: set[tuple[int, int]], column: int, row: int, name: str, style: Style
) -> None:
    """Write a name beside a place, unless another name or mark is there."""
    if cell_len(name) != len(name) or not name.isprintable():
        return
    for start, written in ((column + 2, f" {name}"), (column - 1 - len(name), f"{name} ")):
        cells = {(each, row) for each in range(start - 1, start + len(name) + 1)}
        fits = start >= 0 and start + len(name) <= raster.columns and 0 <= row < raster.rows
        if fits and not cells & (used - {(column, row)}):
            raster.put(start - 1 if start > column else start, row, written, style)
            used |= cells
            return
