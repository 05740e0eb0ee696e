"""The page of the documentation about failsafes, made of what was recorded."""

import json
import re
from collections import defaultdict
from collections.abc import Iterator
from typing import Any

from mavlink_failsafe_cells import VEHICLES
from mavlink_failsafes import FILE

PAGE = """# Failsafes of a vehicle while a mission runs

What real autopilots, which simulate themselves, and m2pem did when a failsafe of the vehicle acted
in a mission: each phase with the real program, `m2pem run` and a second ground station that brought
the failsafe about. `tools/record_failsafes` does it again and writes this page. The rules are in
[MAVLink vehicles](mavlink.md#when-the-link-is-lost-and-other-failsafes).

Aircraft take off to 30 m (90 m in "taking off", planes 150 m); the fleet says `lost_after: 10 s`.
No boundary event catches an error, so that a behavior that fails ends the mission; yours can catch
it and go on. When the mission is over, m2pem ends, and with it its heartbeats as a ground station:
a vehicle that stays in the air then returns by its own ground station failsafe.

Phases that went alike share a row, and failsafes their rows. Where "on the ground" or "at rest" is
missing (but for the terrain), the vehicle was not armed, and the behavior ended with `FAILED` and
the reason, such as "not ready: prearm: Battery 1 low voltage failsafe".

- *The vehicle*: its modes from the failsafe on, also after the mission, and where it ended ("away":
  not at home).
- *The mission*: how the behavior of the phase ended. "to RTL": the mode changed to RTL, which m2pem
  did not command, and then what the vehicle said of it; with `TAKEN_OVER` another ground station or
  a switch did it, else a failsafe of the vehicle. "does not move": it should, but has not for 60 s
  (in RTL 120 s).

Operators read, besides, what the vehicle says; what is missing until it is ready; of a lost vehicle
that was armed, its last mode and height; and at the end of the mission which vehicles stay armed.

Rovers say "Radio Failsafe" when it is the ground station that they have lost. Planes circle where
copters hover.

PX4 arms without manual control, and has then no failsafe for its loss until the pilot is there
again. Its texts say "Failsafe activated" without the cause. PX4 restarts neither in the simulation
nor while it is armed, and refuses missions with heights above terrain.
"""

HEAD = """
The fleet says `failsafe: {vehicle.failsafe}`, the vehicle has {parameters}.

| Failsafe | Phase | The vehicle | The mission |
|---|---|---|---|
"""

NOT_ARMED = "`FAILED` not ready: "
"""How each behavior ended that a failsafe kept from arming its vehicle."""

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
        alike = defaultdict(list)
        for name, phases in kept[vehicle.name].items():
            rows = defaultdict(list)
            for phase in vehicle.phases_of(vehicle.failsafes[name]):
                if NOT_ARMED not in (cells := _cells(phases[phase])):
                    rows[cells].append(phase)
            alike[tuple(f"{', '.join(row)} | {cells}" for cells, row in rows.items())].append(name)
        for lines, names in alike.items():
            first = f"**{'; '.join(names)}**"
            for line in lines:
                yield f"| {first} | {line} |\n"
                first = ""


def _cells(seen: dict[str, Any]) -> str:
    modes = ", ".join(seen["modes"]) or "same mode"
    end = "at rest, armed" if seen.get("stands") else "armed"
    if seen["disarmed"]:
        end = "disarmed" if seen["at home"] else "disarmed away"
    said = "\n".join(seen["said"])
    error = re.search(r": error (\w+) \((.*)\), not caught", said)
    mission = f"`{error[1]}` {_shorter(error[2])}" if error else "completed"
    return f"{modes}; {end} | {mission}"


def _shorter(text: str) -> str:
    for pattern, words in SHORTER:
        text = re.sub(pattern, words, text)
    return text
