"""The page of the documentation about failsafes, made of what was recorded."""

import json
import re
from collections.abc import Iterator
from typing import Any

from mavlink_failsafe_cells import VEHICLES
from mavlink_failsafes import FILE

PAGE = """# Failsafes of a vehicle while a mission runs

What real autopilots, which simulate themselves, and m2pem do when a failsafe of the vehicle acts
in a mission. Each row was played with the real program, `m2pem run` and a second ground station
that brought the failsafe about; `tools/record_failsafes` does it again and writes this page. The
rules are in [MAVLink vehicles](mavlink.md#when-the-link-is-lost-and-other-failsafes): m2pem
interrupts no RTL and no LAND that it has not asked for, arms no vehicle that is not ready, and says
what it sees.

In the missions of aircraft the first task takes off to 30 m (90 m in "taking off", planes 150 m);
the fleet says `lost_after: 10 s`. No boundary event catches an error, so that a behavior that fails
ends the mission; a mission of yours can catch the error and go on. When the mission is over, m2pem
ends, and with it the heartbeats of the ground station: a vehicle that stays in the air then returns
by its own ground station failsafe.

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

SET = """
The fleet says `failsafe: {vehicle.failsafe}`, the vehicle has {parameters}.
"""

HEAD = """
| Phase | The vehicle | The mission | Operators read |
|---|---|---|---|
"""

ROUTINE = re.compile(
    r"^(Start|End|Task\d|r1 of \w+ started|Task\d: \w+ begins .*|r1 completed"
    r"|Task\d: \w+ ends .*: succeeded|Task\d: error .*|r1 failed: .*"
    r"|WARNING m2pem.arbiter: \w+: nothing happens when its battery is low.*"
    r"|WARNING m2pem.arbiter: \w+: fleet says .*"
    r"|WARNING m2pem.arbiter: \w+ is ready|.*waits until it is ready: EKF: .*"
    r"|.*the vehicle has not reported its position yet)$"
)
"""Lines of every mission; how it ends has a column of its own."""


def page() -> str:
    """The page."""
    return "".join(_page())


def _page() -> Iterator[str]:
    yield PAGE
    kept = json.loads(FILE.read_text(encoding="utf-8"))
    for vehicle in VEHICLES.values():
        if vehicle.name not in kept:
            continue
        parameters = ", ".join(f"`{key}` {value:g}" for key, value in vehicle.parameters.items())
        yield f"\n## {vehicle.title}\n{SET.format(vehicle=vehicle, parameters=parameters)}"
        for name, phases in kept[vehicle.name].items():
            yield f"\n### {vehicle.title}: {name}\n{HEAD}"
            for phase in vehicle.phases_of(vehicle.failsafes[name]):
                if phase in phases:
                    seen = phases[phase]
                    yield f"| {phase} | {_vehicle(seen)} | {_mission(seen)} | {_read(seen)} |\n"


def _vehicle(seen: dict[str, Any]) -> str:
    modes = ", ".join(seen["modes"]) or "changes no mode"
    end = "stands, armed" if seen.get("stands") else "stays armed"
    if seen["disarmed"]:
        end = "disarmed at home" if seen["at home"] else "disarmed elsewhere"
    texts = "".join(f"<br>*{text}*" for text in seen["texts"])
    return f"{modes}; {end}{texts}"


def _mission(seen: dict[str, Any]) -> str:
    if seen["status"] is None:
        return "waits"
    for line in reversed(seen["said"]):
        if match := re.search(r"ends (\w+): (failed|lost), (.*)$", line):
            return f"`{match[1]}` {match[2]}: {match[3]}"
    return "completed" if seen["status"] == 0 else "failed"


def _read(seen: dict[str, Any]) -> str:
    lines = (line for line in seen["said"] if not ROUTINE.match(line))
    plain = (re.sub(r"^(WARNING m2pem\.\w+: |m2pem: r1: )", "", line) for line in lines)
    plain = (
        re.sub(r"\. Nothing commands it now: .*", "; what may be done", line) for line in plain
    )
    return "<br>".join(dict.fromkeys(line for line in plain if "ends" not in line)) or "-"
