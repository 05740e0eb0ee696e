"""`m2pem mavlink signing`: keys are made, and given to vehicles or taken from them."""

import asyncio
from collections.abc import Callable, Coroutine
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from m2pem import load_fleet
from m2pem.api import Connection, ResourceId
from m2pem.errors import PluginError
from m2pem.journal import default_url, file_of
from m2pem_plugin_mavlink.protocol.url import SerialUrl, parse_url
from m2pem_plugin_mavlink.settings import Settings, read_settings
from m2pem_plugin_mavlink.signing.key_file import write_new_key
from m2pem_plugin_mavlink.signing.policy import SigningPolicy
from m2pem_plugin_mavlink.signing.setup import SetupError, remove_key, set_up_key

_FILE = click.Path(exists=True, dir_okay=False, path_type=Path)
_LOOPBACK = ("127.", "::1", "localhost")


def _options(command: Callable[..., None]) -> Callable[..., None]:
    for option in (
        click.argument("vehicle"),
        click.option("--fleet", "fleet_file", required=True, type=_FILE, help="The fleet file."),
        click.option(
            "--journal",
            type=click.Path(dir_okay=False, path_type=Path),
            help="The executive's journal: timestamps are kept beside it.  [default: the user's "
            "own journal]",
        ),
        click.option("--yes", is_flag=True, help="Do not ask."),
    ):
        command = option(command)
    return command


@click.command()
@_options
@click.option(
    "--old-key",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="The key that the vehicle has, if it has one.",
)
def setup(
    vehicle: str, fleet_file: Path, journal: Path | None, old_key: Path | None, yes: bool
) -> None:
    """Give a vehicle the signing key that its fleet file names, over its own link.

    No executive may command the vehicle meanwhile, and it must be disarmed. Whoever reads the link
    reads the key: use a USB cable, or the old key over a link that no other program can read.

    Example: m2pem mavlink signing setup --fleet fleet.yaml uav1
    """
    settings, policy = _signed(fleet_file, vehicle, journal)
    _confirm(settings, f"Send the key of {policy.key} to {vehicle}?", yes)
    before = None if old_key is None else replace(policy, key=old_key.absolute())
    _run(set_up_key(settings, policy, before), vehicle)
    click.echo(f"{vehicle} signs its messages with the key of {policy.key}")


@click.command()
@_options
def remove(vehicle: str, fleet_file: Path, journal: Path | None, yes: bool) -> None:
    """Turn the signing of a vehicle off: it then obeys everybody who reaches it.

    Example: m2pem mavlink signing remove --fleet fleet.yaml uav1
    """
    settings, policy = _signed(fleet_file, vehicle, journal)
    if not yes:
        click.confirm(f"Turn the signing of {vehicle} off?", abort=True, err=True)
    _run(remove_key(settings, policy), vehicle)
    click.echo(
        f"{vehicle} no longer signs: take `signing` of {vehicle} out of {fleet_file}, or it is "
        "not received"
    )


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
def keygen(file: Path) -> None:
    """Write a new signing key to FILE, which only you can read.

    It is a passphrase, which QGroundControl and MAVProxy take, too.

    Example: m2pem mavlink signing keygen ~/uav1.key
    """
    write_new_key(file)
    click.echo(f"{file}: `signing: {{key: {file.absolute()}}}` in the connection of a vehicle")


def _signed(fleet_file: Path, vehicle: str, journal: Path | None) -> tuple[Settings, SigningPolicy]:
    fleet = load_fleet(fleet_file)
    found = fleet.vehicles.get(ResourceId(vehicle))
    if found is None or found.arbiter != "mavlink":
        names = [str(each.id) for each in fleet.vehicles.values() if each.arbiter == "mavlink"]
        raise click.UsageError(
            f"{fleet_file} has no MAVLink vehicle {vehicle!r}; it has: {', '.join(names) or 'none'}"
        )
    connection = Connection(found.id, found.domain.value, found.settings)
    own = journal.absolute() if journal is not None else file_of(default_url())
    folder = None if own is None else own.parent
    settings = read_settings({found.id: connection}, folder)[found.id]
    if settings.signing is None:
        raise click.UsageError(
            f"{fleet_file}: {vehicle}: connection.signing is missing, such as "
            "`signing: {key: /etc/m2pem/uav1.key}`"
        )
    return settings, settings.signing


def _confirm(settings: Settings, question: str, yes: bool) -> None:
    for url in settings.urls:
        parsed = parse_url(url)
        if not isinstance(parsed, SerialUrl) and not parsed.host.startswith(_LOOPBACK):
            click.echo(
                f"Warning: every program that reads what is sent over {url} gets the key. Use "
                "a serial line or USB, or a network that no other program can read.",
                err=True,
            )
    if not yes:
        click.confirm(question, abort=True, err=True)


def _run(work: Coroutine[Any, Any, None], vehicle: str) -> None:
    try:
        asyncio.run(work)
    except (SetupError, PluginError) as error:
        raise click.ClickException(f"{vehicle}: {error}") from error
