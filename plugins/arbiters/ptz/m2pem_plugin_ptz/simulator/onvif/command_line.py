"""The command `m2pem sim onvif`: a simulated camera, until Ctrl-C."""

import asyncio
import re
from pathlib import Path

import click

from m2pem.api.command_options import DurationOption, FaultOption, TextOption
from m2pem.api.faults import PlannedFault
from m2pem.api.foreground import interrupted
from m2pem.errors import PluginError
from m2pem_plugin_ptz.drivers.onvif.settings import read_credentials
from m2pem_plugin_ptz.simulator.onvif.camera import Account, CameraSpec
from m2pem_plugin_ptz.simulator.onvif.faults import GRAMMAR, Faults
from m2pem_plugin_ptz.simulator.onvif.server import OnvifServer

Address = tuple[str, int]


def _read_address(text: str) -> Address:
    """Read HOST:PORT."""
    match = re.fullmatch(r"(?:http://)?([^:/]+|\[[^]]+\]):(\d{1,5})/?", text)
    if match is None or int(match[2]) > 65535:
        raise ValueError(f"{text!r} is not HOST:PORT, such as 127.0.0.1:8081")
    host = match[1].strip("[]")
    return ("127.0.0.1" if host == "localhost" else host), int(match[2])


def _read_range(text: str) -> tuple[float, float]:
    """Read LOW,HIGH in degrees."""
    try:
        low, high = map(float, text.split(","))
    except ValueError:
        raise ValueError(f"{text!r} is not LOW,HIGH in degrees, such as -170,170") from None
    if not -360 <= low < high <= 360:
        raise ValueError(f"{text!r}: it goes up from LOW to HIGH, within -360 to 360")
    return low, high


_RANGE = TextOption("low,high", _read_range)


@click.command()
@click.option(
    "--listen",
    type=TextOption("host:port", _read_address),
    default="127.0.0.1:8081",
    show_default=True,
    help="Where it is reached; port 0: any that is free.",
)
@click.option(
    "--credentials",
    type=click.Path(path_type=Path, dir_okay=False),
    help="The file with the user and the password that it takes.  [default: it takes everybody]",
)
@click.option("--pan", type=_RANGE, default="-180,180", show_default=True, help="In degrees.")
@click.option("--tilt", type=_RANGE, default="-90,30", show_default=True, help="In degrees.")
@click.option("--endless", is_flag=True, help="It pans all round, without stops.")
@click.option("--zoom-max", type=click.FloatRange(1.1, 100), default=20.0, show_default=True)
@click.option(
    "--rate",
    "rate_deg_s",
    type=click.FloatRange(0.1, 1000),
    default=100.0,
    show_default=True,
    help="How quickly it turns, in degrees per second.",
)
@click.option("--generic", is_flag=True, help="It counts from -1 to 1 only, not in degrees.")
@click.option("--no-recording", is_flag=True, help="It has no recording control.")
@click.option(
    "--latency",
    "latency_s",
    type=DurationOption(),
    default="50ms",
    show_default=True,
    help="Of answers.",
)
@click.option(
    "--clock",
    "skew_s",
    type=DurationOption(negative=True),
    default="0s",
    help="How far its clock is ahead.",
)
@click.option(
    "--fault",
    "faults",
    type=FaultOption(GRAMMAR),
    multiple=True,
    help='What goes wrong, such as "silent at 10 s for 5 s": ACTION [at SECONDS s] '
    "[for SECONDS s]. May be given more than once.",
)
def onvif(
    listen: Address,
    credentials: Path | None,
    pan: tuple[float, float],
    tilt: tuple[float, float],
    endless: bool,
    zoom_max: float,
    rate_deg_s: float,
    generic: bool,
    no_recording: bool,
    latency_s: float,
    skew_s: float,
    faults: tuple[PlannedFault[Faults], ...],
) -> None:
    """Simulate a camera that turns, zooms and speaks ONVIF over HTTP, until Ctrl-C.

    Example: m2pem sim onvif --listen 127.0.0.1:8081 --credentials camera.yaml
    """
    try:
        account = None if credentials is None else read_credentials(credentials)
    except PluginError as error:
        raise click.UsageError(str(error)) from error
    spec = CameraSpec(
        pan_deg=pan,
        tilt_deg=tilt,
        zoom_max=zoom_max,
        rate_deg_s=rate_deg_s,
        acceleration_deg_s2=3 * rate_deg_s,
        endless=endless,
        degrees=not generic,
        recording=not no_recording,
        account=None if account is None else Account(account.user, account.password),
        skew_s=skew_s,
        latency_s=latency_s,
    )
    try:
        asyncio.run(_run(OnvifServer(spec, host=listen[0], port=listen[1]), faults))
    except OSError as error:
        host, port = listen
        raise click.ClickException(f"cannot listen at {host}:{port}: {error.strerror}") from error


async def _run(server: OnvifServer, faults: tuple[PlannedFault[Faults], ...]) -> None:
    stop = interrupted()
    async with server:
        click.echo(f"camera  http://{server.host}:{server.port}/onvif/device_service")
        for fault in faults:
            server.faults.plan(fault)
        await stop.wait()
