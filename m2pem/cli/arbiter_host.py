"""`m2pem arbiter-host`: the arbiters of vehicles, beside them, for an executive on another host."""

import asyncio
from pathlib import Path
from typing import TYPE_CHECKING

import click

from m2pem.cli.options import UnusableError, example, fleet_option

if TYPE_CHECKING:
    from m2pem.cli.interruption import Interruption
    from m2pem.fleet.fleet import Fleet


@click.command(
    "arbiter-host",
    epilog=example("m2pem arbiter-host --fleet fleet.yaml --host uav1-pi"),
)
@fleet_option(required=True)
@click.option(
    "--host",
    "name",
    metavar="HOST",
    help="Which of the fleet's hosts this is  [default: the only one]",
)
@click.option(
    "--connect",
    metavar="ENDPOINT",
    multiple=True,
    help="Connect to this endpoint, such as a router's, in place of the fleet's. Can be given "
    "again.",
)
@click.option(
    "--listen",
    metavar="ENDPOINT",
    multiple=True,
    help="Listen at this endpoint in place of the fleet's. Can be given again.",
)
@click.option(
    "--state",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="DIR",
    help="Where behaviors and reports are kept  "
    "[default: m2pem/hosts in $XDG_STATE_HOME or ~/.local/state]",
)
def arbiter_host(
    fleet_file: str,
    name: str | None,
    connect: tuple[str, ...],
    listen: tuple[str, ...],
    state: Path | None,
) -> int:
    """Run the arbiters of vehicles on this host, for an executive elsewhere.

    The fleet file is the executive's; this host serves the vehicles that have it as their `host`.
    Ctrl-C or SIGTERM end it with 0: the vehicles go on.
    """
    from m2pem.cli.interruption import Interruption
    from m2pem.fleet.fleet_file import load_fleet

    if connect and listen:
        raise click.UsageError("--connect and --listen: a host does one or the other")
    fleet = load_fleet(fleet_file)
    with Interruption("its arbiters") as interruption:
        serving = _serve(fleet, _chosen(fleet, name), connect, listen, state, interruption)
        return asyncio.run(serving)


def _chosen(fleet: "Fleet", name: str | None) -> str:
    """Return the name of the host that is meant, which serves vehicles."""
    from m2pem.suggestions import suggest

    served = dict.fromkeys(each.host for each in fleet.vehicles.values() if each.host)
    if not served:
        raise UnusableError(f"{fleet.file}: no vehicle has a host; write `host: NAME` at one")
    if name is None:
        if len(served) > 1:
            raise click.UsageError(f"--host: say which: {', '.join(served)}")
        return next(iter(served))
    if name not in served:
        raise UnusableError(
            f"{fleet.file}: no vehicle has the host '{name}'; {suggest(name, served, 'hosts')}"
        )
    return name


async def _serve(
    fleet: "Fleet",
    name: str,
    connect: tuple[str, ...],
    listen: tuple[str, ...],
    state: Path | None,
    interruption: "Interruption",
) -> int:
    import logging
    from uuid import uuid4

    from m2pem.api.arbiter import ArbiterContext
    from m2pem.api.clock import SystemClock
    from m2pem.cli.notes import note
    from m2pem.executive.fleet_connections import HOST_LINK, FleetArbiters, hosted_arbiters
    from m2pem.executive.vehicle_locks import VehicleLocks, addresses_of
    from m2pem.fleet.allocation import spelled_out
    from m2pem.journal import default_url, file_of
    from m2pem.plugins import PluginManager
    from m2pem.telemetry.bus import Bus

    _refuse_endpoints(fleet, name, (*connect, *listen))
    own = file_of(default_url())
    assert own is not None  # the user's own journal is a file
    folder = (own.parent / "hosts" if state is None else state) / f"{fleet.name}-{name}"
    fleet = _with_state(fleet, name, folder)
    plugins = PluginManager()
    teams = {team.name: spelled_out(team) for team in fleet.teams.values()}
    bus, logger = Bus(), logging.getLogger("m2pem.host")
    context = ArbiterContext(
        SystemClock(), bus, logger, fleet.origin, teams, uuid4(), state_folder=folder
    )
    link = plugins.arbiter(HOST_LINK)
    # As an executive here would have them: what is wrong with a setting is said at once, and no
    # executive of this host may command the same vehicles meanwhile.
    locks = VehicleLocks(addresses_of(FleetArbiters(_alone(fleet, name), plugins, context)))
    locks.acquire()
    try:
        serving = asyncio.ensure_future(
            link.serve(  # type: ignore[attr-defined]  # it is a `HostLink`
                hosted_arbiters(fleet, plugins, name),
                context,
                folder,
                connect=connect,
                listen=listen,
                ready=lambda line: note(f"m2pem: {line}"),
            )
        )
        interruption.begin()
        asked = asyncio.create_task(interruption.asked.wait())
        await asyncio.wait({serving, asked}, return_when=asyncio.FIRST_COMPLETED)
        asked.cancel()
        serving.cancel()
        await asyncio.wait({serving})
        if not serving.cancelled():
            serving.result()
    finally:
        locks.release()
    return 0


def _refuse_endpoints(fleet: "Fleet", name: str, endpoints: tuple[str, ...]) -> None:
    """Refuse endpoints of the command line, as those of a fleet file are.

    Raises:
        UnusableError: one is none, or not safe.
    """
    from m2pem.fleet.hosts import endpoint_problem

    for each in endpoints:
        message, remedy = endpoint_problem(each, authenticated=bool(fleet.hosts[name].certificate))
        if message:
            raise UnusableError(f"{message}; {remedy}")


def _with_state(fleet: "Fleet", name: str, folder: Path) -> "Fleet":
    """Return the fleet whose vehicles that this host simulates are kept in its folder."""
    from dataclasses import replace

    from m2pem.executive.simulated_state import STATE
    from m2pem.fleet.fleet import SIMULATED, Payload, Vehicle

    def settings(each: Vehicle | Payload, host: str) -> dict[str, object]:
        own = dict(each.settings)
        kept = {STATE: str(folder / "simulated.db")}
        return {**kept, **own} if each.arbiter == SIMULATED and host == name else own

    hosts = {vehicle.id: vehicle.host for vehicle in fleet.vehicles.values()}
    return replace(
        fleet,
        vehicles={
            id_: replace(each, settings=settings(each, each.host))
            for id_, each in fleet.vehicles.items()
        },
        payloads={
            id_: replace(each, settings=settings(each, hosts[each.vehicle]))
            for id_, each in fleet.payloads.items()
        },
    )


def _alone(fleet: "Fleet", name: str) -> "Fleet":
    """Return the fleet of this host's vehicles, as if their arbiters ran in an executive."""
    from dataclasses import replace

    mine = {id_: each for id_, each in fleet.vehicles.items() if each.host == name}
    return replace(
        fleet,
        vehicles={id_: replace(each, host="") for id_, each in mine.items()},
        payloads={id_: each for id_, each in fleet.payloads.items() if each.vehicle in mine},
        teams={},
        hosts={},
    )
