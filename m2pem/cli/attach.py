"""`m2pem attach`: one more operator of a running executive, from another terminal."""

import asyncio
from contextlib import suppress
from functools import partial
from pathlib import Path

import click

from m2pem.cli.options import (
    example,
    journal_option,
    ocu_option,
    optional_run_argument,
    path_option,
)
from m2pem.cli.run_control import explain, journal_file


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
    are read here, and sent.
    """
    asyncio.run(_attach(run_id, journal, ocu_names, search_path))


async def _attach(
    run: str | None, journal_url: str | None, ocu_names: str | None, search_path: tuple[Path, ...]
) -> None:
    from m2pem.api.runs import RunStatus
    from m2pem.cli.notes import note
    from m2pem.cli.ocus import Operators, chosen
    from m2pem.cli.session import what_goes_on
    from m2pem.control_socket.client import find_executive
    from m2pem.control_socket.paths import ControlSocketError
    from m2pem.control_socket.remote import RemoteControl
    from m2pem.errors import NotDrivenError
    from m2pem.executive.loading import load_source
    from m2pem.plugins import PluginManager

    path = journal_file(journal_url)
    plugins = PluginManager()
    operators = Operators(chosen(ocu_names, plugins), plugins)
    try:
        executive = await asyncio.to_thread(find_executive, path, run)
    except NotDrivenError as error:
        if run is None:
            raise
        raise await asyncio.to_thread(explain, error, journal_url, path, "attach", run) from error
    async with RemoteControl(executive, partial(load_source, search_path=search_path)) as control:
        operators.begin(control, lambda: None)
        try:
            await operators.left()
        finally:
            await operators.end()
        with suppress(ControlSocketError):  # the executive has ended: nothing goes on
            runs = await control.runs()
            driven = (RunStatus.RUNNING, RunStatus.PAUSED)
            running = [each.run for each in runs if each.status in driven]
            note(what_goes_on(running, path, serves=not running))
