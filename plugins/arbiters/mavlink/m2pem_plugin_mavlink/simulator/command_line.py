"""`m2pem sim mavlink`: simulated vehicles, until Ctrl-C."""

import asyncio
import difflib
import math
from collections.abc import Iterable, Iterator
from dataclasses import astuple, replace
from pathlib import Path
from urllib.parse import urlsplit

import click

from m2pem.api import GeoPosition
from m2pem.api.command_options import DurationOption, FaultOption, PositionOption
from m2pem.api.faults import PlannedFault
from m2pem.api.foreground import interrupted
from m2pem_plugin_mavlink.signing.key_file import SigningError, read_key
from m2pem_plugin_mavlink.simulator.autopilot import FIRMWARES
from m2pem_plugin_mavlink.simulator.faults import GRAMMAR, Faults
from m2pem_plugin_mavlink.simulator.geometry import LocalFrame, Location, Point
from m2pem_plugin_mavlink.simulator.server import Address
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import ZURICH, Kind, VehicleSpec

APART_M = 5.0
"""Vehicles stand in a row, so far from each other."""
MOST_SYSTEMS = 250
"""Ground stations have the numbers above."""


class UdpAddress(click.ParamType):  # type: ignore[type-arg]  # older clicks have it bare
    """A URL such as udp://127.0.0.1:14550."""

    name = "url"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> Address:
        """Host and port."""
        try:
            url = urlsplit(str(value))
            if url.scheme in ("udp", "udpin", "udpout") and url.hostname and url.port:
                host = "127.0.0.1" if url.hostname == "localhost" else url.hostname
                return host, url.port
        except ValueError:
            pass
        self.fail(f"{value!r} is not a UDP address such as udp://127.0.0.1:14550", param, ctx)


class Parameter(click.ParamType):  # type: ignore[type-arg]  # older clicks have it bare
    """NAME=VALUE."""

    name = "name=value"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[str, float]:
        """The parameter's name and number."""
        if isinstance(value, tuple):
            return value
        name, equals, number = str(value).partition("=")
        try:
            if name and equals and math.isfinite(float(number)):
                return name.strip(), float(number)
        except ValueError:
            pass
        self.fail(f"{value!r} is not NAME=VALUE, such as FS_GCS_ENABLE=1", param, ctx)


