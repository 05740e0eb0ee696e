"""The vehicles pane: the latest of every vehicle, greyed when nothing is heard of it any more."""

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
from m2pem_plugin_terminal.payloads import payload_words
from m2pem_plugin_terminal.words import shortened

if TYPE_CHECKING:
    from m2pem.fleet.fleet import Fleet

SILENT_AFTER_S = 3.0
"""Where the fleet does not say when a vehicle counts as lost."""

GREY = "#5f6771"
DETAIL = "#9aa4af"
LINKS = {
    LinkState.CONNECTED: ("●", "#7fc8a9"),
    LinkState.DEGRADED: ("◐", "#e8c468"),
    LinkState.LOST: ("✗", "#e07a6a"),
}
NAME_CELLS = 9
MARCH_FOR_S = 2.0
"""What was told of a march is shown for so long."""

AT_ITS_PLACE_M = 1.0
LOW_BATTERY = 0.2


@dataclass(slots=True)
class _Heard:
    state: VehicleState | PayloadState
    at: float


class Vehicles:
    """Remembers the newest telemetry of each vehicle and payload of the fleet."""

    def __init__(self, fleet: "Fleet") -> None:
        self._fleet = fleet
        self._heard: dict[str, _Heard] = {}
        self._marching: dict[str, tuple[TeamMemberState, float]] = {}

    def hear(self, state: Telemetry, now: float) -> None:
        """Take telemetry in; `now` is the operator's clock, in seconds."""
        if isinstance(state, TeamState):
            self._marching.update({each.resource: (each, now) for each in state.members})
            return
        self._heard[state.resource] = _Heard(state, now)

    def table(
        self, now: float, width: int, named: Callable[[str], str], taken: Mapping[str, str]
    ) -> Text:
        """All vehicles, each on two or three lines of `width` cells, and who took them.

        `named` gives the name of a behavior by its id; `taken`, by resource, the operators who
        have something.
        """
        lines: list[Text] = []
        for vehicle in self._fleet.vehicles.values():
            silent_s = vehicle.lost_after_s or SILENT_AFTER_S
            heard = self._heard.get(vehicle.id)
            holders = _taken((vehicle.id, *vehicle.payloads), taken, width)
            if heard is None or not isinstance(heard.state, VehicleState):
                lines += [Text(f"○ {_name(vehicle.id)} not heard of yet", GREY), *holders]
                continue
            age_s = now - heard.at
            payloads = [self._heard[p].state for p in vehicle.payloads if p in self._heard]
            if age_s > silent_s or heard.state.link is LinkState.LOST:
                lines += _silent(heard.state, age_s)
            else:
                lines += _vehicle(heard.state, payloads, width, named)
                lines += self._place(vehicle.id, now)
            lines += holders
        return Text("\n").join(lines)

    def _place(self, vehicle: str, now: float) -> list[Text]:
        """How well a member of a march keeps its place, as long as that is told."""
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


def _silent(state: VehicleState, age_s: float) -> list[Text]:
    lines = [Text(f"✗ {_name(state.resource)} silent for {int(age_s)} s", GREY)]
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
        words = payload_words(payload, named) if isinstance(payload, PayloadState) else ""
        if isinstance(payload, PayloadState) and payload.pan_rad is not None and words:
            looking.append(Text(f"  {shortened(words, width - 2)}", "#7fc8a9"))
        elif words:
            doing.append(words)
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
