"""The vehicles pane: the latest state of every vehicle and payload, grey when it is silent."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rich.text import Text

from m2pem.api.telemetry import (
    LinkState,
    PayloadState,
    TeamMemberState,
    TeamState,
    Telemetry,
    VehicleState,
)
from m2pem_plugin_terminal.formatting import shortened

if TYPE_CHECKING:
    from m2pem.fleet.fleet import Fleet

GREY = "#5f6771"
DETAIL = "#9aa4af"
LINKS = {
    LinkState.CONNECTED: ("●", "#7fc8a9"),
    LinkState.DEGRADED: ("◐", "#e8c468"),
    LinkState.LOST: ("✗", "#e07a6a"),
}
NAME_CELLS = 9
MARCH_FOR_S = 2.0
"""Seconds for which the latest state of a march is shown."""

AT_ITS_PLACE_M = 1.0
LOW_BATTERY = 0.2
ASIDE_DEG, ZOOMED = 0.5, 1.05
"""Smaller angles and zooms are not shown."""


@dataclass(slots=True)
class _Latest:
    """`at`: when something was last received, which a lost resource does not send."""

    state: VehicleState | PayloadState
    at: float


class Vehicles:
    """Remembers the newest telemetry of each vehicle and payload of the fleet.

    `speed`: seconds of the executive's clock in a second of the operator's. The table counts how
    long a vehicle was silent by the former, as the reasons of lost links do.
    """

    def __init__(self, fleet: "Fleet", speed: float = 1.0) -> None:
        self._fleet = fleet
        self._speed = speed
        self._latest: dict[str, _Latest] = {}
        self._marching: dict[str, tuple[TeamMemberState, float]] = {}
        self._ended = False

    def end(self) -> None:
        """The executive has ended: a vehicle of which nothing comes any more is not silent."""
        self._ended = True

    def update(self, state: Telemetry, now: float) -> None:
        """Keep a state as the latest; `now` is the operator's clock, in seconds."""
        if isinstance(state, TeamState):
            self._marching.update({each.resource: (each, now) for each in state.members})
            return
        if (
            state.link is LinkState.LOST
            and (before := self._latest.get(state.resource)) is not None
        ):
            now = before.at
        self._latest[state.resource] = _Latest(state, now)

    def silent(self) -> set[str]:
        """Return the vehicles whose links are lost."""
        return {
            vehicle.id
            for vehicle in self._fleet.vehicles.values()
            if (latest := self._latest.get(vehicle.id)) is not None
            and (self._ended or latest.state.link is LinkState.LOST)
        }

    def table(
        self, now: float, width: int, named: Callable[[str], str], taken: Mapping[str, str]
    ) -> Text:
        """Return all vehicles, each on two or three lines of `width` cells, with their operators.

        `named` gives the name of a behavior by its id; `taken`: the operators, by
        resource.
        """
        lines: list[Text] = []
        for vehicle in self._fleet.vehicles.values():
            latest = self._latest.get(vehicle.id)
            holders = _taken((vehicle.id, *vehicle.payloads), taken, width)
            if latest is None or not isinstance(latest.state, VehicleState):
                lines += [Text(f"○ {_name(vehicle.id)} no telemetry yet", GREY), *holders]
                continue
            payloads = [self._latest[p].state for p in vehicle.payloads if p in self._latest]
            if self._ended:
                lines += _not_seen(latest.state, "○", "not watched now")
            elif latest.state.link is LinkState.LOST:
                silent_s = int((now - latest.at) * self._speed)
                lines += _not_seen(latest.state, "✗", f"silent for {silent_s} s")
            else:
                lines += _vehicle(latest.state, payloads, width, named)
                lines += self._place(vehicle.id, now)
            lines += holders
        return Text("\n").join(lines)

    def _place(self, vehicle: str, now: float) -> list[Text]:
        """Return the deviation of a member of a march, while its state is recent."""
        member, at = self._marching.get(vehicle, (None, 0.0))
        if member is None or member.along_m is None or now - at > MARCH_FOR_S:
            return []
        text = f"{abs(member.along_m):.0f} m {'ahead' if member.along_m >= 0 else 'behind'}"
        text = "in its place" if abs(member.along_m) < AT_ITS_PLACE_M else text
        if member.gap_m is not None:
            text += f", gap {member.gap_m:.0f} m"
        return [Text(f"  {text}", DETAIL)]


