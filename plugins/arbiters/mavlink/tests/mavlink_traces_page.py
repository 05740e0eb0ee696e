"""The page of the documentation about the recorded traces."""

from collections.abc import Iterator
from typing import Any

from mavlink_scenarios import scenarios_of
from mavlink_traces import HELD, VEHICLES, compare, firmware, play_simulated, reasons, recorded

PAGE = """# What simulated autopilots are held to

`m2pem sim mavlink` simulates autopilots. It answers as real ones do: real ArduPilots and a real
PX4, which simulate themselves, were led through scripted conversations, and what they said was
written down as data (`plugins/arbiters/mavlink/tests/traces`). Every test run leads the
simulated autopilots through the same conversations and compares, step by step:

- results of commands and of uploads, modes, whether it is armed, `MAV_STATE`, the landed state,
  `MISSION_CURRENT` (item, state, mode), `MISSION_ITEM_REACHED`, the estimator's position, the fix,
  the fence, values of parameters, each in its order;
- texts of severity warning and worse: all of them; other texts: the simulation says none that the
  real one does not say;
- how long things take: within 4 s, or 40 %.

`tools/record_autopilot` records again; it needs a program of an autopilot and no mission (see
`.venv/bin/python tools/record_autopilot --help`); `... arducopter` prints the differences.

| Vehicle | Firmware | Scenarios | Steps | Differences left |
|---|---|---|---|---|
"""

DIFFERENCES = """
## Differences that are left

| Scenario | Step: what | Real | Simulated | Why |
|---|---|---|---|---|
"""


def page() -> str:
    """The page of the documentation about the recorded traces."""
    return "".join(_page())


def _page() -> Iterator[str]:
    yield PAGE
    for vehicle in VEHICLES:
        traces = recorded(vehicle)
        steps = sum(map(len, traces.values()))
        left = sum(len(reasons(vehicle, scenario)) for scenario in traces)
        held = left if vehicle in HELD else "not held to it yet"
        yield f"| `{vehicle}` | {firmware(vehicle)} | {len(traces)} | {steps} | {held} |\n"
    yield DIFFERENCES
    for vehicle in HELD:
        traces = recorded(vehicle)
        for scenario in scenarios_of(vehicle):
            listed = reasons(vehicle, scenario.name)
            if not listed:
                continue
            differences = compare(traces[scenario.name], play_simulated(vehicle, scenario))
            for found in differences:
                if found.key in listed:
                    yield (
                        f"| `{vehicle}` `{scenario.name}` | {found.key} | {_cell(found.real)} "
                        f"| {_cell(found.simulated)} | {listed[found.key]} |\n"
                    )


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)
