"""With which command, environment and files a program of an autopilot is started.

Sources: `arducopter --help`; ROMFS/px4fmu_common/init.d-posix/rcS of PX4.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from m2pem_plugin_mavlink.sitl.frames import Frame
from m2pem_plugin_mavlink.sitl.programs import ArduPilotProgram, Px4Program

SERIALS = (0, 1, 2, 5, 6, 7, 8)
"""The serial ports of ArduPilot that would wait for connections from everywhere without an option
of their own: SERIAL3 and SERIAL4 have the simulated GPS receivers. The first ones speak MAVLink."""

MAVLINK_SERIALS = 3
OWN_PARAMETERS = "m2pem.parm"


@dataclass(frozen=True, slots=True)
class Start:
    """Where a vehicle stands at first: WGS-84 degrees, metres above mean sea level, degrees from
    true north, clockwise. `speed`: simulated seconds per second."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float
    heading_deg: float = 0.0
    speed: float = 1.0


@dataclass(frozen=True, slots=True)
class Launch:
    """How one program is started, in a folder of its own. `files`: what that has at first, by name;
    `environment`: what is added to that of m2pem."""

    name: str
    command: tuple[str, ...]
    environment: Mapping[str, str] = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=dict)


def ardupilot_launch(
    name: str,
    program: ArduPilotProgram,
    frame: Frame,
    start: Start,
    *,
    instance: int,
    system_id: int,
    ports: Sequence[int],
    parameters: Mapping[str, float] | None = None,
) -> Launch:
    """Start ArduPilot, which sends to `ports` of 127.0.0.1 (three at most), and waits for no
    connection. `instance` must differ between programs of a machine. `parameters` go before those
    of the program."""
    files = {file.name: file.read_text(encoding="utf-8") for file in program.parameters}
    if parameters:
        files[OWN_PARAMETERS] = "".join(
            f"{parameter} {value:g}\n" for parameter, value in parameters.items()
        )
    home = (start.latitude_deg, start.longitude_deg, start.altitude_m, start.heading_deg)
    command = (
        *(str(program.path), "-w", "--model", frame.name, "--speedup", f"{start.speed:g}"),
        *(f"-I{instance}", "--sysid", str(system_id)),
        *("--home", ",".join(f"{value:.10g}" for value in home)),
        *("--defaults", ",".join(files)),
        *_serials(ports),
    )
    return Launch(name, command, {}, files)


def _serials(ports: Sequence[int]) -> Iterator[str]:
    for number, serial in enumerate(SERIALS):
        to = f"udpclient:127.0.0.1:{ports[number]}" if number < len(ports) else f"none:{serial}"
        yield from (f"--serial{serial}", to)


def px4_launch(
    name: str,
    program: Px4Program,
    model: str,
    start: Start,
    *,
    instance: int,
    folder: Path,
    parameters: Mapping[str, float] | None = None,
) -> Launch:
    """Start PX4 with its own simulation (SIH). Its system id is `instance` + 1, and it sends to
    `px4_port(instance)`; `folder`: where it is started."""
    environment = {
        "PX4_SIMULATOR": "sihsim",
        "PX4_SIM_MODEL": model,
        "PX4_SIM_SPEED_FACTOR": f"{start.speed:g}",
        "PX4_HOME_LAT": f"{start.latitude_deg:.10g}",
        "PX4_HOME_LON": f"{start.longitude_deg:.10g}",
        "PX4_HOME_ALT": f"{start.altitude_m:.10g}",
        "PX4_HOME_YAW": f"{start.heading_deg:.10g}",
        **{f"PX4_PARAM_{key}": f"{value:g}" for key, value in (parameters or {}).items()},
    }
    command = (str(program.path), "-d", "-i", str(instance), "-w", str(folder), str(program.etc))
    return Launch(name, command, environment)


def px4_port(instance: int) -> int:
    """Where an instance of PX4 sends for programs such as m2pem (its API link)."""
    return 14540 + instance if instance < 10 else 14549