@click.command()
@click.option("--copters", type=click.IntRange(0), help="[default: 1 if nothing else is asked for]")
@click.option("--rovers", type=click.IntRange(0), default=0, show_default=True)
@click.option("--planes", type=click.IntRange(0), default=0, show_default=True)
@click.option("--boats", type=click.IntRange(0), default=0, show_default=True)
@click.option(
    "--speed",
    type=click.FloatRange(0.1, 100),
    default=1.0,
    show_default=True,
    help="Simulated seconds per second.",
)
@click.option(
    "--to",
    type=UdpAddress(),
    default="udp://127.0.0.1:14550",
    show_default=True,
    help="The ground station to which all vehicles send.",
)
@click.option(
    "--listen",
    type=UdpAddress(),
    help="Wait here to be spoken to instead; each further vehicle has the next port.",
)
@click.option(
    "--home",
    type=PositionOption(),
    help="Where the first vehicle is at first.  [default: Zurich]",
)
@click.option(
    "--ekf",
    "estimator_s",
    type=DurationOption(),
    default="41s",
    show_default=True,
    help="Until vehicles know where they are, in simulated time.",
)
@click.option("--first-system", type=click.IntRange(1, MOST_SYSTEMS), default=1, show_default=True)
@click.option(
    "--firmware",
    type=click.Choice([*FIRMWARES]),
    default="ardupilot",
    show_default=True,
    help="As which autopilot all vehicles speak.",
)
@click.option(
    "--set",
    "parameters",
    type=Parameter(),
    multiple=True,
    help="A parameter of all vehicles, such as FS_GCS_ENABLE=1. May be given more than once.",
)
@click.option("--camera", is_flag=True, help="All vehicles have a camera (component 100).")
@click.option("--gimbal", is_flag=True, help="All vehicles have a gimbal, not copters alone.")
@click.option(
    "--signing-key",
    "key_file",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="All vehicles sign their frames with the key in this file, and ignore others.",
)
@click.option(
    "--fault",
    "faults",
    type=FaultOption(GRAMMAR),
    multiple=True,
    help='What goes wrong, such as "1: cut link at 40 s for 600 s": [VEHICLES:] ACTION '
    "[at SECONDS s after it was first armed] [for SECONDS s]. May be given more than once.",
)
def mavlink(
    copters: int | None,
    rovers: int,
    planes: int,
    boats: int,
    speed: float,
    to: Address,
    listen: Address | None,
    home: GeoPosition | None,
    estimator_s: float,
    first_system: int,
    firmware: str,
    parameters: tuple[tuple[str, float], ...],
    camera: bool,
    gimbal: bool,
    key_file: Path | None,
    faults: tuple[PlannedFault[Faults], ...],
) -> None:
    """Simulate MAVLink vehicles over UDP, as ArduPilot or PX4 speaks, until Ctrl-C.

    Example: m2pem sim mavlink --copters 2 --rovers 1 --speed 10
    """
    others = [Kind.ROVER] * rovers + [Kind.PLANE] * planes + [Kind.BOAT] * boats
    if copters is None:
        copters = 0 if others else 1
    kinds = [Kind.COPTER] * copters + others
    if not kinds:
        raise click.UsageError("no vehicles: say how many, such as --copters 2")
    if first_system + len(kinds) - 1 > MOST_SYSTEMS:
        raise click.UsageError(f"system ids go to {MOST_SYSTEMS}: these are too many vehicles")
    like = VehicleSpec(
        home=ZURICH if home is None else Location(*astuple(home)),
        estimator_s=estimator_s,
        firmware=firmware,
        parameters=dict(parameters),
        camera=camera,
        gimbal=True if gimbal else None,
        signing_key=_key(key_file, firmware),
    )
    try:
        specs = list(_specs(kinds, like, first_system))
        simulator = Simulator(specs, speed=speed, to=None if listen else to, listen=listen)
        simulator.plan(faults)
        _check_parameters(simulator, like.parameters)
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    try:
        asyncio.run(_run(simulator))
    except OSError as error:
        raise click.ClickException(f"cannot open a vehicle's UDP socket: {error}") from error


def _key(file: Path | None, firmware: str) -> bytes | None:
    if file is None:
        return None
    if firmware != "ardupilot":
        raise click.UsageError("--signing-key is for vehicles of ArduPilot")
    try:
        return read_key(file)
    except SigningError as error:
        raise click.UsageError(f"--signing-key: {error}") from error


def _specs(kinds: list[Kind], like: VehicleSpec, first_system: int) -> Iterator[VehicleSpec]:
    frame = LocalFrame(like.home)
    for number, kind in enumerate(kinds):
        place = frame.to_location(Point(0.0, number * APART_M, 0.0))
        yield replace(like, kind=kind, system=first_system + number, home=place)


def _check_parameters(simulator: Simulator, names: Iterable[str]) -> None:
    """A name of no vehicle is a mistake; of some of them, not: a rover has less than a copter."""
    known = {name for vehicle in simulator for name in vehicle.autopilot.firmware.parameters()}
    for name in names:
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            hint = f"; did you mean {near[0]}?" if near else ""
            raise ValueError(f"--set {name}: no simulated vehicle has that parameter{hint}")


async def _run(simulator: Simulator) -> None:
    stop = interrupted()
    async with simulator as vehicles:
        for vehicle in vehicles:
            spec, (host, port) = vehicle.autopilot.spec, vehicle.address
            click.echo(f"system {spec.system}  {spec.kind:<6}  udp://{host}:{port}")
        waiting = [asyncio.ensure_future(each) for each in (vehicles.stopped(), stop.wait())]
        await asyncio.wait(waiting, return_when=asyncio.FIRST_COMPLETED)
        if waiting[0].done():
            waiting[0].result()
        for each in waiting:
            each.cancel()
        await asyncio.gather(*waiting, return_exceptions=True)
