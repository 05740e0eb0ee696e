"""The command `m2pem sim ros`: simulated vehicles, until Ctrl-C."""

import asyncio
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import Any

import click

from m2pem.api import GeoPosition
from m2pem.api.command_options import (
    FaultOption,
    PositionOption,
    TextOption,
    read_position,
    read_setting,
    speed_option,
)
from m2pem.api.faults import FaultError, PlannedFault
from m2pem.api.foreground import interrupted, plan_typed_faults, until_interrupted
from m2pem.errors import PluginError
from m2pem_plugin_ros.frames import Origin, to_local
from m2pem_plugin_ros.loopback import keep_on_loopback
from m2pem_plugin_ros.settings import DriverName
from m2pem_plugin_ros.simulator.faults import DRIVER_TEXTS, GRAMMAR, FaultTarget
from m2pem_plugin_ros.simulator.fleet import make_default_vehicles
from m2pem_plugin_ros.simulator.sensors import Target
from m2pem_plugin_ros.simulator.specification import FORT, SettingError, VehicleSpec

MOST = 100
"""Vehicles in one process; 20 are moderate, see docs/ros-simulation.md."""


def _read_target(text: str) -> tuple[str, GeoPosition]:
    """Read TYPE@LAT,LON, something that a detector can find."""
    kind, at, place = text.partition("@")
    if not (kind.strip() and at):
        raise ValueError(f"{text!r} is not TYPE@LAT,LON, such as gpr@38.1,-77.3")
    return kind.strip(), read_position(place)


@click.command()
@click.option(
    "--fleet",
    "fleet_file",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Simulate what this fleet file has of arbiter ros, marked `sitl: true`.",
)
@click.option("--ground", type=click.IntRange(0, MOST), help="[default: 1 without --fleet]")
@click.option("--surface", type=click.IntRange(0, MOST), default=0, show_default=True)
@click.option(
    "--driver",
    type=click.Choice([str(each) for each in DriverName]),
    help="How vehicles without a fleet are reached.  [default: m2pem]",
)
@click.option(
    "--home", type=PositionOption(), help="Where the first vehicle without a fleet is at first."
)
@click.option(
    "--target",
    "targets",
    type=TextOption("type@lat,lon", _read_target),
    multiple=True,
    help="Something that detectors of vehicles without a fleet find, such as gpr@38.1,-77.3.",
)
@speed_option(20)
@click.option(
    "--domain-id",
    type=click.IntRange(0, 101),
    help="The ROS domain of vehicles whose fleet does not say.  [default: ROS_DOMAIN_ID]",
)
@click.option(
    "--set",
    "words",
    type=TextOption("key=value", partial(read_setting, example="max_speed=3 m/s")),
    multiple=True,
    help="Of all vehicles, such as max_speed=3 m/s. May be given more than once.",
)
@click.option(
    "--fault",
    "faults",
    type=FaultOption(GRAMMAR),
    multiple=True,
    help='What goes wrong, such as "evsg1: silent at 20 s for 5 s": [VEHICLES:] ACTION '
    "[at SECONDS s] [for SECONDS s]. May be given more than once; also a line of standard input.",
)
def ros(
    fleet_file: Path | None,
    ground: int | None,
    surface: int,
    driver: str | None,
    home: GeoPosition | None,
    targets: tuple[tuple[str, GeoPosition], ...],
    speed: float,
    domain_id: int | None,
    words: tuple[tuple[str, str], ...],
    faults: tuple[PlannedFault[FaultTarget], ...],
) -> None:
    """Simulate ROS vehicles, on 127.0.0.1 alone, until Ctrl-C.

    Example: m2pem sim ros --ground 4 --speed 10
    """
    said = dict(words)
    try:
        if fleet_file is not None:
            if ground is not None or surface or driver or home or targets:
                raise click.UsageError(
                    "--fleet says which vehicles there are, of which driver and where: leave "
                    "--ground, --surface, --driver, --home and --target out"
                )
            specs = _of_fleet(fleet_file, said)
        else:
            counts = [1 if ground is None and not surface else ground or 0, surface]
            domains = ["ground"] * counts[0] + ["surface"] * counts[1]
            name = DriverName(driver or DriverName.NODE)
            specs = _crew(domains, name, home or FORT, targets, said)
    except SettingError as error:
        raise click.UsageError(f"--set {error}") from error
    keep_on_loopback()
    try:
        asyncio.run(_run(specs, speed, domain_id, faults))
    except (FaultError, ValueError) as error:
        raise click.UsageError(str(error)) from error


def _of_fleet(file: Path, words: dict[str, Any]) -> list[VehicleSpec]:
    from m2pem import load_fleet  # noqa: PLC0415  # readers of files are needed here alone
    from m2pem_plugin_ros.simulator.fleet import ARBITER, read_specs  # noqa: PLC0415

    fleet = load_fleet(file)
    try:
        specs = list(read_specs(fleet, words))
    except PluginError as error:
        raise click.UsageError(f"{file}: {error}") from error
    if not specs:
        raise click.UsageError(
            f"{file} has nothing to simulate: no vehicle has `arbiter: {ARBITER}` and `sitl: true`"
        )
    return specs


def _crew(
    domains: list[str],
    driver: DriverName,
    home: GeoPosition,
    targets: Iterable[tuple[str, GeoPosition]],
    words: dict[str, Any],
) -> list[VehicleSpec]:
    if not domains:
        raise click.UsageError("no vehicles: say how many, such as --ground 2")
    if "home" in words:
        raise click.UsageError("--set home: say --home, which places vehicles beside each other")
    origin: Origin = (home.latitude_deg, home.longitude_deg, home.altitude_m)
    planted = [
        Target(
            kind, *to_local(GeoPosition(at.latitude_deg, at.longitude_deg, origin[2]), origin)[:2]
        )
        for kind, at in targets
    ]
    return list(make_default_vehicles(domains, driver, origin, planted, words))


async def _run(
    specs: list[VehicleSpec],
    speed: float,
    domain_id: int | None,
    faults: Iterable[PlannedFault[FaultTarget]],
) -> None:
    from m2pem_plugin_ros.simulator.simulation import Simulation  # noqa: PLC0415  # imports rclpy

    stop = interrupted()
    async with Simulation(specs, speed=speed, domain_id=domain_id, faults=faults) as vehicles:
        for spec in specs:
            click.echo(_line(spec))
        click.echo("ready")
        typed = plan_typed_faults(GRAMMAR, vehicles.plan)
        await until_interrupted(stop, vehicles.stopped(), typed)


def _line(spec: VehicleSpec) -> str:
    from m2pem_plugin_ros.simulator.vehicle import Vehicle  # noqa: PLC0415

    place = Vehicle(spec).position
    where = f"{place.latitude_deg:.6f},{place.longitude_deg:.6f}"
    what = DRIVER_TEXTS[spec.settings.driver].removeprefix("an ").removeprefix("a ")
    return f"{spec.name}: {spec.settings.namespace or '/'}, {what}, at {where}"
