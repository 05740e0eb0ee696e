"""`m2pem doctor`: what of this host is right for missions, and what to do about the rest."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import click

from m2pem.cli.options import as_json, example, fleet_option, format_option, journal_option

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from m2pem.api.health import HealthCheck

ANSWERED_WITHIN_S = 5.0

COLOURS = {"ok": "green", "warning": "yellow", "error": "red"}


@click.command(epilog=example("m2pem doctor --fleet fleet_configs/vignette1.yaml"))
@fleet_option(required=False)
@click.option(
    "--running", is_flag=True, help="Ask the executives that serve the journal instead of the host."
)
@journal_option
@format_option
def doctor(fleet_file: str | None, running: bool, journal: str | None, output: str) -> int:
    """Check this host: what is right, and what to do about the rest.

    With a fleet also what that one needs. Nothing is sent to a vehicle. Ends with 0 if nothing is
    an error, and else with 1.
    """
    if running:
        if fleet_file is not None:
            raise click.UsageError("--running asks an executive, which has a fleet: omit --fleet")
        return _show(_running(journal), output)
    from m2pem.scripting.sources import DEFAULT_FLEET

    if fleet_file == DEFAULT_FLEET:
        raise click.UsageError(f"{DEFAULT_FLEET!r} is made up from a mission; name a fleet file")
    return _show(_host(fleet_file, journal), output)


def _host(fleet_file: str | None, journal: str | None) -> "list[HealthCheck]":
    from m2pem.cli.host_checks import check_fleet, check_host
    from m2pem.plugins import PluginManager

    plugins = PluginManager()
    checks = list(check_host(plugins, journal))
    fleet = None
    if fleet_file is not None:
        of_fleet, fleet = check_fleet(fleet_file, plugins, journal)
        checks += of_fleet
        if fleet is None:
            return checks
    return checks + plugins.check_host(fleet)


def _running(journal: str | None) -> "list[HealthCheck]":
    """Return what the executives of a journal say of themselves."""
    import msgspec

    from m2pem.api.health import HealthCheck, HealthStatus
    from m2pem.cli.run_control import elsewhere, journal_file
    from m2pem.control_socket.client import ask
    from m2pem.control_socket.paths import live_sockets
    from m2pem.errors import M2pemError

    path = journal_file(journal)
    checks: list[HealthCheck] = []
    for socket in live_sockets(path):
        name = f"executive {socket.stem}"
        try:
            said = msgspec.convert(
                ask(socket, "health", timeout_s=ANSWERED_WITHIN_S), list[HealthCheck]
            )
        except (M2pemError, msgspec.ValidationError) as error:
            remedy = "it may be blocked by a plugin: use the vehicles' own stop if they must stop"
            checks.append(HealthCheck(name, HealthStatus.ERROR, str(error), remedy))
        else:
            checks += [replace(check, name=f"{name}: {check.name}") for check in said]
            checks += _standbys_at(socket, name)
    if not checks:
        why = f"none serves {path} here"
        remedy = elsewhere(journal) or "m2pem serve starts one"
        checks.append(HealthCheck("executive", HealthStatus.ERROR, why, remedy))
    return checks


def _standbys_at(socket: "Path", name: str) -> "Iterator[HealthCheck]":
    """Say who stands by for an executive."""
    import msgspec

    from m2pem.api.health import ExecutiveAddress, HealthCheck, HealthStatus
    from m2pem.control_socket.client import ask
    from m2pem.errors import M2pemError

    try:
        said = ask(socket, "standbys", timeout_s=ANSWERED_WITHIN_S)
        found = msgspec.convert(said, list[ExecutiveAddress])
    except (M2pemError, msgspec.ValidationError):
        return  # the check of its journal says it
    who = "; ".join(map(str, found))
    text = f"{who} stands by" if who else "no standby (m2pem serve --standby)"
    yield HealthCheck(f"{name}: standby", HealthStatus.OK, text)


def _show(checks: "Sequence[HealthCheck]", output: str) -> int:
    from m2pem.findings import escaped

    errors = sum(check.status == "error" for check in checks)
    warnings = sum(check.status == "warning" for check in checks)
    if output == "json":
        click.echo(as_json({"ok": not errors, "checks": checks}))
        return 1 if errors else 0
    width = max(len(check.name) for check in checks)
    for check in checks:
        status = click.style(f"{check.status.value:<7}", fg=COLOURS[check.status.value])
        click.echo(f"{status}  {check.name:<{width}}  {escaped(check.message)}")
        if check.remedy:
            click.echo(f"{'':{width + 11}}{escaped(check.remedy)}")
    click.echo(f"{len(checks)} checks; errors: {errors}, warnings: {warnings}")
    return 1 if errors else 0