def _name(resource: str) -> str:
    return shortened(resource, NAME_CELLS).ljust(NAME_CELLS)


def _taken(resources: Iterable[str], taken: Mapping[str, str], width: int) -> list[Text]:
    lines = []
    for resource in resources:
        if holder := taken.get(resource):
            payload = resource.partition("/")[2]
            what = f"{payload}: with {holder}" if payload else f"with {holder}"
            lines.append(Text(f"  {shortened(what, width - 2)}", "bold #e8c468"))
    return lines


def _not_seen(state: VehicleState, mark: str, why: str) -> list[Text]:
    lines = [Text(f"{mark} {_name(state.resource)} {why}", GREY)]
    if state.position is not None:
        lines.append(Text(f"  last at {_position(state)}", GREY))
    return lines


def _vehicle(
    state: VehicleState,
    payloads: list[VehicleState | PayloadState],
    width: int,
    named: Callable[[str], str],
) -> list[Text]:
    symbol, colour = LINKS[state.link]
    first = Text.assemble((symbol, colour), " ", (_name(state.resource), "bold #e3e8ee"))
    if state.battery_fraction is not None:
        low = state.battery_fraction < LOW_BATTERY
        first.append(f" {state.battery_fraction:4.0%}", "bold #e07a6a" if low else DETAIL)
    if state.velocity_enu_m_s is not None:
        speed = math.dist(state.velocity_enu_m_s, (0.0, 0.0, 0.0))
        first.append(f" {speed:4.1f} m/s", DETAIL)
    room = width - first.cell_len - 1
    if state.mode and room > 2:
        first.append(f" {shortened(state.mode, room)}", DETAIL)
    lines = [first]
    if state.position is not None:
        lines.append(Text(f"  {_position(state)}", DETAIL))
    doing = [named(state.behavior)] if state.behavior else []
    looking: list[Text] = []
    for payload in payloads:
        shown = payload_text(payload, named) if isinstance(payload, PayloadState) else ""
        if isinstance(payload, PayloadState) and payload.pan_rad is not None and shown:
            looking.append(Text(f"  {shortened(shown, width - 2)}", "#7fc8a9"))
        elif shown:
            doing.append(shown)
    if doing:
        lines.append(Text(shortened(f"{', '.join(doing)}", width - 2), "#7fc8a9"))
        lines[-1] = Text("  ").append_text(lines[-1])
    elif state.not_ready_reasons:
        text = shortened("; ".join(state.not_ready_reasons), width - 2)
        lines.append(Text(f"  {text}", "#e8c468"))
    return [*lines, *looking]


def _position(state: VehicleState) -> str:
    position = state.position
    assert position is not None
    text = f"{position.latitude_deg:.5f} {position.longitude_deg:.5f}"
    above = state.altitude_above_home_m
    return f"{text} {above:+.0f} m" if above is not None and abs(above) >= 1 else text


def payload_text(state: PayloadState, named: Callable[[str], str]) -> str:
    """Return a text such as "ptz: 30°→ 10°↓ x4 ptz_track"; "" without information.

    `named` gives the name of a behavior by its id. Pan is from the vehicle's heading; "→" is
    clockwise.
    """
    if state.link is LinkState.LOST:
        parts = ["no telemetry"]
    else:
        parts = _look(state)
        if state.behavior:
            parts.append(named(state.behavior))
    return f"{state.resource.rpartition('/')[2]}: {' '.join(parts)}" if parts else ""


def _look(state: PayloadState) -> list[str]:
    pan_rad = state.pan_rad
    if pan_rad is not None and math.isfinite(pan_rad):
        pan_rad = math.remainder(pan_rad, math.tau)
    zoom = f"x{state.zoom:.2g}" if state.zoom is not None and state.zoom >= ZOOMED else ""
    return [each for each in (_turned(pan_rad, "→←"), _turned(state.tilt_rad, "↑↓"), zoom) if each]


def _turned(angle_rad: float | None, arrows: str) -> str:
    """Return an angle in degrees with its arrow. `arrows`: for positive and negative angles."""
    if angle_rad is None or not math.isfinite(angle_rad):
        return ""
    angle_deg = math.degrees(angle_rad)
    if abs(angle_deg) < ASIDE_DEG:
        return ""
    return f"{abs(angle_deg):.0f}°{arrows[angle_deg < 0]}"
