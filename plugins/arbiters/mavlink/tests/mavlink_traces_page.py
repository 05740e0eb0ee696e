"""The page of the documentation about the recorded traces."""

from collections.abc import Iterator
from typing import Any

from mavlink_scenarios import scenarios_of
from mavlink_traces import VEHICLES, compare, firmware, play_simulated, reasons, recorded

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

PX4 repeats its last `MISSION_ITEM_REACHED` ten times; the repetitions are not recorded, and not
simulated. Its start script sets `COM_DL_LOSS_T`, `COM_OF_LOSS_T` and `COM_DISARM_PRFLT` to a
multiple, because it was recorded at five times the speed of time; so has the simulated one for the
comparison.

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
        yield f"| `{vehicle}` | {firmware(vehicle)} | {len(traces)} | {steps} | {left} |\n"
    yield DIFFERENCES
    for vehicle in VEHICLES:
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
