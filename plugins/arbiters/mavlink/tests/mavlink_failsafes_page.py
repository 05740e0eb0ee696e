"""The page of the documentation about failsafes, made of what was recorded."""

import json
import re
from collections import defaultdict
from collections.abc import Iterator
from typing import Any

from mavlink_failsafe_cells import VEHICLES
from mavlink_failsafes import FILE

PAGE = """# Failsafes of a vehicle while a mission runs

What real autopilots, which simulate themselves, and m2pem do when a failsafe of the vehicle acts
in a mission. Each phase was played with the real program, `m2pem run` and a second ground station
that brought the failsafe about; `tools/record_failsafes` does it again and writes this page. The
rules are in [MAVLink vehicles](mavlink.md#when-the-link-is-lost-and-other-failsafes): m2pem
interrupts no RTL and no LAND that it has not asked for, arms no vehicle that is not ready, and says
what it sees.

In the missions of aircraft the first task takes off to 30 m (90 m in "taking off", planes 150 m);
the fleet says `lost_after: 10 s`. No boundary event catches an error, so that a behavior that fails
ends the mission; a mission of yours can catch the error and go on. When the mission is over, m2pem
ends, and with it the heartbeats of the ground station: a vehicle that stays in the air then returns
by its own ground station failsafe.

In the tables, phases that went alike share a row.

- *The vehicle*: its modes from the failsafe on, also after the mission, and where it ended ("away":
  not at home).
- *The mission*: how the behavior of the phase ended. "to RTL": the mode changed to RTL, which m2pem
  did not command, and then what the vehicle said of it; with `TAKEN_OVER` another ground station or
  a switch did it, else a failsafe of the vehicle. "does not move": it should, but has not for 60 s
  (in RTL 120 s).
- *Operators read*: what else they read during the mission, mostly what the vehicle says.

Operators read these lines, too, whatever the failsafe is:

- Before the takeoff: `uav1 waits until it is ready`, and what is missing.
- When the link is lost: `uav1: LINK_LOST: its arbiter lost the link`; if the vehicle was armed, its
  mode and height, that what it does now is not known, and what may be done.
- When the mission ends and the vehicle is armed: `uav1 stays armed in RTL, 38 m above its home`,
  and what may be done.

Rovers say "Radio Failsafe" when it is the ground station that they have lost. m2pem commands
heights above terrain only where a mission says `altitude_frame: terrain`, and serves no terrain
data: a vehicle that has none does not move. Planes circle where copters stand.

PX4 arms without manual control, and has then no failsafe for its loss until the pilot is there
again. Its texts say "Failsafe activated" without the cause, and nothing where it lands or returns
already; the cause is in its EVENT messages, which m2pem does not read. A simulated PX4 does not
restart: it denies `MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN` on the ground, and every PX4 does while it is
armed. PX4 refuses missions with heights above terrain, so that the behavior fails at once ("its
frame is not supported"). `MAV_CMD_INJECT_FAILURE` stops its motor 1, which PX4 does only where
`CA_FAILURE_MODE` is not 0.
"""

HEAD = """
The fleet says `failsafe: {vehicle.failsafe}`, the vehicle has {parameters}.

| Failsafe | Phase | The vehicle | The mission | Operators read |
|---|---|---|---|---|
"""

ROUTINE = re.compile(
    r"Start|End|Task\d|r1 .*|Task\d: (.* begins|.* ends|error) .*|.* is ready|.*: LINK_LOST: .*"
    r"|.*( waits until it is ready: | stays armed in | was armed in |an unknown module block).*"
    r"|.*: (nothing happens|it only warns) when its battery is low.*|.*: fleet says .*"
    r"|.*the vehicle has not reported its position yet|.*GCS Failsafe Off"
)
"""Lines of every mission, what the page says before the tables, and what is of no vehicle."""

SHORTER = (
    (r"(a failsafe of its own|another ground station or a switch) has taken over: ", ""),
    (r"the mode changed from \S+ (to \w[^:,]*)(, which m2pem did not command)?", r"\1"),
    (r"it should move, but has not moved for .*", "does not move"),
    (r" [\d.]+V used \d+ mAh| at \d+%,| for [\d.]+ s(econds)?\b|, \d+ s\b| \(\d\)|AUTO\.", ""),
)
"""What the page says before the tables, and what differs from one run to the next."""


def page() -> str:
    """The page."""
    return "".join(_page())


def _page() -> Iterator[str]:
    yield PAGE
    kept = json.loads(FILE.read_text(encoding="utf-8"))
    for vehicle in VEHICLES.values():
        parameters = ", ".join(f"`{key}` {value:g}" for key, value in vehicle.parameters.items())
        yield f"\n## {vehicle.title}\n{HEAD.format(vehicle=vehicle, parameters=parameters)}"
        for name, phases in kept[vehicle.name].items():
            rows = defaultdict(list)
            for phase in vehicle.phases_of(vehicle.failsafes[name]):
                rows[_cells(phases[phase])].append(phase)
            first = f"**{name}**"
            for cells, alike in rows.items():
                yield f"| {first} | {', '.join(alike)} | {cells} |\n"
                first = ""


def _cells(seen: dict[str, Any]) -> str:
    modes = ", ".join(seen["modes"]) or "same mode"
    end = "stands, armed" if seen.get("stands") else "armed"
    if seen["disarmed"]:
        end = "disarmed" if seen["at home"] else "disarmed away"
    said = "\n".join(seen["said"])
    error = re.search(r": error (\w+) \((.*)\), not caught", said)
    mission = f"`{error[1]}` {_shorter(error[2])}" if error else "completed"
    lines = (line.split(": ", 1)[1] for line in seen["said"] if not ROUTINE.fullmatch(line))
    plain = (re.sub(r"^\w+( says)?: (BATTERY_LOW: )?", "", _shorter(line)) for line in lines)
    read = [line for line in dict.fromkeys(plain) if line.casefold() not in mission.casefold()]
    return f"{modes}; {end} | {mission} | {'; '.join(read) or '-'}"


def _shorter(text: str) -> str:
    for pattern, words in SHORTER:
        text = re.sub(pattern, words, text)
    return text
