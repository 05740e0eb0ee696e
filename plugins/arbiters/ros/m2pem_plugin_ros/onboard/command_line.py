"""The command `m2pem ros onboard`: the m2pem node of a vehicle, until Ctrl-C."""

import asyncio
from pathlib import Path
from typing import Any

import click

from m2pem.api import Connection, EpochFence, GeoPosition, ResourceId
from m2pem.api.command_options import PositionOption, TextOption, read_setting
from m2pem.errors import PluginError
from m2pem_plugin_ros.loopback import keep_on_loopback
from m2pem_plugin_ros.settings import DriverName, read_settings

_FLAGS = {"true": True, "false": False}


def _read_setting(text: str) -> tuple[tuple[str, ...], str | bool]:
    """Read KEY=VALUE. A key of an inner map has a dot: bounds.speed=1.5 m/s. Return the path of
    keys, and the value."""
    example = "bounds.speed=1.5 m/s"
    key, said = read_setting(text, example)
    path = tuple(key.split("."))
    if not all(path) or len(path) > 2:
        raise ValueError(f"{text!r} is not KEY=VALUE, such as {example}")
    return path, _FLAGS.get(said, said)


@click.command()
@click.option("--vehicle", required=True, help="The vehicle's name in the fleet.")
@click.option("--namespace", help="The namespace of its topics.  [default: / and its name]")
@click.option(
    "--driver",
    type=click.Choice([DriverName.BASE.value, DriverName.NAV2.value]),
    default=DriverName.BASE.value,
    show_default=True,
    help="The driver: velocities from m2pem, or Nav2.",
)
@click.option(
    "--domain", type=click.Choice(["ground", "surface"]), default="ground", show_default=True
)
@click.option(
    "--origin",
    type=PositionOption(),
    required=True,
    help="The origin of the frame map of its odometry: that of the fleet.",
)
@click.option(
    "--domain-id", type=click.IntRange(0, 232), help="The ROS domain.  [default: ROS_DOMAIN_ID]"
)
@click.option(
    "--set",
    "words",
    type=TextOption("key=value", _read_setting),
    multiple=True,
    help="A key of a connection in a fleet, such as bounds.speed=1.5 m/s or odom_frame=odom. "
    "May be given more than once.",
)
@click.option(
    "--epochs",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Keep in this file which executive has driven each run, so that an earlier one is refused "
    "after a restart of the node, too.",
)
@click.option(
    "--autostart/--no-autostart",
    default=True,
    show_default=True,
    help="Configure and activate the managed node at once, or leave that to ROS.",
)
@click.option("--loopback", is_flag=True, help="Keep DDS on 127.0.0.1.")
def onboard(
    vehicle: str,
    namespace: str | None,
    driver: str,
    domain: str,
    origin: GeoPosition,
    domain_id: int | None,
    words: tuple[tuple[tuple[str, ...], str | bool], ...],
    epochs: Path | None,
    autostart: bool,
    loopback: bool,
) -> None:
    """Run the m2pem node of a vehicle on board until Ctrl-C, which stops the vehicle.

    It is a managed node of ROS. What follows --ros-args is for ROS: -r, -p, --params-file.

    Example: m2pem ros onboard --vehicle evsg1 --origin 38.1075,-77.3192,60
    """
    given: dict[str, Any] = {"namespace": namespace or f"/{vehicle}", "driver": driver}
    if domain_id is not None:
        given["domain_id"] = domain_id
    for path, value in words:
        _put(given, path, value)
    connection = Connection(ResourceId(vehicle), domain, given)
    try:
        settings = read_settings({connection.resource: connection})[connection.resource]
    except PluginError as error:
        raise click.UsageError(str(error)) from error
    if settings.driver is DriverName.NODE:
        raise click.UsageError("this is the m2pem node; its driver must be base or nav2")
    if loopback:
        keep_on_loopback()
    from m2pem_plugin_ros.onboard.program import OnboardSetup, serve  # noqa: PLC0415  # rclpy

    at = (origin.latitude_deg, origin.longitude_deg, origin.altitude_m)
    setup = OnboardSetup(connection, settings, at, EpochFence(epochs), autostart)
    asyncio.run(serve(setup, click.echo))


def _put(given: dict[str, Any], path: tuple[str, ...], value: str | bool) -> None:
    inner = given if len(path) == 1 else given.setdefault(path[0], {})
    if not isinstance(inner, dict):
        raise click.UsageError(f"--set {'.'.join(path)}: '{path[0]}' has a value of its own")
    inner[path[-1]] = value
