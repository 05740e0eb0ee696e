"""`m2pem attach`: one more operator of a running executive, from another terminal."""

import asyncio
from contextlib import nullcontext, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from m2pem.cli.options import (
    example,
    journal_option,
    ocu_option,
    optional_run_argument,
    path_option,
)
from m2pem.cli.run_control import explain, found_elsewhere, journal_file

if TYPE_CHECKING:
    from m2pem.cli.ocus import Operators
    from m2pem.control_socket.remote import RemoteControl

TAKEN_OVER_WITHIN_S = 3.0
"""By a standby of this host, after the executive has died."""

LOOK_EACH_S = 0.1


@click.command(epilog=example("m2pem attach r1"))
@optional_run_argument
@journal_option
@ocu_option
@path_option
def attach(
    run_id: str | None,
    journal: str | None,
    ocu_names: str | None,
    search_path: tuple[Path, ...],
) -> None:
    """Serve an operator of an executive that is running on this host.

    RUN selects the executive, when several write to the journal. All its operators see the same
    and may do the same; missions go on when this one leaves. The files of missions that it starts
    are read here, and sent. When the executive has died, it goes on at the one that has taken over.
    """
    asyncio.run(_attach(run_id, journal, ocu_names, search_path))


async def _attach(
    run: str | None, journal_url: str | None, ocu_names: str | None, search_path: tuple[Path, ...]
) -> None:
    from m2pem.cli.notes import note
    from m2pem.cli.ocus import Operators, chosen
    from m2pem.control_socket.client import find_executive
    from m2pem.errors import NotDrivenError
    from m2pem.plugins import PluginManager

    path = journal_file(journal_url)
    plugins = PluginManager()
    units = chosen(ocu_names, plugins)
    try:
        with found_elsewhere(journal_url) if run is None else nullcontext():
            executive = await asyncio.to_thread(find_executive, path, run)
    except NotDrivenError as error:
        if run is None:
            raise
        raise await asyncio.to_thread(explain, error, journal_url, path, "attach", run) from error
    following: Path | None = executive
    while following is not None:
        following = await _serve_at(following, Operators(units, plugins), path, search_path)
        if following is not None:
            note(f"m2pem: the executive has ended; process {following.stem} has taken over")


async def _serve_at(
    executive: Path, operators: "Operators", journal: Path, search_path: tuple[Path, ...]
) -> Path | None:
    """Serve until the operators have left; returns the executive that has taken over before."""
    from m2pem.api.runs import RunStatus
    from m2pem.cli.notes import note
    from m2pem.cli.session import what_goes_on
    from m2pem.control_socket.paths import ControlSocketError
    from m2pem.control_socket.remote import RemoteControl
    from m2pem.executive.loading import load_source

    remote = RemoteControl(executive, partial(load_source, search_path=search_path))
    async with remote as control:
        operators.begin(control, lambda: None)
        left = asyncio.create_task(operators.left())
        looking = asyncio.create_task(_taken_over(remote, executive, journal))
        try:
            await asyncio.wait((left, looking), return_when=asyncio.FIRST_COMPLETED)
            if not left.done() and (following := looking.result()) is not None:
                return following
            await left
        finally:
            looking.cancel()
            await operators.end()
        with suppress(ControlSocketError):  # the executive has ended: nothing goes on
            runs = await control.runs()
            driven = (RunStatus.RUNNING, RunStatus.PAUSED)
            running = [each.run for each in runs if each.status in driven]
            note(what_goes_on(running, journal, serves=not running))
    return None


async def _taken_over(remote: "RemoteControl", executive: Path, journal: Path) -> Path | None:
    """Wait until the executive is gone; returns the one that a standby has become soon after."""
    from m2pem.control_socket.paths import live_sockets

    await remote.gone()
    for _ in range(round(TAKEN_OVER_WITHIN_S / LOOK_EACH_S)):
        for path in await asyncio.to_thread(list, live_sockets(journal)):
            if path != executive:
                return path
        await asyncio.sleep(LOOK_EACH_S)
    return None
