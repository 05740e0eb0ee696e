"""The page of the documentation about the recorded traces."""

from collections.abc import Iterator

from mavlink_scenarios import scenarios_of
from mavlink_traces import VEHICLES, compare, firmware, play_simulated, reasons, recorded

PAGE = """# What simulated autopilots are held to

`m2pem sim mavlink` answers as real autopilots do: real ArduPilots and a real PX4, which simulate
themselves, were led through scripted conversations (`plugins/arbiters/mavlink/tests/traces`). Every
test run leads the simulated ones through the same conversations and compares, step by step:

- results of commands and of uploads, modes, states, progress of missions, the estimator's position,
  the fix, the fence, values of parameters, each in its order;
- texts of severity warning and worse: all of them; other texts: the simulation says none that the
  real one does not say;
- how long things take: within 4 s, or 40 %.

`tools/record_autopilot` records again; `.venv/bin/python tools/record_autopilot arducopter` prints
the differences.

| Vehicle | Firmware | Scenarios | Steps | Differences left |
|---|---|---|---|---|
"""

DIFFERENCES = """
## Differences that are left

| Scenario | Step: what | Why |
|---|---|---|
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
                    where = f"`{vehicle}` `{scenario.name}` | {found.key}"
                    yield f"| {where} | {listed[found.key]} |\n"
